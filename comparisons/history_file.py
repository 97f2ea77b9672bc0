"""The SQLite file of a history: small enough for the cache of a CI system, and safe with writers side by side.

A file that is damaged, of somebody else, or of another version is refused and left as it is.
"""

import sqlite3
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path

from scenes.errors import InputError

APPLICATION = int.from_bytes(b"lgau", "big")
"""What the header of an SQLite file says about whose it is."""

VERSION = 1

WAIT_S = 30.0
"""Runs that end at the same time take turns; writing one takes a fraction of a second."""

SCHEMA = f"""
PRAGMA application_id = {APPLICATION};
PRAGMA user_version = {VERSION};
CREATE TABLE runs (
    id INTEGER PRIMARY KEY, key TEXT NOT NULL UNIQUE, started TEXT NOT NULL, commit_name TEXT NOT NULL,
    lightgauge TEXT NOT NULL, gl_renderer TEXT NOT NULL, platform TEXT NOT NULL, jobs INTEGER NOT NULL,
    shard TEXT NOT NULL, seconds REAL
);
CREATE TABLE checks (id INTEGER PRIMARY KEY, name TEXT NOT NULL UNIQUE);
CREATE TABLE results (
    run INTEGER NOT NULL REFERENCES runs ON DELETE CASCADE, check_id INTEGER NOT NULL REFERENCES checks,
    verdict TEXT NOT NULL, unit TEXT NOT NULL, renderer TEXT NOT NULL, spp INTEGER NOT NULL, realtime_seconds REAL,
    truth_seconds REAL, cached INTEGER NOT NULL, PRIMARY KEY (run, check_id)
) WITHOUT ROWID;
CREATE TABLE criteria (
    run INTEGER NOT NULL, check_id INTEGER NOT NULL, number INTEGER NOT NULL, metric TEXT NOT NULL,
    verdict TEXT NOT NULL, value REAL, low REAL, high REAL, min REAL, max REAL, accepted REAL,
    PRIMARY KEY (run, check_id, number), FOREIGN KEY (run, check_id) REFERENCES results ON DELETE CASCADE
) WITHOUT ROWID;
"""


def require_history(path: Path) -> None:
    """See that runs can be noted in that file, before anything is rendered; begin it if there is none.

    Raises
    ------
    InputError
        It is damaged, no history, of a newer version, or cannot be written to.
    """
    if path.is_dir():
        raise InputError(f"'{path}' is a folder. Name a file with --history, such as '{path / 'history.sqlite'}'.")
    try:
        path.absolute().parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(
            f"The folder of '{path}' cannot be made ({error.strerror}). Name a file with --history in a folder that "
            "this user may write to."
        ) from error
    with writing(path):
        pass


@contextmanager
def writing(path: Path) -> Iterator[sqlite3.Connection]:
    """All that the block writes, or nothing of it. Other writers wait."""
    with open_history(path, "rwc") as db:
        db.execute("BEGIN IMMEDIATE")
        try:
            if not is_begun(path, db):
                for statement in SCHEMA.split(";"):
                    db.execute(statement)
            yield db
            db.execute("COMMIT")
        finally:
            if db.in_transaction:
                db.execute("ROLLBACK")


@contextmanager
def open_history(path: Path, mode: str) -> Iterator[sqlite3.Connection]:
    """The file as a database; whatever SQLite complains about becomes an InputError."""
    try:
        with closing(
            sqlite3.connect(f"{path.absolute().as_uri()}?mode={mode}", uri=True, timeout=WAIT_S, isolation_level=None)
        ) as db:
            db.row_factory = sqlite3.Row
            db.execute("PRAGMA foreign_keys = ON")
            ((state,),) = db.execute("PRAGMA quick_check(1)").fetchall()
            if state != "ok":
                raise sqlite3.DatabaseError(state)
            yield db
    except sqlite3.Error as error:
        raise InputError(_complaint(path, error)) from error


def _complaint(path: Path, error: sqlite3.Error) -> str:
    if getattr(error, "sqlite_errorname", "").startswith("SQLITE_BUSY"):
        return (
            f"'{path}' has been in use by another process for {WAIT_S:g} s, so the run could not be noted there. When "
            "that has ended, `lightgauge report RUN --history FILE` notes it."
        )
    return (
        f"'{path}' cannot be used as a history: {error}. It is left as it is. If it is damaged, restore it from a "
        "backup or an earlier cache; else name another file with --history, in a folder that this user may write to."
    )


def is_begun(path: Path, db: sqlite3.Connection) -> bool:
    """Whether the file holds a history already; False if it is empty.

    Raises
    ------
    InputError
        It holds something else.
    """
    if db.execute("SELECT 1 FROM sqlite_master").fetchone() is None:
        return False
    application, version = (db.execute(f"PRAGMA {key}").fetchone()[0] for key in ("application_id", "user_version"))
    if application != APPLICATION:
        raise InputError(
            f"'{path}' is an SQLite file of another application. It is left as it is; name another file with --history."
        )
    if version != VERSION:
        raise InputError(
            f"'{path}' is a history of version {version}; this lightgauge reads version {VERSION}. It is left as it "
            "is: use the lightgauge that wrote it, or name another file with --history."
        )
    return True
