"""States and tracks in one file of SQLite."""

from __future__ import annotations

import json
import os
import sqlite3
from collections.abc import Sequence
from contextlib import ExitStack, closing, suppress
from errno import ENOSPC
from hashlib import sha256
from pathlib import Path
from shutil import disk_usage
from typing import Any, ClassVar, final

from attrs import define, evolve, field, frozen

from vedette import fields
from vedette.errors import InputError
from vedette.streams import Saved, Storage, Store, TrackReport, now
from vedette_files import SCHEMA, keep_facts, keep_tracks
from vedette_files.input_files import user_path
from vedette_files.writing import growing, unused
from vedette_live.log import LOG

VERSION = 2
"""Of the tables, as the database's user_version."""
BORNE = 10
"""Latest reports, of which the earliest tells how old tracks are: a leap that is given up has fewer than five scans."""
KEPT = 2
"""States that are kept: the latest, and the one before it, should the latest be damaged."""

_TABLES = """
CREATE TABLE IF NOT EXISTS states (id INTEGER PRIMARY KEY, saved REAL NOT NULL, digest TEXT NOT NULL, content TEXT NOT NULL);
"""


@final
@frozen
class SqliteStore(Store):
    """One file, in write-ahead mode: a transaction keeps the state and all tracks since the last one, or nothing of them.

    Tracks are rows, by time and by place, of the last `keep`; `vedette export FILE` reads them. A file that is damaged is
    set aside, and the copy of it that was made at the last start is used. https://www.sqlite.org/wal.html
    """

    kind: ClassVar[str] = "sqlite"

    path: str = fields.text("of the file")
    keep: float = fields.quantity("s", "age of the oldest tracks that are kept", default=7 * 86400.0, above=0)

    def open(self) -> Storage:
        path = user_path(self.path)
        held = ExitStack()
        held.enter_context(growing(path, "service.store.path"))
        try:
            return self._opened(path, held)
        except BaseException:
            held.close()
            raise

    def _opened(self, path: Path, held: ExitStack) -> _Open:
        try:
            connection, saved = _opened(path)
        except sqlite3.OperationalError as error:
            raise InputError(f"service.store: {path}: cannot be opened: {error}") from None
        except sqlite3.DatabaseError as error:
            aside, before = unused(path.with_name(f"{path.name}.damaged")), _before(path)
            _tell(f"{path} is damaged ({error}): it is kept as {aside.name}")
            path.replace(aside)
            for end in ("-wal", "-shm"):
                with suppress(FileNotFoundError):
                    path.with_name(path.name + end).replace(aside.with_name(aside.name + end))
            if before.exists():
                _copy(before, path)
                _tell(f"{before.name}, a copy made at the last start, is used")
            try:
                connection, saved = _opened(path)
            except sqlite3.DatabaseError as second:
                raise InputError(f"service.store: {path}: neither it nor {before.name} can be used: {second}") from None
            saved = saved and evolve(saved, older=True)
        else:
            if saved is not None and saved.older:
                _tell(f"the latest state in {path} is damaged: the one before it is used")
        opened = _Open(connection, path, self.keep, saved, held, copied=saved is None)
        if told := opened.copy():
            _tell(told)
        return opened


def _tell(why: str) -> None:
    LOG.error("store", extra={"why": why})


def _before(path: Path) -> Path:
    return path.with_name(f"{path.name}.before")


def _copy(source: Path, target: Path) -> None:
    """Copy a database, with what its log holds, whole or not at all."""
    part = target.with_name(f".{target.name}.part")
    part.unlink(missing_ok=True)
    try:
        with closing(sqlite3.connect(source)) as old, closing(sqlite3.connect(part)) as new:
            old.backup(new)
        part.replace(target)
    finally:
        part.unlink(missing_ok=True)


