"""Writes the runs of a scenario's cases as JUnit XML, for build servers."""

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple
from xml.etree import ElementTree as ET

from regrasp.app.files.findings import Findings
from regrasp.app.files.whole_file import write_whole
from regrasp.app.run.batch import Row
from regrasp.interfaces.quote import printable

ERRORS = ("internal_error", "wall_limit")  # outcomes that say nothing about the robot


class JunitCase(NamedTuple):
    """A run as JUnit has it. One without a row was interrupted; one without a folder left no record."""

    scenario: str
    name: str
    row: Row | None
    folder: Path | None


def write_junit(path: Path, name: str, cases: Sequence[JunitCase]) -> None:
    """Write one testcase per run: its wall time, why it failed (in a sentence and in full), its record's folder.

    A run that was interrupted counts as skipped.

    Raises:
        OSError: the file cannot be written.
    """
    rows = [case.row for case in cases if case.row is not None]
    errors = sum(row.outcome in ERRORS for row in rows)
    counts = {
        "tests": len(cases),
        "failures": sum(not row.succeeded for row in rows) - errors,
        "errors": errors,
        "skipped": len(cases) - len(rows),
        "time": f"{sum(row.wall_seconds for row in rows):.3f}",
    }
    told = {key: str(value) for key, value in counts.items()}
    above = {
        key: text for key, text in told.items() if key != "skipped"
    }  # the common JUnit schema has no `skipped` there
    suites = ET.Element("testsuites", {"name": "regrasp", **above})
    suite = ET.SubElement(suites, "testsuite", {"name": printable(name), **told})
    for case in cases:
        _testcase(suite, case)
    ET.indent(suites)
    text = ET.tostring(suites, encoding="unicode")
    write_whole(path, f'<?xml version="1.0" encoding="UTF-8"?>\n{text}\n')


def _testcase(suite: ET.Element, run: JunitCase) -> None:
    row = run.row
    about = {"classname": printable(run.scenario), "name": printable(run.name)}
    case = ET.SubElement(suite, "testcase", {**about, "time": f"{row.wall_seconds if row else 0.0:.3f}"})
    if row is None:
        ET.SubElement(case, "skipped", {"message": "interrupted before its end"})
    elif not row.succeeded:
        tag = "error" if row.outcome in ERRORS else "failure"
        code = row.cause["code"] if row.cause else row.outcome
        why = printable(row.why)
        ET.SubElement(case, tag, {"type": str(code), "message": why}).text = _in_full(run.folder) or why
    if run.folder is not None:
        ET.SubElement(case, "system-out").text = printable(str(run.folder))


def _in_full(folder: Path | None) -> str:
    """The page that `regrasp explain` shows of a record; '' if there is no record."""
    from regrasp.app.records.explain import REPORT_WIDTH, explanation  # late: the command line starts with this module
    from regrasp.app.records.reader import read_record

    try:
        return explanation(read_record(folder), REPORT_WIDTH) if folder else ""
    except Findings:
        return ""
