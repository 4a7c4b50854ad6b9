"""The detector's network and its training, in torch; nothing but `regrasp train-detector` imports this."""

import io
import warnings
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from functools import partial
from itertools import pairwise

import cv2
import numpy as np
import onnx
import onnx.numpy_helper
import torch
from torch import nn

from regrasp.app.studies.detector.data import CLEAR, Pictures, draw_patch, target_maps
from regrasp.app.studies.detector.score import LEAST_SCORE, Answer, average_precision, true_box
from regrasp.perception.pose.detector import NETWORK_HEIGHT, NETWORK_INPUT, NETWORK_WIDTH, decode, network_input

CHANNELS = (16, 32, 64, 96)  # at strides 4 to 32
DEPTHS = (1, 3, 3)  # convolutions at strides 8 to 32, after the one that shrinks
WIDTH_UP = 32  # channels on the way up and of the answer's head; choice: 3.2 ms of processor time an answer in all
RATE, BATCH = 4e-3, 32  # choice: usual for AdamW on a small network; not tuned
CHECK_EVERY = 6000  # steps; choice: a check takes as long as some 300 of them
AHEAD = 3  # batches
# Learning in bfloat16 takes two thirds of the time where the processor has instructions for it, and for ever elsewhere.
HALF = torch.cpu._is_avx512_bf16_supported()  # torch has no public way to ask
KEPT_BACK = 12  # one picture of so many is kept back to choose the best network by
OPSET = 17  # of ONNX; choice: OpenCV 5 reads it


