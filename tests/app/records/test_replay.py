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

from regrasp.app.cli.commands import app
from regrasp.app.cli.replay_screen import View, draw, pressed
from regrasp.app.files.findings import Findings
from regrasp.app.records.reader import Tick, read_record
from regrasp.app.records.replay import Replay
from regrasp.app.records.result import NodeStatus


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return write_record(tmp_path / "run")


@pytest.fixture
def replay(folder: Path) -> Replay:
    return Replay(read_record(folder))


GRASP = "root/mission/tries/one/try/grasp"


def test_every_node_has_its_status_at_every_tick(replay: Replay) -> None:
    assert [change.t for change in replay.changes] == [0.0, 0.5, 1.0, 1.5]
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
        f"    1.00  {GRASP}  FAILURE",
    ]
    assert len(CliRunner().invoke(app, ["replay", str(folder)]).stdout.splitlines()) > 15


def test_the_screen_ends_where_it_is_told(folder: Path) -> None:
    record = read_record(folder)
    assert [change.t for change in Replay(record, 1.0).changes] == [0.0, 0.5, 1.0]
    assert [change.t for change in Replay(record, 0.2).changes] == [0.0]


WRONG = {
    "no number": (["--from", "nan"], "--from: nan is no second of a run; write a number such as 8.5"),
    "no end": (["--to", "inf"], "--to: inf is no second of a run; write a number such as 8.5"),
    "before the beginning": (["--from=-1"], "--from: -1 is no second of a run; write a number such as 8.5"),
    "end first": (["--from", "30", "--to", "20"], "--to: 20 s is before --from, 30 s; name a later second"),
    "too late": (["--from", "99"], "--from: 99 s is after the last change, at 1.50 s; name an earlier second"),
    "no such node": (["--filter", "grsp"], "--filter: no node has 'grsp' in its path; did you mean 'grasp'?"),
}


@pytest.mark.parametrize(("args", "told"), WRONG.values(), ids=WRONG.keys())
def test_what_shows_nothing_is_told_in_one_line(folder: Path, args: list[str], told: str) -> None:
    ran = CliRunner().invoke(app, ["replay", str(folder), *args])
    assert (ran.exit_code, ran.stdout, ran.stderr) == (2, "", told + "\n")


def test_an_end_like_the_one_before_is_no_change(folder: Path) -> None:
    lines = [f'{{"t": {t}, "path": "root", "status": "{s}"}}\n' for t, s in ((0.0, "SUCCESS"), (1.0, "SUCCESS"))]
    (folder / "ticks.jsonl").write_text("".join(lines))
    (folder / "events.jsonl").write_text("")
    assert [change.t for change in Replay(read_record(folder)).changes] == [0.0]


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
        (["/", *"grips", "enter"], View(0, note="no node has 'grips'")),
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
        "    0.50 s   change 2 of 4",
        "  root           RUNNING  Fallback",
        "    mission      RUNNING  Sequence",
        "      start      SUCCESS  Look",
        "      tries      RUNNING  Retry",
        "*       try      FAILURE  Sequence",
        "          held   SUCCESS  Look",
        "*         grasp  FAILURE  Grasp",
        "    stop         INVALID  Stop",
        "    never        INVALID  Stop",
        "grasp  slip: by=gap, value=0.0443",
        "right/left step  PgDn/PgUp 10  Home/End  n failure  g time  / filter  q quit",
    ]


@pytest.mark.parametrize(("width", "height"), [(80, 24), (40, 8), (20, 4), (4, 2)])
def test_the_screen_fits_and_holds_what_changed(replay: Replay, width: int, height: int) -> None:
    for index in range(4):
        lines = drawn(replay, View(index), width, height)
        assert len(lines) <= max(height, 4)
        assert max(map(len, lines)) <= width
        assert any(line.startswith("*") for line in lines)


