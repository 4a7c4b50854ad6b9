"""Many runs, each in a process of its own, and a row of figures for each."""

import contextlib
import math
import sys
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, field
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from regrasp.app.records.record import finish_killed
from regrasp.app.records.result import Outcome, Result
from regrasp.app.records.summary import limit_words
from regrasp.app.run.processes import Done, run_each
from regrasp.app.scenario.load import Scenario
from regrasp.interfaces.cause import Cause, CauseCode

if TYPE_CHECKING:
    from regrasp.sim.render.renderer import RendererName

RunEpisode = Callable[..., Result]


@dataclass(frozen=True)
class Settings:
    """How runs are done: what is rendered and shown, and how many seconds of wall time each may take."""

    video: bool = False
    pictures: bool = False
    renderer: "RendererName" = "software"
    quiet: bool = False
    wall_limit: float = math.inf
    report: bool = False  # whether `regrasp run` writes a page into each record


@dataclass(frozen=True)
class Run:
    """One run to do: a case of a scenario, its seed, and the folder of its record."""

    scenario: Scenario
    seed: int
    folder: Path | None = None

    def __str__(self) -> str:
        seed = "" if "seed=" in self.scenario.case else f" seed {self.seed}"
        return f"{self.scenario.title}{seed}"


@dataclass(frozen=True)
class Row:
    """The figures of a run. Seconds are simulated unless a field says otherwise, forces in newtons; None: unknown."""

    scenario: str
    case: str
    gravity: str
    seed: int
    outcome: str
    succeeded: bool
    cause: dict[str, Any] | None
    peak_memory_mb: float
    renderer: str = "software"
    measured: dict[str, Any] = field(default_factory=dict)  # by the task's judge
    unintended_force: float | None = None
    unmet: list[str] = field(default_factory=list)
    why: str = ""  # the cause and the unmet expectations in words; '' if the run came out as expected
    sim_seconds: float = 0.0
    wall_seconds: float = 0.0  # real ones
    real_time_factor: float = 0.0
    wall_by_part: dict[str, float] = field(default_factory=dict)  # real seconds
    longest_tick: float = 0.0  # real seconds
    task: str = ""


def run_all(
    runs: Sequence[Run],
    jobs: int,
    keep: Callable[[list[Row]], None] = lambda rows: None,
    settings: Settings = Settings(),
    episode: RunEpisode | None = None,
) -> tuple[dict[int, Row], bool]:
    """Do the runs, `jobs` at a time. Returns the rows by the runs' numbers, and whether Ctrl-C came.

    After each run a line goes to stderr (not if `settings.quiet`), and `keep` gets the rows so far. If a run's process
    dies, its outcome is an internal error; a run that takes longer than the wall limit is stopped. `episode` replaces
    `run_episode` in tests.
    """
    tasks = [run_task(run, settings, episode) for run in runs]
    rows: dict[int, Row] = {}
    try:
        with contextlib.closing(run_each(tasks, jobs, settings.wall_limit)) as ended:
            for done in ended:
                row = rows[done.number] = row_of(runs[done.number], done)
                keep([rows[i] for i in sorted(rows)])
                if not settings.quiet:
                    told = f"[{len(rows)}/{len(runs)}] {runs[done.number]}: {summary(row)}"
                    print(told, file=sys.stderr, flush=True)
    except KeyboardInterrupt:
        print(f"interrupted; {len(rows)} of {len(runs)} runs were done", file=sys.stderr)
        return dict(sorted(rows.items())), True
    return dict(sorted(rows.items())), False


def run_task(run: Run, settings: Settings, episode: RunEpisode | None = None) -> Callable[[], Result]:
    """What does the run when it is called, picklable. `episode` replaces `run_episode` in tests."""
    return partial(
        episode or _run_episode,
        run.scenario,
        run.folder,
        seed=run.seed,
        video=settings.video,
        renderer=settings.renderer,
        **({"pictures": True} if settings.pictures else {}),
    )


def _run_episode(*args: Any, **kwargs: Any) -> Result:
    """`run_episode`, imported in the run's own process only: it brings the physics engine."""
    from regrasp.app.run.episode import run_episode

    return run_episode(*args, **kwargs)


def summary(row: Row) -> str:
    """How a run came out, in a line of the progress."""
    how = row.outcome if row.succeeded else f"{row.outcome}, not as expected ({reason(row)})"
    if not row.wall_seconds:  # its process died
        return how
    return f"{how}, {row.sim_seconds:.1f} s simulated, {row.real_time_factor:.2f} x real time"


def reason(row: Row) -> str:
    """Why a run was not as expected, in a word or two: its cause, or what expectations were not met."""
    if row.cause is not None:
        return str(row.cause["code"])
    return f"not met: {', '.join(row.unmet)}" if row.unmet else row.outcome


def result_of(run: Run, done: Done[Result]) -> Result:
    """The result of a run. If its process died or was killed, its record is finished here, with the leaf at work."""
    if done.value is not None:
        return done.value
    code = CauseCode.WALL_LIMIT if done.timed_out else CauseCode.INTERNAL_ERROR
    outcome: Outcome = "wall_limit" if done.timed_out else "internal_error"
    cause = Cause(code, done.error)
    scenario = run.scenario
    result = Result(
        scenario.name, run.seed, outcome, succeeded=False, task=scenario.file.TASK, case=scenario.case, cause=cause
    )
    return finish_killed(run.folder, result) if run.folder else result


def row_of(run: Run, done: Done[Result]) -> Row:
    """The row of a run that has ended."""
    what = (run.scenario.name, run.scenario.case, run.scenario.file.gravity, run.seed)
    result = result_of(run, done)
    values = {e.name: e.value for e in result.expectations}
    return Row(
        *what,
        outcome=result.outcome,
        succeeded=result.succeeded,
        cause=asdict(result.cause) if result.cause else None,
        measured=result.measured,
        unintended_force=values.get("unintended_force"),
        unmet=[e.name for e in result.expectations if not e.met],
        why="" if result.succeeded else failure_words(result),
        sim_seconds=result.sim_seconds,
        wall_seconds=result.wall_seconds,
        real_time_factor=result.real_time_factor,
        wall_by_part=result.wall_by_part,
        longest_tick=result.longest_tick,
        peak_memory_mb=round(done.peak_memory_mb, 1),
        renderer=result.renderer or "software",
        task=result.task,
    )


def failure_words(result: Result) -> str:
    """Why a run did not come out as expected, in words: its cause and each unmet expectation."""
    cause = [f"{result.cause.code}: {result.cause.message}"] if result.cause else []
    unmet = (e for e in result.expectations if not e.met)
    return "; ".join([*cause, *(f"{e.name} is {e.value}, expected {limit_words(e, result.task)}" for e in unmet)])
