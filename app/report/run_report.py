"""The page of a run: what was asked, what came out and why, and all of its course."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from regrasp.app.files.findings import Finding, Findings, shown
from regrasp.app.records.history import attempts
from regrasp.app.records.reader import RunRecord, read_sound_part
from regrasp.app.records.result import DEFAULT_CASE, Attempt, Result
from regrasp.app.records.signals import FILE as SIGNALS
from regrasp.app.records.signals import Signals
from regrasp.app.records.summary import limit_words, measured_lines, what_ran
from regrasp.app.report import course
from regrasp.app.report.asked import asked
from regrasp.app.report.charts import curve_chart
from regrasp.app.report.curves import Panel, panels, readable
from regrasp.app.report.page import page, plain_texts
from regrasp.app.report.pictures import pictures
from regrasp.app.report.plans import plans
from regrasp.app.report.sightings import Sightings
from regrasp.app.report.time_line import time_line
from regrasp.app.report.tree_picture import TreePicture, changes, tree_picture
from regrasp.app.task.find import words_of

LATE = 1.0  # s: signals that end so long before the record are cut off


@dataclass(frozen=True)
class Verdict:
    """How a run came out: `tone` is good, bad or unknown; `head` and `rest` are a few words and a sentence."""

    tone: str
    head: str
    rest: str


def run_page(folder: Path, reload: int = 0) -> tuple[bytes, list[Finding]]:
    """The page of a run's folder, and what is wrong in the folder: that is left out, and said in the page.

    `reload`: the run still goes on, and the page loads itself anew every so many seconds.

    Raises `Findings` for a folder without a run, or with one that is newer than this program.
    """
    record, found = read_sound_part(folder)
    signals, of_signals = _signals(record)
    found += of_signals
    tried, tree, what = attempts(record), tree_picture(record), asked(record)
    kept = pictures(record, Sightings(record, signals))
    curves = panels(signals) if signals else []
    end = max([record.end, record.result.sim_seconds if record.result else 0.0, *(one.ended for one in tried)])
    told = [f"{Path(one.source).name}{f', line {one.line}' if one.line else ''}: {one.message}" for one in found]
    no_curves = [] if of_signals else _without_signals(record, signals, curves)
    missing = [*record.remarks, *told, *what.damage, *tree.damage, *tree.remarks, *kept.remarks, *no_curves]
    if record.result is not None or any(event.event == "end" for event in record.events):
        empty = () if record.events else ("is empty",)
        of_files = {"": record.remarks, "events.jsonl": empty, "scenario.yaml": what.damage, "tree.xml": tree.damage}
        found += _cut(folder, of_files | {SIGNALS: no_curves})
    values = {
        **_glance(record),
        **_course(record, tried, tree, curves, end),
        "asked": what,
        "cameras": _by_camera(kept.frames),
        "film": kept.film,
        "missing": list(dict.fromkeys(missing)),
    }
    if reload:
        values |= {"missing": [one for one in values["missing"] if "result.json" not in one]}
        values |= {"verdict": Verdict("unknown", "Running", f"The page loads itself anew every {reload} s.")}
    return page("run.html", "run.js", reload=reload, **values), found


def _cut(folder: Path, remarks: Mapping[str, Sequence[str]]) -> list[Finding]:
    """The remarks on files that are there: a run that ended wrote them whole. An old record has not all of them."""
    there = {name: told for name, told in remarks.items() if (folder / name).exists()}
    return [Finding(shown(folder / name), 0, remark) for name, told in there.items() for remark in told]


def _glance(record: RunRecord) -> dict[str, Any]:
    """What the page tells at its top and at its end."""
    result = record.result
    return {
        "title": _title(record),
        "verdict": verdict(record),
        "result": result,
        "why": _why(record),
        "expectations": _expectations(result),
        "measured": [*measured_lines(result)] if result else [],
        "measured_title": words_of(result.task).measured_title if result else "",
        "belief": _belief(result),
        "versions": result.versions if result else {},
    }


def _course(
    record: RunRecord, tried: Sequence[Attempt], tree: TreePicture, curves: list[Panel], end: float
) -> dict[str, Any]:
    """What the page tells between: all that has a time."""
    marks, failed = course.marks(record), course.failures(record, tried)
    return {
        "end": end,
        "time_line": time_line(course.phase_lane(tried, tree.phases), marks, course.lanes(tried), end),
        "tree": tree.svg,
        "chart": curve_chart(curves, end) if curves else "",
        "panels": curves,
        "failures": failed,
        "repeated": course.repeated(failed),
        "plans": [*plans(record.events)],
        "log": marks[: course.MAX_LOG],
        "left_out": max(0, len(marks) - course.MAX_LOG),
        "data": plain_texts(_data(record, end, tried, tree.paths, curves)),
    }


def _without_signals(record: RunRecord, signals: Signals | None, curves: Sequence[Panel]) -> list[str]:
    """Why there are no curves, or none to the end."""
    if signals is None:
        return ["the record has no signals, so there are no curves"]
    if not curves:
        return ["the signals end before there is anything to draw"]
    last = float(signals["t"][-1])
    return [f"the signals end at {last:.2f} s, before the record does"] if last < record.end - LATE else []


def _signals(record: RunRecord) -> tuple[Signals | None, list[Finding]]:
    file = record.folder / SIGNALS
    if file.is_file() and not file.stat().st_size:  # killed before the first tick
        return None, []
    try:
        return record.signals(), []
    except Findings as error:
        return None, error.items


def _title(record: RunRecord) -> str:
    begin, result = record.begin, record.result
    if result is not None:
        return what_ran(result.scenario, result.case, result.seed)
    name, case = str(begin.get("scenario", "a run")), str(begin.get("case", DEFAULT_CASE))
    return what_ran(name, case, begin.get("seed", "unknown"))


def verdict(record: RunRecord) -> Verdict:
    """How the run came out, in words for somebody who does not know it."""
    result = record.result
    if result is None:
        if any(event.event == "end" for event in record.events):
            return Verdict("unknown", "No result", "The run ended, but its result cannot be read.")
        return Verdict("unknown", "Not ended", "The run was killed, or still goes on.")
    met = sum(one.met for one in result.expectations)
    count = f"{met} of {len(result.expectations)} expectations met"
    outcome = _OUTCOMES.get(result.outcome, result.outcome)
    if not result.succeeded:
        return Verdict("bad", outcome, f"This was not as expected: {count}.")
    if result.outcome == "success":
        return Verdict("good", outcome, f"As expected: {count}.")
    return Verdict("expected", outcome, f"The scenario expects this end: {count}.")


_OUTCOMES = {
    "success": "Success",
    "failure": "Failure",
    "time_limit": "Out of time",
    "wall_limit": "Stopped: took too long",
    "interrupted": "Interrupted",
    "internal_error": "Internal error",
}


def _why(record: RunRecord) -> Mapping[str, Any]:
    """The cause, the chain of nodes down to it, and the traceback; of a run without a result what was at work."""
    result = record.result
    if result is None:
        at, leaf = record.at_work or (record.end, "")
        running = _running(record)
        return {"cause": None, "chain": (), "traceback": (), "at_work": leaf or running, "at": at}
    trace = (result.traceback or "").splitlines()
    unmet = [one for one in result.expectations if not one.met]
    return {
        "cause": result.cause,
        "chain": result.chain or (),
        "traceback": trace,
        "at_work": "",
        "at": result.chain[-1].at if result.chain else result.sim_seconds,
        "unmet": [(one.name, str(one.value), limit_words(one, result.task)) for one in unmet],
    }


def _running(record: RunRecord) -> str:
    """The deepest node that runs when the record ends; '' if none does."""
    statuses = {tick.path: tick.status for tick in record.ticks}
    running = [path for path, status in statuses.items() if status == "RUNNING"]
    return max(running, key=lambda path: path.count("/"), default="")


def _expectations(result: Result | None) -> list[tuple[bool, str, str, str]]:
    """Of each expectation whether it is met, its name, what came out, and what was expected."""
    if result is None:
        return []
    return [(one.met, one.name, _short(one.value), limit_words(one, result.task)) for one in result.expectations]


def _short(value: object) -> str:
    return f"{value:.3g}" if isinstance(value, float) else "unknown" if value is None else str(value)


def _belief(result: Result | None) -> list[str]:
    if result is None or not result.belief:
        return []
    try:
        return [*words_of(result.task).belief_lines(result.belief)]
    except Exception:  # another package's code, and a file that anybody may have changed
        return [f"not in the form that the task {result.task} writes"]


def _by_camera(frames: Sequence[Any]) -> dict[str, list[Any]]:
    found: dict[str, list[Any]] = {}
    for frame in frames:
        found.setdefault(frame.camera, []).append(frame)
    return found


def _data(
    record: RunRecord, end: float, tried: Sequence[Attempt], paths: Sequence[str], curves: list[Panel]
) -> dict[str, Any]:
    """What the page's script moves: moments at which something changed, nodes, attempts, curves."""
    stops = {round(event.t, 3) for event in record.events} | {round(one.started, 3) for one in tried}
    stops |= {round(one.ended, 3) for one in tried}
    failed = sorted({round(one.ended, 3) for one in tried if one.status == "FAILURE" and one.cause})
    chain = record.result.chain if record.result else None
    failed = sorted({*failed, *(round(link.at, 3) for link in chain or ())})
    return {
        "end": round(end, 3),
        "begin": round(chain[-1].at, 3) if chain else round(end, 3),
        "stops": sorted(stops),
        "failures": failed,
        "paths": [*paths],
        "changes": changes(record.ticks, paths),
        "work": [[round(one.started, 3), round(one.ended, 3), one.path] for one in tried if one.ended > one.started],
        "panels": readable(curves),
    }
