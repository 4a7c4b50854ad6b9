import os
import shutil
import warnings
from pathlib import Path

import pytest
from typer.testing import CliRunner

from regrasp.app.cli.commands import app
from regrasp.app.files.findings import Findings
from regrasp.app.records.reader import read_record
from regrasp.app.scenario.load import cases, load_scenario
from regrasp.app.scenario.old_words import OldWordWarning, migrated
from regrasp.app.tasks.cable.expectations import Expect

OLD = """\
description: old    # a remark
cell: thesis
tree: recovery
gravity: zero
expect:
  outcome: "stowed"    # stowed stays here
  slips: 1
vary:
  expect.outcome: [stowed, safe_stop, failure]
  expect: [{outcome: safe_stop}, {slips: 2}]
"""
NEW = OLD.replace('outcome: "stowed"', 'outcome: "success"').replace("[stowed, safe_stop", "[success, failure")
NEW = NEW.replace("outcome: safe_stop", "outcome: failure")
HEAD = "description: old\ncell: thesis\ntree: recovery\ngravity: zero\n"


@pytest.mark.parametrize(("old", "outcome", "end"), [("stowed", "success", "stowed"), ("safe_stop", "failure", None)])
def test_an_old_word_is_read_with_a_warning_that_shows_the_new_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, old: str, outcome: str, end: str | None
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("mine.yaml").write_text(f"{HEAD}expect: {{outcome: {old}}}\n")
    with pytest.warns(OldWordWarning, match=f"^mine.yaml:5: expect.outcome: {old} .* write outcome: {outcome}, as"):
        expect = load_scenario("mine.yaml").file.expect
    assert isinstance(expect, Expect)
    assert (expect.outcome, expect.end_state) == (outcome, end)


def test_a_case_and_the_command_line_may_say_the_old_word_too(tmp_path: Path) -> None:
    path = tmp_path / "mine.yaml"
    path.write_text(f"{HEAD}expect: {{outcome: failure}}\nvary: {{expect.outcome: [failure, stowed]}}\n")
    with pytest.warns(OldWordWarning, match="stowed"):
        assert [made.file.expect.outcome for made in cases(str(path))] == ["failure", "success"]
    with pytest.warns(OldWordWarning, match="^--set"):
        load_scenario(str(path), ["vary.expect.outcome=[failure]", "expect.outcome=safe_stop"])


def test_shipped_scenarios_have_no_old_word() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        cases("short_obstacle")
        cases("faults/joint_stalls_for_good")


def test_migrate_changes_these_words_and_nothing_else(tmp_path: Path) -> None:
    path, other = tmp_path / "mine.yaml", tmp_path / "other.yaml"
    path.write_bytes(OLD.replace("\n", "\r\n").encode())
    other.write_text(HEAD)
    told = CliRunner().invoke(app, ["migrate", "--dry-run", str(path)])
    assert path.read_bytes() == OLD.replace("\n", "\r\n").encode()
    done = CliRunner().invoke(app, ["migrate", str(path), str(other)])
    assert path.read_bytes() == NEW.replace("\n", "\r\n").encode()
    assert done.stdout.startswith(told.stdout)
    assert [line.split(":")[1] for line in told.stdout.splitlines()] == ["6", "9", "10"]
    assert done.stdout.splitlines()[-1].endswith("other.yaml: nothing to change")
    assert migrated(NEW, "mine.yaml") == (NEW, [])


def test_where_one_file_cannot_be_read_none_is_changed(tmp_path: Path) -> None:
    path, broken = tmp_path / "mine.yaml", tmp_path / "broken.yaml"
    path.write_text(OLD)
    broken.write_text("expect: {outcome: stowed\n")
    done = CliRunner().invoke(app, ["migrate", str(path), str(broken), str(tmp_path / "none.yaml")])
    assert done.exit_code == 2
    assert len(done.stderr.splitlines()) == 2
    assert path.read_text() == OLD


@pytest.mark.parametrize(
    "text", ["", "[1]", "expect: 3\nvary: 4\n", "expect: {outcome: [stowed]}\n", "vary: {expect: [3]}\n"]
)
def test_what_is_no_scenario_stays_as_it_is(text: str) -> None:
    assert migrated(text, "mine.yaml") == (text, [])


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("expect: {outcome: 'stowed'}\n", "expect: {outcome: 'success'}\n"),
        ("expect:\n  outcome: |-\n    stowed\n  slips: 0\n", "expect:\n  outcome: |-\n    success\n  slips: 0\n"),
        (
            "vary: {expect.outcome: [&a safe_stop, *a]}\nexpect: {outcome: &stowed stowed}\n",
            "vary: {expect.outcome: [&a failure, *a]}\nexpect: {outcome: &stowed success}\n",
        ),
    ],
)
def test_quotes_blocks_and_anchors_stay(old: str, new: str) -> None:
    assert migrated(old, "mine.yaml")[0] == new


@pytest.mark.parametrize(
    "text",
    [
        "sigh: &o stowed\nexpect: {outcome: *o}\n",
        "x: &d {outcome: stowed}\nexpect: {<<: *d}\n",
    ],
)
def test_what_an_alias_shares_with_another_key_is_left_to_a_person(text: str) -> None:
    with pytest.raises(Findings, match="shares; change it by hand"):
        migrated(text, "mine.yaml")


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write anything")
def test_a_write_protected_file_stops_it_before_anything_is_changed(tmp_path: Path) -> None:
    path, kept = tmp_path / "mine.yaml", tmp_path / "kept.yaml"
    path.write_text(OLD)
    kept.write_text(OLD)
    kept.chmod(0o444)
    done = CliRunner().invoke(app, ["migrate", str(path), str(kept)])
    assert (done.exit_code, path.read_text()) == (2, OLD)
    assert "kept.yaml: is write-protected" in done.stderr


def test_what_is_not_yaml_is_a_finding() -> None:
    with pytest.raises(Findings, match=r"mine\.yaml:1: not YAML"):
        migrated("expect: [", "mine.yaml")


def test_a_record_of_schema_1_is_read(tmp_path: Path) -> None:
    kept = Path(__file__).parents[2] / "support" / "record"
    assert '"schema": 1' in (kept / "result.json").read_text()
    shutil.copytree(kept, tmp_path / "record")
    record = read_record(tmp_path / "record")
    assert record.result is not None
    assert record.result.outcome == "failure"
    assert [(e.value, e.limit) for e in record.result.expectations if e.name == "outcome"] == [("failure", "failure")]
