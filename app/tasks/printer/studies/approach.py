"""`regrasp study approach`: how near the hand comes to the printed part, by approach (the source's Table 4-5).

The hand is put where it starts, the approach runs by the services that the leaves use, and then the hand takes the
part. The error is that of the true tool point from the true goal, at the approach's end.
"""

import csv
import io
import statistics
from collections.abc import Iterable, Sequence
from functools import partial
from pathlib import Path
from time import perf_counter
from typing import Any, get_args

import cv2
import numpy as np
import typer
from pydantic import TypeAdapter
from scipy.spatial.transform import RigidTransform

from regrasp.app.campaigns.digest import digest_of
from regrasp.app.campaigns.statistics import wilson_interval
from regrasp.app.campaigns.table import print_table
from regrasp.app.files.resources import shipped
from regrasp.app.files.whole_file import write_whole
from regrasp.app.scenario.cell_file import load_cell
from regrasp.app.studies.figures import write_figures
from regrasp.app.studies.scene_tasks import SceneTask, run_tasks
from regrasp.app.tasks.printer.studies.approach_plots import write_plots
from regrasp.app.tasks.printer.studies.approach_trial import ApproachParameters, Block, Trial, run_trial
from regrasp.app.tasks.printer.studies.hand_placed import HandPlaced
from regrasp.app.tasks.printer.studies.reach import STARTS
from regrasp.interfaces.printer.actions import Approach
from regrasp.interfaces.printer.cell import PrinterCell

KIND = "trials of an approach study"
CELL = "habitat_open"

# Table 4-5 of the source: mean errors in m, over its starts: in the Y-Z plane, along X, and in all three
SOURCE = {
    "one_step": (0.01393, 0.01901, 0.02505),
    "two_step": (0.00958, 0.00630, 0.01212),
    "three_step": (0.01152, 0.00203, 0.01189),
}


_TRIALS: TypeAdapter[list[Trial]] = TypeAdapter(list[Trial])


def run_approach(
    seeds: range,
    jobs: int,
    out: Path | None,
    blocks: Sequence[Block] = get_args(Block),
    approaches: Sequence[Approach] = get_args(Approach),
    parameters: ApproachParameters = ApproachParameters(),  # noqa: B008 - it is frozen
) -> int:
    """Try the approaches in the blocks for every seed.

    Progress goes to stderr, the table to stdout; figures to out/approach.json, trials to out/approach.csv, plots beside
    them. Each trial is kept in `out` as it ends. Returns the exit code of `run_tasks`.

    Raises:
        OSError: `out` cannot be written.
    """
    cell = load_cell(shipped("cell")[CELL])
    assert isinstance(cell, PrinterCell)
    digest = digest_of(cell.model_dump(mode="json"), parameters.__dict__)
    tasks = {
        f"{block} {approach} {start} seed {seed}": SceneTask(
            partial(run_trial, cell, block, approach, start, seed, parameters),
            digest_of([block, approach, start, seed], digest),
        )
        for seed in seeds
        for block in blocks
        for approach in _of_block(block, approaches)
        for start in (("drawn",) if block == "B" else STARTS)
    }
    trials, code = run_tasks(tasks, jobs, out, KIND, _TRIALS)
    if out is not None and trials:
        write_figures(out / "approach.json", seeds, approach_figures(trials))
        write_whole(out / "approach.csv", _table(trials))
        write_plots(trials, out)
    _print(trials)
    if "servo" in approaches and not code:
        took = tracking_ms(cell)
        typer.echo(f"a cycle of the servo's tracking takes {statistics.median(took):.1f} ms, the median of {len(took)}")
    return code


def tracking_ms(cell: PrinterCell, seed: int = 0, pictures: int = 5) -> list[float]:
    """How long (ms) the tracker takes for a picture on one core, for so many from each of the source's starts."""
    threads, took = cv2.getNumThreads(), list[float]()
    cv2.setNumThreads(1)
    with HandPlaced(cell, seed) as hand:
        perception, motion = hand.services.perception, hand.services.motion
        nominal = motion.part_goal(hand.before)
        for offset in STARTS.values():
            hand.place(RigidTransform.from_translation(offset) * nominal)
            hand.world.advance(0.5)  # until the jaw stands, and there are pictures from here
            tracker = perception.part_tracker(motion.tool_at, lambda: hand.arm.gripper.reading().gap, hand.world.now())
            for _ in range(pictures):
                hand.picture()  # drawn before the clock starts
                begin = perf_counter()
                seen = tracker.update()
                took.append(1e3 * (perf_counter() - begin))
                assert seen is not None, tracker.why
    cv2.setNumThreads(threads)
    return took


