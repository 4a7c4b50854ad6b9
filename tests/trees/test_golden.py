"""Every format of a tree that uses every feature, as it is and with a run. A missing golden file is written."""

from pathlib import Path

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray
from toy_leaves import LEAVES

from regrasp import trees
from regrasp.trees import Node, check_tree, collapsed, read_graph, recorded, run_stats
from regrasp.trees.export import FORMATS, export_tree

GOLDEN = Path(__file__).parent / "golden"
FEATURES = GOLDEN / "features.xml"
ENDINGS = {"ascii": "txt", "dot": "dot", "groot": "groot.xml", "json": "json", "mermaid": "mmd", "svg": "svg"}
RUN = [  # the search succeeds at its second try, then carrying fails
    (0.05, "root", "RUNNING"),
    (0.05, "root/search/retry", "RUNNING"),
    (0.05, "root/search/retry/either", "FAILURE"),
    (0.05, "root/search/retry/either/not_yet", "FAILURE"),
    (0.05, "root/search/retry/either/not_yet/seen", "SUCCESS"),
    (0.05, "root/search/retry/either/look_about", "FAILURE"),
    (0.05, "root/search/retry/either/look_about/look", "FAILURE"),
    (0.1, "root/search/retry", "SUCCESS"),
    (0.1, "root/search/retry/either", "SUCCESS"),
    (0.1, "root/search/retry/either/look_about", "SUCCESS"),
    (0.1, "root/search/retry/either/look_about/look", "SUCCESS"),
    (0.1, "root/carry", "RUNNING"),
    (0.1, "root/carry/watch", "RUNNING"),
    (0.1, "root/carry/twice", "RUNNING"),
    (0.1, "root/carry/twice/move", "RUNNING"),
    (3.2, "root", "FAILURE"),
    (3.2, "root/carry", "FAILURE"),
    (3.2, "root/carry/watch", "INVALID"),
    (3.2, "root/carry/twice", "FAILURE"),
    (3.2, "root/carry/twice/move", "FAILURE"),
]
# Builds smooth the edges of letters and lines in their own ways; a stroke that is missing makes more than 40.
SMUDGE, MOST_DIFFERENCE = 9, 30  # px, grey levels
CHAIN = {"root", "root/carry", "root/carry/twice", "root/carry/twice/move"}


def features() -> Node:
    return read_graph(FEATURES, LEAVES)


def features_with_run() -> Node:
    return recorded(features(), run_stats(RUN), CHAIN)


def golden(name: str, content: bytes) -> bytes:
    path = GOLDEN / name
    if not path.exists():
        path.write_bytes(content)
        pytest.fail(f"{path} was missing and is written: look at it, and keep it if it is right")
    return path.read_bytes()


def compare(name: str, content: bytes) -> None:
    assert content.decode() == golden(name, content).decode()


def pixels(png: bytes) -> NDArray[np.uint8]:
    image = cv2.imdecode(np.frombuffer(png, np.uint8), cv2.IMREAD_COLOR)
    assert image is not None
    return np.asarray(image, np.uint8)


def test_every_format_has_a_golden_file() -> None:
    assert check_tree(FEATURES, LEAVES) == []
    assert {*ENDINGS, "png"} == set(FORMATS)


@pytest.mark.parametrize("form", ENDINGS)
def test_a_tree_with_every_feature(form: str) -> None:
    compare(f"features.{ENDINGS[form]}", export_tree(features(), form))


@pytest.mark.parametrize("form", ENDINGS)
def test_a_run_of_it(form: str) -> None:
    compare(f"features_run.{ENDINGS[form]}", export_tree(features_with_run(), form, "dark"))


@pytest.mark.parametrize("form", ["ascii", "mermaid"])
def test_the_shipped_recovery_tree(form: str) -> None:
    tree = read_graph(Path(trees.__file__).with_name("recovery.xml"))
    compare(f"recovery.{ENDINGS[form]}", export_tree(tree, form))


def test_a_picture_of_a_run_with_closed_subtrees_whatever_the_build_of_opencv() -> None:
    content = export_tree(collapsed(features_with_run(), 0), "png", "dark")
    ours, right = pixels(content), pixels(golden("features_run_closed.png", content))
    assert ours.shape == right.shape
    difference = cv2.blur(cv2.absdiff(ours, right), (SMUDGE, SMUDGE))
    assert difference.max() < MOST_DIFFERENCE
