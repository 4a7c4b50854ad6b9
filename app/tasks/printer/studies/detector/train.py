"""The training of the part's detector, in torch; nothing but `regrasp train-part-detector` imports this."""

from collections.abc import Callable, Iterable
from functools import partial

import numpy as np
import torch
from numpy.typing import NDArray

from regrasp.app.studies.detector.network import Network, NetworkParameters, read_weights, to_onnx
from regrasp.app.studies.detector.precision import area_under_curve
from regrasp.app.studies.detector.training import Batch, TrainingParameters
from regrasp.app.studies.detector.training import train as train_network
from regrasp.app.tasks.printer.studies.detector.pictures import PartPictures, changed
from regrasp.app.tasks.printer.studies.detector.score import MIN_RECORDED_SCORE, Truth, hits_of
from regrasp.interfaces.printer.actions import CLASSES
from regrasp.perception.printer.detector import BOX_MAPS, NETWORK_INPUT, NETWORK_SHAPE, decode, network_input

TRAINING = TrainingParameters(check_every=1000, averaging=0.998)  # choice: over some 500 steps
NETWORK = NetworkParameters(inputs=12, classes=len(CLASSES), values=BOX_MAPS)


def train(
    pictures: PartPictures,
    seed: int,
    steps: int,
    keep: Callable[[bytes, float], None],
    report_progress: Callable[[int, str], None] = lambda _step, _words: None,
    start: bytes | None = None,
    batch_size: int = 8,
    validation_every: int = 12,
    parameters: TrainingParameters = TRAINING,
) -> None:
    """Train for so many steps, from random weights, or from those of the ONNX file `start` at a lower learning rate.

    `keep` is called with each network that is the best so far: an ONNX file, and its mean average precision on the
    validation pictures, one of `validation_every`, which are not trained on. A batch has `batch_size` pictures. See
    `regrasp.app.studies.detector.training.train`.

    Raises:
        ValueError: `start` is no ONNX file, or one of another network.
    """
    weights = None if start is None else read_weights(start, NETWORK)
    torch.manual_seed(seed)
    count = len(pictures.images) - max(1, len(pictures.images) // validation_every)
    training, validation = pictures.part(0, count), pictures.part(count, len(pictures.images))
    train_network(
        Network(NETWORK),
        lambda rng: _batch(training, rng, batch_size),
        partial(_precision, pictures=validation),
        seed,
        steps,
        lambda network, score: keep(to_onnx(network, NETWORK_INPUT, NETWORK_SHAPE), score),
        report_progress,
        None if weights is None else (weights, _inputs(training.images[:batch_size])),
        parameters,
    )


def _batch(pictures: PartPictures, rng: np.random.Generator, count: int) -> Batch:
    images, wanted = zip(
        *(changed(pictures, int(i), rng) for i in rng.integers(len(pictures.images), size=count)), strict=True
    )
    return _inputs(images).contiguous(memory_format=torch.channels_last), torch.from_numpy(np.stack(wanted))


def _inputs(images: Iterable[NDArray[np.uint8]]) -> torch.Tensor:
    return torch.from_numpy(np.stack([network_input(image) for image in images]))


@torch.no_grad()
def _precision(network: Network, pictures: PartPictures) -> float:
    """Mean average precision of the classes, each without the pictures that show too little of it."""
    network.eval()
    found = [decode(network(_inputs(image[None]))[0].numpy(), 1.0, MIN_RECORDED_SCORE) for image in pictures.images]
    network.train()
    areas = []
    for k, name in enumerate(CLASSES):
        hits, things = [], []
        for detections, boxes, counts in zip(found, pictures.boxes[:, k], pictures.counts[:, k], strict=True):
            there = bool(np.isfinite(boxes).all())
            if there and not counts:
                continue
            truth: Truth = tuple((boxes - 0.5).tolist()) if there else None
            hits.append(hits_of(name, detections, truth))
            things.append(int(there))
        areas.append(area_under_curve(hits, np.array(things)))
    return float(np.mean(areas))
