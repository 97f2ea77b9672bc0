"""The course of errors and times over runs, kept in one SQLite file.

A run is noted once, however often its report is written. The file holds every run; the newest are read.
"""

import hashlib
import json
import math
import sqlite3
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from comparisons.baseline import LEAST_CHANGE, error_of, family_of
from comparisons.gate import Verdict
from comparisons.history_file import is_begun, open_history, require_history, writing
from scenes.errors import InputError

RUNS_READ = 50
"""Older runs stay in the file, but no plot has room for more."""


@dataclass(frozen=True)
class Run:
    """A run; `started` in UTC as ISO 8601, `jobs` the scenes that ran side by side, `counts` its checks by verdict."""

    started: str
    commit: str
    lightgauge: str
    gl_renderer: str
    platform: str
    jobs: int
    shard: str
    seconds: float | None
    counts: Mapping[str, int]

    @property
    def when(self) -> str:
        """Date and time to the minute."""
        return self.started[:16].replace("T", " ")


@dataclass(frozen=True)
class Entry:
    """One criterion of a check as a run found it; of a check that could not be judged, one without a metric.

    `accepted` is the value that was accepted at that time, `renderer` the family of the OpenGL renderer. The times of a
    `cached` result were measured when it was judged, in an earlier run.
    """

    run: Run
    check: str
    metric: str
    verdict: str
    value: float | None
    low: float | None
    high: float | None
    min: float | None
    max: float | None
    accepted: float | None
    unit: str
    renderer: str
    spp: int
    realtime_seconds: float | None
    truth_seconds: float | None
    cached: bool

    @property
    def commit(self) -> str:
        return self.run.commit

    @property
    def when(self) -> str:
        return self.run.when

    @property
    def error(self) -> tuple[float, float, float] | None:
        """Distance of the value from 0, with its interval; None if nothing was measured."""
        if self.value is None or self.low is None or self.high is None:
            return None
        return error_of((self.value, self.low, self.high))


@dataclass(frozen=True)
class Change:
    """An error that differs between two entries by more than noise, and by more than `LEAST_CHANGE` of its budget."""

    before: Entry
    now: Entry

    @property
    def rose(self) -> bool:
        return _size(self.now) > _size(self.before)

    @property
    def share(self) -> float:
        """The size of the change as a share of the budget."""
        change, budget = abs(_size(self.now) - _size(self.before)), _budget(self.now)
        return change / budget if budget else math.inf


@dataclass(frozen=True)
class History:
    """Runs and the entries of each check, both from the oldest on."""

    runs: tuple[Run, ...]
    courses: Mapping[str, tuple[Entry, ...]]

    def entries(self, check_id: str) -> tuple[Entry, ...]:
        """All criteria of a check in the order of time; () if no run had it."""
        return self.courses.get(check_id, ())

    def commits(self) -> tuple[str, ...]:
        """Each commit once, in the order in which they were run first."""
        return tuple(dict.fromkeys(run.commit for run in self.runs if run.commit))

    def changes(self) -> tuple[Change, ...]:
        """What the newest run changed, the largest share of its budget first.

        Each criterion is held against the last run before that judged it on a renderer of the same family. Its error
        has changed if the two intervals do not overlap and the difference exceeds `LEAST_CHANGE` of the budget: the
        rule by which `comparisons.baseline` finds a regression, here in both directions.
        """
        if not self.runs:
            return ()
        changes = (change for entries in self.courses.values() for change in _changes(entries, self.runs[-1]))
        return tuple(sorted(changes, key=lambda change: -change.share))


def _changes(entries: Sequence[Entry], newest: Run) -> Iterator[Change]:
    for now in entries:
        if now.run is newest:
            earlier = [e for e in entries if e.run is not newest and _is_comparable(e, now)]
            if earlier and _has_changed(earlier[-1], now):
                yield Change(earlier[-1], now)


def _is_comparable(before: Entry, now: Entry) -> bool:
    return (before.metric, before.renderer) == (now.metric, now.renderer) and before.error is not None


def _has_changed(before: Entry, now: Entry) -> bool:
    if before.error is None or now.error is None:
        return False
    (was, was_low, was_high), (value, low, high) = before.error, now.error
    apart = low > was_high or high < was_low
    return apart and abs(value - was) > LEAST_CHANGE * _budget(now)


def _budget(entry: Entry) -> float:
    return max((abs(bound) for bound in (entry.min, entry.max) if bound is not None), default=0.0)


def _size(entry: Entry) -> float:
    return entry.error[0] if entry.error is not None else 0.0


def note(path: Path, results: Mapping[str, Any]) -> None:
    """Note a run in the history of that file, which is begun if there is none. A run that is noted already is replaced.

    Parameters
    ----------
    results : the content of results.json.

    Raises
    ------
    InputError
        As `require_history`, or the results do not say when the run started.
    """
    if not results.get("started"):
        raise InputError(
            f"The results do not say when the run started, so it has no place in '{path}'. Run the checks again."
        )
    require_history(path)
    key = _key(results)
    with writing(path) as db:
        db.execute("DELETE FROM runs WHERE key = ?", (key,))
        run = _insert(db, "runs", (None, key, *_run_row(results)))
        for check in results.get("checks") or []:
            db.execute("INSERT OR IGNORE INTO checks VALUES (NULL, ?)", (check["id"],))
            (check_id,) = db.execute("SELECT id FROM checks WHERE name = ?", (check["id"],)).fetchone()
            _insert(db, "results", (run, check_id, *_result_row(check)))
            for number, criterion in enumerate(check.get("criteria") or []):
                accepted = check.get("accepted") or {}
                _insert(db, "criteria", (run, check_id, number, *_criterion_row(criterion, accepted)))


