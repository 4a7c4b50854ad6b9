"""The detector's network and its training, in torch; nothing but `regrasp train-detector` imports this."""

import io
import warnings
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, field
from functools import partial
from itertools import pairwise

import cv2
import numpy as np
import onnx
import onnx.numpy_helper
import torch
from torch import nn

from regrasp.app.tasks.cable.studies.detector.crops import AugmentationParameters, draw_crop, target_maps
from regrasp.app.tasks.cable.studies.detector.data import Pictures
from regrasp.app.tasks.cable.studies.detector.score import ScoredPicture, ScoreParameters, average_precision, true_box
from regrasp.perception.pose.detector import NETWORK_HEIGHT, NETWORK_INPUT, NETWORK_WIDTH, decode, network_input

OPSET = 17  # of ONNX; choice: OpenCV 5 reads it


@dataclass(frozen=True)
class NetworkParameters:
    """The size of the network."""

    channels: tuple[int, ...] = (16, 32, 64, 96)  # at strides 4 to 32; choice
    depths: tuple[int, ...] = (1, 3, 3)  # convolutions at strides 8 to 32, after the one that halves the resolution
    head_channels: int = 32  # on the way up and in the head; choice: 3.2 ms of processor time per picture in all


@dataclass(frozen=True)
class TrainingParameters:
    """How the network learns."""

    learning_rate: float = 4e-3  # at its peak; choice: usual for AdamW on a small network; not tuned
    restart_factor: float = 0.25  # of the learning rate, for a network that was trained before; choice
    weight_decay: float = 1e-4  # of AdamW; choice: usual
    batch_size: int = 32  # crops; choice: usual; not tuned
    check_every: int = 6000  # steps; choice: a check takes as long as some 300 of them
    batches_ahead: int = 3  # made while the network learns; choice
    validation_every: int = 12  # one picture of so many is kept to choose the best network; choice
    # bfloat16 takes two thirds of the time where the processor has instructions for it, and far longer elsewhere.
    # torch has no public function that tells.
    bfloat16: bool = field(default_factory=torch.cpu._is_avx512_bf16_supported)


def _convolution(inputs: int, outputs: int, stride: int = 1, kernel: int = 3) -> nn.Sequential:
    layer = nn.Conv2d(inputs, outputs, kernel, stride, kernel // 2, bias=False)
    return nn.Sequential(layer, nn.BatchNorm2d(outputs), nn.ReLU(inplace=True))


Weights = dict[str, tuple[torch.Tensor, ...]]  # of each convolution, by its name in the network: weight, bias


class Network(nn.Module):
    """From inputs (n, 13, h / 2, w / 2) of `network_input` to maps (n, 7, h / 8, w / 8) as in `decode`.

    A feature pyramid (Lin et al. 2017): down to stride 32, where a cell's receptive field is some 370 px, and up to
    stride 8 again; each level is added to the one of the same size. With finer output cells the head would take half of
    the processor time.
    """

    def __init__(self, parameters: NetworkParameters = NetworkParameters()) -> None:
        super().__init__()
        channels, head = parameters.channels, parameters.head_channels
        half = channels[0] // 2
        self.stem = nn.Sequential(_convolution(13, half, kernel=1), _convolution(half, channels[0], 2))
        self.down = nn.ModuleList(
            nn.Sequential(_convolution(a, b, 2), *(_convolution(b, b) for _ in range(depth)))
            for (a, b), depth in zip(pairwise(channels), parameters.depths, strict=True)
        )
        self.side = nn.ModuleList(_convolution(count, head, kernel=1) for count in channels[1:])
        last = nn.Conv2d(head, 7, 1)
        nn.init.constant_(last.bias[:1], -4.0)  # a likelihood of 2 % at first: few cells hold a connector
        self.head = nn.Sequential(_convolution(head, head), last)

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
    report_progress: Callable[[int, str], None] = lambda _step, _words: None,
    start: Weights | None = None,
    parameters: TrainingParameters = TrainingParameters(),
) -> None:
    """Train for so many steps, from random weights, or from `start` at a lower learning rate.

    `keep` is called with each network that is the best so far: an ONNX file, and its average precision on the
    validation pictures, which are not trained on. `report_progress` is called with the step and a text after every
    step. One thread learns, another makes the next crops. The same seed gives the same network on the same kind of
    machine.
    """
    torch.manual_seed(seed)
    torch.set_num_threads(1)
    count = len(pictures.images) - len(pictures.images) // parameters.validation_every
    training, validation = pictures.part(0, count), pictures.part(count, len(pictures.images))
    network = Network().to(memory_format=torch.channels_last)  # 1.4 times as fast on a processor
    best, rate, draws = -1.0, parameters.learning_rate, [seed]
    if start is not None:
        load_weights(network, start, _inputs(training, slice(parameters.batch_size)))
        best = _precision(network, validation)
        rate, draws = rate * parameters.restart_factor, [seed, 1]  # other crops
        keep(to_onnx(network), best)
    optimizer = torch.optim.AdamW(network.parameters(), rate, weight_decay=parameters.weight_decay)
    schedule = torch.optim.lr_scheduler.OneCycleLR(optimizer, rate, total_steps=steps)
    for step, (images, wanted) in enumerate(_batches(training, draws, steps, parameters), 1):
        with torch.autocast("cpu", torch.bfloat16, enabled=parameters.bfloat16):
            maps = network(images)
        error = loss(maps.float(), wanted)
        optimizer.zero_grad()
        error.backward()
        optimizer.step()
        schedule.step()
        report_progress(step, f"loss {error.item():.2f}, best AP50 {max(best, 0):.3f}")
        if step % parameters.check_every == 0 or step == steps:
            score = _precision(network, validation)
            if score > best:
                best = score
                keep(to_onnx(network), score)