def _convolution(inputs: int, outputs: int, stride: int = 1, kernel: int = 3) -> nn.Sequential:
    layer = nn.Conv2d(inputs, outputs, kernel, stride, kernel // 2, bias=False)
    return nn.Sequential(layer, nn.BatchNorm2d(outputs), nn.ReLU(inplace=True))


Weights = dict[str, tuple[torch.Tensor, ...]]  # of each convolution, by its name in the network: weight, bias


class Network(nn.Module):
    """From inputs (n, 13, h / 2, w / 2) of `network_input` to maps (n, 7, h / 8, w / 8) as in `decode`.

    Down to stride 32, where a cell sees some 370 px, and up to stride 8 again, each level added to its like:
    a pyramid of features (Lin et al. 2017). Finer cells had half as much of the processor's time for what they mean.
    """

    def __init__(self) -> None:
        super().__init__()
        half = CHANNELS[0] // 2
        self.stem = nn.Sequential(_convolution(13, half, kernel=1), _convolution(half, CHANNELS[0], 2))
        self.down = nn.ModuleList(
            nn.Sequential(_convolution(a, b, 2), *(_convolution(b, b) for _ in range(depth)))
            for (a, b), depth in zip(pairwise(CHANNELS), DEPTHS, strict=True)
        )
        self.side = nn.ModuleList(_convolution(channels, WIDTH_UP, kernel=1) for channels in CHANNELS[1:])
        last = nn.Conv2d(WIDTH_UP, 7, 1)
        nn.init.constant_(last.bias[:1], -4.0)  # nothing is likely at first: few cells hold a connector
        self.head = nn.Sequential(_convolution(WIDTH_UP, WIDTH_UP), last)

    def forward(self, x: torch.Tensor) -> torch.Tensor:
        """See the class."""
        x = self.stem(x)
        levels = []
        for down, side in zip(self.down, self.side, strict=True):
            x = down(x)
            levels.append(side(x))
        x = levels.pop()
        for level in reversed(levels):
            x = level + nn.functional.interpolate(x, size=level.shape[-2:], mode="nearest")
        out = self.head(x)
        return torch.cat([out[:, :1].sigmoid(), out[:, 1:]], dim=1)


def train(
    pictures: Pictures,
    seed: int,
    steps: int,
    keep: Callable[[bytes, float], None],
    tell: Callable[[int, str], None] = lambda _step, _words: None,
    start: Weights | None = None,
) -> None:
    """Train on most of the pictures, and `keep` each network, an ONNX file, that is the best so far.

    From random weights, or from `start` at a slower rate.

    The best has the highest average precision on the pictures kept back. `tell` is called after every step. One thread
    learns, another makes the next parts of pictures; one seed: the same network on the same kind of machine.
    """
    torch.manual_seed(seed)
    torch.set_num_threads(1)
    count = len(pictures.images) - len(pictures.images) // KEPT_BACK
    learned, kept_back = pictures.part(0, count), pictures.part(count, len(pictures.images))
    network = Network().to(memory_format=torch.channels_last)  # 1.4 times as fast on a processor
    best, rate, draws = -1.0, RATE, [seed]
    if start is not None:
        take_over(network, start, _inputs(learned, slice(BATCH)))
        best, rate, draws = _precision(network, kept_back), RATE / 4, [seed, 1]  # other parts of the pictures
        keep(to_onnx(network), best)
    optimizer = torch.optim.AdamW(network.parameters(), rate, weight_decay=1e-4)
    schedule = torch.optim.lr_scheduler.OneCycleLR(optimizer, rate, total_steps=steps)
    for step, (images, wanted) in enumerate(_batches(learned, draws, steps), 1):
        with torch.autocast("cpu", torch.bfloat16, enabled=HALF):
            maps = network(images)
        error = loss(maps.float(), wanted)
        optimizer.zero_grad()
        error.backward()
        optimizer.step()
        schedule.step()
        tell(step, f"loss {error.item():.2f}, best AP50 {max(best, 0):.3f}")
        if step % CHECK_EVERY == 0 or step == steps:
            score = _precision(network, kept_back)
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
    """The network as an ONNX file: `NETWORK_INPUT` (1, 13, 120, 216) in, `maps` (1, 7, 30, 54) out."""
    file, example = io.BytesIO(), (torch.zeros(1, 13, NETWORK_HEIGHT // 2, NETWORK_WIDTH // 2),)
    network.eval()
    with warnings.catch_warnings(action="ignore", category=DeprecationWarning):  # the newer way needs onnxscript, too
        torch.onnx.export(
            network,
            example,
            file,
            dynamo=False,
            input_names=[NETWORK_INPUT],
            output_names=["maps"],
            opset_version=OPSET,
        )
    network.train()
    return file.getvalue()


def read_weights(model: bytes) -> Weights:
    """Weight and bias of each convolution of an ONNX file that `to_onnx` made. Raises ValueError for another's."""
    try:
        graph = onnx.load_from_string(model).graph
    except Exception as error:  # protobuf's own, which differ by its version
        raise ValueError("is no ONNX file") from error
    values = {t.name: torch.from_numpy(onnx.numpy_helper.to_array(t).copy()) for t in graph.initializer}
    convolutions = {n.name.split("/")[-2:][0]: n.input[1:] for n in graph.node if n.op_type == "Conv"}
    found = {name: tuple(values[i] for i in inputs if i in values) for name, inputs in convolutions.items()}
    layers = _layers(Network()).items()
    expected = {name: [layer.weight.shape, layer.weight.shape[:1]] for name, layer in layers}  # weight, bias
    if {name: [part.shape for part in parts] for name, parts in found.items()} != expected:
        raise ValueError("has other layers than the network that is trained")
    return found


@torch.no_grad()
def take_over(network: Network, weights: Weights, inputs: torch.Tensor) -> None:
    """Give the network these weights: it then answers as the file did that they were read from.

    A file has each convolution and its normalization in one; they are two again by what `inputs`
    (n, 13, h / 2, w / 2) make of the convolution.
    """
    hooks = []
    for name, layer in _layers(network).items():
        weight, bias = weights[name]
        layer.weight.copy_(weight)
        if layer.bias is not None:
            layer.bias.copy_(bias)
            continue
        normalization = network.get_submodule(f"{name.rsplit('.', 1)[0]}.1")
        normalization.bias.copy_(bias)
        hooks.append(layer.register_forward_hook(partial(_normalize, normalization)))
    network.eval()
    network(inputs)
    network.train()
    for hook in hooks:
        hook.remove()


def _layers(network: Network) -> dict[str, nn.Conv2d]:
    return {name: layer for name, layer in network.named_modules() if isinstance(layer, nn.Conv2d)}


def _normalize(normalization: nn.BatchNorm2d, _layer: nn.Module, _inputs: object, output: torch.Tensor) -> None:
    """Let it make its layer's output standard, as in training, and undo that."""
    variance, mean = torch.var_mean(output, dim=(0, 2, 3), correction=0)
    normalization.running_mean.copy_(mean)
    normalization.running_var.copy_(variance)
    normalization.weight.copy_((variance + normalization.eps).sqrt())
    normalization.bias.add_(mean)


def _batches(pictures: Pictures, draws: Sequence[int], steps: int) -> Iterator[tuple[torch.Tensor, torch.Tensor]]:
    """One for each step, `AHEAD` of them made while the network learns."""
    with ThreadPoolExecutor(1) as pool:
        waiting: deque[Future[tuple[torch.Tensor, torch.Tensor]]] = deque()
        try:
            for step in range(1, steps + 1):
                waiting.append(pool.submit(_batch, pictures, np.random.default_rng([*draws, step])))
                if len(waiting) > AHEAD:
                    yield waiting.popleft().result()
            while waiting:
                yield waiting.popleft().result()
        finally:
            pool.shutdown(cancel_futures=True)


def _batch(pictures: Pictures, rng: np.random.Generator) -> tuple[torch.Tensor, torch.Tensor]:
    images, sizes, targets = zip(*(draw_patch(pictures, rng) for _ in range(BATCH)), strict=True)
    inputs = np.stack([network_input(*pair) for pair in zip(images, sizes, strict=True)])
    wanted = torch.from_numpy(np.stack([target_maps(t) for t in targets]))
    return torch.from_numpy(inputs).contiguous(memory_format=torch.channels_last), wanted


def _inputs(pictures: Pictures, which: slice) -> torch.Tensor:
    """Whole pictures as the network sees them, (n, 13, 120, 216)."""
    pairs = zip(pictures.images[which], pictures.sizes[which] * np.float32(1e-6), strict=True)
    return torch.from_numpy(np.stack([network_input(*pair) for pair in pairs]))


@torch.no_grad()
def _precision(network: Network, pictures: Pictures) -> float:
    """Average precision on whole pictures; those where too little shows are left out."""
    network.eval()
    answers = []
    for i, mask in enumerate(pictures.masks >= 128):
        if 0 < cv2.countNonZero(mask.astype(np.uint8)) < CLEAR:
            continue
        maps = network(_inputs(pictures, slice(i, i + 1)))[0].numpy()
        answers.append(Answer(decode(maps, 1.0, LEAST_SCORE), true_box(mask)))
    network.train()
    return average_precision(answers)
