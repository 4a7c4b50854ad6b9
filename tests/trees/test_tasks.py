"""The task that a tree's leaves are of, and leaf sets of other packages, installed as pip installs them."""

import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from toy_leaves import KEY_LEAVES, LEAVES

from regrasp.behaviors import registry
from regrasp.behaviors.registry import Leaves, all_leaves, leaves_for, leaves_of
from regrasp.interfaces import plugins
from regrasp.trees import check_tree
from regrasp.trees.scripted import ScriptedTree

Install = Callable[[dict[str, str], list[str]], None]
MODULE = """\
from py_trees.ports import BehaviourWithPorts

def leaf(name):
    return type(name, (BehaviourWithPorts,), {"INPUT_PORTS": {}, "OUTPUT_PORTS": {}, "OF": __name__}, register=False)

LEAVES = {name: leaf(name) for name in NAMES}
"""
BUTTON = MODULE.replace("NAMES", '("Press", "Regrasp")')
BROKEN = "import no_such_module\n"
CACHED = (plugins.installed, registry.leaf_set, registry.leaves_of, registry.all_leaves)


def forget() -> None:
    for function in CACHED:
        function.cache_clear()


@pytest.fixture
def install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Install]:
    """Installs leaf sets, a module of this text each, and tasks of these names."""
    before = {*sys.modules}

    def now(sets: dict[str, str], tasks: list[str]) -> None:
        folder = tmp_path / "toys-1.0.dist-info"
        folder.mkdir()
        (folder / "METADATA").write_text("Metadata-Version: 2.1\nName: toys\nVersion: 1.0\n")
        points = [f"{name} = toy_{name}:LEAVES" for name in sets]
        named = [f"{name} = no_such_module:TASK" for name in tasks]
        text = ["[regrasp.leaves]", *points, "[regrasp.tasks]", *named]
        (folder / "entry_points.txt").write_text("\n".join(text))
        for name, module in sets.items():
            (tmp_path / f"toy_{name}.py").write_text(module)
        monkeypatch.syspath_prepend(str(tmp_path))
        forget()

    yield now
    forget()
    for name in {*sys.modules} - before:
        if name.startswith("toy_"):
            del sys.modules[name]


def check(tmp_path: Path, *lines: str, task: str | None = None, leaves: Leaves | None = None) -> list[tuple[int, str]]:
    body = "\n".join(['<Sequence name="s" memory="true">', *lines])
    path = tmp_path / "tree.xml"
    path.write_text(f'<root main_tree_to_execute="M"><BehaviorTree ID="M">{body}</Sequence></BehaviorTree></root>')
    return check_tree(path, leaves, task=task)


UNPLUG, PRESS, WAIT = '<Unplug name="unplug" socket="a"/>', '<Press name="press"/>', '<Wait name="w" seconds="1.0"/>'
TWO = "Press 'press' is a leaf of the task button, and "


def test_a_tree_of_two_tasks_is_a_finding_at_the_second_tasks_first_leaf(install: Install, tmp_path: Path) -> None:
    install({"button": BUTTON}, ["button"])
    both = [WAIT, UNPLUG, PRESS, PRESS.replace("press", "again")]
    assert check(tmp_path, *both) == [
        (4, f"{TWO}Unplug of line 3 one of the task cable; a tree does one task's job: write two trees")
    ]
    assert check(tmp_path, WAIT, UNPLUG) == check(tmp_path, WAIT, PRESS) == []


def test_a_leaf_of_another_task_than_the_scenarios_is_a_finding(install: Install, tmp_path: Path) -> None:
    install({"button": BUTTON}, ["button"])
    assert check(tmp_path, WAIT, UNPLUG, PRESS, task="cable") == [
        (4, f"{TWO}the scenario's task is cable; take leaves of cable, or another tree")
    ]
    assert check(tmp_path, WAIT, PRESS, task="button") == []
    assert [line for line, _ in check(tmp_path, UNPLUG, task="button")] == [2]


