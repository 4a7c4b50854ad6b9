"""The detectors' network in torch: a CenterNet (Zhou et al. 2019). Nothing but their training imports this."""

import io
import warnings
from dataclasses import dataclass
from functools import partial
from itertools import pairwise

import onnx
import onnx.numpy_helper
import torch
from torch import nn

OPSET = 17  # of ONNX; choice: OpenCV 5 reads it


@dataclass(frozen=True)
class NetworkParameters:
    """The format and the size of a network. The first three are what its file's name of input and output stand for."""

    inputs: int  # channels of its picture, which has a quarter of the pixels; 12 for red, green, blue of four
    classes: int = 1
    values: int = 4  # maps of each class besides its likelihood; the first four tell a box, see `peaks`
    channels: tuple[int, ...] = (16, 32, 64, 96)  # at strides 4 to 32; choice
    depths: tuple[int, ...] = (1, 3, 3)  # convolutions at strides 8 to 32, after the one that halves the resolution
    head_channels: int = 32  # on the way up and in the head; choice: 3.2 ms of processor time per picture in all


def _convolution(inputs: int, outputs: int, stride: int = 1, kernel: int = 3) -> nn.Sequential:
    layer = nn.Conv2d(inputs, outputs, kernel, stride, kernel // 2, bias=False)
    return nn.Sequential(layer, nn.BatchNorm2d(outputs), nn.ReLU(inplace=True))


Weights = dict[str, tuple[torch.Tensor, ...]]  # of each convolution, by its name in the network: weight, bias


class Network(nn.Module):
    """From inputs (n, channels, h / 2, w / 2) to maps (n, classes * (1 + values), h / 8, w / 8).

    The first maps are the classes' likelihoods, then follow the values of the first class, and so on.

    A feature pyramid (Lin et al. 2017): down to stride 32, where a cell's receptive field is some 370 px, and up to
    stride 8 again; each level is added to the one of the same size. With finer output cells the head would take half of
    the processor time.
    """

    def __init__(self, parameters: NetworkParameters) -> None:
        super().__init__()
        self.form = parameters
        channels, head = parameters.channels, parameters.head_channels
        half = channels[0] // 2
        self.stem = nn.Sequential(_convolution(parameters.inputs, half, kernel=1), _convolution(half, channels[0], 2))
        self.down = nn.ModuleList(
            nn.Sequential(_convolution(a, b, 2), *(_convolution(b, b) for _ in range(depth)))
            for (a, b), depth in zip(pairwise(channels), parameters.depths, strict=True)
        )
        self.side = nn.ModuleList(_convolution(count, head, kernel=1) for count in channels[1:])
        last = nn.Conv2d(head, parameters.classes * (1 + parameters.values), 1)
        nn.init.constant_(last.bias[: parameters.classes], -4.0)  # likely by 2 % at first: few cells hold a thing
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
        classes = self.form.classes
        return torch.cat([out[:, :classes].sigmoid(), out[:, classes:]], dim=1)


def to_onnx(network: Network, name: str, shape: tuple[int, int]) -> bytes:
    """The network as an ONNX file for pictures of `shape` (h, w) px: input `name`, output `maps`."""
    file, example = io.BytesIO(), (torch.zeros(1, network.form.inputs, shape[0] // 2, shape[1] // 2),)
    network.eval()
    with warnings.catch_warnings(action="ignore", category=DeprecationWarning):  # the newer way needs onnxscript, too
        torch.onnx.export(
            network,
            example,
            file,
            dynamo=False,
            input_names=[name],
            output_names=["maps"],
            opset_version=OPSET,
        )
    network.train()
    return file.getvalue()


def read_weights(model: bytes, parameters: NetworkParameters) -> Weights:
    """Weight and bias of each convolution of an ONNX file that `to_onnx` made of a network with these parameters.

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
    layers = _layers(Network(parameters)).items()
    expected = {name: [layer.weight.shape, layer.weight.shape[:1]] for name, layer in layers}  # weight, bias
    if {name: [part.shape for part in parts] for name, parts in found.items()} != expected:
        raise ValueError("has other layers than the network that is trained")
    return found


@torch.no_grad()
def load_weights(network: Network, weights: Weights, inputs: torch.Tensor) -> None:
    """Give the network these weights; it then gives the same maps as the file from which they were read.

    A file holds each convolution and its batch normalization fused into one. They are split again: the normalization
    gets the mean and variance of the convolution's output for `inputs` (n, channels, h / 2, w / 2), and scale and
    bias that undo it.
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
