"""The command as a shell runs it, with standard streams that are closed, poor, or without a reader."""

import contextlib
import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import IO

import pytest
from toy_record import write_record

from regrasp.app.cli.progress import shown_progress

ROOT = Path(__file__).parents[2]
COMMANDS = [
    "--help",
    "doctor",
    "explain run",
    "replay run",
    "scenarios list",
    "scenarios schema --task cable",
    "scenarios show short_obstacle",
    "trees check recovery",
    "trees export recovery --format svg",
    "trees leaves",
    "trees show recovery",
]


@pytest.fixture(autouse=True)
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A folder with a run in it."""
    write_record(tmp_path / "run")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("PYTHONPATH", str(ROOT))


def shell(line: str, stdout: IO[str] | None = None) -> subprocess.CompletedProcess[str]:
    """Run a line of sh, in which the command `regrasp` is ours."""
    ours = f'regrasp() {{ "{sys.executable}" -m regrasp "$@"; }}; {line}'
    return subprocess.run(["sh", "-c", ours], stdout=stdout, stderr=subprocess.PIPE, text=True, timeout=120)


@pytest.fixture
def no_reader() -> Iterator[IO[str]]:
    """The writing end of a pipe that nobody reads."""
    reader, writer = os.pipe()
    os.close(reader)
    with contextlib.suppress(BrokenPipeError), open(writer, "w") as stream:
        yield stream


@pytest.mark.parametrize("command", COMMANDS)
def test_without_a_reader_it_ends_quietly(command: str, no_reader: IO[str]) -> None:
    told = shell(f"regrasp {command}", stdout=no_reader)
    assert (told.returncode, told.stderr) == (141, "")


@pytest.mark.parametrize("command", ["trees show recovery", "replay run", "--version"])
def test_without_standard_output_it_says_so(command: str) -> None:
    told = shell(f"regrasp {command} >&-")
    assert (told.returncode, told.stderr) == (2, "standard output is closed; open it, or write > /dev/null\n")
    assert shell(f"regrasp {command} <&- >&- 2>&-").returncode == 2


@pytest.mark.parametrize("command", ["trees show recovery", "replay run"])
def test_standard_input_and_errors_are_not_needed(command: str) -> None:
    usual = shell(f"regrasp {command} > usual")
    closed = shell(f"regrasp {command} <&- 2>&- > closed")
    assert (usual.returncode, usual.stderr) == (closed.returncode, closed.stderr) == (0, "")
    assert Path("closed").read_bytes() == Path("usual").read_bytes() != b""


def test_what_is_only_written_at_the_end_finds_no_reader_either(no_reader: IO[str]) -> None:
    program = (
        "import regrasp.app.cli.commands as c, regrasp.app.__main__ as m; c.app = lambda: print('a table'); m.main()"
    )
    told = shell(f'"{sys.executable}" -c "{program}"', stdout=no_reader)
    assert (told.returncode, told.stderr) == (141, "")


def test_a_run_that_nobody_watches_ends_as_by_ctrl_c(monkeypatch: pytest.MonkeyPatch, no_reader: IO[str]) -> None:
    monkeypatch.setattr("sys.stderr", no_reader)
    with shown_progress(quiet=False) as observers, pytest.raises(KeyboardInterrupt):
        observers.tick(0.0, "carry")


def test_an_encoding_without_a_sign_shows_a_question_mark() -> None:
    told = shell("PYTHONIOENCODING=latin-1 regrasp trees show recovery > told")
    assert (told.returncode, told.stderr) == (0, "")
    assert Path("told").read_text(encoding="latin-1").splitlines()[-1] == "?? safe_stop  SafeStop"


def test_a_technique_that_no_cell_has_is_a_finding_without_a_cell(tmp_path: Path) -> None:
    leaf = '<UseTechnique name="look" technique="fuzed"/>'
    tree = f'<root main_tree_to_execute="m"><BehaviorTree ID="m">{leaf}</BehaviorTree></root>'
    (tmp_path / "tree.xml").write_text(tree)
    assert "technique='fuzed' is unknown; did you mean 'fused'?" in shell("regrasp trees check tree.xml").stderr
    (tmp_path / "tree.xml").write_text(tree.replace("fuzed", "fiducial"))
    assert shell("regrasp trees check tree.xml").returncode == 0


def test_a_script_beside_the_checkout_imports_it() -> None:
    """There a folder named regrasp, the checkout, must not hide the package."""
    program = "import regrasp; print(regrasp.run.__name__)"
    told = subprocess.run([sys.executable, "-c", program], cwd=ROOT.parent, capture_output=True, text=True)
    assert (told.stdout, told.stderr) == ("run\n", "")