def test_a_set_without_a_task_is_for_every_task(install: Install, tmp_path: Path) -> None:
    install({"button": BUTTON, "extra": MODULE.replace("NAMES", '("Blink",)')}, ["button"])
    blink = '<Blink name="blink"/>'
    for lines, task in (([blink, UNPLUG], None), ([blink, UNPLUG], "cable"), ([PRESS, blink], "button")):
        assert check(tmp_path, *lines, task=task) == []
    assert all_leaves().tasks["Press"] == "button"
    assert "Blink" not in all_leaves().tasks
    assert "Wait" not in all_leaves().tasks


def test_a_name_that_two_tasks_have_is_the_trees_tasks(install: Install, tmp_path: Path) -> None:
    install({"button": BUTTON}, ["button"])
    for names in (["Regrasp", "Press"], ["Press", "Regrasp"]):
        assert leaves_for(names)["Regrasp"].OF == "toy_button"
    assert leaves_for(["Regrasp", "Unplug"])["Regrasp"].__module__ == "regrasp.behaviors.cable.regrasp"
    assert leaves_for(["Regrasp"], "cable")["Regrasp"].__module__ == "regrasp.behaviors.cable.regrasp"
    assert leaves_for(["Regrasp", "Nothing"], "cable")["Regrasp"].__module__ == "regrasp.behaviors.cable.regrasp"
    assert check(tmp_path, PRESS, '<Regrasp name="regrasp"/>') == []
    tree = ScriptedTree(tmp_path / "tree.xml")
    assert [*tree.leaves] == ["s/press", "s/regrasp"]


def test_a_set_that_cannot_be_imported_is_told_where_a_leaf_is_unknown(install: Install, tmp_path: Path) -> None:
    install({"button": BROKEN, "extra": BROKEN}, ["button"])
    assert check(tmp_path, WAIT, UNPLUG) == []
    assert check(tmp_path, WAIT, UNPLUG, task="cable") == []
    why = "cannot be imported (ModuleNotFoundError: No module named 'no_such_module')"
    both = f", and the leaf set button {why}, and the leaf set extra {why}; "
    [(line, sentence)] = check(tmp_path, WAIT, '<Unplugg name="u" socket="a"/>')
    assert (line, sentence) == (3, f"unknown element 'Unplugg'{both}did you mean 'Unplug'?")
    for task in ("button", "cable", None):
        [(_, sentence)] = check(tmp_path, WAIT, PRESS, task=task)
        assert sentence.startswith(f"unknown element 'Press'{both}")
    assert {*leaves_of("cable").broken} == {"extra"}


@pytest.mark.parametrize(
    ("module", "why"),
    [
        ("LEAVES = 3", "TypeError: 'int' object is not iterable"),
        ("LEAVES = {'Press': 3}", "TypeError: leaf Press is no py_trees.ports.BehaviourWithPorts"),
        ("from regrasp.behaviors import Leaf\nLEAVES = {'Press': Leaf}", "TypeError: leaf Press has no INPUT_PORTS"),
        ("from toy_extra import a", "ModuleNotFoundError: No module named 'toy_extra'"),
    ],
)
def test_a_set_of_something_else_breaks_no_other(install: Install, tmp_path: Path, module: str, why: str) -> None:
    install({"button": module}, [])
    assert check(tmp_path, WAIT, UNPLUG) == []
    [(_, sentence)] = check(tmp_path, WAIT, PRESS)
    assert f"the leaf set button cannot be imported ({why}" in sentence


def test_the_other_tasks_sets_are_not_imported_for_a_known_task(install: Install, tmp_path: Path) -> None:
    install({"button": "raise SystemExit"}, ["button"])
    assert check(tmp_path, WAIT, UNPLUG, task="cable") == []
    assert "toy_button" not in sys.modules


def test_leaves_that_are_handed_in_may_tell_their_tasks(tmp_path: Path) -> None:
    leaves = Leaves(LEAVES | KEY_LEAVES, tasks={"Grip": "hand", "Say": "talk"})
    lines = ['<Grip name="grip"/>', '<Say name="say" word="{w}"/>']
    assert check(tmp_path, *lines, leaves=leaves) == [
        (
            3,
            "Say 'say' is a leaf of the task talk, and Grip of line 2 one of the task hand; "
            "a tree does one task's job: write two trees",
        )
    ]
