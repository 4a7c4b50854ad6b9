"""Every text format of a tree that uses every feature, as it is and with a run. A missing golden file is written."""

from pathlib import Path

import pytest
from toy_leaves import LEAVES

import trees
from trees import Node, check_tree, read_graph, recorded, run_stats
from trees.export import FORMATS, export_tree

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
CHAIN = {"root", "root/carry", "root/carry/twice", "root/carry/twice/move"}


def features() -> Node:
    return read_graph(FEATURES, LEAVES)


def features_with_run() -> Node:
    return recorded(features(), run_stats(RUN), CHAIN)


def compare(name: str, content: bytes) -> None:
    path = GOLDEN / name
    if not path.exists():
        path.write_bytes(content)
        pytest.fail(f"{path} was missing and is written: look at it, and keep it if it is right")
    assert content.decode() == path.read_text(encoding="utf-8")


def test_every_text_format_has_a_golden_file() -> None:
    assert check_tree(FEATURES, LEAVES) == []
    assert set(ENDINGS) == set(FORMATS) - {"png"}


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
