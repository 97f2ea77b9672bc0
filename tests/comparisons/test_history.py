"""The history of runs: what it remembers, what it calls a change, and which files it refuses."""

import math
import multiprocessing
import sqlite3
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import pytest

from comparisons import history_file
from comparisons.history import History, note, noted, read
from comparisons.history_file import VERSION, require_history
from scenes.errors import InputError

Make = Callable[..., dict[str, Any]]
Run = Callable[..., Any]

PROBE = "room/indirect.probe"


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "new folder" / "history.sqlite"


def day(number: int) -> str:
    return f"2026-02-{number:02}T08:30:00+00:00"


@pytest.fixture
def course(path: Path, make_judged: Make, make_run: Make) -> Callable[..., History]:
    """Notes one run a day, with what make_judged is given for each, and reads the history."""

    def noted_course(*days: dict[str, Any]) -> History:
        for number, given in enumerate(days, start=1):
            note(path, make_run(make_judged(**given), started=day(number), commit=f"commit{number}"))
        return read(path)

    return noted_course


def test_an_entry_is_what_the_run_found(path: Path, make_judged: Make, make_run: Make) -> None:
    accepted = {"criteria": {"nrmse": [0.09, 0.08, 0.1]}, "date": "2026-01-01", "reason": "as in 2005"}
    check = make_judged(0.1, 0.08, 0.12, min=0.01, max=0.2, accepted=accepted, cached=True)
    history = noted(path, make_run(check, commit="abc+", jobs=3, shard="2/5"))
    (entry,) = history.entries(PROBE)
    assert (entry.commit, entry.when) == ("abc+", "2026-01-31 12:00")
    assert (entry.metric, entry.verdict, entry.unit) == ("nrmse", "PASS", "W/(m² sr)")
    assert (entry.value, entry.low, entry.high, entry.min, entry.max) == (0.1, 0.08, 0.12, 0.01, 0.2)
    assert (entry.accepted, entry.spp, entry.renderer, entry.cached) == (0.09, 64, "llvmpipe", True)
    assert (entry.realtime_seconds, entry.truth_seconds) == (0.02, 3.0)
    (run,) = history.runs
    assert (run.jobs, run.shard, run.seconds, run.counts) == (3, "2/5", 4.0, {"PASS": 1})
    assert history.entries("room/other") == ()


def test_a_run_that_is_noted_twice_is_there_once(path: Path, make_judged: Make, make_run: Make) -> None:
    run = make_run(make_judged(), make_judged(scene="hall"))
    before = noted(path, run)
    assert noted(path, run) == before
    other = noted(path, make_run(make_judged()))
    assert len(other.runs) == 2  # at the same moment, but other checks: another run


def test_runs_stand_in_the_order_of_time_whenever_they_are_noted(path: Path, make_judged: Make, make_run: Make) -> None:
    for number in (2, 3, 1):
        history = noted(path, make_run(make_judged(number / 100), started=day(number), commit=f"commit{number % 2}"))
    assert [entry.value for entry in read(path).entries(PROBE)] == [0.01, 0.02, 0.03]
    assert read(path).commits() == ("commit1", "commit0")
    assert [entry.value for entry in history.entries(PROBE)] == [0.01]  # up to the run that was noted last
    assert [entry.value for entry in read(path, runs=2).entries(PROBE)] == [0.02, 0.03]


def test_a_check_that_could_not_be_judged_is_remembered_without_a_metric(course: Callable[..., History]) -> None:
    history = course({}, {"verdict": "ERROR", "value": math.nan, "spp": 0, "seconds": {}, "gl_renderer": ""})
    _, broken = history.entries(PROBE)
    assert (broken.metric, broken.verdict, broken.value, broken.realtime_seconds) == ("", "ERROR", None, None)
    assert history.runs[1].counts == {"ERROR": 1}
    assert history.changes() == ()


