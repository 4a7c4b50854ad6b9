"""The elements that a tree file may hold, and the attributes and children that each takes.

This is less than py_trees' parser accepts. Left out are elements that it would silently misread (`success_on_selected`
cannot be built from XML), and those that read the wall clock (`Timeout`) or the blackboard directly.
"""

import inspect
import math
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from typing import Any

import py_trees
from py_trees.common import Status
from py_trees.ports import PortsMixin
from py_trees.ports_utils import convert_str_to_type, is_instance_of_type

from regrasp.behaviors.keys import Keys, declared
from regrasp.interfaces.quote import nearest

Accepts = Any  # a type, or the words that may stand there as a tuple of strings
# The names in a cell by kind of object: {"shelf": ["upper", "lower"]}. A mapping in place of the list gives for each
# name the reason why it cannot be used here; "" means that it can.
CellNames = Mapping[str, Collection[str]]
ANY_STATUS = frozenset({Status.SUCCESS, Status.FAILURE, Status.RUNNING})
MAX_COMPARED = 200  # known words that are searched for the closest one
_EXAMPLES = {int: "a whole number such as 3", float: "a number such as 0.5", bool: "true or false"}


@dataclass(frozen=True)
class Attribute:
    """What values an attribute takes, and whether it is a port. A number is above `above`, and not below `least`."""

    accepts: Accepts
    required: bool = True
    is_port: bool = False
    is_output: bool = False
    takes_key: bool = True
    above: float | None = None
    least: float | None = None
    default: Any = None
    about: str = ""
    refused: Mapping[str, str] = field(default_factory=dict)  # accepted words that cannot be used here, and why

    @property
    def takes(self) -> str:
        """The kind of value in words: 'float above 0', 'true or false'."""
        if isinstance(self.accepts, tuple):
            return " or ".join(self.accepts)
        limit = "" if self.above is None else f" above {self.above:g}"
        limit += "" if self.least is None else f" from {self.least:g} on"
        return getattr(self.accepts, "__name__", str(self.accepts)) + limit

    def problem(self, value: str) -> str | None:
        """What is wrong with this literal, and what would be right; None if it is valid."""
        if isinstance(self.accepts, tuple):
            if value in self.accepts:
                return self.refused.get(value)
            return f"is unknown; {suggestion(value, [word for word in self.accepts if word not in self.refused])}"
        right = f"write {_EXAMPLES.get(self.accepts, self.takes)}"
        try:
            converted, result = convert_str_to_type(value, self.accepts)
            suits = converted and result is not None and is_instance_of_type(result, self.accepts)
        except (ValueError, NotImplementedError):
            suits = False
        if not suits:
            return f"is no {self.accepts.__name__ if isinstance(self.accepts, type) else self.accepts}; {right}"
        if isinstance(result, float) and not math.isfinite(result):
            return f"is not finite; {right}"
        if self.above is not None and result <= self.above:
            return f"is not above {self.above:g}; write more than {self.above:g}"
        if self.least is not None and result < self.least:
            return f"is below {self.least:g}; write {self.least:g} or more"
        return None


@dataclass(frozen=True)
class ElementKind:
    """One kind of element; `max_children` None for any number, `returns` the statuses that its `update` may return.

    `needs`, `reads` and `writes` are the keys that a leaf class declares.
    """

    attributes: Mapping[str, Attribute] = field(default_factory=dict)
    min_children: int = 0
    max_children: int | None = 0
    about: str = ""
    returns: frozenset[Status] = ANY_STATUS
    needs: Keys = ()
    reads: Keys = ()
    writes: Keys = ()
    clears: Keys = ()  # which are no writers


