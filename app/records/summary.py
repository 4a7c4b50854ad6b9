"""The result of a run as lines of text."""

import sys
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from regrasp.app.records.result import DEFAULT_CASE

if TYPE_CHECKING:
    from regrasp.app.records.result import Expectation, Result


def run_summary(result: "Result", folder: Path) -> str:
    """What `regrasp run` prints at the end."""
    lines = [headline(result)]
    if result.cause:
        at = f" ({result.cause.node})" if result.cause.node else ""
        lines.append(f"  cause   {result.cause.code}: {result.cause.message}{at}")
    lines += [f"  {line}" for line in expectation_lines(result)]
    lines += [f"  slip    {line}" for line in slip_lines(result)]
    lines.append(f"  record  {folder}")
    lines.append(
        f"  time    {result.sim_seconds:.1f} s simulated in {result.wall_seconds:.1f} s, "
        f"real-time factor {result.real_time_factor:.2f}, renderer {result.renderer}"
    )
    lines += [f"  went to {line}" for line in wall_lines(result)]
    return "\n".join(lines)


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
        yield f"{yes if e.met else no} {e.name}: {_plain(e.value)} (expected: {limit_words(e)})"


def limit_words(expectation: "Expectation") -> str:
    """What the scenario expects, and whether it is the least, the most or the very value."""
    limit = _plain(expectation.limit)
    if expectation.name == "slips":
        return f"at least {limit}, all noticed"
    return limit if expectation.name in ("outcome", "end", "cause", "hidden") else f"at most {limit}"


def slip_lines(result: "Result") -> Iterator[str]:
    """Each loss of the connector, and how it was noticed."""
    for slip in result.slips:
        seen = (
            f"noticed at {slip.detected_at:.2f} s by {slip.detected_by}"
            if slip.detected_at is not None
            else "not noticed"
        )
        yield f"lost at {slip.released_at:.2f} s, {seen}"


def event_words(event: str, values: Mapping[str, Any]) -> str:
    """An event's name, and its values as name=value."""
    told = ", ".join(f"{name}={_short(value)}" for name, value in values.items())
    return f"{event}: {told}" if told else event


def _short(value: object) -> str:
    return f"{value:.6g}" if isinstance(value, float) else str(value)


def marks() -> tuple[str, str]:
    """Signs for met and not met, in characters that stdout can show."""
    return ("✓", "✗") if (sys.stdout.encoding or "").lower().startswith("utf") else ("ok", "NOT MET")


def _plain(value: object) -> str:
    return f"{value:.3g}" if isinstance(value, float) else str(value)