@pytest.mark.parametrize(
    ("before", "now", "rose"),
    [
        ((0.10, 0.09, 0.11), (0.15, 0.14, 0.16), True),
        ((0.15, 0.14, 0.16), (0.10, 0.09, 0.11), False),
        ((0.10, 0.09, 0.11), (0.12, 0.11, 0.13), None),  # the intervals touch
        ((0.100, 0.100, 0.100), (0.109, 0.109, 0.109), None),  # less than 5 % of the budget of 0.2
        ((0.100, 0.100, 0.100), (0.111, 0.111, 0.111), True),
        ((-0.10, -0.11, -0.09), (0.10, 0.09, 0.11), None),  # as far from 0 as before
    ],
)
def test_a_change_is_beyond_the_noise_and_a_twentieth_of_the_budget(
    course: Callable[..., History], before: tuple[float, ...], now: tuple[float, ...], rose: bool | None
) -> None:
    history = course(*(dict(zip(("value", "low", "high"), triple, strict=True)) for triple in (before, now)))
    changes = history.changes()
    assert [change.rose for change in changes] == ([] if rose is None else [rose])
    for change in changes:
        assert change.share == pytest.approx(abs(now[0] - before[0]) / 0.2)


def test_only_the_newest_run_changes_and_only_against_the_same_renderer(course: Callable[..., History]) -> None:
    other = "NVIDIA H200/PCIe/SSE2, OpenGL 4.3"
    history = course({"value": 0.1}, {"value": 0.15}, {"value": 0.15, "gl_renderer": other})
    assert history.changes() == ()
    history = course({"value": 0.1}, {"value": 0.15}, {"value": 0.02, "gl_renderer": other}, {"value": 0.12})
    (change,) = history.changes()
    assert (change.before.value, change.now.value, change.rose) == (0.15, 0.12, False)


def test_the_largest_changes_come_first(path: Path, make_judged: Make, make_run: Make) -> None:
    for number, values in enumerate([(0.1, 0.1), (0.12, 0.15)], start=1):
        checks = [make_judged(value, scene=scene) for value, scene in zip(values, ("little", "much"), strict=True)]
        history = noted(path, make_run(*checks, started=day(number)))
    assert [change.now.check for change in history.changes()] == ["much/indirect.probe", "little/indirect.probe"]


def test_an_empty_history_has_nothing(path: Path) -> None:
    require_history(path)
    assert read(path) == History((), {})
    assert read(path).changes() == ()


def damaged(path: Path) -> None:
    content = bytearray(path.read_bytes())
    content[4096:8192] = b"\xff" * 4096
    path.write_bytes(content)


def of_another_application(path: Path) -> None:
    path.unlink()
    with sqlite3.connect(path) as db:
        db.execute("CREATE TABLE cookies (name TEXT)")
    db.close()


def of_a_newer_version(path: Path) -> None:
    with sqlite3.connect(path) as db:
        db.execute(f"PRAGMA user_version = {VERSION + 1}")
    db.close()


@pytest.mark.parametrize(
    ("spoil", "complaint"),
    [
        (lambda path: path.write_text("when,error\n"), "not a database"),
        (damaged, "cannot be used as a history"),
        (of_another_application, "of another application"),
        (of_a_newer_version, f"of version {VERSION + 1}; this lightgauge reads version {VERSION}"),
    ],
)
def test_what_is_no_sound_history_is_refused_and_left_as_it_is(
    path: Path, make_judged: Make, make_run: Make, spoil: Callable[[Path], object], complaint: str
) -> None:
    note(path, make_run(make_judged()))
    spoil(path)
    content = path.read_bytes()
    for use in (read, require_history, lambda path: note(path, make_run(make_judged()))):
        with pytest.raises(InputError, match=complaint):
            use(path)
    assert path.read_bytes() == content


