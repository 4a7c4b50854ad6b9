"""The words of a tree file: which elements there are, and which attributes and children each takes.

Narrower than what py_trees' parser takes: what it would silently misread is left out (`success_on_selected` cannot be
built from XML), and so is what reads the wall clock (`Timeout`) or the bare blackboard.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import py_trees
from py_trees.ports import PortsMixin
from py_trees.ports_utils import convert_str_to_type, is_instance_of_type

Accepts = Any  # a type, or the words that may stand there as a tuple of strings


@dataclass(frozen=True)
class Attribute:
    """What one attribute takes, and where its value goes."""

    accepts: Accepts
    required: bool = True
    is_port: bool = False
    is_output: bool = False
    takes_key: bool = True
    minimum: int | None = None

    def problem(self, value: str) -> str | None:
        """Why this literal does not do, None if it does."""
        if isinstance(self.accepts, tuple):
            return None if value in self.accepts else f"is not one of {', '.join(self.accepts)}"
        try:
            converted, result = convert_str_to_type(value, self.accepts)
            suits = converted and result is not None and is_instance_of_type(result, self.accepts)
        except (ValueError, NotImplementedError):
            suits = False
        if not suits:
            return f"is no {getattr(self.accepts, '__name__', self.accepts)}"
        if isinstance(result, float) and not math.isfinite(result):
            return "is not finite"
        return f"is less than {self.minimum}" if self.minimum is not None and result < self.minimum else None


@dataclass(frozen=True)
class Kind:
    """One kind of element; `max_children` None for any number."""

    attributes: Mapping[str, Attribute] = field(default_factory=dict)
    min_children: int = 0
    max_children: int | None = 0


_MEMORY = Kind({"memory": Attribute(("true", "false"), takes_key=False)}, 1, None)
_POLICY = Attribute(("success_on_all", "success_on_one"), takes_key=False)
_PLAIN_DECORATORS = (
    *("Count", "FailureIsRunning", "FailureIsSuccess", "Inverter", "PassThrough"),
    *("RunningIsFailure", "RunningIsSuccess", "SuccessIsFailure", "SuccessIsRunning"),
)
BUILT_IN = {
    "Sequence": _MEMORY,
    "Fallback": _MEMORY,
    "Selector": _MEMORY,
    "Parallel": Kind({"policy": _POLICY}, 1, None),
    "Retry": Kind({"num_failures": Attribute(int, minimum=1)}, 1, 1),
    "Repeat": Kind({"num_success": Attribute(int, minimum=1)}, 1, 1),
    "OneShot": Kind({"policy": Attribute(("on_completion", "on_successful_completion"))}, 1, 1),
    "Condition": Kind({"status": Attribute(("success", "failure", "running"))}, 1, 1),
    **{tag: Kind({}, 1, 1) for tag in _PLAIN_DECORATORS},
}


def kinds(leaves: Mapping[str, type]) -> dict[str, Kind]:
    """Every element but SubTree: the built-in ones and the leaves.

    Raises:
        TypeError: a leaf class without ports, which the parser could not build.
    """
    return BUILT_IN | {tag: _leaf_kind(tag, leaf) for tag, leaf in leaves.items()}


def _leaf_kind(tag: str, leaf: Any) -> Kind:
    if not issubclass(leaf, PortsMixin) or not issubclass(leaf, py_trees.behaviour.Behaviour):
        raise TypeError(f"leaf {tag} must be a py_trees.ports.BehaviourWithPorts")
    inputs = {
        name: Attribute(port.data_type, port.required and not port.has_default, is_port=True)
        for name, port in leaf.input_ports().items()
    }
    outputs = {
        name: Attribute(port.data_type, required=False, is_port=True, is_output=True)
        for name, port in leaf.output_ports().items()
    }
    if issubclass(leaf, py_trees.decorators.Decorator):
        return Kind(inputs | outputs, 1, 1)
    if issubclass(leaf, py_trees.composites.Composite):
        return Kind(inputs | outputs, 1, None)
    return Kind(inputs | outputs)
