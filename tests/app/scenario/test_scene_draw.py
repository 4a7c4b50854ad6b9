import colorsys
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from regrasp.app.files.findings import Findings
from regrasp.app.scenario.load import Scenario, load_scenario
from regrasp.app.scenario.sampling import scene_setup
from regrasp.app.scenario.scene_draw import drawn
from regrasp.app.scenario.schema import ScenarioFile
from regrasp.app.scenario.shapes import JitteredBox, penetration_depth
from regrasp.interfaces.cable.cell import CableCell

SCENE = """\
description: blocks where nothing stands
cell: thesis
tree: recovery
gravity: zero
draw:
  obstacles:
    - name: foam
      count: [1, 3]
      size: {x: [0.03, 0.05], y: [0.04, 0.06], z: [0.02, 0.08]}
      region: {x: [0.25, 0.45], y: [-0.30, 0.30], z: [0.02, 0.05], on_stand: 0.5}
      yaw_deg: [-90, 45]
      hue_deg: [200, 300]
  light: {brightness: [0.6, 1.2], tilt_deg: [10, 50]}
  stiffness_factor: [0.7, 1.4]
  connector_color: {hue_deg: [-20, 10]}
  tries: 20
"""


def loaded(folder: Path, text: str = SCENE, *overrides: str) -> Scenario:
    path = folder / "mine.yaml"
    path.write_text(text)
    return load_scenario(str(path), overrides)


@pytest.fixture(scope="module")
def scenario(tmp_path_factory: pytest.TempPathFactory) -> Scenario:
    return loaded(tmp_path_factory.mktemp("random"))


def what_is_drawn(scenario: Scenario) -> str:
    return json.dumps([scenario.file.model_dump(mode="json"), scenario.cell.model_dump(mode="json")])


def hue(color: tuple[float, float, float]) -> float:
    return 360 * colorsys.rgb_to_hsv(*color)[0]


def test_a_seed_draws_one_scene_and_another_seed_another(scenario: Scenario) -> None:
    first, again, other = (drawn(scenario, seed) for seed in (7, 7, 8))
    assert what_is_drawn(first.scenario) == what_is_drawn(again.scenario)
    assert first.thrown_away == again.thrown_away
    assert what_is_drawn(first.scenario) != what_is_drawn(other.scenario)


def test_what_has_nothing_to_draw_stays_as_it_is() -> None:
    tall = load_scenario("tall_obstacle")
    before = scene_setup(tall.file, 3)
    assert drawn(tall, 3).scenario is tall
    assert drawn(tall, 3).thrown_away is None
    assert scene_setup(tall.file, 3) == before


def test_a_drawn_scene_leaves_nothing_to_draw(scenario: Scenario) -> None:
    made = drawn(scenario, 2).scenario
    assert made.file.draw is None
    assert drawn(made, 5).scenario is made


@settings(max_examples=15, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.integers(0, 2**31 - 1))
def test_all_that_is_drawn_lies_in_its_ranges_and_in_nothing_else(scenario: Scenario, seed: int) -> None:
    made = drawn(scenario, seed).scenario
    assert 1 <= len(made.file.obstacles) <= 3
    for piece in made.file.obstacles:
        x, y, bottom = piece.position_in("zero")
        assert [low <= edge <= high for edge, (low, high) in zip(piece.size, SIZES, strict=True)] == [True] * 3
        assert 0.25 <= x <= 0.45
        assert -0.30 <= y <= 0.30
        assert bottom == 0.0 or 0.02 <= bottom <= 0.05
        assert -90 <= piece.yaw_deg <= 45
        assert 199 <= hue(piece.color) <= 301
        assert piece.jitter == (0.0, 0.0, 0.0)
    boxes = [as_box(piece) for piece in made.file.obstacles]
    for i, one in enumerate(boxes):
        for other in boxes[:i]:
            generators = np.vstack([one.generators, other.generators])
            assert penetration_depth(generators, one.center - other.center) <= 1e-9
    light = made.file.light
    assert 0.6 <= light.brightness <= 1.2
    assert light.direction is not None
    assert np.linalg.norm(light.direction) == pytest.approx(1.0)
    assert np.cos(np.deg2rad(50)) - 1e-9 <= light.direction[2] <= np.cos(np.deg2rad(10)) + 1e-9
    cell, own = made.cell, scenario.cell
    assert isinstance(cell, CableCell)
    assert isinstance(own, CableCell)
    factor = cell.hidden.cable.stiffness.zero / own.hidden.cable.stiffness.zero
    assert 0.7 <= factor <= 1.4
    assert cell.hidden.cable.stiffness.earth == pytest.approx(factor * own.hidden.cable.stiffness.earth)
    assert (hue(cell.known.cable.connector.color) + 180) % 360 - 180 == pytest.approx(-5, abs=15.001)


SIZES = ((0.03, 0.05), (0.04, 0.06), (0.02, 0.08))


def as_box(piece: Any) -> JitteredBox:
    x, y, bottom = piece.position_in("zero")
    return JitteredBox(np.array([x, y, bottom + 0.5 * piece.size[2]]), piece.size, piece.yaw_deg)


