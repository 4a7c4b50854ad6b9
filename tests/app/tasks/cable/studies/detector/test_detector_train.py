import json
from functools import partial
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from typer.testing import CliRunner

from regrasp.app.cli.commands import app
from regrasp.perception.pose.detector import shipped_network

torch = pytest.importorskip("torch", reason="the extra train is missing")
onnx = pytest.importorskip("onnx", reason="the extra train is missing")

SIZES = ("--pictures", "24", "--steps", "2", "--held-out", "1")


def train(out: Path, *more: str) -> Any:
    return CliRunner().invoke(app, ["train-detector", "--out", str(out), *SIZES, *more])


def test_a_tiny_training_leaves_a_network_and_its_figures_and_the_seed_decides(tmp_path: Path) -> None:
    first, again = tmp_path / "first", tmp_path / "again"
    results = [train(out) for out in (first, again)]
    assert [r.exit_code for r in results] == [0, 0], results[0].output
    assert "AP50" in results[0].output
    figures = json.loads((first / "evaluation.json").read_text())
    assert figures["recall"][1] == 4
    assert 1000 < (first / "detector.onnx").stat().st_size < 2 * 1024 * 1024
    assert (first / "detector.onnx").read_bytes() == (again / "detector.onnx").read_bytes()
    assert (first / "evaluation.json").read_bytes() == (again / "evaluation.json").read_bytes()


def test_another_training_goes_on_from_a_network(tmp_path: Path) -> None:
    from regrasp.app.studies.detector.network import Network, load_weights, read_weights
    from regrasp.app.tasks.cable.studies.detector.train import NETWORK, onnx_file

    model = shipped_network()
    network = Network(NETWORK)
    inputs = np.random.default_rng(0).random((4, 13, 120, 216), np.float32)
    load_weights(network, read_weights(model, NETWORK), torch.from_numpy(inputs))
    answers = []
    for file in (model, onnx_file(network)):
        net = cv2.dnn.readNetFromONNX(np.frombuffer(file, np.uint8))
        net.setInput(inputs[:1])
        answers.append(net.forward())
    np.testing.assert_allclose(answers[0], answers[1], atol=1e-3)
    (tmp_path / "shipped.onnx").write_bytes(model)
    result = train(tmp_path / "better", "--start", str(tmp_path / "shipped.onnx"))
    assert result.exit_code == 0, result.output
    assert (tmp_path / "better" / "detector.onnx").exists()


def another_network(name: str) -> bytes:
    """An ONNX file of one convolution; its weights are no initializer, but a constant's output."""
    weights = onnx.numpy_helper.from_array(np.zeros((8, 13, 1, 1), np.float32))
    constant = onnx.helper.make_node("Constant", [], ["w"], value=weights)
    convolution = onnx.helper.make_node("Conv", ["x", "w"], ["y"], name=name)
    sizes = {"x": (1, 13, 4, 4), "y": (1, 8, 4, 4)}
    x, y = (onnx.helper.make_tensor_value_info(n, onnx.TensorProto.FLOAT, size) for n, size in sizes.items())
    graph = onnx.helper.make_graph([constant, convolution], "other", [x], [y])
    return bytes(onnx.helper.make_model(graph).SerializeToString())


NAMED, UNNAMED = another_network("/stem/stem.0/stem.0.0/Conv"), another_network("")


@pytest.mark.parametrize("content", [b"", b"no network", b"\x08\x08", NAMED, UNNAMED])
def test_what_is_no_network_of_ours_is_no_start(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "other.onnx").write_bytes(content)
    result = train(tmp_path / "out", "--start", str(tmp_path / "other.onnx"))
    assert (result.exit_code, (tmp_path / "out").exists()) == (2, False)
    assert "name one that `train-detector` made" in result.stderr


def test_ctrl_c_keeps_the_best_so_far(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from regrasp.app.studies.detector.training import TrainingParameters
    from regrasp.app.tasks.cable.studies.detector import train as detector_train

    batch = detector_train._batch
    drawn: list[int] = []

    def interrupted(*args: Any) -> Any:
        if drawn:
            raise KeyboardInterrupt
        drawn.append(1)
        return batch(*args)

    every_step = partial(detector_train.train, parameters=TrainingParameters(check_every=1))
    monkeypatch.setattr(detector_train, "train", every_step)
    monkeypatch.setattr(detector_train, "_batch", interrupted)
    assert train(tmp_path / "out").exit_code == 130
    assert [f.name for f in (tmp_path / "out").iterdir()] == ["detector.onnx"]


def test_opencv_computes_what_torch_does() -> None:
    from regrasp.app.studies.detector.network import Network
    from regrasp.app.tasks.cable.studies.detector.train import NETWORK, onnx_file

    torch.manual_seed(1)
    network = Network(NETWORK)
    image = np.random.default_rng(0).random((1, 13, 120, 216), np.float32)
    with torch.no_grad():
        network(torch.from_numpy(image))  # fills the running means
        expected = network.eval()(torch.from_numpy(image)).numpy()
    net = cv2.dnn.readNetFromONNX(np.frombuffer(onnx_file(network), np.uint8))
    net.setInput(image)
    assert np.abs(net.forward() - expected).max() < 1e-5
    assert expected.std(axis=(2, 3)).min() > 1e-5  # the picture matters
