from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from regrasp.app.files.findings import Finding, Findings, shown
from regrasp.interfaces.quote import nearest


def test_findings_are_kept_once_and_in_the_order_of_the_file() -> None:
    late, early = Finding("a.yaml", 12, "late"), Finding("a.yaml", 3, "early")
    assert str(Findings([late, early, late])) == "a.yaml:3: early\na.yaml:12: late"


@given(st.text())
def test_a_finding_is_one_line_that_does_not_steer_the_terminal(text: str) -> None:
    assert str(Finding(text, 1, text)).isprintable()


@pytest.mark.parametrize(
    ("name", "names", "expected"),
    [
        ("tris", ["tries", "sim_seconds"], "did you mean 'tries'?"),
        ("moon", ["zero", "earth"], "there are earth, zero"),
        ("moon", [], "there are none"),
    ],
)
def test_nearest_names_the_nearest_or_all(name: str, names: list[str], expected: str) -> None:
    assert nearest(name, names) == expected


def test_paths_are_shown_from_the_current_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert shown(tmp_path / "a" / "b.yaml") == "a/b.yaml"
    assert shown(tmp_path.parent / "c.yaml") == str(tmp_path.parent / "c.yaml")
