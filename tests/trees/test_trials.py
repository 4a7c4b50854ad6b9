from pathlib import Path
from typing import Any, ClassVar

import pytest
from py_trees.common import Status
from py_trees.decorators import Decorator
from py_trees.ports import PortsMixin
from toy_leaves import GOOD, LEAVES

from regrasp.trees.trials import left_by_a_stop, never_ends, trials

TREE = '<root main_tree_to_execute="M"><BehaviorTree ID="M">{}</BehaviorTree></root>'
TWO = '<Sequence name="root" memory="true"><Wait name="a" ticks="1"/><Wait name="b" ticks="1"/></Sequence>'


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "tree.xml"


def test_a_sound_tree_stands_every_trial(path: Path) -> None:
    path.write_text(GOOD)
    assert [*never_ends(path, LEAVES), *left_by_a_stop(path, LEAVES)] == []


def test_the_trials_come_to_every_leaf_and_are_the_same_each_time(path: Path) -> None:
    path.write_text(GOOD)

    def tables() -> dict[str, str]:
        ran = {trial.name: trial.tree() for trial in trials(path, LEAVES)}
        for tree in ran.values():
            tree.run()
        assert all(any(tree.entered(leaf) for tree in ran.values()) for leaf in next(iter(ran.values())).leaves)
        return {name: tree.table() for name, tree in ran.items()}

    assert tables() == tables()


def test_a_tree_that_goes_on_for_ever_is_named_with_what_it_does(path: Path) -> None:
    path.write_text(TREE.format(f'<SuccessIsRunning name="again">{TWO}</SuccessIsRunning>'))
    first = next(never_ends(path, LEAVES))
    assert first.startswith("what can succeed does: the tree still runs after 10000 ticks")


class Careless(PortsMixin, Decorator, register=False):  # type: ignore[misc, call-arg]
    """Leaves its child at work when it is stopped, and when it gives up."""

    INPUT_PORTS: ClassVar[dict[str, Any]] = {}
    OUTPUT_PORTS: ClassVar[dict[str, Any]] = {}
    gives_up = False

    def update(self) -> Status:
        return Status.FAILURE if self.gives_up else self.decorated.status

    def stop(self, new_status: Status) -> None:
        self.status = new_status


class GivesUp(Careless, register=False):  # type: ignore[call-arg]
    gives_up = True


def careless(path: Path, tag: str) -> dict[str, Any]:
    path.write_text(TREE.format(f'<{tag} name="careless">{TWO}</{tag}>'))
    return {**LEAVES, "Careless": Careless, "GivesUp": GivesUp}


def test_a_leaf_left_at_work_by_a_stop_is_named_with_the_tick(path: Path) -> None:
    first = next(left_by_a_stop(path, careless(path, "Careless")))
    assert first == (
        "drawn from seed 0: stopped after tick 1, careless/root/a was not\ntick      1\ncareless  X\na         R"
    )


def test_a_leaf_left_at_work_by_the_trees_own_end_is_named(path: Path) -> None:
    first = next(never_ends(path, careless(path, "GivesUp")))
    assert first.startswith("drawn from seed 0: the tree ended, but careless/root/a still runs\ntick")
