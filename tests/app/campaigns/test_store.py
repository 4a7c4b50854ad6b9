"""The store of a campaign: what it keeps, and folders that it refuses."""

import sqlite3
from pathlib import Path

import pytest

from regrasp.app.campaigns.store import FILE, NewRow, Store
from regrasp.app.files.findings import Findings

KIND = "things"


def made(folder: Path, count: int = 3) -> None:
    with Store.create(folder, KIND) as store:
        version = store.version_id("d1", {"python": "3"})
        for n in range(count):
            store.add(NewRow(version, f"k{n}", f"thing {n}", {"n": n, **({"succeeded": False} if n == 1 else {})}))


def test_what_was_added_is_there_again(tmp_path: Path) -> None:
    made(tmp_path / "c")
    with Store.create(tmp_path / "c", KIND) as store:
        version = store.version_id("d1", {"python": "3"})
        assert store.keys(version) == {"k0": True, "k1": False, "k2": True}
        other = store.version_id("d2", {"python": "4"})
        assert store.keys(other) == {}
        store.add(NewRow(other, "k0", "thing 0", {"n": 5}, "runs/a"))
    with Store.read(tmp_path / "c") as store:
        assert [(row.number, row.title, row.value) for row in store.rows(version)] == [
            (1, "thing 0", {"n": 0}),
            (2, "thing 1", {"n": 1, "succeeded": False}),
            (3, "thing 2", {"n": 2}),
        ]
        assert [(v.id, v.program, v.runs) for v in store.versions()] == [
            (1, {"python": "3"}, 3),
            (2, {"python": "4"}, 1),
        ]
        assert store.records() == {"runs/a"}
        row = store.row(4)
        assert row is not None
        assert row.value == {"n": 5}
        assert store.row(5) is None


def test_a_run_is_there_only_once(tmp_path: Path) -> None:
    made(tmp_path / "c")
    with Store.create(tmp_path / "c", KIND) as store, pytest.raises(Findings, match="UNIQUE"):
        store.add(NewRow(1, "k0", "thing 0", {}))


def test_two_campaigns_in_one_folder(tmp_path: Path) -> None:
    with (
        Store.create(tmp_path / "c", KIND),
        pytest.raises(Findings, match=r"another campaign writes here \(process \d+"),
    ):
        Store.create(tmp_path / "c", KIND)
    made(tmp_path / "c")  # after its end another may


def test_it_can_be_read_while_it_is_written(tmp_path: Path) -> None:
    with Store.create(tmp_path / "c", KIND) as store:
        version = store.version_id("d", {})
        store.add(NewRow(version, "k", "one", {}))
        with Store.read(tmp_path / "c") as reader:
            assert [row.title for row in reader.rows(version)] == ["one"]
            store.add(NewRow(version, "l", "two", {}))
            assert [row.title for row in reader.rows(version)] == ["one", "two"]


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"this is no database at all" * 100, "is damaged"),
        (b"SQLite format 3\0" + b"x" * 4000, "is damaged"),
    ],
)
def test_a_file_that_is_no_store(tmp_path: Path, content: bytes, message: str) -> None:
    (tmp_path / FILE).write_bytes(content)
    for opened in (Store.read, lambda folder: Store.create(folder, KIND)):
        with pytest.raises(Findings, match=message):
            opened(tmp_path)
    assert (tmp_path / FILE).read_bytes() == content


