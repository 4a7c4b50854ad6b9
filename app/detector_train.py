"""The detector's network and its training, in torch; nothing but `regrasp train-detector` imports this."""

import io
import warnings
from collections.abc import Callable
from itertools import pairwise

import cv2
import numpy as np
import torch
from torch import nn

from app.detector_data import CLEAR, Pictures, draw_patch, target_maps
from app.detector_score import LEAST_SCORE, Answer, average_precision, true_box
from perception.detector import HEIGHT, WIDTH, decode

CHANNELS = (8, 16, 32, 64, 96)  # at strides 2 to 32; choice: measured 3 ms of processor time an answer
RATE, BATCH = 4e-3, 32  # choice: usual for AdamW on a small network; not tuned
CHECK_EVERY = 500  # steps; choice: a check takes as long as some 25 of them
KEPT_BACK = 12  # one picture of so many is kept back to choose the best network by
OPSET = 17  # of ONNX; choice: OpenCV 5 reads it


def _convolution(inputs: int, outputs: int, stride: int = 1, kernel: int = 3) -> nn.Sequential:
    layer = nn.Conv2d(inputs, outputs, kernel, stride, kernel // 2, bias=False)
    return nn.Sequential(layer, nn.BatchNorm2d(outputs), nn.ReLU(inplace=True))


class Network(nn.Module):
    """From images (n, 3, h, w), 0 to 1, to maps (n, 7, h / 4, w / 4) as in `perception.detector.decode`.

    Down to stride 32, where a cell sees 150 px around it, and up to stride 4 again, each level added to its like.
    """

    def __init__(self) -> None:
        super().__init__()
        levels = list(pairwise(CHANNELS))
        self.stem = _convolution(3, CHANNELS[0], 2)
        self.down = nn.ModuleList(nn.Sequential(_convolution(a, b, 2), _convolution(b, b)) for a, b in levels)
        self.up = nn.ModuleList(_convolution(b, a, kernel=1) for a, b in levels[1:])
        last = nn.Conv2d(CHANNELS[1], 7, 1)
        nn.init.constant_(last.bias[:1], -4.0)  # nothing is likely at first: few cells hold a connector
        self.head = nn.Sequential(_convolution(CHANNELS[1], CHANNELS[1]), last)

    def forward(self, x: torch.Tensor) -> torch.Tensor:
        """See the class."""
        x = self.stem(x)
        levels = []
        for step in self.down:
            x = step(x)
            levels.append(x)
        for step, level in zip(reversed(self.up), reversed(levels[:-1]), strict=True):
            x = level + nn.functional.interpolate(step(x), size=level.shape[-2:], mode="nearest")
        out = self.head(x)
        return torch.cat([out[:, :1].sigmoid(), out[:, 1:]], dim=1)


def train(
    pictures: Pictures,
    seed: int,
    steps: int,
    keep: Callable[[bytes, float], None],
    tell: Callable[[int, str], None] = lambda _step, _words: None,
) -> None:
    """Train on most of the pictures, and `keep` each network, an ONNX file, that is the best so far.

    The best has the highest average precision on the pictures kept back. `tell` is called after every step. One thread
    and one seed: the same network on the same kind of machine.
    """
    torch.manual_seed(seed)
    torch.set_num_threads(1)
    count = len(pictures.images) - len(pictures.images) // KEPT_BACK
    network, best = Network().to(memory_format=torch.channels_last), -1.0  # 1.4 times as fast on a processor
    optimizer = torch.optim.AdamW(network.parameters(), RATE, weight_decay=1e-4)
    schedule = torch.optim.lr_scheduler.OneCycleLR(optimizer, RATE, total_steps=steps)
    learned = pictures.part(0, count)
    for step in range(1, steps + 1):
        images, wanted = _batch(learned, np.random.default_rng([seed, step]))
        error = loss(network(images), wanted)
        optimizer.zero_grad()
        error.backward()
        optimizer.step()
        schedule.step()
        tell(step, f"loss {error.item():.2f}, best AP50 {max(best, 0):.3f}")
        if step % CHECK_EVERY == 0 or step == steps:
            score = _precision(network, pictures.part(count, len(pictures.images)))
            if score > best:
                best = score
                keep(to_onnx(network), score)


def loss(maps: torch.Tensor, wanted: torch.Tensor) -> torch.Tensor:
    """CenterNet's: focal loss on the likelihood, absolute errors about the middles of connectors; see `target_maps`."""
    heat, truth, weight = maps[:, 0].clamp(1e-4, 1 - 1e-4), wanted[:, 0], wanted[:, 8]
    peak = (truth == 1).float()
    focal = peak * (1 - heat) ** 2 * heat.log() + (1 - peak) * (1 - truth) ** 4 * heat**2 * (1 - heat).log()
    error = (maps[:, 1:] - wanted[:, 1:7]).abs() * wanted[:, 7:8]
    return -(focal * weight).sum() / peak.sum().clamp(min=1) + error.sum() / wanted[:, 7].sum().clamp(min=1)


def to_onnx(network: Network) -> bytes:
    """The network as an ONNX file: `image` (1, 3, 240, 432) RGB 0 to 1 in, `maps` (1, 7, 60, 108) out."""
    file, example = io.BytesIO(), (torch.zeros(1, 3, HEIGHT, WIDTH),)
    network.eval()
    with warnings.catch_warnings(action="ignore", category=DeprecationWarning):  # the newer way needs onnxscript, too
        torch.onnx.export(
            network, example, file, dynamo=False, input_names=["image"], output_names=["maps"], opset_version=OPSET
        )
    network.train()
    return file.getvalue()


def _batch(pictures: Pictures, rng: np.random.Generator) -> tuple[torch.Tensor, torch.Tensor]:
    images, targets = zip(*(draw_patch(pictures, rng) for _ in range(BATCH)), strict=True)
    batch = torch.stack([_tensor(i) for i in images]).contiguous(memory_format=torch.channels_last)
    return batch, torch.from_numpy(np.stack([target_maps(t) for t in targets]))


def _tensor(image: np.typing.NDArray[np.uint8]) -> torch.Tensor:
    return torch.from_numpy(image.transpose(2, 0, 1) / np.float32(255))


@torch.no_grad()
def _precision(network: Network, pictures: Pictures) -> float:
    """Average precision on whole pictures; those where too little shows are left out."""
    network.eval()
    answers = []
    for image, mask in zip(pictures.images, pictures.masks >= 128, strict=True):
        if 0 < cv2.countNonZero(mask.astype(np.uint8)) < CLEAR:
            continue
        maps = network(_tensor(image)[None])[0].numpy()
        answers.append(Answer(decode(maps, 1.0, LEAST_SCORE), true_box(mask)))
    network.train()
    return average_precision(answers)
