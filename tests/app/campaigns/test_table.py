import re

import pytest

from regrasp.app.campaigns.table import print_table

HEADER = ("case", "as expected", "outcome", "seconds")
NAMES = ["gravity=zero,light.brightness=0.75,seed=2", "gravity=earth,[bold]=0.5,seed=13"]
LINES = [(name, "yes", "internal_error", "1234.5") for name in NAMES]


@pytest.mark.parametrize(("columns", "shown"), [(12, 1), (40, 2), (60, 3), (80, 4), (120, 4)])
def test_on_a_narrow_terminal_names_are_folded_and_columns_left_out_but_nothing_is_cut(
    columns: int, shown: int, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("COLUMNS", str(columns))
    monkeypatch.setattr("sys.stdout.isatty", lambda: True)
    print_table(HEADER, LINES)
    told = re.sub(r"\x1b\[\d*m", "", capsys.readouterr().out)
    assert max(map(len, told.splitlines())) <= columns
    assert [title in told for title in HEADER] == [True] * shown + [False] * (4 - shown)
    names = "".join(line[1:].partition("│")[0].strip() for line in told.splitlines() if line.startswith("│"))
    assert names == "".join(NAMES)


def test_in_a_pipe_it_is_whole_whatever_the_width(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("COLUMNS", "12")
    print_table(HEADER, LINES)
    assert [tuple(line.split()) for line in capsys.readouterr().out.splitlines()[1:]] == LINES
