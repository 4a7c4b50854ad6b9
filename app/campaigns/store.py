"""The store of a campaign: a SQLite file in its folder, with a row for each run that has ended."""

import fcntl
import json
import os
import sqlite3
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Self

from regrasp.app.files.findings import Finding, Findings, shown

FILE, LOCK = "campaign.db", "campaign.lock"
SCHEMA = 1  # SQLite's user_version
_APPLICATION = 0x52475250  # SQLite's application_id: "RGRP"
_TABLES = """
create table campaign (kind text not null);
create table version (id integer primary key, digest text not null, began text not null, program text not null);
create table row (
  number integer primary key autoincrement,
  version integer not null references version,
  key text not null,
  title text not null,
  family text not null,
  content text not null,
  ended text not null,
  record text not null,
  value text not null,
  unique (version, key)
);
"""


@dataclass(frozen=True)
class NewRow:
    """A run that has ended, for the store. `family`: its name and content, see `Store.version_id`."""

    version: int
    key: str
    title: str
    value: Mapping[str, Any]
    record: str = ""
    family: tuple[str, str] = ("", "")


@dataclass(frozen=True)
class StoredRow:
    """A run that has ended. `record`: its folder, relative to the campaign's; '' if there is none."""

    number: int
    version: int
    key: str
    title: str
    ended: str  # UTC
    record: str
    value: dict[str, Any]


@dataclass(frozen=True)
class Version:
    """Runs of one program and of scenarios that did not change. `program`: its packages' versions and digests."""

    id: int
    began: str  # UTC
    program: dict[str, str]
    runs: int


