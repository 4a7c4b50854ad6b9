import fcntl
import os
import pty
import select
import struct
import subprocess
import sys
import termios
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import pytest
from rich.console import Console
from toy_record import write_record
from typer.testing import CliRunner

from app.cli import app
from app.findings import Findings
from app.record_reader import read_record
from app.replay import Replay
from app.replay_screen import View, draw, pressed


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return write_record(tmp_path / "run")


@pytest.fixture
def replay(folder: Path) -> Replay:
    return Replay(read_record(folder))


GRASP = "root/mission/tries/one/try/grasp"


def test_every_node_has_its_status_at_every_tick(replay: Replay) -> None:
    assert [frame.t for frame in replay.frames] == [0.0, 0.5, 1.0, 1.5]
    assert [replay.status(GRASP, i) for i in range(4)] == ["RUNNING", "FAILURE", "FAILURE", "INVALID"]
    assert [replay.status("root/never", i) for i in range(4)] == ["INVALID"] * 3 + ["FAILURE"]
    assert [row.path for row in replay.rows][:4] == [
        "root",
        "root/mission",
        "root/mission/start",
        "root/mission/tries",
    ]


def test_seconds_lead_to_the_tick_before(replay: Replay) -> None:
    assert [replay.at(t) for t in (-1.0, 0.0, 0.7, 1.0, 99.0)] == [0, 0, 1, 2, 3]


def test_without_the_tree_the_ticks_name_the_nodes(folder: Path) -> None:
    (folder / "tree.xml").unlink()
    assert [row.path for row in Replay(read_record(folder)).rows][:2] == ["root", "root/mission"]


def test_a_broken_tree_is_a_finding(folder: Path) -> None:
    (folder / "tree.xml").write_text("<root")
    with pytest.raises(Findings, match=r"tree\.xml:1: malformed XML"):
        Replay(read_record(folder))


def test_in_a_pipe_it_prints_lines(folder: Path) -> None:
    ran = CliRunner().invoke(app, ["replay", str(folder), "--from", "0.5", "--to", "1", "--filter", "grasp"])
    assert ran.stdout.splitlines() == [
        f"    0.50  {GRASP}  FAILURE",
        f"    0.50  {GRASP}  slip: by=gap, value=0.0443",
    ]
    assert len(CliRunner().invoke(app, ["replay", str(folder)]).stdout.splitlines()) > 15


def press(replay: Replay, view: View, *keys: str) -> View | None:
    for key in keys:
        if (after := pressed(replay, view, key)) is None:
            return None
        view = after
    return view


@pytest.mark.parametrize(
    ("keys", "expected"),
    [
        (["forward"], View(1)),
        (["forward", " ", "l", "forward", "forward"], View(3)),  # stays at the last
        (["end", "back"], View(2)),
        (["back"], View(0)),
        (["page forward"], View(3)),
        (["end", "home"], View(0)),
        (["n"], View(1)),
        (["n", "n"], View(2)),
        (["end", "n"], View(3, note="no failure after this")),
        (["end", "n", ""], View(3, note="no failure after this")),  # no key: nothing changes
        (["g", *"1.2", "enter"], View(2)),
        (["g", *"x", "enter"], View(0, note="'x' is no number of seconds")),
        (["g", *"nan", "enter"], View(0, note="'nan' is no number of seconds")),
        (["g", *"1", "escape"], View(0)),
        (["/", *"neverr", "delete", "enter", "n"], View(3, part="never")),
        (["/", "q"], View(0, prompt="/", typed="q")),
        (["q"], None),
        (["?"], View(0)),
    ],
)
def test_keys(replay: Replay, keys: list[str], expected: View | None) -> None:
    assert press(replay, View(), *keys) == expected


def drawn(replay: Replay, view: View, width: int = 80, height: int = 24) -> list[str]:
    console = Console(width=width, height=height, color_system=None, markup=False)
    with console.capture() as capture:
        console.print(draw(replay, view, width, height))
    return [line.rstrip() for line in capture.get().splitlines()]


