"""What a campaign is to run: every case of some scenarios with every seed."""

from collections.abc import Sequence
from pathlib import Path

from pydantic import Field, field_validator

from regrasp.app.files.findings import Finding, Findings, shown
from regrasp.app.files.resources import read_text
from regrasp.app.files.validation import validated
from regrasp.app.files.yaml_lines import Document, parse
from regrasp.app.run.batch import Run
from regrasp.app.scenario.load import Scenario, cases
from regrasp.interfaces.fields import Model
from regrasp.interfaces.quote import quoted
from regrasp.interfaces.seed import MAX_SEED, seed_range

MAX_RUNS = 100_000  # of one campaign; choice: months on one computer


class Entry(Model):
    """A scenario of a campaign file, with what is changed in it, and the seeds of its runs."""

    scenario: str = Field(examples=["no_obstacle"])  # a shipped one's name, or a path relative to the campaign file
    set: tuple[str, ...] = ()  # key=value, as of `regrasp run --set`
    seeds: str | tuple[int, ...] | None = None  # A:B without B, or a list; None: the file's, or the scenario's own

    @field_validator("seeds")
    @classmethod
    def _are_seeds(cls, value: str | tuple[int, ...] | None) -> str | tuple[int, ...] | None:
        _seeds_of(value)
        return value


class CampaignFile(Model):
    """A campaign file."""

    scenarios: tuple[Entry, ...] = Field(min_length=1)
    seeds: str | tuple[int, ...] | None = None  # of the entries that name none
    description: str = ""

    @field_validator("seeds")
    @classmethod
    def _are_seeds(cls, value: str | tuple[int, ...] | None) -> str | tuple[int, ...] | None:
        _seeds_of(value)
        return value


def _seeds_of(value: str | tuple[int, ...] | None) -> list[int] | None:
    """The seeds, each once. Raises ValueError for what are none."""
    if value is None:
        return None
    if isinstance(value, str):
        return [*seed_range(value)]
    wrong = [seed for seed in value if not 0 <= seed <= MAX_SEED]
    if wrong or not value:
        raise ValueError(f"{wrong[0] if wrong else 'an empty list'} is no seed; write numbers from 0 to {MAX_SEED}")
    return [*dict.fromkeys(value)]


def planned(name_or_path: str, overrides: Sequence[str] = (), seeds: Sequence[int] | None = None) -> list[Run]:
    """The runs of a scenario, or of a campaign file: every case with every seed, seed by seed.

    `overrides` and `seeds` are those of the command line; they go before a file's. Without any seeds each case has its
    own. Raises `Findings` with all that is wrong.
    """
    document = _campaign_document(name_or_path)
    if document is None:
        runs = _runs(cases(name_or_path, overrides), seeds, "--seeds", 0)
    else:
        runs = _of_file(Path(name_or_path), document, overrides, seeds)
    if len(runs) > MAX_RUNS:
        raise Findings([Finding("campaign", 0, f"{len(runs)} runs; ask for at most {MAX_RUNS} in one campaign")])
    return runs


def _campaign_document(name_or_path: str) -> Document | None:
    """The campaign file's document; None for a scenario."""
    path = Path(name_or_path)
    if path.suffix != ".yaml" or not path.is_file():
        return None
    document = parse(read_text(path), shown(path))
    return document if isinstance(document.value, dict) and "scenarios" in document.value else None


def _of_file(path: Path, document: Document, overrides: Sequence[str], seeds: Sequence[int] | None) -> list[Run]:
    file = validated(document, CampaignFile)
    runs: list[Run] = []
    wrong: list[Finding] = []
    for number, entry in enumerate(file.scenarios):
        source, line = document.place(("scenarios", number, "scenario"))
        beside = path.parent / entry.scenario
        name = str(beside) if entry.scenario.endswith(".yaml") else entry.scenario
        if _campaign_document(name) is not None:
            wrong.append(Finding(source, line, f"{quoted(entry.scenario)} is a campaign file; name a scenario"))
            continue
        own = seeds if seeds is not None else _seeds_of(entry.seeds if entry.seeds is not None else file.seeds)
        try:
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


def _at(finding: Finding, source: str, line: int, scenario: str) -> Finding:
    """A finding without a line of its own stands at the entry that names the scenario."""
    if finding.line or finding.source == source:
        return finding
    return Finding(source, line, f"{scenario}: {finding}")


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