def test_a_file_that_is_missing_or_a_folder_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="does not exist"):
        read(tmp_path / "none.sqlite")
    with pytest.raises(InputError, match="is a folder"):
        require_history(tmp_path)
    (tmp_path / "file").touch()
    with pytest.raises(InputError, match="cannot be made"):
        require_history(tmp_path / "file" / "history.sqlite")


def test_a_run_without_a_start_has_no_place(path: Path, make_judged: Make, make_run: Make) -> None:
    with pytest.raises(InputError, match="when the run started"):
        note(path, make_run(make_judged(), started=""))
    assert not path.exists()


def test_a_run_is_noted_whole_or_not_at_all(path: Path, make_judged: Make, make_run: Make) -> None:
    before = noted(path, make_run(make_judged()))
    run = make_run(make_judged(), make_judged(scene="hall"), started=day(2))
    del run["checks"][1]["id"]
    with pytest.raises(KeyError):
        note(path, run)
    assert read(path) == before


def test_a_writer_that_waits_too_long_says_so(
    path: Path, make_judged: Make, make_run: Make, monkeypatch: pytest.MonkeyPatch
) -> None:
    note(path, make_run(make_judged()))
    monkeypatch.setattr(history_file, "WAIT_S", 0.05)
    other = sqlite3.connect(path, isolation_level=None)
    other.execute("BEGIN EXCLUSIVE")
    try:
        with pytest.raises(InputError, match="in use by another process"):
            note(path, make_run(make_judged(), started=day(2)))
    finally:
        other.close()
    assert len(read(path).runs) == 1


def test_writers_side_by_side_lose_nothing(path: Path, make_judged: Make, make_run: Make) -> None:
    runs = [make_run(make_judged(), started=day(number)) for number in range(1, 25)]
    with ThreadPoolExecutor(8) as threads:
        list(threads.map(lambda run: note(path, run), runs))
    assert [run.started for run in read(path).runs] == [run["started"] for run in runs]


def test_processes_side_by_side_begin_one_history(path: Path) -> None:
    spawn = multiprocessing.get_context("spawn")
    writers = [spawn.Process(target=require_history, args=(path,)) for _ in range(3)]
    for writer in writers:
        writer.start()
    for writer in writers:
        writer.join(timeout=60)
    assert [writer.exitcode for writer in writers] == [0, 0, 0]
    assert read(path) == History((), {})


@pytest.fixture
def told(path: Path, course: Callable[..., History]) -> Path:
    """A history of three runs, of which the last changed an error."""
    course({"value": 0.1}, {"verdict": "ERROR", "gl_renderer": "", "seconds": {}}, {"value": 0.15, "cached": True})
    return path


def test_the_command_lists_runs_and_what_the_last_one_changed(told: Path, lightgauge: Run) -> None:
    outcome = lightgauge("history", str(told))
    assert outcome.status == 0
    lines = outcome.out.splitlines()
    assert [line.split()[:3] for line in lines[1:4]] == [["2026-02-0" + n, "08:30", "commit" + n] for n in "123"]
    assert "1 ERROR" in lines[2]
    assert lines[4] == (
        "rose: room/indirect.probe: nrmse from 10.0\u202f% exact (commit1) to 15.0\u202f% exact, "
        "by 25\u202f% of the budget"
    )


def test_the_command_tells_the_course_of_a_check(told: Path, lightgauge: Run) -> None:
    name, header, *rows = lightgauge("history", str(told), "probe").out.splitlines()
    assert name == PROBE
    assert header.split()[:4] == ["when", "commit", "metric", "error"]
    assert [("ERROR" in row, "(stored)" in row) for row in rows] == [(False, False), (True, False), (False, True)]


def test_the_command_refuses_what_is_not_there(told: Path, lightgauge: Run) -> None:
    outcome = lightgauge("history", str(told), "rom/indirect")
    assert outcome.status == 3
    assert f"Close to it: {PROBE}." in outcome.err
    assert lightgauge("history", str(told.with_name("none"))).status == 3
