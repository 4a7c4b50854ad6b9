"""Planning in a task network: the shipped one from every state, and small ones with what can go wrong."""

from itertools import product
from pathlib import Path
from typing import Any

import pytest
import yaml

import regrasp.trees
from regrasp.behaviors.network.planner import EndlessError, NoPlanError, plan
from regrasp.interfaces.task_network import TaskNetwork, holds

SHIPPED = Path(regrasp.trees.__file__).parent / "networks" / "print_and_place.yaml"


@pytest.fixture(scope="module")
def shipped() -> TaskNetwork:
    return TaskNetwork.model_validate(yaml.safe_load(SHIPPED.read_text(encoding="utf-8")))


def network(**tasks: list[dict[str, Any]]) -> TaskNetwork:
    """A network of a lamp and a key, with these tasks."""
    return TaskNetwork.model_validate(
        {
            "description": "A lamp that only a key switches.",
            "goal": "light",
            "state": {
                "lamp": {"values": ["dark", "lit"], "starts": "dark"},
                "key": {"values": ["away", "here"], "starts": "away"},
            },
            "impossible": [{"state": {"lamp": "lit", "key": "away"}, "because": "a lamp without a key is dark"}],
            "actions": {
                "fetch": {"needs": {"key": "away"}, "gives": {"key": "here"}},
                "turn": {"needs": {"key": "here", "lamp": "dark"}, "gives": {"lamp": "lit"}},
            },
            "tasks": tasks,
        }
    )


def after(net: TaskNetwork, state: dict[str, str], actions: tuple[str, ...]) -> dict[str, str]:
    """The state after the actions, each of which must be possible where it comes."""
    for name in actions:
        assert holds(net.actions[name].needs, state), (name, state)
        state = state | net.actions[name].gives
        assert net.contradiction(state) is None, (name, state)
    return state


def test_the_whole_job_is_planned_from_the_start(shipped: TaskNetwork) -> None:
    made = plan(shipped, shipped.start())
    assert made.actions == (
        *("open_door", "take_part", "draw_out", "look_at_desk", "put_into_clamp"),
        *("grip_part", "twist_off", "put_into_tray", "close_door"),
    )
    assert after(shipped, shipped.start(), made.actions) == {
        "door": "closed",
        "plate": "clamp",
        "part": "tray",
        "hand": "empty",
        "desk": "free",
    }


def test_from_every_state_the_plan_can_be_done_and_ends_the_job(shipped: TaskNetwork) -> None:
    planned = 0
    for values in product(*(variable.values for variable in shipped.state.values())):
        state = dict(zip(shipped.state, values, strict=True))
        if shipped.contradiction(state) is not None:
            with pytest.raises(ValueError, match="contradicts itself"):
                plan(shipped, state)
            continue
        try:
            made = plan(shipped, state)
        except NoPlanError as error:
            assert "lost" in str(error), state  # noqa: PT017
            continue
        planned += 1
        end = after(shipped, state, made.actions)
        assert (end["part"], end["door"], end["hand"]) == ("tray", "closed", "empty")
        assert plan(shipped, end).actions == ()  # what is done is not done again
    assert planned > 20


def test_a_method_whose_end_cannot_be_reached_gives_way_to_the_next_one_and_is_not_drawn() -> None:
    net = network(
        light=[{"name": "at_once", "do": ["prepare", "turn"]}],
        prepare=[{"name": "in_vain", "do": []}, {"name": "by_key", "do": ["fetch"]}],
    )
    made = plan(net, net.start())
    assert made.actions == ("fetch", "turn")
    assert [*made.root.lines()] == ["light: at_once", "  prepare: by_key", "    fetch", "  turn"]


def test_where_there_is_no_plan_it_says_which_action_and_why() -> None:
    net = network(light=[{"name": "at_once", "do": ["turn"]}])
    with pytest.raises(NoPlanError, match="no method leads to the end of light where lamp is dark, key is away: turn"):
        plan(net, net.start())


def test_methods_that_never_end_are_told() -> None:
    net = network(
        light=[{"name": "round", "do": ["again"]}],
        again=[{"name": "and_round", "do": ["fetch_or_not", "light"]}],
        fetch_or_not=[{"name": "not", "do": []}],
    )
    with pytest.raises(EndlessError, match="never end"):
        plan(net, net.start())


def test_an_unknown_task_and_a_state_that_contradicts_itself_are_refused() -> None:
    net = network(light=[{"name": "at_once", "do": ["turn"]}])
    with pytest.raises(ValueError, match="no task 'lihgt'; did you mean 'light'"):
        plan(net, net.start(), "lihgt")
    with pytest.raises(ValueError, match="a lamp without a key is dark"):
        plan(net, {"lamp": "lit", "key": "away"})


def test_the_library_is_silent(capfd: pytest.CaptureFixture[str], shipped: TaskNetwork) -> None:
    plan(shipped, shipped.start())
    assert capfd.readouterr() == ("", "")