@pytest.mark.parametrize("width", [40, 80, 160])
@pytest.mark.parametrize("part", ["", "grasp"])
def test_at_any_width_statuses_are_whole_and_the_last_line_says_how_to_quit(
    replay: Replay, width: int, part: str
) -> None:
    lines = drawn(replay, View(1, part=part), width)
    assert lines[-1].endswith("q quit")
    [grasp] = [line for line in lines if "grasp " in line and line.startswith("*")]
    assert "  FAILURE" in grasp
    assert (GRASP in grasp) == (part != "" and width > 40)
    assert grasp.startswith("* root/mission/t…/one/try/grasp  FAILURE" if part and width == 40 else "* ")


def test_a_name_that_is_too_long_loses_its_middle_and_then_half_its_indent(folder: Path) -> None:
    long = "root/" + "a/" * 20 + "the_name_of_a_node_that_is_long"
    (folder / "ticks.jsonl").write_text(f'{{"t": 0.0, "path": "{long}", "status": "RUNNING"}}\n')
    (folder / "events.jsonl").write_text("")
    (folder / "tree.xml").unlink()
    lines = drawn(Replay(read_record(folder)), View(), 40)
    assert lines[1] == "*               the_nam…is_long  RUNNING"


def test_a_filter_leaves_whole_paths(replay: Replay) -> None:
    lines = drawn(replay, replace(View(1), part="grasp"))
    assert lines[0].endswith("only paths with 'grasp'")
    assert lines[1].startswith(f"* {GRASP} ")


Type = Callable[[bytes, bytes], bytes]  # sends keys and reads until a text shows


@pytest.fixture
def terminal(folder: Path, request: pytest.FixtureRequest) -> Iterator[tuple[subprocess.Popen[bytes], Type, int]]:
    """`regrasp replay` on a pseudo-terminal of 80 by 24, or as wide as the test's parameter; with --to 1.5."""
    ours, theirs = pty.openpty()
    fcntl.ioctl(theirs, termios.TIOCSWINSZ, struct.pack("HHHH", 24, getattr(request, "param", 80), 0, 0))
    command = [sys.executable, "-m", "regrasp", "replay", str(folder), "--to", "1.5"]
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
    first = type_(b"", b"change 1 of 4")
    assert b"\x1b[?1049h" in first  # the alternate screen
    type_(b"\x1b[C", b"change 2 of 4")
    type_(b"\x1b[F", b"change 4 of 4")
    type_(b"g0.5\r", b"change 2 of 4")
    type_(b"n", b"change 3 of 4")
    assert not termios.tcgetattr(theirs)[3] & termios.ICANON
    if leave == b"q":
        type_(b"q", b"\x1b[?1049l")
    else:
        process.send_signal({b"SIGTERM": 15, b"SIGINT": 2}[leave])
        type_(b"", b"\x1b[?1049l")
    assert process.wait(60) == (0 if leave == b"q" else 130)
    assert termios.tcgetattr(theirs) == before


@pytest.mark.parametrize("terminal", [40, 160], indirect=True)
def test_a_narrow_and_a_wide_terminal_show_statuses_and_how_to_quit(
    terminal: tuple[subprocess.Popen[bytes], Type, int],
) -> None:
    process, type_, _ = terminal
    assert b"RUNNING" in type_(b"", b"q quit")
    assert b"FAILURE" in type_(b"n", b"q quit")
    type_(b"q", b"\x1b[?1049l")
    assert process.wait(60) == 0


def test_a_long_record_takes_a_time_that_grows_with_its_length(folder: Path) -> None:
    """Comparisons of seconds are counted; they used to grow with the square of the number of ticks."""
    compared = 0

    class Second(float):
        def __lt__(self, other: float) -> bool:
            nonlocal compared
            compared += 1
            return float(self) < float(other)

        def __le__(self, other: float) -> bool:
            nonlocal compared
            compared += 1
            return float(self) <= float(other)

    statuses: list[NodeStatus] = ["RUNNING", "SUCCESS"]
    ticks = tuple(Tick(Second(0.05 * i), "root", statuses[i % 2]) for i in range(2000))
    long = replace(read_record(folder), ticks=ticks, events=())
    assert len(Replay(long).changes) == 2000
    assert compared < 50 * 2000
