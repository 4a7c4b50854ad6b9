"""The words that a task uses in summaries and explanations, and those of every task."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

from regrasp.interfaces.quote import arm_words

Lines = Callable[[Mapping[str, Any]], Iterator[str]]
Moments = Callable[[Mapping[str, Any]], Iterator[tuple[float, str]]]


def name_and_value(values: Mapping[str, Any]) -> Iterator[str]:
    """A line for each value."""
    yield from (f"{name}: {value}" for name, value in values.items())


def robot_lines(belief: Mapping[str, Any]) -> Iterator[str]:
    """The obstacles that the robot has mapped, and where it reads its arms."""
    yield f"obstacles mapped: {belief.get('occupied_voxels', 0)} voxels"
    for name, arm in belief.get("arms", {}).items():
        yield f"{arm_words(name).removeprefix('the ')}: tool at {place(arm['tool'])}"
        yield f"  joints {numbers(arm['joints'])} rad"


def belief_lines(belief: Mapping[str, Any]) -> Iterator[str]:
    """What the tree's keys held, then the robot."""
    yield from name_and_value(
        {name: value for name, value in belief.items() if name not in ("arms", "occupied_voxels")}
    )
    yield from robot_lines(belief)


def place(pose: Mapping[str, Any]) -> str:
    """The position of a pose."""
    return f"{numbers(pose['position'])} m"


def numbers(values: Any) -> str:
    """Numbers to three decimals, in parentheses."""
    return "(" + ", ".join(f"{round(value, 3) + 0.0:.3f}" for value in values) + ")"


def no_moments(_measured: Mapping[str, Any]) -> Iterator[tuple[float, str]]:
    """Of a task that tells none."""
    yield from ()


@dataclass(frozen=True)
class Words:
    """How a task tells of what it measured, and of what its robot knew. The defaults tell names and values."""

    measured: str = "measured"  # stands before each line of `measured_lines` in a summary
    measured_title: str = "What was measured, by ground truth"
    measured_lines: Lines = name_and_value
    belief_lines: Lines = belief_lines
    measured_moments: Moments = no_moments  # what truly happened when: seconds, and a few words for a time line
    # The words for what an expectation of this name wants; by default "at most" a number, and any other value itself.
    limits: Mapping[str, str] = field(default_factory=dict)  # such as {"slips": "at least {}, all noticed"}
    # The units of what the judge measures and of expectations, by their names: {"door_open": "m"}; see `unit`.
    units: Mapping[str, str] = field(default_factory=dict)

    def unit(self, name: str) -> str:
        """The unit of a measured value or an expectation; '' if it has none, or none is known."""
        return self.units.get(name, _UNITS.get(name, ""))


_UNITS = {"unintended_force": "N"}  # of every task

PLAIN = Words()
