"""The result of a run as lines of text."""

import sys
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from regrasp.app.records.result import DEFAULT_CASE
from regrasp.app.task.find import words_of
from regrasp.interfaces.quote import printable

if TYPE_CHECKING:
    from regrasp.app.records.result import Result
    from regrasp.app.task.expectation import Expectation


def run_summary(result: "Result", folder: Path) -> str:
    """What `regrasp run` prints at the end."""
    lines = [headline(result)]
    if result.cause:
        at = f" ({result.cause.node})" if result.cause.node else ""
        lines.append(f"  cause   {result.cause.code}: {result.cause.message}{at}")
    lines += [f"  {line}" for line in expectation_lines(result)]
    lines += [f"  {words_of(result.task).measured:<7} {line}" for line in measured_lines(result)]
    if result.thrown_away is not None:
        lines.append(f"  scene   {thrown_words(result.thrown_away)}")
    lines.append(f"  record  {folder}")
    lines.append(
        f"  time    {result.sim_seconds:.1f} s simulated in {result.wall_seconds:.1f} s, "
        f"real-time factor {result.real_time_factor:.2f}, renderer {result.renderer}"
    )
    lines += [f"  went to {line}" for line in wall_lines(result)]
    return "\n".join(map(printable, lines))  # a cause may quote an exception


def thrown_words(thrown_away: Mapping[str, Mapping[str, int]]) -> str:
    """What was thrown away before a scene was kept: how many of each kind, and why, the most frequent reason first."""
    told = []
    for kind, reasons in thrown_away.items():
        why = ", ".join(f"{count} {reason}" for reason, count in sorted(reasons.items(), key=lambda item: -item[1]))
        told.append(f"{sum(reasons.values())} {kind} thrown away" + (f" ({why})" if why else ""))
    return "; ".join(told)


def wall_lines(result: "Result") -> Iterator[str]:
    """Where the wall-clock time went: each part's share, the largest first."""
    parts = sorted(result.wall_by_part.items(), key=lambda part: -part[1])
    whole = sum(result.wall_by_part.values())
    if whole > 0:
        yield ", ".join(f"{name} {100 * seconds / whole:.0f} %" for name, seconds in parts)


def headline(result: "Result") -> str:
    """Scenario, seed, outcome, and how many expectations were met."""
    met = sum(e.met for e in result.expectations)
    ran = what_ran(result.scenario, result.case, result.seed)
    return f"{ran}: {result.outcome}, {met} of {len(result.expectations)} expectations met"


def what_ran(scenario: str, case: str, seed: object) -> str:
    """Scenario, case if it has several, seed."""
    return f"{scenario}{'' if case == DEFAULT_CASE else f' {case}'}, seed {seed}"


def expectation_lines(result: "Result") -> Iterator[str]:
    """Each expectation with a mark: met or not, what came out, what was expected."""
    yes, no = marks()
    for e in result.expectations:
        yield f"{yes if e.met else no} {e.name}: {_plain(e.value)} (expected: {limit_words(e, result.task)})"


def limit_words(expectation: "Expectation", task: str) -> str:
    """What the scenario expects, in words: the very value, or a number as the most that may come out."""
    name, limit = expectation.name, _plain(expectation.limit)
    if (words := words_of(task).limits.get(name)) is not None:
        return words.format(limit)
    is_number = isinstance(expectation.limit, (int, float)) and not isinstance(expectation.limit, bool)
    unit = words_of(task).unit(name)
    return f"at most {limit}{unit and f' {unit}'}" if is_number else limit


def measured_lines(result: "Result") -> Iterator[str]:
    """What the task's judge measured."""
    try:
        yield from words_of(result.task).measured_lines(result.measured)
    except Exception:  # another package's code, and a file that anybody may have changed
        yield f"not in the form that the task {result.task} writes"


def event_words(event: str, values: Mapping[str, Any], between: str = "=") -> str:
    """An event's name, and its values as name=value, but for mappings and lists of words, which are for programs.

    `between` stands for the equals sign.
    """
    told = ", ".join(f"{name}{between}{_short(value)}" for name, value in values.items() if not _structured(value))
    return f"{event}: {told}" if told else event


def _structured(value: object) -> bool:
    return isinstance(value, dict) or (isinstance(value, list) and any(isinstance(item, str) for item in value))


def _short(value: object) -> str:
    return f"{value:.6g}" if isinstance(value, float) else str(value)


def marks() -> tuple[str, str]:
    """Signs for met and not met, in characters that stdout can show."""
    return ("✓", "✗") if (sys.stdout.encoding or "").lower().startswith("utf") else ("ok", "NOT MET")


def _plain(value: object) -> str:
    return f"{value:.3g}" if isinstance(value, float) else str(value)