class Store:
    """The rows of a campaign. Only one process writes; others may read meanwhile. Without a folder it is in memory.

    Every method raises `Findings` for a file that is damaged, locked, on a full disk or of another program.
    """

    def __init__(self, folder: Path | None, connection: sqlite3.Connection, lock: int | None = None) -> None:
        self.folder = folder
        self._connection, self._lock = connection, lock

    @classmethod
    def create(cls, folder: Path | None, kind: str) -> Self:
        """Open the store in `folder` to write, or make a new one. `kind` says what its rows are.

        Raises:
            Findings: the folder holds something else, a store of another kind, or another process writes to it.
            OSError: the folder cannot be made.
        """
        if folder is None:
            store = cls(None, sqlite3.connect(":memory:"))
            store._begin(kind)
            return store
        folder.mkdir(parents=True, exist_ok=True)
        _check_folder(folder)
        lock = _locked(folder)
        try:
            new = not (folder / FILE).exists()
            with _told(folder):
                store = cls(folder, sqlite3.connect(folder / FILE, timeout=10.0), lock)
                store._connection.execute("pragma synchronous = full")
            if new or store._is_empty():
                store._begin(kind)
            store._check(kind)
        except BaseException:
            os.close(lock)
            raise
        return store

    @classmethod
    def read(cls, folder: Path) -> Self:
        """Open the store in `folder` to read."""
        path = folder / FILE
        if not path.is_file():
            if folder.exists() and not folder.is_dir():
                raise Findings([Finding(shown(folder), 0, "is a file; name a campaign's folder")])
            wrong = "holds no campaign" if folder.is_dir() else "does not exist"
            raise Findings([Finding(shown(folder), 0, f"{wrong}; name a folder that regrasp campaign made")])
        if path.stat().st_size == 0:  # it is being made, or the process that made it was killed
            raise Findings([Finding(shown(folder), 0, "holds no run yet; wait for the first")])
        with _told(folder):
            store = cls(folder, sqlite3.connect(f"{path.absolute().as_uri()}?mode=ro", uri=True, timeout=10.0))
        store._check(None)
        return store

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._connection.close()
        if self._lock is not None:
            os.close(self._lock)
            self._lock = None

    @property
    def kind(self) -> str:
        """What its rows are."""
        with _told(self.folder):
            return str(self._connection.execute("select kind from campaign").fetchone()[0])

    def version_id(self, digest: str, program: Mapping[str, str], families: Mapping[str, str] | None = None) -> int:
        """The number of the newest version of this program in which no family has other content; a new one if none.

        A family is what has one content for all its runs: a scenario's case, whose content is a digest of its files.
        """
        with _told(self.folder), self._connection:
            query = "select id from version where digest = ? order by id desc"
            for (number,) in self._connection.execute(query, (digest,)).fetchall():
                query = "select distinct family, content from row where version = ?"
                held = self._connection.execute(query, (number,))
                if all((families or {}).get(family, content) == content for family, content in held):
                    return int(number)
            cursor = self._connection.execute(
                "insert into version (digest, began, program) values (?, ?, ?)",
                (digest, _now(), json.dumps(dict(program))),
            )
        assert cursor.lastrowid is not None
        return cursor.lastrowid

    def versions(self) -> list[Version]:
        """The versions, those with the latest beginning last."""
        query = (
            "select id, began, program, (select count(*) from row where version = version.id) from version order by id"
        )
        with _told(self.folder):
            found = self._connection.execute(query).fetchall()
            return [Version(number, began, json.loads(program), runs) for number, began, program, runs in found]

    def keys(self, version: int, wall_limit: float = 0.0) -> dict[str, bool]:
        """The keys of the runs that this version has done, and whether each came out as expected.

        A row without the value `succeeded` did. Left out are those that were `stopped_after` fewer s than `wall_limit`.
        """
        query = (
            "select key, ifnull(json_extract(value, '$.succeeded'), 1) from row where version = ?"
            " and ifnull(json_extract(value, '$.stopped_after') >= ?, 1)"
        )
        with _told(self.folder):
            found = self._connection.execute(query, (version, wall_limit))
            return {key: bool(succeeded) for key, succeeded in found}

    def add(self, row: NewRow) -> int:
        """Add a row, in place of one that was stopped; it is on the disk when this returns. Returns its number."""
        stopped = "delete from row where version = ? and key = ? and json_extract(value, '$.stopped_after') is not null"
        with _told(self.folder), self._connection:
            self._connection.execute(stopped, (row.version, row.key))
            cursor = self._connection.execute(
                "insert into row (version, key, title, family, content, ended, record, value)"
                " values (?, ?, ?, ?, ?, ?, ?, ?)",
                (
                    row.version,
                    row.key,
                    row.title,
                    *row.family,
                    _now(),
                    row.record,
                    json.dumps(row.value, allow_nan=False),
                ),
            )
        assert cursor.lastrowid is not None
        return cursor.lastrowid

    def rows(self, version: int) -> Iterator[StoredRow]:
        """The rows of a version in the order in which they ended."""
        query = "select number, version, key, title, ended, record, value from row where version = ? order by number"
        with _told(self.folder):
            for found in self._connection.execute(query, (version,)):
                yield _stored(found, self.folder)

    def row(self, number: int) -> StoredRow | None:
        """The row of that number; None if there is none."""
        query = "select number, version, key, title, ended, record, value from row where number = ?"
        with _told(self.folder):
            found = self._connection.execute(query, (number,)).fetchone()
        return _stored(found, self.folder) if found else None

    def records(self) -> set[str]:
        """The folders of the rows that have one."""
        with _told(self.folder):
            return {record for (record,) in self._connection.execute("select record from row where record != ''")}

    def _is_empty(self) -> bool:
        """Whether it has no tables: the process that made it was killed before."""
        with _told(self.folder):
            return self._connection.execute("select count(*) from sqlite_master").fetchone()[0] == 0

    def _begin(self, kind: str) -> None:
        with _told(self.folder):
            self._connection.executescript(
                f"begin; {_TABLES} pragma application_id = {_APPLICATION}; pragma user_version = {SCHEMA}; commit;"
            )
            with self._connection:
                self._connection.execute("insert into campaign values (?)", (kind,))

    def _check(self, kind: str | None) -> None:
        assert self.folder is not None
        with _told(self.folder):
            application = self._connection.execute("pragma application_id").fetchone()[0]
            schema = self._connection.execute("pragma user_version").fetchone()[0]
            sound = self._connection.execute("pragma quick_check(1)").fetchone()[0]
        where = shown(self.folder / FILE)
        if application != _APPLICATION:
            raise Findings([Finding(where, 0, "is another program's database; name another folder")])
        if schema > SCHEMA:
            message = f"schema {schema} is newer than {SCHEMA}, which this program reads; take a newer Regrasp"
            raise Findings([Finding(where, 0, message)])
        if sound != "ok":
            raise Findings([Finding(where, 0, _damaged(str(sound)))])
        if kind is not None and self.kind != kind:
            raise Findings([Finding(where, 0, f"holds {self.kind}, and these are {kind}; name another folder")])


