"""Every finished run, kept at once in one SQLite file: write-ahead log, one writer, nothing lost by a kill.

A run is found again by the content of its effective problem and the version of the semantics, and only so: whatever
changes the answer changes the key. Each entry carries a digest of itself, and a file that is damaged or belongs to
something else is refused.
"""

from __future__ import annotations

import hashlib
import sqlite3
from collections.abc import Sequence
from functools import cache
from pathlib import Path
from types import TracebackType

from dse.support.errors import UsageError
from dse.support.files.reading import MOST_BYTES, UnreadableFileError, beginning
from dse.support.version import SEMANTICS

APPLICATION_ID = 0x64736531
"""``dse1`` in the header of the file."""
FORM = 1
ANSWERING = ("support/units", "spec", "space", "analysis", "encode", "search", "questions")
"""The folders of dse whose code decides what a run answers."""
MAGIC = b"SQLite format 3\0"
WAIT_S = 60.0
UNTOUCHED = "; nothing was taken from it and nothing was written (move it away, or name another with --store)"
DAMAGE = (sqlite3.Error, UnicodeDecodeError, OverflowError)
"""What reading a file that is no whole database may end in."""


@cache
def semantics_version() -> str:
    """The version of the semantics: its number, and a digest of the code that answers.

    A run that other code has answered is never taken for an answer of this one.
    """
    digest = hashlib.sha256()
    root = Path(__file__).resolve().parents[2]
    for package in ANSWERING:
        for path in sorted((root / package).rglob("*.py")):
            digest.update(path.relative_to(root).as_posix().encode() + b"\0" + path.read_bytes() + b"\0")
    return f"{SEMANTICS}-{digest.hexdigest()[:16]}"


def run_key(payload: str) -> str:
    """The key of a run: the hash of its effective problem and of the version of the semantics.

    SHA-256 in hexadecimal. A release that changes figures changes `semantics_version`, and then solves every run again.
    """
    return hashlib.sha256(f"{semantics_version()}\n{payload}".encode()).hexdigest()


def _check_beginning(path: Path) -> None:
    """Stop where a file is no database: SQLite would wait for more of one that the kernel makes up.

    Raises
    ------
    UsageError
        naming the file.
    """
    try:
        begins = beginning(path, len(MAGIC))
    except UnreadableFileError as error:
        raise UsageError(f"{path}: cannot be used as a store: {error.reason}") from None
    if begins not in (b"", MAGIC):
        raise UsageError(f"{path}: cannot be used as a store: file is not a database{UNTOUCHED}")


class Store:
    """Outcomes by key. Only the process that opened it writes, one transaction for each run.

    An SQLite file; processes that solve send their outcomes to the one that writes. A digest with each outcome detects
    a damaged file.
    """

    def __init__(self, path: Path) -> None:
        """Open a store, or begin one where there is no file.

        Raises
        ------
        UsageError
            when the file is no store of this form, damaged, or cannot be written.
        """
        self.path = path
        if path.exists():
            _check_beginning(path)
        try:
            self._connection = sqlite3.connect(path, timeout=WAIT_S, isolation_level=None)
            self._connection.setlimit(sqlite3.SQLITE_LIMIT_LENGTH, MOST_BYTES)
            self._prepare()
        except DAMAGE as error:
            raise UsageError(f"{path}: cannot be used as a store: {error}{UNTOUCHED}") from error

    def __enter__(self) -> Store:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """Close the file."""
        self._connection.close()

    def _prepare(self) -> None:
        tables = [row[0] for row in self._connection.execute("SELECT name FROM sqlite_master WHERE type = 'table'")]
        application = self._number("PRAGMA application_id")
        if tables or application:
            if application != APPLICATION_ID:
                raise self._refused("it is a database of another program")
            if self._number("PRAGMA user_version") != FORM:
                raise self._refused("it was written by another version of dse")
            if self._connection.execute("SELECT 1 FROM sqlite_master WHERE type NOT IN ('table', 'index')").fetchone():
                raise self._refused("it holds more than runs")
            damage = self._connection.execute("PRAGMA quick_check").fetchone()[0]
            if damage != "ok":
                raise self._refused(f"it is damaged: {damage}")
            if missing := {"runs", "solves"} - set(tables):
                raise self._refused(f"it is damaged: it has no table {' and no table '.join(sorted(missing))}")
        self._connection.execute("PRAGMA journal_mode = WAL")
        self._connection.execute("PRAGMA synchronous = FULL")
        if not tables:
            self._connection.executescript(
                f"""
                BEGIN IMMEDIATE;
                CREATE TABLE IF NOT EXISTS runs (
                    key TEXT PRIMARY KEY, semantics TEXT NOT NULL, outcome TEXT NOT NULL, digest TEXT NOT NULL
                ) WITHOUT ROWID;
                CREATE TABLE IF NOT EXISTS solves (number INTEGER PRIMARY KEY, key TEXT NOT NULL);
                PRAGMA application_id = {APPLICATION_ID};
                PRAGMA user_version = {FORM};
                COMMIT;
                """
            )

    def _number(self, pragma: str) -> int:
        return int(self._connection.execute(pragma).fetchone()[0])

    def _refused(self, why: str) -> UsageError:
        self._connection.close()
        return UsageError(f"{self.path}: cannot be used as a store: {why} (move it away, or name another with --store)")

    def find(self, keys: Sequence[str]) -> dict[str, str]:
        """The outcomes that are there already.

        Raises
        ------
        UsageError
            when an entry does not agree with its digest.
        """
        outcomes = {}
        try:
            for key in keys:
                row = self._connection.execute("SELECT outcome, digest FROM runs WHERE key = ?", (key,)).fetchone()
                if row is None:
                    continue
                if not isinstance(row[0], str) or row[1] != _digest(key, row[0]):
                    raise self._refused(f"the entry {key[:12]} is damaged")
                outcomes[key] = row[0]
        except DAMAGE as error:
            raise self._refused(f"it is damaged: {error}") from error
        return outcomes

    def keep(self, key: str, outcome: str) -> None:
        """Keep the outcome of a run that was just solved.

        One transaction, so that a kill loses at most the run in progress. Raises `UsageError` where the file cannot be
        written.
        """
        try:
            self._connection.execute("BEGIN IMMEDIATE")
            entry = (key, semantics_version(), outcome, _digest(key, outcome))
            self._connection.execute("INSERT OR REPLACE INTO runs VALUES (?, ?, ?, ?)", entry)
            self._connection.execute("INSERT INTO solves (key) VALUES (?)", (key,))
            self._connection.execute("COMMIT")
        except sqlite3.DatabaseError as error:
            raise UsageError(f"{self.path}: the store cannot be written: {error}") from error

    def solved(self) -> int:
        """The number of runs solved since the store was created; a run whose outcome was found in it does not count.

        It counts solves, not outcomes: a run that was solved twice counts twice.
        """
        return self._number("SELECT count(*) FROM solves")

    def kept(self) -> int:
        """The number of outcomes in the store."""
        return self._number("SELECT count(*) FROM runs")


def _digest(key: str, outcome: str) -> str:
    return hashlib.sha256(f"{key}\n{outcome}".encode()).hexdigest()
