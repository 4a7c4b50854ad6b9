from pathlib import Path
from typing import Any
from xml.etree import ElementTree as ET

import pytest
from toy_record import kill, write_record
from typer.testing import CliRunner

from regrasp.app.cli.commands import app
from regrasp.trees.export import FORMATS


def export(*args: str) -> Any:
    return CliRunner().invoke(app, ["trees", "export", *args])


@pytest.fixture(autouse=True)
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize("form", FORMATS)
def test_every_format_comes_out_on_standard_output(form: str) -> None:
    told = export("recovery", "--format", form)
    assert told.exit_code == 0
    assert len(told.stdout_bytes) > 500


def test_a_file_s_ending_says_the_format_and_nothing_else_is_left(here: Path) -> None:
    assert export("recovery", "-o", "tree.svg", "--theme", "dark").exit_code == 0
    assert ET.parse("tree.svg").getroot().tag.endswith("svg")
    assert export("recovery", "-o", "tree.svg", "--format", "svg").stdout == ""
    assert export("recovery", "-o", "tree.md", "--format", "mermaid").exit_code == 0
    assert (here / "tree.md").read_text(encoding="utf-8").startswith("flowchart")
    assert sorted(path.name for path in here.iterdir()) == ["tree.md", "tree.svg"]


def test_a_dash_is_standard_output(here: Path) -> None:
    told = export("recovery", "-o", "-", "--format", "svg")
    assert told.stdout_bytes == export("recovery", "--format", "svg").stdout_bytes != b""
    assert export("recovery", "-o", "-").stdout == export("recovery").stdout
    assert not [*here.iterdir()]


def test_without_a_format_it_is_what_show_draws() -> None:
    assert export("recovery").stdout == CliRunner().invoke(app, ["trees", "show", "recovery"]).stdout


def test_depth_says_how_deep_subtrees_are_open() -> None:
    lines = export("recovery", "--depth", "0").stdout.splitlines()
    assert [line for line in lines if "SubTree" in line] == [
        "│        │  └─ recovery  SubTree Recover  +8 nodes",
        "│        └─ delivery  SubTree Deliver  +11 nodes",
    ]
    assert export("recovery", "--depth", "1").stdout == export("recovery").stdout


WRONG = {
    "nothing named": ([], "TREE: is missing"),
    "unknown tree": (["recovry"], "recovry: no tree named 'recovry'; did you mean 'recovery'?"),
    "unknown format": (["recovery", "--format", "svgg"], "--format: no format 'svgg'; did you mean 'svg'?"),
    "unknown ending": (["recovery", "-o", "x.gif"], "x.gif: the name ends in none of .txt"),
    "two formats": (["recovery", "-o", "x.svg", "--format", "png"], "x.svg: is a name of svg, not of png; write"),
    "unknown theme": (["recovery", "--theme", "drak"], "--theme: no theme 'drak'; did you mean 'dark'?"),
    "no folder": (["recovery", "-o", "no/x.svg"], "no/x.svg: there is no folder 'no'"),
    "a folder": (["recovery", "-o", ".", "--format", "svg"], ": is a folder"),
    "half a tree for Groot": (["recovery", "--format", "groot", "--depth", "1"], "--depth: Groot2 opens whole trees"),
    "no run": (["recovery", "--run", "none"], "none: does not exist"),
}


@pytest.mark.parametrize(("args", "told"), WRONG.values(), ids=WRONG.keys())
def test_bad_input_is_told_in_one_line(args: list[str], told: str) -> None:
    result = export(*args)
    assert result.exit_code == 2
    assert told in result.stderr
    assert len(result.stderr.splitlines()) == 1


def test_a_tree_is_not_written_over_itself(here: Path) -> None:
    text = '<root main_tree_to_execute="M"><BehaviorTree ID="M"><Holding name="h"/></BehaviorTree></root>'
    (here / "mine.xml").write_text(text)
    told = export("mine.xml", "-o", "mine.xml")
    assert (told.exit_code, (here / "mine.xml").read_text()) == (2, text)
    assert "mine.xml: is the tree itself" in told.stderr


def test_a_run_shows_its_own_tree_with_what_happened_and_the_path_that_failed(here: Path) -> None:
    write_record(here / "run")
    lines = export("--run", "run").stdout.splitlines()
    assert lines[0] == "root  Fallback with memory  [1 visit, 1 failed, 1.50 s]  FAILED"
    grasp = next(line for line in lines if " grasp " in line)
    # It failed in two ticks on end: two tries, as `explain` tells.
    assert grasp.endswith("grasp  Grasp  [2 visits, 2 failed, 0.50 s]  FAILED")
    held = next(line for line in lines if " held " in line)
    assert not held.endswith("FAILED")


def test_a_killed_run_and_one_without_a_copy_of_its_tree(here: Path) -> None:
    kill(write_record(here / "run"))
    assert "FAILED" not in export("--run", "run").stdout
    (here / "run" / "tree.xml").unlink()
    told = export("--run", "run")
    assert told.exit_code == 2
    assert told.stderr.startswith("run/tree.xml: is missing; name the tree that ran: ")


def test_a_run_of_another_tree_is_told_with_the_first_nodes_that_are_missing(here: Path) -> None:
    write_record(here / "run")
    told = export("recovery", "--run", "run")
    assert told.exit_code == 2
    assert told.stderr.startswith("run/ticks.jsonl:1: ")
    assert told.stderr.endswith(
        "recovery.xml is not the tree that ran: it has no 'root', 'root/mission', 'root/mission/start' "
        "and 6 more nodes; name that tree, or leave TREE out\n"
    )


@pytest.mark.parametrize("text", ["", "<root", "<root/>", "\x00", '<root main_tree_to_execute="M"/>'])
@pytest.mark.parametrize("form", ["ascii", "groot"])
def test_a_broken_copy_of_a_tree_is_told_in_one_line(here: Path, text: str, form: str) -> None:
    write_record(here / "run")
    (here / "run" / "tree.xml").write_text(text)
    told = export("--run", "run", "--format", form)
    assert told.exit_code == 2
    assert told.stderr.startswith("run/tree.xml:")


def test_trees_that_include_one_another_end_in_words(here: Path) -> None:
    write_record(here / "run")
    text = (here / "run" / "tree.xml").read_text()
    (here / "run" / "tree.xml").write_text(text.replace('<Look name="held"/>', '<SubTree ID="Main" name="again"/>'))
    for form in FORMATS:
        told = export("--run", "run", "--format", form)
        assert told.exit_code in (0, 2)
        assert told.exception is None or isinstance(told.exception, SystemExit)
