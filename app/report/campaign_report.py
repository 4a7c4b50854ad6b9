"""The page of a campaign: how often, why not, how long, and what decides it."""

import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from urllib.parse import quote

from regrasp.app.campaigns.episodes import row_in
from regrasp.app.campaigns.figures import Comparison, by_case, compare, failure_groups
from regrasp.app.campaigns.opened import opened
from regrasp.app.campaigns.store import Store, StoredRow, Version
from regrasp.app.files.findings import Finding, Findings
from regrasp.app.records.explain import explanation
from regrasp.app.records.reader import read_sound_part
from regrasp.app.records.result import Link
from regrasp.app.report.campaign_charts import case_chart, distribution_chart, knob_chart
from regrasp.app.report.doubts import doubts
from regrasp.app.report.figures_of_runs import figures, strange
from regrasp.app.report.knobs import knobs
from regrasp.app.report.page import FILE, page
from regrasp.app.report.run_report import Verdict
from regrasp.app.run.batch import Row
from regrasp.app.task.find import words_of

WIDTH = 110  # characters of an explanation


@dataclass(frozen=True)
class CampaignLimits:
    """How much of a large campaign a page takes."""

    rows: int = 2000  # in the table of runs
    told: int = 40  # records of failed runs that are told in full
    of_group: int = 5  # of these, of runs that failed alike
    slowest: int = 8


@dataclass(frozen=True)
class Told:
    """A failed run in full: its chain, its explanation, and where its own report is ('' if there is none)."""

    number: int
    chain: tuple[Link, ...]
    text: str
    report: str


def campaign_page(
    name: str, against: str | None = None, page_folder: Path | None = None, limits: CampaignLimits = CampaignLimits()
) -> bytes:
    """The page of the campaign that a user names, beside the other one if there is one.

    Links to the runs' reports are relative to `page_folder`, by default the campaign's. Raises `Findings`.
    """
    with opened(name) as (store, version):
        compared = _compared(store, version, name, against)
        return _page(store, version, page_folder or store.folder or Path(), compared, limits)


def _compared(store: Store, version: Version, name: str, against: str | None) -> Comparison | None:
    if against is None:
        return None
    with opened(against) as (other, of_other):
        found = compare(other.rows(of_other.id), store.rows(version.id))
    if not found.scenes:
        message = f"has no scene of {name}; compare campaigns of the same scenarios and seeds"
        raise Findings([Finding(against, 0, message)])
    return found


def _page(
    store: Store, version: Version, page_folder: Path, compared: Comparison | None, limits: CampaignLimits
) -> bytes:
    stored = [*store.rows(version.id)]
    rows = [row_in(one) for one in stored]
    *cases, together = by_case(stored)
    found, varied, groups = figures(rows, _unit_in(rows)), knobs(rows, stored), failure_groups(stored)
    told = _told(store, [one for group in groups for one in group.rows[: limits.of_group]][: limits.told], page_folder)
    slow = sorted(range(len(rows)), key=lambda place: (-rows[place].sim_seconds, place))[: limits.slowest]
    shown = _shown(stored, rows, limits.rows)
    return page(
        "campaign.html",
        "campaign.js",
        title=f"{store.folder.name if store.folder else 'campaign'}: {_scenarios(rows)}",
        verdict=_verdict(together.succeeded, together.runs),
        together=together,
        cases=cases,
        case_chart=case_chart(cases),
        groups=groups,
        row_in=row_in,
        told=told,
        links=_links(store, stored, page_folder),
        distributions=distribution_chart(found, rows) if found else "",
        knobs=varied,
        knob_chart=knob_chart(varied) if varied else "",
        slow=[(stored[place], rows[place]) for place in slow],
        strange=[(stored[one.place], one) for one in strange(found)],
        compared=compared,
        doubts=[*doubts(together, cases, varied)],
        runs=shown,
        left_out=len(rows) - len(shown),
        records=sum(bool(one.record) for one in stored),
        version=version,
        others=[other for other in store.versions() if other.id != version.id and other.runs],
    )


def _scenarios(rows: Sequence[Row]) -> str:
    names = list(dict.fromkeys(row.scenario for row in rows))
    return ", ".join(names[:4]) + (f" and {len(names) - 4} more" if len(names) > 4 else "")


def _verdict(succeeded: int, runs: int) -> Verdict:
    tone = "good" if succeeded == runs else "bad"
    return Verdict(tone, f"{succeeded} of {runs} as expected", "")


def _shown(stored: Sequence[StoredRow], rows: Sequence[Row], most: int) -> list[tuple[StoredRow, Row]]:
    """The runs of the table; of too many, those that failed and then the first ones."""
    pairs = [*zip(stored, rows, strict=True)]
    if len(pairs) <= most:
        return pairs
    return sorted(sorted(pairs, key=lambda pair: pair[1].succeeded)[:most], key=lambda pair: pair[0].number)


def _unit_in(rows: Sequence[Row]) -> Callable[[str], str]:
    """The unit of what the runs' tasks measure, by its name."""
    words = [words_of(task) for task in sorted({row.task for row in rows if row.task})]
    return lambda name: next(filter(None, (one.unit(name) for one in words)), "")


def _told(store: Store, chosen: Sequence[StoredRow], page_folder: Path) -> dict[int, Told]:
    """The runs in full that have a record, by their row's number."""
    return {one.number: _in_full(store, one, page_folder) for one in chosen if one.record and store.folder}


def _links(store: Store, stored: Sequence[StoredRow], page_folder: Path) -> dict[int, str]:
    """The reports that lie in records, by their row's number."""
    folder = store.folder or Path()
    found = {one.number: _link(folder / one.record, page_folder) for one in stored if one.record}
    return {number: link for number, link in found.items() if link}


def _in_full(store: Store, stored: StoredRow, page_folder: Path) -> Told:
    assert store.folder is not None
    folder = store.folder / stored.record
    link = _link(folder, page_folder)
    try:
        record, wrong = read_sound_part(folder)
    except Findings as error:
        return Told(stored.number, (), str(error), link)
    damage = "".join(f"damaged: {one.message}\n" for one in wrong)
    chain = (record.result.chain if record.result else None) or ()
    return Told(stored.number, chain, damage + explanation(record, WIDTH), link)


def _link(record: Path, page_folder: Path) -> str:
    """Where a record's own report is, seen from the page; '' if there is none."""
    report = record / FILE
    return quote(Path(os.path.relpath(report, page_folder)).as_posix()) if report.is_file() else ""


def kept_records(name: str) -> list[Path]:
    """The folders of the failed runs' records that a campaign has kept. Raises `Findings`."""
    with opened(name) as (store, version):
        rows: list[Any] = [*store.rows(version.id)]
        folder = store.folder or Path()
        return [folder / one.record for one in rows if one.record and not row_in(one).succeeded]
