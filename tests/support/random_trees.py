"""Random tree files, and leaves that end each tick in any status that they may return."""

import random
from collections.abc import Collection
from typing import Any, ClassVar

import py_trees
from hypothesis import strategies as st
from py_trees.common import Status
from py_trees.ports import BehaviourWithPorts, PortInformation

from regrasp.behaviors.keys import Key, WithKeys
from regrasp.trees.vocabulary import BUILT_IN

Ports = dict[str, PortInformation]
STATUSES = [Status.SUCCESS, Status.FAILURE, Status.RUNNING]


class Dice(BehaviourWithPorts):  # type: ignore[misc]
    INPUT_PORTS: ClassVar[Ports] = {}
    OUTPUT_PORTS: ClassVar[Ports] = {}
    RETURNS: ClassVar[frozenset[Status]] = frozenset(STATUSES)
    dice: ClassVar[random.Random] = random.Random(0)
    ticked: ClassVar[list[str]] = []  # names of the nodes that were ticked to their end, in turn

    def update(self) -> Status:
        self.ticked.append(self.name)
        return self.dice.choice([status for status in STATUSES if status in self.RETURNS])


class Yes(Dice):
    RETURNS = frozenset({Status.SUCCESS})


class No(Dice):
    RETURNS = frozenset({Status.FAILURE, Status.RUNNING})


class Busy(Dice):
    RETURNS = frozenset({Status.RUNNING})


class Read(Dice):
    INPUT_PORTS: ClassVar[Ports] = {"x": PortInformation(data_type=int)}

    def update(self) -> Status:
        self.get_input("x")
        return super().update()


class Write(Dice):
    OUTPUT_PORTS: ClassVar[Ports] = {"x": PortInformation(data_type=int, required=False)}

    def update(self) -> Status:
        if self.dice.random() < 0.7:
            self._set_output("x", 1)
        return super().update()


A: Key[int] = Key("toy/a", "a number")
B: Key[int] = Key("toy/b", "another number")


class Put(WithKeys, Dice):
    WRITES = (A,)

    def update(self) -> Status:
        if self.dice.random() < 0.7:
            self.write(A, 1)
        return super().update()


class Need(WithKeys, Dice):
    NEEDS = (A,)

    def update(self) -> Status:
        self.read(A)
        return super().update()


class Turn(Need):
    """Turns one key into another."""

    WRITES = (A, B)

    def update(self) -> Status:
        status = super().update()
        self.write(B, self.read(A))
        if self.dice.random() < 0.5:
            self.clear(A)
        return status


class NeedBoth(Need):
    NEEDS = (B,)

    def update(self) -> Status:
        self.read(B)
        return super().update()


LEAVES: dict[str, type[py_trees.behaviour.Behaviour]] = {
    leaf.__name__: leaf for leaf in (Dice, Yes, No, Busy, Read, Write, Put, Need, Turn, NeedBoth)
}

_BOOL, _KEY = st.sampled_from(["true", "false"]), st.sampled_from(["{a}", "{b}"])
_CONTROL: dict[str, dict[str, st.SearchStrategy[str]]] = {
    "Sequence": {"memory": _BOOL},
    "Fallback": {"memory": _BOOL},
    "Parallel": {"policy": st.sampled_from(["success_on_one", "success_on_all"])},
}
_DECORATORS: dict[str, dict[str, st.SearchStrategy[str]]] = {
    "Retry": {"num_failures": st.sampled_from(["1", "2", "3"])},
    "Repeat": {"num_success": st.sampled_from(["1", "2"])},
    "OneShot": {"policy": st.sampled_from(["on_completion", "on_successful_completion"])},
    "Condition": {"status": st.sampled_from(["success", "failure", "running"])},
}
_DECORATORS |= {tag: {} for tag, kind in BUILT_IN.items() if kind.max_children == 1 and not kind.attributes}
_LEAF_PORTS: dict[str, dict[str, st.SearchStrategy[str]]] = {"Read": {"x": _KEY}, "Write": {"x": _KEY}}

Node = tuple[str, dict[str, str], list[Any]]  # tag, attributes, children


def _element(tag: str, attributes: dict[str, st.SearchStrategy[str]], children: Any) -> st.SearchStrategy[Node]:
    return st.tuples(st.just(tag), st.fixed_dictionaries(attributes), children)


KEYED = ("Dice", "Need", "NeedBoth", "Put", "Turn")
_SUBTREE = _element("SubTree", {"ID": st.just("Inner")}, st.just([]))


def _leaf(tags: Collection[str]) -> st.SearchStrategy[Node]:
    return st.sampled_from(sorted(tags)).flatmap(lambda tag: _element(tag, _LEAF_PORTS.get(tag, {}), st.just([])))


def _parents(nodes: st.SearchStrategy[Node]) -> st.SearchStrategy[Node]:
    control = [_element(tag, given, st.lists(nodes, min_size=1, max_size=4)) for tag, given in _CONTROL.items()]
    decorators = [_element(tag, given, nodes.map(lambda node: [node])) for tag, given in _DECORATORS.items()]
    return st.one_of(*control, *control, *decorators)


def _text(node: Node, lines: list[str]) -> None:
    """One element a line, each with a name that tells its line: n7 is the element of line 7."""
    tag, attributes, children = node
    given = "".join(f' {key}="{value}"' for key, value in attributes.items())
    lines.append(f'<{tag} name="n{len(lines) + 1}"{given}>')
    for child in children:
        _text(child, lines)
    lines[-1] += f"</{tag}>"


@st.composite
def trees(draw: st.DrawFn, tags: Collection[str] = tuple(LEAVES)) -> str:
    """The text of a tree file of these leaves with all that they need; what it does may still be wrong."""
    main = draw(st.recursive(_leaf(tags) | _SUBTREE, _parents, max_leaves=10))
    lines = ['<root main_tree_to_execute="Main">', '<BehaviorTree ID="Main">']
    _text(main, lines)
    lines[-1] += "</BehaviorTree>"
    inner = draw(st.recursive(_leaf(tags), _parents, max_leaves=4))
    lines.append('<BehaviorTree ID="Inner">')
    _text(inner, lines)
    lines[-1] += "</BehaviorTree></root>"
    return "\n".join(lines)
