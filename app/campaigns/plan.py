"""What a campaign is to run: every case of some scenarios with every seed."""

import json
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from pydantic import Field

from regrasp.app.files.findings import Finding, Findings, shown
from regrasp.app.files.resources import read_text
from regrasp.app.files.schema_nodes import value_at
from regrasp.app.files.validation import read_as
from regrasp.app.files.yaml_lines import Document, parse
from regrasp.app.files.yaml_lines import Path as KeyPath
from regrasp.app.run.batch import Run
from regrasp.app.scenario.load import Scenario, cases
from regrasp.interfaces.fields import Model
from regrasp.interfaces.quote import closest, cut, quoted
from regrasp.interfaces.seed import MAX_SEED, seed_range

MAX_RUNS = 100_000  # of one campaign; choice: months on one computer


class Entry(Model):
    """A scenario of a campaign file, with what is changed in it, and the seeds of its runs."""

    scenario: str = Field(examples=["no_obstacle"])  # a shipped one's name, or a path relative to the campaign file
    set: tuple[str, ...] = ()  # key=value, as of `regrasp run --set`
    seeds: Any = None  # A:B without B, or a list; None: the file's, or the scenario's own


class CampaignFile(Model):
    """A campaign file. `_seed_findings` checks the seeds, for each item of a list is told with its line."""

    scenarios: tuple[Entry, ...] = Field(min_length=1)
    seeds: Any = None  # of the entries that name none
    description: str = ""


def _seeds_of(value: Any) -> list[int] | None:
    """The seeds, each once, of a value that `_seed_findings` finds right."""
    if value is None:
        return None
    return [*(seed_range(value) if isinstance(value, str) else dict.fromkeys(value))]


def _seed_findings(document: Document) -> Iterator[Finding]:
    """What is wrong with the seeds of a campaign file; what could not be read is among the document's findings."""
    entries = value_at(document.value, ("scenarios",))
    numbers = range(len(entries)) if isinstance(entries, list) else ()
    for path in (("seeds",), *(("scenarios", number, "seeds") for number in numbers)):
        value: Any = value_at(document.value, path)
        dotted = ".".join(map(str, path))
        if isinstance(value, str):
            try:
                seed_range(value)
            except ValueError as error:
                yield Finding(*document.place(path), f"{dotted}: {error}")
        elif isinstance(value, list):
            if not value:
                yield Finding(*document.place(path), f"{dotted}: an empty list is no seed; {_RIGHT_LIST}")
            for at, item in enumerate(value):
                if not _is_seed(item) and (*path, at) not in document.unread:
                    told = f"{dotted}: {_as_written(item)} is no seed; {_RIGHT_SEED}"
                    yield Finding(*document.place((*path, at)), told)
        elif value is not None:
            first = value if _is_seed(value) and value + 10 <= MAX_SEED else 0
            right = f'write a range such as "{first}:{first + 10}", or a list such as [3, 7]'
            yield Finding(*document.place(path), f"{dotted}: {_as_written(value)} is no range of seeds; {right}")


def _is_seed(value: Any) -> bool:
    return isinstance(value, int) and not isinstance(value, bool) and 0 <= value <= MAX_SEED


def _as_written(value: Any) -> str:
    """A value as YAML has it."""
    return quoted(value) if isinstance(value, str) else cut(json.dumps(value))


_RIGHT_SEED = f"write whole numbers from 0 to {MAX_SEED}"
_RIGHT_LIST = "write some, such as [3, 7], or leave seeds out"


def planned(name_or_path: str, overrides: Sequence[str] = (), seeds: Sequence[int] | None = None) -> list[Run]:
    """The runs of a scenario, or of a campaign file: every case with every seed, seed by seed.

    `overrides` and `seeds` are those of the command line; they go before a file's. Without any seeds each case has its
    own. Raises `Findings` with all that is wrong.
    """
    document = _campaign_document(name_or_path)
    if document is None:
        if seeds is not None and _sets_seed(overrides):
            raise Findings([Finding("--seeds", 0, "the seed is given by --set, too; leave one out")])
        runs = _runs(cases(name_or_path, overrides), seeds, "--seeds", 0)
    else:
        runs = _of_file(Path(name_or_path), document, overrides, seeds)
    if len(runs) > MAX_RUNS:
        raise Findings([Finding("campaign", 0, f"{len(runs)} runs; ask for at most {MAX_RUNS} in one campaign")])
    return runs


def one_seed_each(runs: Sequence[Run]) -> bool:
    """Whether no seeds were asked for: each scenario has its own only."""
    seeds: dict[Path, set[int]] = {}
    for run in runs:
        seeds.setdefault(run.scenario.path, set()).add(run.seed)
    return all(len(each) == 1 for each in seeds.values()) and all(run.seed == run.scenario.file.seed for run in runs)


def _sets_seed(overrides: Sequence[str]) -> str | None:
    """That of the texts key=value that gives the seed."""
    return next((text for text in overrides if text.partition("=")[0].strip() == "seed"), None)