def test_the_screen_shows_tree_changes_and_events(replay: Replay) -> None:
    assert drawn(replay, View(1)) == [
        "    0.50 s   tick 2 of 4",
        "  root                                 RUNNING   Fallback",
        "    mission                            RUNNING   Sequence",
        "      start                            SUCCESS   Look",
        "      tries                            RUNNING   Retry",
        "*       try                            FAILURE   Sequence",
        "          held                         SUCCESS   Look",
        "*         grasp                        FAILURE   Grasp",
        "    stop                               INVALID   Stop",
        "    never                              INVALID   Stop",
        "grasp  slip: by=gap, value=0.0443",
        "right/left step  PgDn/PgUp 10  Home/End  n next failure  g go to a time  / filt…",
    ]


@pytest.mark.parametrize(("width", "height"), [(80, 24), (40, 8), (20, 4), (4, 2)])
def test_the_screen_fits_and_holds_what_changed(replay: Replay, width: int, height: int) -> None:
    for index in range(4):
        lines = drawn(replay, View(index), width, height)
        assert len(lines) <= max(height, 4)
        assert max(map(len, lines)) <= width
        assert any(line.startswith("*") for line in lines)


def test_a_filter_leaves_whole_paths(replay: Replay) -> None:
    lines = drawn(replay, replace(View(1), part="grasp"))
    assert lines[0].endswith("only paths with 'grasp'")
    assert lines[1].startswith(f"* {GRASP} ")


Type = Callable[[bytes, bytes], bytes]  # sends keys and reads until a text shows


@pytest.fixture
def terminal(folder: Path) -> Iterator[tuple[subprocess.Popen[bytes], Type, int]]:
    """`regrasp replay` on a pseudo-terminal of 80 by 24."""
    ours, theirs = pty.openpty()
    fcntl.ioctl(theirs, termios.TIOCSWINSZ, struct.pack("HHHH", 24, 80, 0, 0))
    command = [sys.executable, "-m", "app", "replay", str(folder)]
    env = os.environ | {"TERM": "xterm-256color"}
    env = {name: value for name, value in env.items() if name not in ("COLUMNS", "LINES", "NO_COLOR")}
    process = subprocess.Popen(command, stdin=theirs, stdout=theirs, stderr=theirs, env=env, start_new_session=True)

    def type_(keys: bytes, until: bytes) -> bytes:
        os.write(ours, keys)
        seen = b""
        while until not in seen:
            assert select.select([ours], [], [], 60)[0], f"{until!r} never came after {keys!r}: {seen!r}"
            seen += os.read(ours, 65536)
        return seen

    yield process, type_, theirs
    process.kill()
    process.wait()
    os.close(ours)
    os.close(theirs)


@pytest.mark.parametrize("leave", [b"q", b"SIGTERM", b"SIGINT"])
def test_on_a_terminal_keys_step_and_the_terminal_is_restored(
    terminal: tuple[subprocess.Popen[bytes], Type, int], leave: bytes
) -> None:
    process, type_, theirs = terminal
    before = termios.tcgetattr(theirs)
    first = type_(b"", b"tick 1 of 4")
    assert b"\x1b[?1049h" in first  # the alternate screen
    type_(b"\x1b[C", b"tick 2 of 4")
    type_(b"\x1b[F", b"tick 4 of 4")
    type_(b"g0.5\r", b"tick 2 of 4")
    type_(b"n", b"tick 3 of 4")
    assert not termios.tcgetattr(theirs)[3] & termios.ICANON
    if leave == b"q":
        type_(b"q", b"\x1b[?1049l")
    else:
        process.send_signal({b"SIGTERM": 15, b"SIGINT": 2}[leave])
        type_(b"", b"\x1b[?1049l")
    assert process.wait(60) == (0 if leave == b"q" else 130)
    assert termios.tcgetattr(theirs) == before