_MEMORY = {"memory": Attribute(("true", "false"), takes_key=False, about="true: go on at the child that was running")}
_POLICY = Attribute(("success_on_all", "success_on_one"), takes_key=False)
_DECORATORS = {
    "Count": "The child's status; counts its ticks.",
    "FailureIsRunning": "RUNNING when the child fails.",
    "FailureIsSuccess": "SUCCESS when the child fails.",
    "Inverter": "SUCCESS when the child fails, FAILURE when it succeeds.",
    "PassThrough": "The child's status.",
    "RunningIsFailure": "FAILURE, and the child is stopped, when it is running.",
    "RunningIsSuccess": "SUCCESS, and the child is stopped, when it is running.",
    "SuccessIsFailure": "FAILURE when the child succeeds.",
    "SuccessIsRunning": "RUNNING when the child succeeds.",
}
_SELECTOR = ElementKind(_MEMORY, 1, None, "Ticks its children in turn until one does not fail.")
BUILT_IN = {
    "Sequence": ElementKind(_MEMORY, 1, None, "Ticks its children in turn until one does not succeed."),
    "Fallback": _SELECTOR,
    "Selector": _SELECTOR,
    "Parallel": ElementKind(
        {"policy": _POLICY}, 1, None, "Ticks all its children at every tick; fails when one fails."
    ),
    "Retry": ElementKind(
        {"num_failures": Attribute(int, above=0, about="tries")}, 1, 1, "Ticks its child anew after a failure."
    ),
    "Repeat": ElementKind(
        {"num_success": Attribute(int, above=0, about="successes")}, 1, 1, "Ticks its child anew after a success."
    ),
    "OneShot": ElementKind(
        {"policy": Attribute(("on_completion", "on_successful_completion"))},
        1,
        1,
        "Ticks its child to its end once; later the same status again.",
    ),
    "Condition": ElementKind(
        {"status": Attribute(("success", "failure", "running"))},
        1,
        1,
        "SUCCESS when the child has this status, RUNNING until then.",
    ),
    **{tag: ElementKind({}, 1, 1, about) for tag, about in _DECORATORS.items()},
}

COUNTERPARTS = {  # for elements of BehaviorTree.CPP, and those of py_trees that are left out
    "ForceFailure": "<SuccessIsFailure>",
    "ForceSuccess": "<FailureIsSuccess>",
    "ReactiveFallback": '<Fallback memory="false">',
    "ReactiveSequence": '<Sequence memory="false">',
    "RetryUntilSuccessful": '<Retry num_failures="...">',
    "Delay": '<Wait seconds="..."> before it',
    "Sleep": '<Wait seconds="...">',
    "Timeout": '<TimeLimit seconds="...">, in simulated seconds',
}


def suggestion(word: str, known: Collection[str]) -> str:
    """What to write in place of an unknown word: the closest known one, else a list of the known ones."""
    return nearest(word, known, compared=MAX_COMPARED) if known else "there are none, remove it"


def element_kinds(leaves: Mapping[str, type], names: CellNames | None = None) -> dict[str, ElementKind]:
    """Every element but SubTree: the built-in ones and the leaves.

    A leaf may declare more than py_trees asks for: its ports `above` and `names` (see
    `regrasp.behaviors.leaf.LeafPort`), its class `RETURNS` and keys (`regrasp.behaviors.keys`). A port for a name takes
    those in `names`, or any string where there are none.

    Raises:
        TypeError: a leaf class without ports, which the parser could not build.
    """
    return BUILT_IN | {tag: _leaf_kind(tag, leaf, names or {}) for tag, leaf in leaves.items()}


def _leaf_kind(tag: str, leaf: Any, names: CellNames) -> ElementKind:
    if not issubclass(leaf, PortsMixin) or not issubclass(leaf, py_trees.behaviour.Behaviour):
        raise TypeError(f"leaf {tag} must be a py_trees.ports.BehaviourWithPorts")
    ports = {
        name: _port(port, is_output, names)
        for is_output, declared in ((False, leaf.input_ports()), (True, leaf.output_ports()))
        for name, port in declared.items()
    }
    needs, returns = declared(leaf, "NEEDS"), getattr(leaf, "RETURNS", ANY_STATUS)
    is_composite = issubclass(leaf, py_trees.composites.Composite)
    is_parent = is_composite or issubclass(leaf, py_trees.decorators.Decorator)
    return ElementKind(
        ports,
        min_children=int(is_parent),
        max_children=None if is_composite else int(is_parent),
        about=inspect.cleandoc(leaf.__doc__ or ""),
        returns=returns | {Status.FAILURE} if needs else returns,  # when a key that it needs was cleared
        needs=needs,
        reads=declared(leaf, "READS"),
        writes=declared(leaf, "WRITES"),
        clears=declared(leaf, "CLEARS"),
    )


def _port(port: Any, is_output: bool, names: CellNames) -> Attribute:
    known = names.get(getattr(port, "names", None) or "")
    return Attribute(
        port.data_type if known is None else tuple(known),
        required=port.required and not port.has_default and not is_output,
        is_port=True,
        is_output=is_output,
        above=getattr(port, "above", None),
        least=getattr(port, "least", None),
        default=port.default_value,
        about=port.description,
        refused={name: why for name, why in known.items() if why} if isinstance(known, Mapping) else {},
    )