def _campaign_document(name_or_path: str) -> Document | None:
    """The campaign file's document; None for a scenario. Raises `Findings` for a file that can be neither."""
    path = Path(name_or_path)
    if path.suffix != ".yaml" or not path.is_file():
        return None
    document = parse(read_text(path), shown(path))
    if isinstance(document.value, dict):
        return document if _is_meant_for_campaign(document.value) else None
    if isinstance(document.value, list):
        wrong = "a list; write scenarios: above it, and each item such as - scenario: no_obstacle"
    else:
        wrong = "empty" if document.value is None else _as_written(document.value)
        wrong += "; write scenarios: and below it a list, such as - scenario: no_obstacle"
    raise Findings(document.findings or [Finding(*document.place(()), f"the file is {wrong}")])


def _is_meant_for_campaign(value: dict[str, Any]) -> bool:
    """Whether a file with these keys has `scenarios`, perhaps misspelt."""
    return "scenarios" in value or ("cell" not in value and any(closest(key, ["scenarios"]) for key in value))


def _read(document: Document) -> CampaignFile:
    """The campaign file. Raises `Findings` with all that is wrong in it."""
    file, errors = read_as(document, CampaignFile)
    wrong = [*document.findings, *(error.finding for error in errors), *_seed_findings(document)]
    if file is None or wrong:
        raise Findings(wrong)
    return file


def _of_file(path: Path, document: Document, overrides: Sequence[str], seeds: Sequence[int] | None) -> list[Run]:
    file = _read(document)
    runs: list[Run] = []
    wrong: list[Finding] = []
    for number, entry in enumerate(file.scenarios):
        source, line = document.place(("scenarios", number, "scenario"))
        beside = path.parent / entry.scenario
        name = str(beside) if entry.scenario.endswith(".yaml") else entry.scenario
        own = seeds if seeds is not None else _seeds_of(entry.seeds if entry.seeds is not None else file.seeds)
        try:
            if _campaign_document(name) is not None:
                wrong.append(Finding(source, line, f"{quoted(entry.scenario)} is a campaign file; name a scenario"))
                continue
            if twice := _seed_given_twice(document, number, entry, overrides, own, asked=seeds is not None):
                wrong.append(twice)
                continue
            runs += _runs(cases(name, [*entry.set, *overrides]), own, source, line)
        except Findings as error:
            wrong += (_at(item, source, line, entry.scenario) for item in error.items)
    if wrong:
        raise Findings(wrong)
    doubled = _doubled(runs)
    if doubled is not None:
        message = f"{doubled} is asked for twice with other values; give one of the scenarios another name, or vary it"
        raise Findings([Finding(shown(path), 0, message)])
    return [*{_identity(run): run for run in runs}.values()]


def _seed_given_twice(
    document: Document, number: int, entry: Entry, overrides: Sequence[str], own: Sequence[int] | None, *, asked: bool
) -> Finding | None:
    """The finding that a seed that is set does nothing beside seeds; those `asked` for by --seeds replace a file's."""
    if own is None:
        return None
    if typed := _sets_seed(overrides):
        right = "leave one out" if asked else "write --seeds A:B for other ones"
        by = "--seeds" if asked else f"the seeds of {document.place(())[0]}"
        return Finding("--set", 0, f"{quoted(typed)} does nothing beside {by}; {right}")
    if asked or (text := _sets_seed(entry.set)) is None:
        return None
    path: KeyPath = ("scenarios", number, "set", entry.set.index(text))
    right = "leave one out" if entry.seeds is not None else f"write seeds: [{cut(text.partition('=')[2])}] in its place"
    return Finding(*document.place(path), f"{quoted(text)} does nothing beside seeds; {right}")


def _at(finding: Finding, source: str, line: int, scenario: str) -> Finding:
    """A finding without a line of its own stands at the entry that names the scenario."""
    if finding.line or finding.source == source:
        return finding
    if quoted(finding.source) in finding.message:  # a name that is none, a file that is not there
        return Finding(source, line, finding.message)
    named = finding.source.endswith(Path(scenario).name)
    return Finding(source, line, str(finding) if named else f"{scenario}: {finding}")


def _runs(chosen: Sequence[Scenario], seeds: Sequence[int] | None, source: str, line: int) -> list[Run]:
    if seeds is None:
        return [Run(case, case.file.seed) for case in chosen]
    varied = [case for case in chosen if "seed=" in case.case]
    if varied:
        message = f"the scenario {varied[0].name} varies its seed itself; leave seeds out"
        raise Findings([Finding(source, line, message)])
    return [Run(case, seed) for seed in seeds for case in chosen]


def _identity(run: Run) -> tuple[str, str, int]:
    return run.scenario.name, run.scenario.case, run.seed


def _doubled(runs: Sequence[Run]) -> Run | None:
    """A run whose name is that of an earlier one with other values."""
    seen: dict[tuple[str, str, int], Scenario] = {}
    for run in runs:
        first = seen.setdefault(_identity(run), run.scenario)
        if (first.file, first.cell, first.tree) != (run.scenario.file, run.scenario.cell, run.scenario.tree):
            return run
    return None
