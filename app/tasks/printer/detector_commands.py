"""`regrasp train-part-detector` and `evaluate-part-detector`, for the network of the technique `printer_part`."""

import json
from pathlib import Path
from statistics import median
from time import perf_counter
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from regrasp.app.cli.training import (
    HELD_OUT_SEED,
    TRAINING_SEED,
    checked_start,
    counted,
    evaluation_findings,
    training_findings,
)
from regrasp.app.files.findings import Finding, Findings, shown
from regrasp.app.files.whole_file import write_whole
from regrasp.app.interrupts import late_imports
from regrasp.interfaces.seed import MAX_SEED

if TYPE_CHECKING:
    from regrasp.interfaces.arrays import ColorImage
    from regrasp.perception.printer.detector import PartDetector

FILE = "part_detector.onnx"
MADE = "name one that `regrasp train-part-detector` made"
_Cell = Annotated[str, typer.Option("--cell", help="A cell with a printer whose door is open.")]
_Seed = Annotated[int, typer.Option(min=0, max=MAX_SEED, help="Draws the pictures and all else.")]


def train_part_detector(
    out: Annotated[Path, typer.Option(help=f"The folder for {FILE} and evaluation.json.")],
    cell: _Cell = "habitat_open",
    pictures: Annotated[int, typer.Option(min=24, help="Random pictures to train on.")] = 6000,
    steps: Annotated[int, typer.Option(min=1, help="Training steps of 8 pictures each.")] = 14000,
    start: Annotated[
        Path | None, typer.Option(metavar="FILE", help="An ONNX file of ours to go on from, at a slower rate.")
    ] = None,
    held_out: Annotated[int, typer.Option(min=1, help="Pictures to evaluate on at the end.")] = 400,
    seed: _Seed = TRAINING_SEED,
) -> None:
    """Train the network that finds the printed part.

    It finds the fingers, too. It learns from random pictures of a cell; then it is evaluated. Needs the extra `train`
    (torch, onnx), an hour and a half of two cores, and 4 GB of free memory. Ctrl-C keeps the best network so far. To
    use it, put its file in the place of perception/printer/part_detector.onnx.

    \b
    Example:
      regrasp train-part-detector --out results/part_detector
    """
    if wrong := training_findings("train-part-detector", out, FILE, start):
        raise Findings(wrong)
    with late_imports():
        from regrasp.app.tasks.printer.cells import printer_cell
        from regrasp.app.tasks.printer.studies.detector.pictures import make_pictures
        from regrasp.app.tasks.printer.studies.detector.train import NETWORK, train

    loaded = printer_cell(cell)
    model = checked_start("train-part-detector", start, NETWORK)
    out.mkdir(parents=True, exist_ok=True)
    with counted("drawing pictures", pictures) as tell:
        drawn = make_pictures(loaded, seed, pictures, tell)
    with counted("training", steps) as tell:
        train(drawn, seed, steps, lambda best, _score: write_whole(out / FILE, best), tell, model)
    evaluate_part_detector(out / FILE, cell, held_out, out=out / "evaluation.json")


def evaluate_part_detector(
    model: Annotated[Path | None, typer.Argument(help="An ONNX file; default the shipped network.")] = None,
    cell: _Cell = "habitat_open",
    held_out: Annotated[int, typer.Option(min=1, help="Pictures.")] = 400,
    renderer: Annotated[Literal["software", "moderngl"], typer.Option(help="What draws them.")] = "software",
    seed: _Seed = HELD_OUT_SEED,
    out: Annotated[Path | None, typer.Option(metavar="FILE", help="Write the figures as JSON, too.")] = None,
) -> None:
    """Measure how well that network finds the part.

    In pictures unlike those of its training: another chamber, other light and other clutter. Up to 70 % of the part
    is hidden, and a quarter of the pictures shows none. The network was trained on pictures of the software renderer.

    \b
    Example:
      regrasp evaluate-part-detector --renderer moderngl --out evaluation.json
    """
    if wrong := evaluation_findings("train-part-detector", model, out):
        raise Findings(wrong)
    with late_imports():
        from regrasp.app.tasks.printer.cells import printer_cell
        from regrasp.app.tasks.printer.studies.detector.score import held_out_shots, part_detector_figures, scored

    loaded, detector = printer_cell(cell), _detector(model)
    with counted("drawing held-out pictures", held_out) as tell:
        shots = held_out_shots(loaded, seed, held_out, renderer, tell)
    figures = {"renderer": renderer, **part_detector_figures([scored(detector, shot) for shot in shots])}
    if out is not None:
        out.parent.mkdir(parents=True, exist_ok=True)
        write_whole(out, json.dumps(figures, indent=2) + "\n")
    _print(figures)
    typer.echo(f"a pass takes {_pass_ms(detector, shots[0].rgb):.1f} ms on one core, the median of 30")


def _pass_ms(detector: "PartDetector", rgb: "ColorImage", passes: int = 30) -> float:
    import cv2

    threads, took = cv2.getNumThreads(), []
    cv2.setNumThreads(1)
    for _ in range(passes):
        begin = perf_counter()
        detector.detect(rgb)
        took.append(perf_counter() - begin)
    cv2.setNumThreads(threads)
    return 1e3 * median(took)


def _detector(model: Path | None) -> "PartDetector":
    """The detector with this network, by default the shipped one. Raises `Findings` if the file holds none."""
    import cv2
    import numpy as np

    from regrasp.perception.printer.detector import NETWORK_SHAPE, PartDetector

    cv2.utils.logging.setLogLevel(cv2.utils.logging.LOG_LEVEL_SILENT)  # the finding below says what is wrong
    try:
        detector = PartDetector(model.read_bytes() if model else None)
        detector.detect(np.zeros((*NETWORK_SHAPE, 3), np.uint8))
        return detector
    except (cv2.error, ValueError):
        raise Findings([Finding(shown(model) if model else FILE, 0, f"holds no such network; {MADE}")]) from None


def _print(figures: dict[str, Any]) -> None:
    from regrasp.app.campaigns.table import print_table

    lines = [
        (
            name,
            f"{each['ap50']:.3f}",
            "{:.3f} to {:.3f}".format(*each["ap50_interval"]),
            "{}/{}".format(*each["recall"]),
            "{} of {}".format(*each["pictures_with_a_false_box"]),
        )
        for name, each in figures["classes"].items()
    ]
    found = f"found at {figures['min_score']}"
    print_table(("class", "AP50", "95 % interval", found, "pictures with a false box"), lines)
    typer.echo(f"mAP50 {figures['map50']:.3f} in {figures['pictures']} pictures")
