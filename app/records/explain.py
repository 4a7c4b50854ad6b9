"""A page of text about a run: what was run and tried, why it ended so, and what the robot knew."""

from collections.abc import Iterator

from regrasp.app.records.history import attempts, node_history
from regrasp.app.records.reader import RunRecord
from regrasp.app.records.result import DEFAULT_CASE, Link, Result
from regrasp.app.records.summary import expectation_lines, headline, measured_lines, what_ran
from regrasp.app.records.timeline import event_text, timeline, wrapped
from regrasp.app.task.find import words_of
from regrasp.interfaces.quote import printable

REPORT_WIDTH = 100  # columns of a page in a test report


def explanation(record: RunRecord, width: int, last_events: int = 8) -> str:
    """The page, in lines of about `width` columns, without control characters.

    For a run without a result it shows the last `last_events` events.
    """
    page = _unfinished(record, width, last_events) if record.result is None else _finished(record, record.result, width)
    return "\n".join(printable(line).rstrip() for line in page) + "\n"


def _finished(record: RunRecord, result: Result, width: int) -> Iterator[str]:
    yield f"{headline(result)}, {result.sim_seconds:.1f} simulated seconds"
    yield from _what_was_run(record, result.versions)
    yield from _section("Why it ended so", _why(result, width))
    yield from _tried(record, width)
    yield from _section(words_of(result.task).measured_title, [*measured_lines(result)])
    if result.belief:
        yield from _section("What the robot knew at the end", [*_belief(result)])
    yield from _section("What an arm touched", [*_touches(record)])
    yield from _section("What was expected", expectation_lines(result))
    yield from _section("Traceback", (result.traceback or "").splitlines())


def _touches(record: RunRecord) -> Iterator[str]:
    """When, in which leaf and how hard an arm touched what it must not; a pair again each time its force doubled."""
    for event in record.events:
        if event.event == "unintended touch":
            yield f"{event.t:8.2f}  {event.node or '-'}  {event.values['what']}, {event.values['force']} N"


def _unfinished(record: RunRecord, width: int, last_events: int) -> Iterator[str]:
    """The page of a run without a result."""
    begin = record.begin
    ran = what_ran(
        str(begin.get("scenario", "a run")), str(begin.get("case", DEFAULT_CASE)), begin.get("seed", "unknown")
    )
    end = next((e.values.get("outcome") for e in record.events if e.event == "end"), None)
    yield f"{ran}: killed, or still going on" if end is None else f"{ran}: {end}, but its result.json is gone"
    yield from _what_was_run(record, {})
    yield from _tried(record, width)
    statuses = {tick.path: tick.status for tick in record.ticks}
    running = sorted((p for p, status in statuses.items() if status == "RUNNING"), key=lambda path: path.split("/"))
    # Paths below another path come right after it.
    leaves = [
        path for path, after in zip(running, [*running[1:], ""], strict=False) if not after.startswith(path + "/")
    ]
    if record.at_work:
        at, leaf = record.at_work
        leaves = [f"{leaf}: its tick at {at:.2f} s has not ended", *(other for other in leaves if other != leaf)]
    yield from _section(f"What was running at {record.end:.2f} s, when the record ends", leaves)
    events = [event for event in record.events if event.event != "begin"]
    last = (f"{e.t:8.2f}  {e.node or '-'}  {event_text(e)}" for e in events[-last_events:])
    yield from _section("The last events", (line for text in last for line in wrapped(text, width - 2)))


def _tried(record: RunRecord, width: int) -> Iterator[str]:
    told = timeline(attempts(record), record.events, node_history(record), width - 2)
    yield from _section("What was tried (simulated seconds, from and to)", told)


def _what_was_run(record: RunRecord, versions: dict[str, str]) -> Iterator[str]:
    begin = record.begin
    told = [f"{name} {begin[name]}" for name in ("gravity", "cell", "tree", "renderer") if name in begin]
    told += [f"regrasp {versions['regrasp']}"] if "regrasp" in versions else []
    if told:
        yield "  " + ", ".join(told)
    overrides = begin.get("overrides")
    if isinstance(overrides, list) and overrides:
        yield "  changed: " + " ".join(map(str, overrides))
    yield from (f"  note: {remark}" for remark in record.remarks)


def _section(title: str, lines: Iterator[str] | list[str]) -> Iterator[str]:
    """A heading and its indented lines; nothing if there are none."""
    found = [*lines]
    if found:
        yield from ("", title)
        yield from (f"  {line}" for line in found)


def _why(result: Result, width: int) -> Iterator[str]:
    if result.cause:
        yield from wrapped(f"{result.cause.code}: {result.cause.message}", width - 2)
        if result.cause.node:
            yield f"in {result.cause.node}"
    chain = result.chain or ()
    names = [*_relative(chain)]
    column = min(36, max(map(len, names), default=0))
    for name, link in zip(names, chain, strict=True):
        first, *more = wrapped(f"{link.at:8.2f} s  {link.type}: {link.why}", width - 2, " " * (column + 2), " " * 12)
        if len(name) > column:
            yield name
            name = ""
        yield from (name + first[len(name) :], *more)


def _relative(chain: tuple[Link, ...]) -> Iterator[str]:
    """Each link's path, relative to the link above it, and indented."""
    above = ""
    for depth, link in enumerate(chain):
        yield "  " * min(depth, 12) + link.path.removeprefix(above)
        above = link.path + "/"


def _belief(result: Result) -> Iterator[str]:
    """What the robot knew, in the task's words."""
    try:
        yield from words_of(result.task).belief_lines(result.belief or {})
    except Exception:  # another package's code, and a file that anybody may have changed
        yield f"not in the form that the task {result.task} writes"