def noted(path: Path, results: Mapping[str, Any]) -> History:
    """The history up to a run, after noting it there."""
    note(path, results)
    return read(path, until=results["started"])


def read(path: Path, until: str | None = None, runs: int = RUNS_READ) -> History:
    """The newest runs of a history, or of those that started no later than `until`.

    Raises
    ------
    InputError
        There is no such file, it is damaged, no history, or of a newer version.
    """
    if not path.is_file():
        raise InputError(f"'{path}' does not exist. `lightgauge run --history {path}` begins a history there.")
    with open_history(path, "ro") as db:
        if not is_begun(path, db):
            return History((), {})
        db.execute("BEGIN")  # both questions are answered by the same state of the file
        chosen = {"until": until, "runs": runs}
        found = {row["id"]: _run_of(db, row) for row in db.execute(_NEWEST, chosen)}
        entries: dict[str, list[Entry]] = {}
        for row in db.execute(_ENTRIES, chosen):
            entries.setdefault(row["name"], []).append(_entry_of(found[row["run"]], row))
    return History(tuple(found.values()), {name: tuple(course) for name, course in entries.items()})


_NEWEST = """
SELECT * FROM (
    SELECT * FROM runs WHERE :until IS NULL OR started <= :until ORDER BY started DESC, id DESC LIMIT :runs
) ORDER BY started, id
"""

_ENTRIES = f"""
SELECT checks.name, results.*, results.verdict AS whole, criteria.number, criteria.metric, criteria.verdict AS part,
    value, low, high, min, max, accepted
FROM ({_NEWEST}) AS newest
JOIN results ON results.run = newest.id
JOIN checks ON checks.id = results.check_id
LEFT JOIN criteria ON criteria.run = results.run AND criteria.check_id = results.check_id
ORDER BY newest.started, newest.id, results.check_id, criteria.number
"""


def _run_of(db: sqlite3.Connection, row: sqlite3.Row) -> Run:
    counts = db.execute("SELECT verdict, count(*) FROM results WHERE run = ? GROUP BY verdict", (row["id"],))
    return Run(
        started=row["started"],
        commit=row["commit_name"],
        lightgauge=row["lightgauge"],
        gl_renderer=row["gl_renderer"],
        platform=row["platform"],
        jobs=row["jobs"],
        shard=row["shard"],
        seconds=row["seconds"],
        counts=dict(counts.fetchall()),
    )


def _entry_of(run: Run, row: sqlite3.Row) -> Entry:
    return Entry(
        run=run,
        check=row["name"],
        metric=row["metric"] or "",
        verdict=row["part"] or row["whole"],
        value=row["value"],
        low=row["low"],
        high=row["high"],
        min=row["min"],
        max=row["max"],
        accepted=row["accepted"],
        unit=row["unit"],
        renderer=row["renderer"],
        spp=row["spp"],
        realtime_seconds=row["realtime_seconds"],
        truth_seconds=row["truth_seconds"],
        cached=bool(row["cached"]),
    )


def _insert(db: sqlite3.Connection, table: str, row: Sequence[Any]) -> int | None:
    """Returns the number of the row."""
    return db.execute(f"INSERT OR REPLACE INTO {table} VALUES ({', '.join('?' * len(row))})", row).lastrowid


def _key(results: Mapping[str, Any]) -> str:
    """What makes a run this one: when and where it ran, and which checks."""
    ids = sorted(check["id"] for check in results.get("checks") or [])
    identity = [results["started"], results.get("environment") or {}, ids]
    return hashlib.sha256(json.dumps(identity, sort_keys=True).encode()).hexdigest()


def _run_row(results: Mapping[str, Any]) -> tuple[Any, ...]:
    environment = results.get("environment") or {}
    told = (environment.get(key) or "" for key in ("commit", "lightgauge", "gl_renderer", "platform"))
    return results["started"], *told, results.get("jobs") or 1, results.get("shard") or "", results.get("seconds")


def _result_row(check: Mapping[str, Any]) -> tuple[Any, ...]:
    seconds = check.get("seconds") or {}
    return (
        check.get("verdict") or str(Verdict.ERROR),
        check.get("unit") or "",
        family_of(check.get("gl_renderer") or ""),
        check.get("spp") or 0,
        seconds.get("realtime"),
        seconds.get("reference"),
        bool(check.get("cached")),
    )


def _criterion_row(criterion: Mapping[str, Any], accepted: Mapping[str, Any]) -> tuple[Any, ...]:
    measured = (accepted.get("criteria") or {}).get(criterion["metric"]) or [None]
    numbers = (criterion.get(key) for key in ("value", "low", "high", "min", "max"))
    return criterion["metric"], criterion.get("verdict") or str(Verdict.ERROR), *numbers, measured[0]
