"""The training of the connector's detector, in torch; nothing but `regrasp train-detector` imports this."""

from collections.abc import Callable
from functools import partial

import cv2
import numpy as np
import torch

from regrasp.app.studies.detector.network import Network, NetworkParameters, read_weights, to_onnx
from regrasp.app.studies.detector.precision import true_box
from regrasp.app.studies.detector.training import Batch, TrainingParameters
from regrasp.app.studies.detector.training import train as train_network
from regrasp.app.tasks.cable.studies.detector.crops import AugmentationParameters, draw_crop, target_maps
from regrasp.app.tasks.cable.studies.detector.data import Pictures
from regrasp.app.tasks.cable.studies.detector.score import ScoredPicture, ScoreParameters, average_precision
from regrasp.perception.pose.detector import NETWORK_HEIGHT, NETWORK_INPUT, NETWORK_WIDTH, decode, network_input

TRAINING = TrainingParameters()
NETWORK = NetworkParameters(inputs=13, values=6)  # see `network_input` and `decode`


def train(
    pictures: Pictures,
    seed: int,
    steps: int,
    keep: Callable[[bytes, float], None],
    report_progress: Callable[[int, str], None] = lambda _step, _words: None,
    start: bytes | None = None,
    batch_size: int = 32,
    validation_every: int = 12,
    parameters: TrainingParameters = TRAINING,
) -> None:
    """Train for so many steps, from random weights, or from those of the ONNX file `start` at a lower learning rate.

    `keep` is called with each network that is the best so far: an ONNX file, and its average precision on the
    validation pictures, one of `validation_every`, which are not trained on. A batch has `batch_size` crops (choice:
    usual). See `regrasp.app.studies.detector.training.train`.

    Raises:
        ValueError: `start` is no ONNX file, or one of another network.
    """
    weights = None if start is None else read_weights(start, NETWORK)
    torch.manual_seed(seed)
    count = len(pictures.images) - len(pictures.images) // validation_every
    training, validation = pictures.part(0, count), pictures.part(count, len(pictures.images))
    train_network(
        Network(NETWORK),
        lambda rng: _batch(training, rng, batch_size),
        partial(_precision, pictures=validation),
        seed,
        steps,
        lambda network, score: keep(onnx_file(network), score),
        report_progress,
        None if weights is None else (weights, _inputs(training, slice(batch_size))),
        parameters,
    )


def onnx_file(network: Network) -> bytes:
    """The network as an ONNX file: `NETWORK_INPUT` (1, 13, 120, 216) in, `maps` (1, 7, 30, 54) out."""
    return to_onnx(network, NETWORK_INPUT, (NETWORK_HEIGHT, NETWORK_WIDTH))


def _batch(pictures: Pictures, rng: np.random.Generator, count: int) -> Batch:
    images, sizes, targets = zip(*(draw_crop(pictures, rng) for _ in range(count)), strict=True)
    inputs = np.stack([network_input(*pair) for pair in zip(images, sizes, strict=True)])
    wanted = torch.from_numpy(np.stack([target_maps(t) for t in targets])[:, None])  # of the only class
    return torch.from_numpy(inputs).contiguous(memory_format=torch.channels_last), wanted


def _inputs(pictures: Pictures, which: slice) -> torch.Tensor:
    """Whole pictures as the network sees them, (n, 13, 120, 216)."""
    pairs = zip(pictures.images[which], pictures.sizes[which] * np.float32(1e-6), strict=True)
    return torch.from_numpy(np.stack([network_input(*pair) for pair in pairs]))


@torch.no_grad()
def _precision(network: Network, pictures: Pictures) -> float:
    """Average precision on whole pictures, without those where too little of the connector is visible."""
    network.eval()
    scored = []
    for i, mask in enumerate(pictures.masks >= 128):
        if 0 < cv2.countNonZero(mask.astype(np.uint8)) < AugmentationParameters.min_visible_area:
            continue
        maps = network(_inputs(pictures, slice(i, i + 1)))[0].numpy()
        scored.append(ScoredPicture(decode(maps, 1.0, ScoreParameters.min_recorded_score), true_box(mask)))
    network.train()
    return average_precision(scored)
