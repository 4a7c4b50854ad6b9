"""The words of a tree file: which elements there are, and which attributes and children each takes.

Narrower than what py_trees' parser takes: what it would silently misread is left out (`success_on_selected` cannot be
built from XML), and so is what reads the wall clock (`Timeout`) or the bare blackboard.
"""

import inspect
import math
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from difflib import get_close_matches
from typing import Any

import py_trees
from py_trees.common import Status
from py_trees.ports import PortsMixin
from py_trees.ports_utils import convert_str_to_type, is_instance_of_type

from regrasp.interfaces.quote import MAX_QUOTE, cut

Accepts = Any  # a type, or the words that may stand there as a tuple of strings
# The names that a kind of thing has: {"socket": ["back_1", "back_2"]}. In place of a list a mapping says of each name
# why it cannot be used here; "" means that it can.
Names = Mapping[str, Collection[str]]
ANY_STATUS = frozenset({Status.SUCCESS, Status.FAILURE, Status.RUNNING})
MOST_LISTED = 12  # known words that are listed when none is near
MOST_COMPARED = 200  # known words among which the nearest is looked for
_EXAMPLES = {int: "a whole number such as 3", float: "a number such as 0.5", bool: "true or false"}


@dataclass(frozen=True)
class Attribute:
    """What one attribute takes, and where its value goes. A number must be more than `above`."""

    accepts: Accepts
    required: bool = True
    is_port: bool = False
    is_output: bool = False
    takes_key: bool = True
    above: float | None = None
    default: Any = None
    about: str = ""
    refused: Mapping[str, str] = field(default_factory=dict)  # of the words that it accepts: why one does not do here

    @property
    def takes(self) -> str:
        """The kind of value in words: 'float above 0', 'true or false'."""
        if isinstance(self.accepts, tuple):
            return " or ".join(self.accepts)
        limit = "" if self.above is None else f" above {self.above:g}"
        return getattr(self.accepts, "__name__", str(self.accepts)) + limit

    def problem(self, value: str) -> str | None:
        """Why this literal does not do, and what would; None if it does."""
        if isinstance(self.accepts, tuple):
            if value in self.accepts:
                return self.refused.get(value)
            return f"is unknown; {nearest(value, [word for word in self.accepts if word not in self.refused])}"
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
        return None


@dataclass(frozen=True)
class Kind:
    """One kind of element; `max_children` None for any number, `returns` the statuses that its `update` may return."""

    attributes: Mapping[str, Attribute] = field(default_factory=dict)
    min_children: int = 0
    max_children: int | None = 0
    about: str = ""
    returns: frozenset[Status] = ANY_STATUS


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
_SELECTOR = Kind(_MEMORY, 1, None, "Ticks its children in turn until one does not fail.")
BUILT_IN = {
    "Sequence": Kind(_MEMORY, 1, None, "Ticks its children in turn until one does not succeed."),
    "Fallback": _SELECTOR,
    "Selector": _SELECTOR,
    "Parallel": Kind({"policy": _POLICY}, 1, None, "Ticks all its children at every tick; fails when one fails."),
    "Retry": Kind(
        {"num_failures": Attribute(int, above=0, about="tries")}, 1, 1, "Ticks its child anew after a failure."
    ),
    "Repeat": Kind(
        {"num_success": Attribute(int, above=0, about="successes")}, 1, 1, "Ticks its child anew after a success."
    ),
    "OneShot": Kind(
        {"policy": Attribute(("on_completion", "on_successful_completion"))},
        1,
        1,
        "Ticks its child to its end once; later the same status again.",
    ),
    "Condition": Kind(
        {"status": Attribute(("success", "failure", "running"))},
        1,
        1,
        "SUCCESS when the child has this status, RUNNING until then.",
    ),
    **{tag: Kind({}, 1, 1, about) for tag, about in _DECORATORS.items()},
}

COUNTERPARTS = {  # of BehaviorTree.CPP's words, and of py_trees' that are left out
    "ForceFailure": "<SuccessIsFailure>",
    "ForceSuccess": "<FailureIsSuccess>",
    "ReactiveFallback": '<Fallback memory="false">',
    "ReactiveSequence": '<Sequence memory="false">',
    "RetryUntilSuccessful": '<Retry num_failures="...">',
    "Timeout": "a leaf with a time limit of its own, such as <SpiralSearch>, in simulated seconds",
}


def nearest(word: str, known: Collection[str]) -> str:
    """The words that help after an unknown one: the nearest known one, else all that there are."""
    words = sorted(known)
    alike = [known for known in words if known.casefold() == word.casefold()]
    if near := alike or get_close_matches(word[:MAX_QUOTE], words[:MOST_COMPARED], 1):
        return f"did you mean {cut(near[0])}?"
    more = f" and {len(words) - MOST_LISTED} more" if words[MOST_LISTED:] else ""
    return f"there are {', '.join(map(cut, words[:MOST_LISTED]))}{more}" if words else "there are none, remove it"


def kinds(leaves: Mapping[str, type], names: Names | None = None) -> dict[str, Kind]:
    """Every element but SubTree: the built-in ones and the leaves.

    A leaf may say more than py_trees asks: a port `above` and `names` (see `regrasp.behaviors.leaf.Port`), the class
    `RETURNS`. A port for a name takes those in `names`, or any string where there are none.

    Raises:
        TypeError: a leaf class without ports, which the parser could not build.
    """
    return BUILT_IN | {tag: _leaf_kind(tag, leaf, names or {}) for tag, leaf in leaves.items()}


def _leaf_kind(tag: str, leaf: Any, names: Names) -> Kind:
    if not issubclass(leaf, PortsMixin) or not issubclass(leaf, py_trees.behaviour.Behaviour):
        raise TypeError(f"leaf {tag} must be a py_trees.ports.BehaviourWithPorts")
    ports = {
        name: _port(port, is_output, names)
        for is_output, declared in ((False, leaf.input_ports()), (True, leaf.output_ports()))
        for name, port in declared.items()
    }
    is_composite = issubclass(leaf, py_trees.composites.Composite)
    is_parent = is_composite or issubclass(leaf, py_trees.decorators.Decorator)
    return Kind(
        ports,
        min_children=int(is_parent),
        max_children=None if is_composite else int(is_parent),
        about=inspect.cleandoc(leaf.__doc__ or ""),
        returns=getattr(leaf, "RETURNS", ANY_STATUS),
    )


def _port(port: Any, is_output: bool, names: Names) -> Attribute:
    known = names.get(getattr(port, "names", None) or "")
    return Attribute(
        port.data_type if known is None else tuple(known),
        required=port.required and not port.has_default and not is_output,
        is_port=True,
        is_output=is_output,
        above=getattr(port, "above", None),
        default=port.default_value,
        about=port.description,
        refused={name: why for name, why in known.items() if why} if isinstance(known, Mapping) else {},
    )
