"""Declared keys at run time."""

from types import SimpleNamespace
from typing import Any, ClassVar

import py_trees
import pytest
from fake_services import Clock, Log
from py_trees.common import Status
from py_trees.decorators import Decorator
from py_trees.ports import PortsMixin

from regrasp.behaviors.keys import CAUSES, Key, MissingKeyError, causes, declared, value_of
from regrasp.behaviors.leaf import Leaf, LeafSteps, StepsLeaf, WithServices
from regrasp.interfaces.cause import Cause, CauseCode

WIDTH: Key[float] = Key("toy/width", "width of what the hand holds, m")
SIDE: Key[str | None] = Key("toy/side", "the side that it is held from", default=None)
PORTS: dict[str, Any] = {}


class Grip(StepsLeaf):
    WRITES = (WIDTH, SIDE)

    def steps(self) -> LeafSteps:
        self.write(WIDTH, 0.04)
        self.write(SIDE, "left")
        yield from ()


class Pull(Leaf):
    INPUT_PORTS: ClassVar = PORTS
    OUTPUT_PORTS: ClassVar = PORTS
    NEEDS = (WIDTH,)

    def work(self) -> Status:
        return Status.SUCCESS if self.read(WIDTH) > 0.01 else Status.FAILURE


class Drop(Leaf):
    INPUT_PORTS: ClassVar = PORTS
    OUTPUT_PORTS: ClassVar = PORTS
    READS = (WIDTH, SIDE)
    WRITES = (WIDTH,)

    def work(self) -> Status:
        if self.read(WIDTH, None) is None:
            return self.fail(CauseCode.NOTHING_HELD, f"nothing is held from {self.read(SIDE)}")
        self.clear(WIDTH)
        return Status.SUCCESS


class Firm(WithServices, PortsMixin, Decorator):  # type: ignore[misc]
    """A decorator that needs a key."""

    INPUT_PORTS: ClassVar = PORTS
    OUTPUT_PORTS: ClassVar = PORTS
    NEEDS = (WIDTH,)

    def work(self) -> Status:
        return self.decorated.status if self.read(WIDTH) > 0.01 else Status.FAILURE


@pytest.fixture(autouse=True)
def services() -> Any:
    py_trees.blackboard.Blackboard.clear()
    yield SimpleNamespace(clock=Clock(), log=Log())
    py_trees.blackboard.Blackboard.clear()


def tick(node: Any, services: Any) -> Status:
    for each in node.iterate():
        each.setup(services=services)
    node.tick_once()
    status: Status = node.status
    return status


def test_leaves_hand_on_by_keys_what_they_declare(services: Any) -> None:
    assert tick(Grip("grip"), services) is Status.SUCCESS
    assert (value_of(WIDTH), value_of(SIDE)) == (0.04, "left")
    assert tick(Pull("pull"), services) is Status.SUCCESS
    assert tick(Firm("firm", Pull("pull")), services) is Status.SUCCESS
    assert tick(Drop("drop"), services) is Status.SUCCESS
    assert value_of(WIDTH, 0) == 0


@pytest.mark.parametrize("after", [[], [Grip, Drop]])
def test_a_needed_key_that_holds_nothing_is_a_failure_with_a_cause(services: Any, after: list[Any]) -> None:
    for leaf in after:
        tick(leaf("before"), services)
    assert tick(Pull("root.pull"), services) is Status.FAILURE
    message = "toy/width (width of what the hand holds, m) holds nothing: no leaf has written it, or one has cleared it"
    assert causes() == (Cause(CauseCode.KEY_MISSING, message, "root/pull"),)
    assert tick(Firm("firm", Grip("grip")), services) is Status.SUCCESS
    tick(Drop("drop"), services)
    assert tick(Firm("firm", py_trees.behaviours.Success("s")), services) is Status.FAILURE
    assert causes()[-1].node == "firm"


def test_a_reader_gets_what_it_asks_for_in_place_of_a_key_that_holds_nothing(services: Any) -> None:
    drop = Drop("drop")
    assert (drop.read(SIDE), drop.read(SIDE, "none"), drop.read(WIDTH, None)) == (None, "none", None)
    assert tick(drop, services) is Status.FAILURE
    assert drop.feedback_message == "nothing is held from None"
    assert value_of(SIDE) is None
    with pytest.raises(MissingKeyError, match="toy/width"):
        value_of(WIDTH)


def test_causes_are_told_in_turn_and_gone_with_the_blackboard(services: Any) -> None:
    assert causes() == ()
    for name in ("a", "b"):
        tick(Drop(name), services)
    assert [cause.node for cause in causes()] == ["a", "b"]
    py_trees.blackboard.Blackboard.clear()
    assert causes() == ()


def test_a_key_that_a_leaf_does_not_declare_is_a_programming_error(services: Any) -> None:
    with pytest.raises(TypeError, match="Pull writes toy/width, which it does not declare; name it in WRITES"):
        Pull("pull").write(WIDTH, 1.0)
    with pytest.raises(TypeError, match="Pull clears toy/width, which it does not declare; name it in CLEARS"):
        Pull("pull").clear(WIDTH)
    with pytest.raises(TypeError, match="Grip reads toy/width, which it does not declare; name it in NEEDS or READS"):
        Grip("grip").read(WIDTH)

    class Careless(Grip, register=False):
        def steps(self) -> LeafSteps:
            self.read(WIDTH)
            yield None

    with pytest.raises(TypeError, match="Careless reads"):
        tick(Careless("careless"), services)


def test_what_base_classes_declare_is_declared_with_it() -> None:
    class Both(Grip, Pull, register=False):
        READS = (WIDTH,)

    assert declared(Both, "NEEDS") == (WIDTH,)
    assert declared(Both, "READS") == (CAUSES, WIDTH)
    assert declared(Both, "WRITES") == (CAUSES, WIDTH, SIDE)


def test_a_key_is_refused_that_could_not_work() -> None:
    for name in ("", "/held", "toy/", "toy.held", "toy//held"):
        with pytest.raises(ValueError, match="such as button/place"):
            Key(name, "")
    with pytest.raises(TypeError, match="the default of toy/list can be changed"):
        Key("toy/list", "", default=[])
    with pytest.raises(TypeError, match="Wrong NEEDS toy/side, whose default is always there; name it in READS"):

        class Wrong(Leaf):
            NEEDS = (SIDE,)
