"""Cells of which every value is right and that cannot work all the same."""

from collections.abc import Iterator
from typing import Any

import numpy as np
import pybullet as p
import pytest
import yaml

from regrasp.app.files.findings import Findings
from regrasp.app.files.overrides import parse_overrides
from regrasp.app.files.resources import shipped
from regrasp.app.scenario.cell_file import load_cell
from regrasp.app.scenario.load import load_scenario
from regrasp.app.tasks.cable.cells import cable_cell
from regrasp.app.tasks.cable.placement import cable_at_start
from regrasp.interfaces.cable.cell import CableCell
from regrasp.interfaces.scene import GRAVITIES, Gravity
from regrasp.sim.cable.objects import cable_world


def findings(*overrides: str, scenario: str = "no_obstacle") -> list[str]:
    try:
        load_scenario(scenario, overrides)
    except Findings as error:
        return [item.message for item in error.items]
    return []


@pytest.mark.parametrize(
    ("override", "expected"),
    [
        ("known.cable.plugged_into=back_3", "a cable 0.553 m long does not reach a connector in socket back_3, 0.58"),
        ("hidden.cable.length=0.54", "a cable 0.54 m long does not reach a connector in socket back_4, 0.545 m away"),
        ("known.cable.plugged_into=right_1", "'right_1', the last socket, holds the cable's other end; name another"),
        ("known.arms.0.sleep.2=3", "3 rad is past the limits of the left arm's elbow; write one"),
        ("known.boxes.0.center.2=0.03", "floor reaches 0.050 m into the left arm's base; move one of them"),
        ("known.boxes.0.center.2=0.3", "no way to take hold of a connector in socket back_4: 1152 grasp candidates: "),
        ("known.boxes.0.center.2=0.48", "floor reaches 0.015 m into the stowed connector; move one of them"),
        ("known.cameras.0.mount.position=[0.5145, 0, 0.3]", "the rear camera is inside back_panel; move one of them"),
        ("known.cable.clip.seat=[0.2, 0.9, 0.4]", "the clip is 1.13 m from the right arm's shoulder, which reaches"),
        ("known.cable.connector={length: 0.09, radius: 0.05, color: [1, 0, 0]}", "back_panel reaches 0.015 m into the"),
        ("known.cable.connector.radius=0.022", "a connector 44 mm thick does not fit the jaw, which opens"),
        ("known.boxes.0.name=back_panel", "2 boxes are named 'back_panel'; rename them"),
        ("known.cameras.0.mount.position=[-0.3, 0, -0.5]", "the rear camera sees neither the plugged connector"),
        ("known.boxes.0={name: a, center: [0.42, -0.2, 0.15], size: [0.05, 0.05, 0.3]}", "a reaches 0.029 m into"),
        ("hidden.gripper.pad_thickness=0.1", "hidden.gripper.pad_thickness is 0.1; expected a number (at least"),
        ("hidden.cable.stiffness.zero=50", "hidden.cable.stiffness.zero is 50; expected a number in newton square"),
        ("known.latencies.image=1.0e+300", "known.latencies.image is 1e+300; expected a number (at least 0, at"),
    ],
)  # fmt: skip
def test_a_cell_that_cannot_work_is_told_before_a_run(override: str, expected: str) -> None:
    assert [message for message in findings(f"cell.{override}") if message.startswith(expected)]


@pytest.mark.parametrize("place", ["[0.0, 0.18, 0.0]", "[0, 0.1, 0]"])
def test_two_robots_in_one_place_are_one_line(place: str) -> None:
    [told] = findings(f"cell.known.arms.1.base={place}")
    assert told == "the right arm's base reaches 0.079 m into the left arm's base; move one of them"


def test_arms_that_sleep_in_each_other_are_told() -> None:
    sleeps = [f"cell.known.arms.{i}.sleep=[{waist}, 0.3, 0, 0, 0.8, 0]" for i, waist in enumerate((-1.57, 1.57))]
    [told] = findings(*sleeps)
    assert told.startswith("the arms asleep reach 0.051 m into each other")


def test_an_obstacle_where_the_connector_is_to_be_stowed_is_told() -> None:
    [told] = findings("obstacles=[{name: o, position: [0.265, 0.065, 0.4], size: [0.05, 0.05, 0.1]}]")
    assert told.startswith("obstacle 'o' reaches 0.042 m into the stowed connector")


