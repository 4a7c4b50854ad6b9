"""`regrasp train-detector` and `evaluate-detector`, for the network of the technique `detector`."""

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

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
from regrasp.app.files.resources import resolve
from regrasp.app.files.whole_file import write_whole
from regrasp.interfaces.seed import MAX_SEED

if TYPE_CHECKING:
    from regrasp.interfaces.cable.cell import CableCell

_Cell = Annotated[str, typer.Option("--cell", help="A shipped cell's name, or a path to a .yaml file.")]
_Seed = Annotated[int, typer.Option(min=0, max=MAX_SEED, help="Draws the pictures and all else.")]


def add_to(app: typer.Typer) -> None:
    """Add the commands to `app`."""
    app.command()(train_detector)
    app.command()(evaluate_detector)


def train_detector(
    out: Annotated[Path, typer.Option(help="The folder for detector.onnx and evaluation.json.")],
    cell: _Cell = "thesis",
    pictures: Annotated[int, typer.Option(min=24, help="Random pictures to train on.")] = 32000,
    steps: Annotated[int, typer.Option(min=1, help="Training steps of 32 parts of pictures each.")] = 100000,
    start: Annotated[
        Path | None, typer.Option(metavar="FILE", help="An ONNX file of ours to go on from, at a slower rate.")
    ] = None,
    held_out: Annotated[int, typer.Option(min=1, help="Pictures of each class to evaluate on at the end.")] = 60,
    seed: _Seed = TRAINING_SEED,
) -> None:
    """Train the network of the technique `detector`.

    On random pictures of a cell; then it is evaluated. Needs the extra `train` (torch, onnx), some 20 minutes to draw
    the pictures and 80 to learn, and 15 GB of free memory (half with --pictures 16000). Ctrl-C keeps the best network
    so far. To use it, put its detector.onnx in the place of perception/pose/detector.onnx.

    \b
    Examples:
      regrasp train-detector --out results/detector
      regrasp train-detector --out results/more \\
        --start perception/pose/detector.onnx
    """
    if wrong := training_findings("train-detector", out, "detector.onnx", start):
        raise Findings(wrong)
    loaded = _load(cell)
    from regrasp.app.tasks.cable.studies.detector.data import make_pictures
    from regrasp.app.tasks.cable.studies.detector.train import NETWORK, train

    model = checked_start("train-detector", start, NETWORK)
    out.mkdir(parents=True, exist_ok=True)
    with counted("drawing pictures", pictures) as tell:
        drawn = make_pictures(loaded, seed, pictures, tell)
    with counted("training", steps) as tell:
        train(drawn, seed, steps, lambda best, _score: write_whole(out / "detector.onnx", best), tell, model)
    evaluate_detector(out / "detector.onnx", cell, held_out, out=out / "evaluation.json")


def evaluate_detector(
    model: Annotated[Path | None, typer.Argument(help="An ONNX file; default the shipped network.")] = None,
    cell: _Cell = "thesis",
    held_out: Annotated[int, typer.Option(min=1, help="Pictures of each class of occlusion, and without any.")] = 60,
    seed: _Seed = HELD_OUT_SEED,
    out: Annotated[Path | None, typer.Option(metavar="FILE", help="Write the figures as JSON, too.")] = None,
) -> None:
    """Measure how well the network finds the connector.

    In pictures unlike those of its training, a minute or two by default. They show another layout of the cell, other
    light, things and look-alikes; the connector is hidden by up to 70 %, and absent in as many pictures as each
    class of occlusion has.

    \b
    Example:
      regrasp evaluate-detector my/detector.onnx --out evaluation.json
    """
    if wrong := evaluation_findings("train-detector", model, out):
        raise Findings(wrong)
    loaded = _load(cell)
    from regrasp.app.tasks.cable.studies.detector.score import detector_figures, held_out_shots, score_picture

    detector = _detector(loaded, model)
    with counted("drawing held-out pictures", 5 * held_out) as tell:
        shots = held_out_shots(loaded, seed, held_out, report_progress=tell)
    figures = detector_figures([score_picture(detector, shot, loaded, number) for number, shot in enumerate(shots)])
    if out is not None:
        out.parent.mkdir(parents=True, exist_ok=True)
        write_whole(out, json.dumps(figures, indent=2) + "\n")
    _print(figures)


def _load(cell: str) -> "CableCell":
    from regrasp.app.tasks.cable.cells import cable_cell

    return cable_cell(resolve("cell", cell, Path()))


def _detector(cell: "CableCell", model: Path | None) -> Any:
    """The detector with this network, by default the shipped one. Raises `Findings` if the file holds none."""
    import cv2
    import numpy as np

    from regrasp.interfaces.frame import Intrinsics, RgbdFrame
    from regrasp.perception.pose.detector import NETWORK_HEIGHT, NETWORK_WIDTH, Detector

    cv2.utils.logging.setLogLevel(cv2.utils.logging.LOG_LEVEL_SILENT)  # the finding below says what is wrong
    try:
        detector = Detector(cell.known, model.read_bytes() if model else None)
        blank = np.zeros((NETWORK_HEIGHT, NETWORK_WIDTH), np.float32)
        k = Intrinsics.from_fov(NETWORK_WIDTH, NETWORK_HEIGHT, 1.0)
        detector.detect(RgbdFrame("blank", 0, 0.0, np.zeros((*blank.shape, 3), np.uint8), blank, k))
        return detector
    except (cv2.error, ValueError):
        message = "holds no such network; name an ONNX file that `regrasp train-detector` made"
        raise Findings([Finding(shown(model) if model else "detector.onnx", 0, message)]) from None


def _print(figures: dict[str, Any]) -> None:
    from regrasp.app.campaigns.statistics import wilson_interval
    from regrasp.app.campaigns.table import print_table

    lines = [
        (name, f"{right}/{all_}", "{:.1f} to {:.1f} %".format(*(100 * x for x in wilson_interval(right, all_))))
        for name, (right, all_) in (*figures["recall_by_occlusion"].items(), ("all", figures["recall"]))
    ]
    print_table(("hidden", f"found at {figures['min_score']}", "95 % interval"), lines)
    false, empty = figures["empty_pictures_with_a_box"]
    angle, place = figures["angle_error_deg"]["50%"], figures["position_error_m"]["50%"]
    low, high = figures["ap50_interval"]
    typer.echo(f"AP50 {figures['ap50']:.3f}, 95 % interval {low:.3f} to {high:.3f}")
    typer.echo(f"a false box in {false} of {empty} pictures without the connector")
    if angle is not None and place is not None:
        typer.echo(f"median error: axis in the image {angle:.1f} degrees, position {1000 * place:.1f} mm")
