"""Whether scenes can be solved: shipped ones can, and each thing in the way has its reason."""

from itertools import product

import numpy as np
import pytest

from regrasp.app.scenario.load import Scenario, load_scenario
from regrasp.app.scenario.sampling import scene_setup
from regrasp.app.tasks.cable.solvable import SolvableParameters, TrueScene, lost_pose, unsolvable
from regrasp.interfaces.cable.cell import PLUGGED_INTO, CableCell, CableKnown
from regrasp.interfaces.cell import Box, WristMount, pose_along
from regrasp.interfaces.scene import Gravity, Obstacle, SceneSetup

Point = tuple[float, float, float]
ROUND_THE_END: list[tuple[Point, Point]] = [  # without gravity, and open above
    ((0.28, 0.14, 0.12), (0.02, 0.10, 0.24)),
    ((0.42, 0.14, 0.12), (0.02, 0.08, 0.24)),
    ((0.36, 0.24, 0.12), (0.12, 0.02, 0.24)),
]


def with_blocks(scenario: Scenario, *blocks: tuple[Point, Point]) -> SceneSetup:
    """What seed 1 adds to the scenario, and blocks: centre and edges."""
    pieces = [Box(name=f"block {n}", center=center, size=size) for n, (center, size) in enumerate(blocks)]
    setup = scene_setup(scenario.file, 1)
    return SceneSetup((*setup.obstacles, *(Obstacle(piece, 0.0, None) for piece in pieces)), setup.faults)


def reason(scenario: Scenario, setup: SceneSetup) -> str:
    assert isinstance(scenario.cell, CableCell)
    return unsolvable(scenario.cell, scenario.file.gravity, setup)


@pytest.mark.parametrize(
    ("name", "gravity"), list(product(("no_obstacle", "short_obstacle", "tall_obstacle"), ("zero", "earth")))
)
def test_the_demonstration_s_scenes_can_be_solved(name: str, gravity: Gravity) -> None:
    scenario = load_scenario(name, [f"gravity={gravity}"])
    assert reason(scenario, scene_setup(scenario.file, 1)) == ""


def test_each_thing_in_the_way_has_its_reason() -> None:
    scenario = load_scenario("no_obstacle")
    before_plug = ((0.40, 0.10, 0.20), (0.08, 0.12, 0.40))
    assert reason(scenario, with_blocks(scenario, before_plug)) == "no free grasp of the plug"
    assert reason(scenario, with_blocks(scenario, *ROUND_THE_END)) == "no free grasp of the lost end"
    at_the_arm = ((0.20, -0.1778, 0.09), (0.06, 0.06, 0.18))
    assert reason(scenario, with_blocks(scenario, at_the_arm)) == "a block too near to the right arm asleep"


def test_an_end_in_a_closed_box_is_not_seen_and_one_behind_a_wall_only_by_the_camera_that_searches() -> None:
    scenario = load_scenario("no_obstacle")
    assert isinstance(scenario.cell, CableCell)
    known, end = scenario.cell.known, pose_along((0.36, 0.14, 0.22), (0.0, 1.0, 0.0))
    wall, back = ((0.27, 0.14, 0.15), (0.02, 0.30, 0.30)), ((0.45, 0.14, 0.15), (0.02, 0.30, 0.30))
    sides = [((0.36, 0.14 + dy, 0.15), (0.2, 0.02, 0.30)) for dy in (-0.10, 0.10)]
    roof = ((0.36, 0.14, 0.31), (0.2, 0.3, 0.02))

    def is_seen(cell: CableKnown, *blocks: tuple[Point, Point]) -> bool:
        return TrueScene(cell, with_blocks(scenario, *blocks).obstacles, SolvableParameters()).is_seen(end)

    far = known.camera("wrist").model_copy(update={"mount": WristMount(arm="left", offset=(0.02, 0.0, 0.30))})
    blind = known.model_copy(update={"cameras": (known.camera("rear"), far)})  # where its arm cannot bring it before
    assert is_seen(known)
    assert is_seen(blind)
    assert is_seen(known, wall)
    assert not is_seen(blind, wall)
    assert not is_seen(known, wall, back, *sides, roof)


def test_without_a_loss_only_plug_and_clip_are_looked_at() -> None:
    scenario = load_scenario("no_obstacle")
    round_the_end = with_blocks(scenario, *ROUND_THE_END)
    assert reason(scenario, round_the_end) != ""
    assert reason(scenario, SceneSetup(round_the_end.obstacles)) == ""


@pytest.mark.parametrize("seed", range(6))
def test_the_end_is_lost_where_the_fault_says(seed: int) -> None:
    scenario = load_scenario("no_obstacle")
    assert isinstance(scenario.cell, CableCell)
    known = scenario.cell.known
    setup = scene_setup(scenario.file, seed)
    lost = lost_pose(known, setup)
    assert lost is not None
    start = known.cable.socket(PLUGGED_INTO).world_from_plug(known.cable.connector.length).translation
    way = known.cable.clip.world_from_seat.translation - start
    share = float((lost.translation - start) @ way / (way @ way))
    [carried] = {fault.when.model_dump()["carried"][0] for fault in setup.faults}
    assert carried <= share <= carried + 0.06  # the way is looked at in steps
    assert np.linalg.norm(lost.translation - start) < np.linalg.norm(way)