def _of_block(block: Block, approaches: Sequence[Approach]) -> list[Approach]:
    """Those of the approaches that are tried in a block: the source's do not follow a part that drifts."""
    return [approach for approach in approaches if block != "C" or approach == "servo"]


def approach_figures(trials: Sequence[Trial]) -> dict[str, Any]:
    """The figures of approach.json: of each approach those of its blocks, and of block A by start."""
    out: dict[str, Any] = {}
    for approach in dict.fromkeys(trial.approach for trial in trials):
        own = [trial for trial in trials if trial.approach == approach]
        blocks = {
            block: _figures([t for t in own if t.block == block]) for block in dict.fromkeys(t.block for t in own)
        }
        of_a = [trial for trial in own if trial.block == "A"]
        starts = {
            start: _figures([t for t in of_a if t.start == start]) for start in dict.fromkeys(t.start for t in of_a)
        }
        out[approach] = {**(blocks.get("A") or next(iter(blocks.values()))), "by_start": starts, "block": blocks}
        if approach in SOURCE:
            out[approach]["source"] = dict(zip(("mean_yz_m", "mean_x_m", "mean_xyz_m"), SOURCE[approach], strict=True))
    return {"approaches": out}


def _figures(trials: Sequence[Trial]) -> dict[str, Any]:
    """Of trials of one approach in one block. Errors in m are of those that came to an end."""
    errors = np.array([trial.error for trial in trials if trial.error is not None]).reshape(-1, 3)
    whole, across = np.linalg.norm(errors, axis=1), np.linalg.norm(errors[:, 1:], axis=1)
    tried = [trial.grasped for trial in trials if trial.grasped is not None]
    return {
        "trials": len(trials),
        "failed": len(trials) - len(errors),
        "mean_yz_m": _mean(across),
        "mean_x_m": _mean(np.abs(errors[:, 0])),
        "mean_xyz_m": _mean(whole),
        "p95_xyz_m": float(np.quantile(whole, 0.95)) if len(whole) else None,
        "max_xyz_m": float(whole.max()) if len(whole) else None,
        "grasped": [sum(tried), len(tried)],
        "median_settle_s": statistics.median(trial.settle for trial in trials) if trials else None,
    }


def _mean(values: Any) -> float | None:
    return float(values.mean()) if len(values) else None


def _table(trials: Iterable[Trial]) -> str:
    """The trials as CSV."""
    text = io.StringIO()
    rows = csv.writer(text, lineterminator="\n")
    rows.writerow(["block", "approach", "start", "seed", "x_m", "y_m", "z_m", "settle_s", "grasped", "why"])
    for t in trials:
        error = ("", "", "") if t.error is None else tuple(f"{value:.6f}" for value in t.error)
        grasped = "" if t.grasped is None else str(t.grasped).lower()
        rows.writerow([t.block, t.approach, t.start, t.seed, *error, f"{t.settle:.2f}", grasped, t.why])
    return text.getvalue()


def _print(trials: Sequence[Trial]) -> None:
    lines = []
    for approach, figures in approach_figures(trials)["approaches"].items():
        for block, of_block in figures["block"].items():
            cells = [_mm(of_block[key]) for key in ("mean_yz_m", "mean_x_m", "mean_xyz_m", "p95_xyz_m", "max_xyz_m")]
            source = f"{1e3 * SOURCE[approach][2]:.1f}" if approach in SOURCE and block.startswith("A") else ""
            taken, tried = of_block["grasped"]
            low, high = wilson_interval(taken, tried) if tried else (0.0, 1.0)
            held = f"{taken}/{tried} ({100 * low:.0f} to {100 * high:.0f} %)" if tried else ""
            lines.append(
                (
                    approach,
                    block,
                    str(of_block["trials"]),
                    str(of_block["failed"]),
                    *cells,
                    source,
                    held,
                    f"{of_block['median_settle_s']:.1f}",
                )
            )
    titles = (
        "approach",
        "block",
        "trials",
        "failed",
        "Y-Z mm",
        "X mm",
        "X-Y-Z mm",
        "95 %",
        "most",
        "source",
        "grasped",
        "s",
    )
    print_table(titles, lines)


def _mm(value: float | None) -> str:
    return "-" if value is None else f"{1e3 * value:.1f}"