@pytest.mark.parametrize("socket", ["back_1", "back_2"])
def test_the_connector_may_begin_in_another_socket(socket: str) -> None:
    """A tree asks the cell where it is plugged in, unless an input names a socket, which then must be that one."""
    plugged = f"cell.known.cable.plugged_into={socket}"
    assert findings(plugged) == findings(plugged, f"inputs.socket={socket}") == []
    [told] = findings(plugged, "inputs.socket=back_4")
    assert f"is 'back_4' here, which is empty at the start: the cell's plugged_into is '{socket}'" in told


def test_an_obstacle_in_the_cable_is_told_with_its_stand_and_jitter() -> None:
    def told(position: str, *more: str) -> list[str]:
        overrides = [f"obstacles.0.position={position}", "obstacles.0.size=[0.02, 0.02, 0.1]", *more]
        found = findings(*overrides, scenario="faults/obstacle_moves_in")
        return [message.partition(" reaches")[0] for message in found if "into the cable at the start" in message]

    assert told("[0.44, -0.15, 0.22]") == ["obstacle 'block'"]
    assert told("[0.44, -0.15, 0.5]") == ["obstacle 'block' on its stand"]
    assert told("[0.38, -0.15, 0.22]") == []
    assert told("[0.38, -0.15, 0.22]", "obstacles.0.jitter=[0.06, 0, 0]") == ["obstacle 'block'"]


def test_a_position_may_be_one_vector_or_one_for_each_gravity() -> None:
    both = "obstacles.0.position={zero: [0.44, -0.15, 0.22], earth: [0.26, 0.6, 0.0]}"
    for position in (both, "obstacles.0.position=[0.44, -0.15, 0.22]"):
        assert len(findings(position, scenario="faults/obstacle_moves_in")) > 0
    one = load_scenario("faults/obstacle_moves_in", ["obstacles.0.position=[0.26, 0.7, 0.0]"]).file.obstacles[0]
    assert one.position_in("zero") == one.position_in("earth") == (0.26, 0.7, 0.0)


@pytest.mark.parametrize("gravity", GRAVITIES)
def test_the_cable_hangs_at_the_start_as_the_world_lays_it(cell: CableCell, gravity: Gravity) -> None:
    points = cable_at_start(cell, gravity)
    world = cable_world(cell, gravity, 0)
    states = p.getLinkStates(
        world.objects.cable.body, range(cell.hidden.cable.links), 1, 1, physicsClientId=world.client
    )
    np.testing.assert_allclose(points[:-1], [state[4] for state in states], atol=0.003)
    world.close()


def numbers(value: Any, path: str = "") -> Iterator[str]:
    """Dotted keys of all numbers below `value`."""
    if isinstance(value, dict | list):
        items = value.items() if isinstance(value, dict) else enumerate(value)
        for key, below in items:
            yield from numbers(below, f"{path}.{key}" if path else str(key))
    elif isinstance(value, float | int):
        yield path


def test_no_number_of_a_cell_may_be_huge() -> None:
    """Each number at once: a bound that is missing lets one through."""
    text = shipped("cell")["thesis"].read_text(encoding="utf-8")
    keys = list(numbers(yaml.safe_load(text)))
    for huge in ("1.0e+300", "-1.0e+300"):
        assignments, _ = parse_overrides([f"{key}={huge}" for key in keys])
        with pytest.raises(Findings) as raised:
            load_cell(shipped("cell")["thesis"], assignments)
        assert {item.source.partition("=")[0].removeprefix("--set ") for item in raised.value.items} == set(keys)


def test_who_only_looks_at_pictures_may_have_a_cell_that_cannot_work() -> None:
    path = shipped("cell")["thesis"]
    high, wrong = parse_overrides(["known.cable.clip.seat=[0.4,0.1,3.0]"])
    assert not wrong
    with pytest.raises(Findings):
        cable_cell(path, high)
    assert cable_cell(path, high, laid_out=False).known.cable.clip.seat == (0.4, 0.1, 3.0)
    misnamed, _ = parse_overrides(["known.plugged_into=nowhere"])
    with pytest.raises(Findings, match="nowhere"):
        load_cell(path, misnamed, laid_out=False)