def loss(maps: torch.Tensor, wanted: torch.Tensor) -> torch.Tensor:
    r"""The loss of CenterNet (Zhou et al. 2019), for maps (n, 7, h, w) and `target_maps` (n, 9, h, w).

    .. math:: L = -\frac{1}{N} \sum_x w_x
        \begin{cases} (1 - p_x)^2 \log p_x & t_x = 1 \\ (1 - t_x)^4 p_x^2 \log (1 - p_x) & t_x < 1 \end{cases}
        + \frac{\sum_x v_x \lVert y_x - \hat y_x \rVert_1}{\sum_x v_x}

    over cells x: a focal loss of the likelihood p against its target t, weighted by map 8 (w), N the number of
    connectors; and the absolute errors of the six other maps y, weighted by map 7 (v).
    """
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
    """Weight and bias of each convolution of an ONNX file that `to_onnx` made.

    Raises:
        ValueError: no ONNX file, or one of another network.
    """
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
def load_weights(network: Network, weights: Weights, inputs: torch.Tensor) -> None:
    """Give the network these weights; it then gives the same maps as the file from which they were read.

    A file holds each convolution and its batch normalization fused into one. They are split again: the normalization
    gets the mean and variance of the convolution's output for `inputs` (n, 13, h / 2, w / 2), and scale and bias that
    undo it.
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
    """Set the statistics to those of the layer's output, and scale and bias so that the output stays the same."""
    variance, mean = torch.var_mean(output, dim=(0, 2, 3), correction=0)
    normalization.running_mean.copy_(mean)
    normalization.running_var.copy_(variance)
    normalization.weight.copy_((variance + normalization.eps).sqrt())
    normalization.bias.add_(mean)


def _batches(
    pictures: Pictures, draws: Sequence[int], steps: int, parameters: TrainingParameters
) -> Iterator[tuple[torch.Tensor, torch.Tensor]]:
    """Inputs and target maps for each step; the next few are made while the network learns."""
    with ThreadPoolExecutor(1) as pool:
        waiting: deque[Future[tuple[torch.Tensor, torch.Tensor]]] = deque()
        try:
            for step in range(1, steps + 1):
                waiting.append(
                    pool.submit(_batch, pictures, np.random.default_rng([*draws, step]), parameters.batch_size)
                )
                if len(waiting) > parameters.batches_ahead:
                    yield waiting.popleft().result()
            while waiting:
                yield waiting.popleft().result()
        finally:
            pool.shutdown(cancel_futures=True)


def _batch(pictures: Pictures, rng: np.random.Generator, count: int) -> tuple[torch.Tensor, torch.Tensor]:
    images, sizes, targets = zip(*(draw_crop(pictures, rng) for _ in range(count)), strict=True)
    inputs = np.stack([network_input(*pair) for pair in zip(images, sizes, strict=True)])
    wanted = torch.from_numpy(np.stack([target_maps(t) for t in targets]))
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