def test_draws_spread_over_their_ranges(scenario: Scenario) -> None:
    files: list[ScenarioFile] = [drawn(scenario, seed).scenario.file for seed in range(12)]
    assert {len(file.obstacles) for file in files} == {1, 2, 3}
    pieces = [piece for file in files for piece in file.obstacles]
    assert any(piece.position_in("zero")[2] for piece in pieces)
    assert not all(piece.position_in("zero")[2] for piece in pieces)
    assert np.ptp([piece.position_in("zero")[1] for piece in pieces]) > 0.3


def test_where_blocks_have_no_room_the_error_says_so(tmp_path: Path) -> None:
    region = "region: {x: [0.51, 0.515], y: [-0.30, 0.30]"  # in the back panel
    made = loaded(tmp_path, SCENE.replace("region: {x: [0.25, 0.45], y: [-0.30, 0.30]", region), "draw.tries=2")
    with pytest.raises(Findings) as wrong:
        drawn(made, 1)
    [finding] = wrong.value.items
    assert finding.source.endswith("mine.yaml")
    assert finding.message.startswith("draw: none of 2 scenes of seed 1 can be solved: 2 no room for its blocks; ")


def test_where_no_scene_can_be_solved_the_error_names_the_reason(tmp_path: Path) -> None:
    text = SCENE.replace(
        "x: [0.03, 0.05], y: [0.04, 0.06], z: [0.02, 0.08]", "x: [0.1, 0.1], y: [0.1, 0.1], z: [0.3, 0.3]"
    )
    text = text.replace(
        "x: [0.25, 0.45], y: [-0.30, 0.30], z: [0.02, 0.05], on_stand: 0.5", "x: [0.4, 0.4], y: [0.09, 0.1]"
    )
    made = loaded(tmp_path, text.replace("yaw_deg: [-90, 45]", ""), "draw.tries=3", "draw.obstacles.0.count=[1,1]")
    with pytest.raises(Findings, match="none of 3 scenes of seed 4 can be solved: 3 no free grasp of the plug; draw"):
        drawn(made, 4)


def test_faults_and_listed_obstacles_are_among_what_is_drawn(tmp_path: Path) -> None:
    text = SCENE + (
        "obstacles:\n  - {name: mine, size: [0.05, 0.05, 0.05], position: [0.3, -0.2, 0.0]}\n"
        "faults:\n  - {type: camera_dark, camera: rear, when: {at: [2.0, 9.0]}, seconds: 1.0}\n"
    )
    made = drawn(loaded(tmp_path, text), 3).scenario
    assert [piece.name for piece in made.file.obstacles][:2] == ["mine", "foam_1"]
    [fault] = made.file.faults
    assert fault.when.at is not None
    assert 2.0 <= fault.when.at[0] == fault.when.at[1] <= 9.0
    assert scene_setup(made.file, 3).faults == made.file.faults


@pytest.mark.parametrize(
    ("right", "wrong", "line", "said"),
    [
        ("count: [1, 3]", "count: [3, 1]", 8, "draw.obstacles.0.count: runs backwards; put the smaller first"),
        ("count: [1, 3]", "count: 3", 8, "draw.obstacles.0.count is 3; expected 2 values, each a whole number"),
        ("x: [0.03, 0.05]", "x: [0, 0.05]", 9, "draw.obstacles.0.size.x.0 is 0; expected a number"),
        ("region: {", "regin: {", 10, "unknown key 'regin'; did you mean 'region'?"),
        ("on_stand: 0.5", "on_stand: 2", 10, "draw.obstacles.0.region.on_stand is 2; expected a number (at least 0"),
        ("stiffness_factor: [0.7, 1.4]", "stiffness_factor: [0.7, x]", 14, "draw.stiffness_factor.1 is 'x'; expected"),
        ("name: foam", "name: 'a b'", 7, "draw.obstacles.0.name is 'a b'; expected text"),
        ("tries: 20", "tries: 0", 16, "draw.tries is 0; expected a whole number (at least 1"),
    ],
)
def test_what_is_wrong_is_told_with_its_line(tmp_path: Path, right: str, wrong: str, line: int, said: str) -> None:
    with pytest.raises(Findings) as found:
        loaded(tmp_path, SCENE.replace(right, wrong))
    [finding] = found.value.items
    assert finding.line == line
    assert finding.message.startswith(said)


def test_names_that_meet_are_told(tmp_path: Path) -> None:
    listed = "obstacles:\n  - {name: foam_2, size: [0.05, 0.05, 0.05], position: [0.3, -0.2, 0.0]}\n"
    with pytest.raises(Findings, match="obstacle 'foam_2' bears the name of a drawn one; rename one"):
        loaded(tmp_path, SCENE + listed)
    twice = SCENE.replace(
        "  light:",
        "    - {name: foam, count: [0, 1], size: {x: [1, 1], y: [1, 1], z: [1, 1]},\n"
        "       region: {x: [0, 0], y: [0, 0]}}\n  light:",
    )
    with pytest.raises(Findings, match=r"draw\.obstacles: two kinds of obstacles 'foam'; rename one"):
        loaded(tmp_path, twice)
