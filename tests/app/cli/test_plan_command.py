"""`regrasp plan`, as a user types it."""

import json
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import pytest
from typer.testing import CliRunner

from regrasp.app.cli.commands import app
from regrasp.trees.scripted import ScriptedTree

NETWORK = """description: A lamp that only a key switches.
goal: light
state:
  lamp: {values: [dark, lit], starts: dark}
  key: {values: [away, here], starts: away}
actions:
  fetch: {needs: {key: away}, gives: {key: here}}
  turn: {needs: {key: here}, gives: {lamp: lit}}
tasks:
  light:
    - {name: by_key, do: [fetch, turn]}
"""


def invoke(*args: object) -> Any:
    return CliRunner().invoke(app, ["plan", *map(str, args)])


@pytest.fixture
def lamp(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    path = Path("lamp.yaml")
    path.write_text(NETWORK)
    return path


def changed(path: Path, old: str, new: str) -> Path:
    text = path.read_text()
    assert text.count(old) == 1
    path.write_text(text.replace(old, new))
    return path


def test_without_a_network_it_lists_the_shipped_ones() -> None:
    result = invoke()
    assert (result.exit_code, result.stdout) == (0, "print_and_place\nstow_loose_ends\n")


def test_a_shipped_network_from_another_state() -> None:
    result = invoke("print_and_place", "--state", "door=open, plate=clamp", "--state", "part=tray")
    assert result.exit_code == 0
    assert result.stdout == (
        "print_and_place: to_desk_and_tray\n"
        "  bring_to_desk: done_already (nothing to do)\n"
        "  separate: done_already (nothing to do)\n"
        "  store: done_already (nothing to do)\n"
        "  close_printer: by_the_handle\n"
        "    close_door\n"
        "1 action: close_door\n"
    )
    done = invoke("print_and_place", "--state", "plate=clamp,part=tray")
    assert done.stdout.endswith("\nnothing is left to do\n")


def test_json_has_state_actions_and_network(lamp: Path) -> None:
    answer = json.loads(invoke(lamp, "--state", "key=away", "--format", "json").stdout)
    assert answer == {
        "state": {"lamp": "dark", "key": "away"},
        "actions": ["fetch", "turn"],
        "network": {"task": "light", "method": "by_key", "steps": [{"action": "fetch"}, {"action": "turn"}]},
    }


def test_a_picture_shows_tasks_methods_and_actions(lamp: Path) -> None:
    assert invoke(lamp, "-o", "net.svg").exit_code == 0
    told = "".join(ElementTree.parse("net.svg").getroot().itertext())
    for word in ("light: by_key", "fetch", "turn"):
        assert word in told


def test_a_plan_as_a_tree_is_checked_and_does_the_actions_in_order(tmp_path: Path) -> None:
    out = tmp_path / "plan.xml"
    assert invoke("print_and_place", "--state", "door=open", "--tree", "printer_part", "-o", out).exit_code == 0
    checked = CliRunner().invoke(app, ["trees", "check", str(out)])
    assert (checked.exit_code, checked.stdout) == (0, "1 tree, no findings\n")
    run = ScriptedTree(out)
    assert run.run() == run.status.SUCCESS
    actions = (
        *("take_part", "draw_out", "look_at_desk", "put_into_clamp"),
        *("grip_part", "twist_off", "put_into_tray", "close_door"),
    )
    words = [word for path in run.leaves for word in path.partition("/task/")[2].split("/") if word in actions]
    assert tuple(dict.fromkeys(words)) == actions


def test_no_plan_is_told_with_exit_code_1(lamp: Path) -> None:
    result = invoke(lamp, "--state", "key=here")
    assert (result.exit_code, result.stdout) == (1, "")
    assert result.output == (
        "no method leads to the end of light where lamp is dark, key is here: fetch cannot be done where key is here\n"
    )


@pytest.mark.parametrize(
    ("args", "told"),
    [
        (["lampe.yaml"], "lampe.yaml: "),
        (["print_and_plac"], "print_and_plac: no network named 'print_and_plac'; did you mean 'print_and_place'?"),
        (["lamp.yaml", "--task", "lihgt"], "--task: no task 'lihgt'; did you mean 'light'?"),
        (["lamp.yaml", "--state", "kay=here"], "--state: no variable 'kay'; did you mean 'key'?"),
        (["lamp.yaml", "--state", "key=hree"], "--state: key cannot be 'hree'; did you mean 'here'?"),
        (["lamp.yaml", "--state", "key"], "--state: 'key' is no NAME=VALUE; write door=open, say"),
        (["lamp.yaml", "--format", "jsn"], "--format: no format 'jsn'; did you mean 'json'?"),
        (["lamp.yaml", "-o", "net.doc"], "net.doc: end it in .txt, .json, .xml, .svg, .png, .dot, .mmd"),
        (["lamp.yaml", "-o", "net.xml"], "--tree: goes with a tree (-o FILE.xml); give both, or none"),
        (["print_and_place", "--state", "plate=hand"], "--state: the state contradicts itself: the plate is in the"),
        (["lamp.yaml", "--tree", "printer_door", "-o", "a.xml"], "printer_door.xml: the tree has 0 nodes DoTask"),
    ],
)
def test_bad_input_is_one_line(lamp: Path, args: list[str], told: str) -> None:
    result = invoke(*args)
    assert (result.exit_code, result.stdout) == (2, "")
    assert told in result.output
    assert len(result.output.splitlines()) == 1
    assert [path.name for path in Path().iterdir()] == ["lamp.yaml"]


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ("do: [fetch, turn]", "do: [fetch, trun]", "lamp.yaml:11: no task or action 'trun'; did you mean 'turn'?"),
        ("goal: light", "goal: night", "lamp.yaml:2: no task 'night'; did you mean 'light'?"),
        (
            "needs: {key: away}",
            "needs: {kay: away}",
            "lamp.yaml:7: no variable 'kay' in the state; did you mean 'key'?",
        ),
        ("gives: {lamp: lit}", "gives: {lamp: lid}", "lamp.yaml:8: lamp cannot be 'lid'; did you mean 'lit'?"),
        ("starts: dark", "starts: drak", "lamp.yaml:4: state.lamp cannot be 'drak'; did you mean 'dark'?"),
        ("  light:\n", "  fetch:\n", "lamp.yaml:10: 'fetch' is a task and an action; rename one"),
        ("tasks:", "task:", "lamp.yaml:9: "),
        ("{name: by_key, do: [fetch, turn]}", "{name: by_key, do: [light]}", "lamp.yaml: the methods of 'light' never"),
    ],
)
def test_a_network_that_is_not_right_is_told_with_its_line(lamp: Path, old: str, new: str, told: str) -> None:
    result = invoke(changed(lamp, old, new))
    assert result.exit_code == 2
    assert any(line.startswith(told) for line in result.output.splitlines()), result.output


def test_a_tree_whose_node_does_not_fit_its_network_is_told_with_the_line(lamp: Path) -> None:
    Path("lamp.xml").write_text(
        '<root main_tree_to_execute="Main"><BehaviorTree ID="Main">\n'
        '<DoTask name="job" network="lamp.yaml" task="lihgt">\n'
        '<StartUp name="fetch"/>\n'
        '<StartUp name="trun"/>\n'
        "</DoTask></BehaviorTree></root>\n"
    )
    result = CliRunner().invoke(app, ["trees", "check", "lamp.xml"])
    assert result.exit_code == 2
    assert result.output.splitlines() == [
        "lamp.xml:2: DoTask 'job' has no child for the action 'turn'; add one of this name",
        "lamp.xml:2: the network has no task 'lihgt'; did you mean 'light'?",
        "lamp.xml:4: the network has no action 'trun'; did you mean 'turn'?",
    ]