def test_a_store_that_was_cut_off(tmp_path: Path) -> None:
    made(tmp_path, 200)
    data = (tmp_path / FILE).read_bytes()
    (tmp_path / FILE).write_bytes(data[: len(data) // 2])
    with pytest.raises(Findings, match="is damaged"):
        Store.create(tmp_path, KIND)


def test_stores_of_others(tmp_path: Path) -> None:
    sqlite3.connect(tmp_path / FILE).execute("create table mine (a)").connection.close()
    with pytest.raises(Findings, match="another program's database"):
        Store.create(tmp_path, KIND)
    made(tmp_path / "new")
    with sqlite3.connect(tmp_path / "new" / FILE) as connection:
        connection.execute("pragma user_version = 2")
    with pytest.raises(Findings, match="schema 2 is newer than 1"):
        Store.read(tmp_path / "new")
    made(tmp_path / "kind")
    with pytest.raises(Findings, match=r"holds things, and these are others; name another folder"):
        Store.create(tmp_path / "kind", "others")


def test_folders_of_others(tmp_path: Path) -> None:
    (tmp_path / "mine.txt").touch()
    with pytest.raises(Findings, match=r"holds other things \(mine.txt\)"):
        Store.create(tmp_path, KIND)
    assert [path.name for path in tmp_path.iterdir()] == ["mine.txt"]
    with pytest.raises(Findings, match="does not exist"):
        Store.read(tmp_path / "none")
    with pytest.raises(Findings, match="holds no campaign"):
        Store.read(tmp_path)


def test_a_store_whose_making_was_cut_off_is_made_anew(tmp_path: Path) -> None:
    (tmp_path / FILE).touch()
    made(tmp_path)
    with Store.read(tmp_path) as store:
        assert len([*store.rows(1)]) == 3


def test_a_folder_that_is_moved_meanwhile_is_told(tmp_path: Path) -> None:
    with Store.create(tmp_path / "c", KIND) as store:
        version = store.version_id("d", {})
        (tmp_path / "c").rename(tmp_path / "moved")
        with pytest.raises(Findings, match="was moved or removed meanwhile"):
            store.add(NewRow(version, "k", "thing", {}))


def test_a_full_disk_is_told(tmp_path: Path) -> None:
    with Store.create(tmp_path, KIND) as store:
        version = store.version_id("d", {})
        store._connection.execute("pragma max_page_count = 12")
        with pytest.raises(Findings, match="make room on the disk"):
            _ = [store.add(NewRow(version, str(n), "thing", {"text": "x" * 500})) for n in range(1000)]
    with Store.read(tmp_path) as store:
        assert len([*store.rows(version)]) > 5


def test_a_family_of_other_content_begins_a_version(tmp_path: Path) -> None:
    with Store.create(tmp_path / "c", KIND) as store:
        first = store.version_id("d", {}, {"tall": "1"})
        store.add(NewRow(first, "k0", "tall seed 0", {}, family=("tall", "1")))
        assert store.version_id("d", {}, {"tall": "1", "short": "1"}) == first
        second = store.version_id("d", {}, {"tall": "2"})
        assert second != first
        store.add(NewRow(second, "k1", "tall seed 0", {}, family=("tall", "2")))
        assert store.version_id("d", {}, {"tall": "1"}) == first
        assert store.version_id("d", {}, {"short": "1"}) == second


def test_a_run_that_was_stopped_counts_as_done_only_for_no_more_time(tmp_path: Path) -> None:
    with Store.create(tmp_path / "c", KIND) as store:
        version = store.version_id("d", {})
        store.add(NewRow(version, "k", "slow", {"succeeded": False, "stopped_after": 2.0}))
        assert store.keys(version, 2.0) == {"k": False}
        assert store.keys(version, 3.0) == store.keys(version, float("inf")) == {}
        store.add(NewRow(version, "k", "slow", {"succeeded": True}))
        assert store.keys(version, 3.0) == {"k": True}
        assert len([*store.rows(version)]) == 1


@pytest.mark.parametrize("value", ["{not json", "[]", "null"])
def test_a_damaged_row_is_told(tmp_path: Path, value: str) -> None:
    made(tmp_path / "c")
    with sqlite3.connect(tmp_path / "c" / FILE) as connection:
        connection.execute("update row set value = ? where number = 2", (value,))
    with Store.read(tmp_path / "c") as store, pytest.raises(Findings, match="row 2 holds no run's figures"):
        _ = [*store.rows(1)]
