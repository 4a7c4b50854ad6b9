"""A pytest plugin, installed with Regrasp: scenario suites, trials of tree files, and scripted leaves.

Write a scenario suite: put scenario files named `*.scenario.yaml` beside your tests and call pytest. Each case is a
test, `cells.scenario.yaml::gravity=zero`, that passes when all that the scenario expects comes out; otherwise its
message is the run's explanation, with the path of a page that shows it (`report.html` in the record). The file's
`markers` are the test's markers, so `-m "not slow"` leaves out what a file marks `slow`. Each case runs in a process of
its own, hence `-n 2` is fine.

    pytest --scenario-seed 0:5 --scenario-records runs     # every case with five seeds; the records are kept
    pytest --scenario-wall-limit 600                       # a case that takes longer than ten minutes fails

Try a tree out: put tree files into a folder `trees` beside pytest's configuration, or name them `*.tree.xml`, and call
pytest; or name the files or their folder: `pytest my/tree.xml`, `pytest my`. Each gives two tests on scripted leaves:
that the tree ends, and that a stop at any tick leaves nothing at work.

Test a tree's logic: the fixture `scripted_tree` (see `regrasp.trees.scripted`) takes a tree file, or a shipped tree's
name.

    def test_a_slip_is_recovered(scripted_tree):
        tree = scripted_tree("recovery", {"DetectSlip": "3 failure, running", "Carry": "5 success"})
        assert tree.run() is Status.SUCCESS
        assert tree.entered("carry") == 2
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator
from contextlib import closing, suppress
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any
from xml.etree import ElementTree

import pytest

# All of Regrasp is imported late: a pytest run without scenarios and trees must not wait for it.
if TYPE_CHECKING:
    from regrasp.app.records.result import Result
    from regrasp.app.scenario.load import Scenario
    from regrasp.trees.scripted import ScriptedTree

SCENARIO, TREE = ".scenario.yaml", ".tree.xml"


def pytest_addoption(parser: pytest.Parser) -> None:
    """The options of scenario suites."""
    group = parser.getgroup("regrasp", "scenario suites (*.scenario.yaml, a test a case) and trees (*.tree.xml)")
    group.addoption(
        "--scenario-seed", metavar="N|A:B", help="Run every case with this seed, or with each from A to B, B left out."
    )
    group.addoption(
        "--scenario-records", metavar="DIR", type=Path, help="Keep the runs' records there, not in pytest's folder."
    )
    group.addoption(
        "--scenario-wall-limit", metavar="SECONDS", type=float, help="Stop a case that takes longer, and fail it."
    )


def pytest_configure(config: pytest.Config) -> None:
    """Refuse wrong options before anything is collected."""
    seed, records = config.getoption("--scenario-seed"), config.getoption("--scenario-records")
    if seed is not None and not re.fullmatch(r"\d+(:\d+)?", seed):
        from regrasp.interfaces.quote import quoted

        raise pytest.UsageError(
            f"--scenario-seed {quoted(seed)} is no seed; write a whole number, or a range such as 0:5"
        )
    limit = config.getoption("--scenario-wall-limit")
    if limit is not None and not 1 <= limit < math.inf:
        raise pytest.UsageError(
            f"--scenario-wall-limit {limit:g} is no limit; write seconds of at least 1, such as 600"
        )
    if records is not None:
        from regrasp.app.records.folders import run_folder_findings

        for finding in run_folder_findings(records):
            raise pytest.UsageError(f"--scenario-records: {finding}")


def pytest_collect_file(file_path: Path, parent: pytest.Collector) -> pytest.Collector | None:
    """Collect scenario files by their names; tree files by name, by folder, or because they were named."""
    if file_path.name.endswith(SCENARIO):
        return ScenarioSuite.from_parent(parent, path=file_path)
    if file_path.suffix == ".xml" and _is_tree(file_path, parent.session):
        return TreeFile.from_parent(parent, path=file_path)
    return None


def _is_tree(path: Path, session: pytest.Session) -> bool:
    """Whether to collect an XML file: it ends in `TREE`, was named, or is a tree in `trees` or in a named folder."""
    if path.name.endswith(TREE) or session.isinitpath(path):
        return True
    likely = session.config.rootpath / "trees" in path.parents or session.isinitpath(path.parent)
    return likely and _begins_as_tree(path)


def _begins_as_tree(path: Path) -> bool:
    """Whether the outermost element is that of a py_trees file, and not the similar one of BehaviorTree.CPP."""
    with suppress(OSError, ElementTree.ParseError, LookupError), path.open("rb") as stream:
        for _, element in ElementTree.iterparse(stream, ["start"]):
            given = element.attrib
            return element.tag == "root" and "main_tree_to_execute" in given and "BTCPP_format" not in given
    return False


class ScenarioSuite(pytest.File):
    """A scenario file; each case is a test."""

    def collect(self) -> Iterator[pytest.Item]:
        """The cases. Raises `CollectError` with a line for each finding in the file."""
        from regrasp.app.files.findings import Findings
        from regrasp.app.scenario.load import cases

        try:
            found = cases(str(self.path), _overrides(self.config.getoption("--scenario-seed")))
        except Findings as error:
            raise self.CollectError(str(error)) from None
        for scenario in found:
            for marker in scenario.file.markers:
                self.config.addinivalue_line("markers", f"{marker}: named in a scenario file")
            yield ScenarioCase.from_parent(self, name=scenario.case, scenario=scenario)


def _overrides(seed: str | None) -> list[str]:
    if seed is None:
        return []
    return [f"vary.seed='{seed}'" if ":" in seed else f"seed={seed}"]


class ItemFailed(Exception):  # noqa: N818 - the message is all of the report
    """A scenario or a tree failed. The message says why; a traceback would add nothing."""


class _Item(pytest.Item):
    def repr_failure(self, excinfo: pytest.ExceptionInfo[BaseException], style: Any = None) -> Any:
        """The message alone."""
        return str(excinfo.value) if isinstance(excinfo.value, ItemFailed) else super().repr_failure(excinfo, style)

    def reportinfo(self) -> tuple[Path, int | None, str]:
        """File and test, for headings."""
        return self.path, None, f"{self.path.name}: {self.name}"


class ScenarioCase(_Item):
    """One case of a scenario."""

    def __init__(self, *, scenario: Scenario, **kwargs: Any) -> None:
        super().__init__(**kwargs)
        self.scenario = scenario
        for marker in scenario.file.markers:
            self.add_marker(marker)

    def runtest(self) -> None:
        """Run it in a process of its own. Raises `ItemFailed` with the explanation of a run that is not as expected."""
        from regrasp.app.run.batch import Run, result_of
        from regrasp.app.run.processes import run_each

        folder = self._folder()
        self.user_properties += [("seed", self.scenario.file.seed), ("record", str(folder))]
        limit = self.config.getoption("--scenario-wall-limit") or math.inf
        with closing(run_each([partial(_run, self.scenario, folder)], 1, limit)) as ended:
            [done] = ended
        result = result_of(Run(self.scenario, self.scenario.file.seed, folder), done)
        if done.value is None:
            page = self._told(folder) if (folder / "events.jsonl").exists() else f"record  {folder}"
            raise ItemFailed(f"{done.error}\n{page}")
        if not result.succeeded:
            raise ItemFailed(self._told(folder))

    def _told(self, folder: Path) -> str:
        """The explanation of a run that failed, and the page that shows it, which is written here."""
        if (report := _reported(folder)) is None:
            return _explained(folder)
        self.user_properties.append(("report", str(report)))
        return f"{_explained(folder)}\nreport  {report}"

    def _folder(self) -> Path:
        """A new folder for the record."""
        from regrasp.app.records.folders import new_folder

        kept: Path | None = self.config.getoption("--scenario-records")
        name = f"{self.path.name.removesuffix(SCENARIO)}-{self.name}"
        if kept is None:
            factory: pytest.TempPathFactory = self.config._tmp_path_factory  # type: ignore[attr-defined]
            return factory.mktemp(re.sub(r"[^\w=.,-]+", "_", name)[:120] + "-")
        return new_folder(name, kept.absolute())


def _run(scenario: Scenario, folder: Path) -> Result:
    """Run the case, in its own process: the only one that imports the physics engine."""
    from regrasp.app.run.episode import run_episode

    return run_episode(scenario, folder, seed=scenario.file.seed)


def _explained(folder: Path) -> str:
    from regrasp.app.records.explain import REPORT_WIDTH, explanation
    from regrasp.app.records.reader import read_record

    return f"{explanation(read_record(folder), REPORT_WIDTH)}\nrecord  {folder}"


def _reported(folder: Path) -> Path | None:
    """The page of a run, in its record; None if it cannot be written, which must not hide why the run failed."""
    from regrasp.app.files.findings import Findings
    from regrasp.app.report.written import write_run_report

    with suppress(Findings, OSError):
        return write_run_report(folder).page
    return None


class TreeFile(pytest.File):
    """A tree file, tried out with scripted leaves."""

    def collect(self) -> Iterator[pytest.Item]:
        """Its two tests. Raises `CollectError` with a line for each finding in the file."""
        from regrasp.app.files.findings import Findings
        from regrasp.app.scenario.tree_file import check_tree_file
        from regrasp.trees.trials import left_by_a_stop, never_ends

        try:
            check_tree_file(self.path)
        except Findings as error:
            raise self.CollectError(str(error)) from None
        yield TreeTrial.from_parent(self, name="ends", trial=never_ends)
        yield TreeTrial.from_parent(self, name="stops at every tick", trial=left_by_a_stop)


class TreeTrial(_Item):
    """One of the trials of `regrasp.trees.trials`."""

    def __init__(self, *, trial: Callable[[Path], Iterator[str]], **kwargs: Any) -> None:
        super().__init__(**kwargs)
        self._trial = trial

    def runtest(self) -> None:
        """Raises `ItemFailed` with the first thing that went wrong."""
        if wrong := next(self._trial(self.path), None):
            raise ItemFailed(wrong)

    def teardown(self) -> None:
        """Clear the blackboard."""
        from py_trees.blackboard import Blackboard

        Blackboard.clear()


@pytest.fixture
def scripted_tree() -> Iterator[Callable[..., ScriptedTree]]:
    """Makes a tree of scripted leaves by a tree file or a shipped tree's name; arguments: `regrasp.trees.scripted`."""
    from py_trees.blackboard import Blackboard

    from regrasp.app.files.resources import resolve
    from regrasp.trees.scripted import ScriptedTree

    def make(tree: str | Path, script: dict[str, str] | None = None, **options: Any) -> ScriptedTree:
        return ScriptedTree(resolve("tree", str(tree), Path()), script, **options)

    Blackboard.clear()
    yield make
    Blackboard.clear()