def _opened(path: Path) -> tuple[sqlite3.Connection, Saved | None]:
    if path.exists() and not path.stat().st_size and _before(path).exists():
        raise sqlite3.DatabaseError("it is empty")
    connection = sqlite3.connect(path, isolation_level=None, check_same_thread=False, timeout=5.0)
    try:
        connection.execute("PRAGMA trusted_schema = OFF")
        connection.execute("PRAGMA journal_mode = WAL")
        connection.execute("PRAGMA synchronous = FULL")
        if (answer := connection.execute("PRAGMA quick_check(1)").fetchone()) != ("ok",):
            raise sqlite3.DatabaseError(str(answer))
        if (version := connection.execute("PRAGMA user_version").fetchone()[0]) not in (0, VERSION):
            raise InputError(
                f"service.store: {path}: is of version {version}, and this Vedette reads {VERSION}: move it away"
            )
        if not version and connection.execute("SELECT 1 FROM sqlite_master").fetchone():
            raise InputError(f"service.store: {path}: is a database of another program: name another file")
        connection.executescript(f"BEGIN; {_TABLES} {SCHEMA} PRAGMA user_version = {VERSION}; COMMIT;")
        with closing(sqlite3.connect(":memory:")) as ours:
            ours.executescript(_TABLES + SCHEMA)
            if lacking := _columns(ours) - _columns(connection):
                raise InputError(f"service.store: {path}: has no column {', '.join(sorted(lacking))}: move it away")
        return connection, _latest(connection)
    except BaseException:
        connection.close()
        raise


def _columns(of: sqlite3.Connection) -> set[str]:
    """Return the columns of all tables, as table.column."""
    rows = of.execute("SELECT t.name || '.' || c.name FROM sqlite_master t, pragma_table_info(t.name) c")
    return {name for (name,) in rows}


def _latest(connection: sqlite3.Connection) -> Saved | None:
    """Return the latest state that is whole."""
    rows = connection.execute("SELECT digest, content FROM states ORDER BY id DESC").fetchall()
    for i, (digest, content) in enumerate(rows):
        if sha256(content.encode()).hexdigest() != digest:
            continue
        try:
            given = json.loads(content)
            return Saved(given["states"], given["counters"], given["acknowledged"], older=i > 0)
        except (ValueError, KeyError, TypeError):
            continue
    if rows:
        raise sqlite3.DatabaseError("no state in it is whole")
    return None


@final
@define(eq=False)
class _Open:
    """The store, open."""

    connection: sqlite3.Connection
    path: Path
    keep: float
    saved: Saved | None
    held: ExitStack
    copied: bool
    times: list[float] = field(factory=list)

    def load(self) -> Saved | None:
        return self.saved

    def save(self, saved: Saved, reports: Sequence[TrackReport]) -> str | None:
        parts = {
            "states": saved.states, "counters": dict(saved.counters), "acknowledged": dict(saved.acknowledged),
        }  # fmt: skip
        content = json.dumps(parts)
        digest = sha256(content.encode()).hexdigest()
        write = self.connection
        try:
            write.execute("BEGIN IMMEDIATE")
            write.execute("INSERT INTO states (saved, digest, content) VALUES (?, ?, ?)", (now(), digest, content))
            write.execute(f"DELETE FROM states WHERE id <= (SELECT MAX(id) FROM states) - {KEPT}")
            if reports:
                keep_facts(write, reports[-1].space, saved.notes)
            for report in reports:
                columns: dict[str, Any] = {"id": report.ids, "mean": report.mean, "cov": report.cov}
                columns |= {"existence": report.existence, "confirmed": report.confirmed}
                places = None if report.geodetic is None else report.geodetic(report.mean)[:2]
                keep_tracks(write, report.time, report.space, columns, places)
            times = [*self.times, *(report.time for report in reports)][-BORNE:]
            if len(times) == BORNE:
                write.execute("DELETE FROM tracks WHERE time < ?", (min(times) - self.keep,))
            write.execute("COMMIT")
        except sqlite3.Error as error:
            if write.in_transaction:
                write.execute("ROLLBACK")
            raise OSError(f"the state cannot be saved: {error}") from None
        self.times = times
        return self.copy()

    def copy(self) -> str | None:
        """Make the copy of this start, once; return why it cannot be made: there is no try where there is no room for it."""
        if self.copied:
            return None
        before = _before(self.path)
        try:
            if disk_usage(self.path.parent).free < self.path.stat().st_size:
                raise OSError(ENOSPC, os.strerror(ENOSPC))
            _copy(self.path, before)
        except (sqlite3.Error, OSError) as error:
            return f"{before.name} cannot be written: {error}"
        self.copied = True
        return None

    def close(self) -> None:
        self.connection.close()
        self.held.close()