def folder_named(name: str) -> tuple[Path, str]:
    """A campaign's folder, and the number of its version or '', by what a user types: DIR or DIR@2."""
    text, at, number = name.rpartition("@")
    return (Path(text), number) if at and number.isdecimal() and not Path(name).is_dir() else (Path(name), "")


def _stored(found: Sequence[Any], folder: Path | None) -> StoredRow:
    number, version, key, title, ended, record, text = found
    try:
        value = json.loads(text)
    except ValueError:
        value = None
    if not isinstance(value, dict):
        raise damaged_row(number, folder)
    return StoredRow(number, version, key, title, ended, record, value)


def damaged_row(number: int, folder: Path | None = None) -> Findings:
    """What to raise for a row whose value is not what its campaign stores."""
    where = shown(folder / FILE) if folder else FILE
    return Findings([Finding(where, 0, _damaged(f"row {number} holds no run's figures"))])


def _now() -> str:
    return datetime.now(UTC).isoformat(timespec="seconds")


def _check_folder(folder: Path) -> None:
    """Raise `Findings` for a folder that holds things and no campaign."""
    if (folder / FILE).exists():
        return
    others = sorted(name for name in os.listdir(folder) if name != LOCK)
    if others:
        few = ", ".join(others[:3])
        raise Findings([Finding(shown(folder), 0, f"holds other things ({few}); name a folder of its own")])


def _locked(folder: Path) -> int:
    """Take the folder's lock, which ends with this process. Returns its file. Raises `Findings` if another has it."""
    file = os.open(folder / LOCK, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o644)
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        holder = os.pread(file, 100, 0).decode(errors="replace").strip()
        os.close(file)
        message = f"another campaign writes here (process {holder or '?'}); wait for its end, or name another folder"
        raise Findings([Finding(shown(folder), 0, message)]) from None
    os.ftruncate(file, 0)
    os.pwrite(file, f"{os.getpid()} on {os.uname().nodename}\n".encode(), 0)
    return file


@contextmanager
def _told(folder: Path | None) -> Iterator[None]:
    """Errors of SQLite become `Findings`."""
    try:
        yield
    except sqlite3.Error as error:
        where = shown(folder / FILE) if folder else "the store in memory"
        if folder is not None and not (folder / FILE).exists():
            raise Findings([Finding(where, 0, "was moved or removed meanwhile; put it back, or begin anew")]) from None
        raise Findings([Finding(where, 0, _in_words(str(error)))]) from None


def _in_words(error: str) -> str:
    if "full" in error or "disk I/O" in error:
        return f"cannot be written ({error}): make room on the disk, then give the same command again; no row is lost"
    if "locked" in error:
        return "another program has locked it; end that one, then give the same command again"
    if "readonly" in error or "unable to open" in error:
        return f"cannot be opened ({error}); make it readable and writable"
    return _damaged(error)


def _damaged(why: str) -> str:
    return f"is damaged ({why}); restore it from a copy, or name another folder"
