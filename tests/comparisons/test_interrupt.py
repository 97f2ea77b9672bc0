"""Ctrl-C: nothing is lost, and nothing else is reported in its place."""

import json
import os
import signal
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from comparisons.interrupt import Interrupt
from scenes.exr import read_exr

Run = Callable[..., Any]
Write = Callable[..., Path]

TRUTH_OF_2048_SPP = "import comparisons.sequential; comparisons.sequential.FIRST_SPP = 1 << 11"
INTERRUPT_THE_IMPORT_OF_MITSUBA = """
import os, signal
class Finder:
    def find_spec(self, name, path=None, target=None):
        if name == "mitsuba":
            os.kill(os.getpid(), signal.SIGINT)
sys.meta_path.insert(0, Finder())
"""
SAID = "lightgauge: interrupted. What was rendered is kept; the same command goes on from there.\n"


def press_ctrl_c() -> None:
    os.kill(os.getpid(), signal.SIGINT)


def interrupted(work: Callable[[Callable[[str], None]], None]) -> list[str]:
    """What `work`, given a callback to mark a point, had noted when the interruption was raised."""
    done: list[str] = []
    with pytest.raises(KeyboardInterrupt), Interrupt() as interrupt:
        work(interrupt.after(done.append))
    return done


def test_an_interruption_waits_for_the_next_mark() -> None:
    def work(mark: Callable[[str], None]) -> None:
        mark("before")
        press_ctrl_c()
        mark("after")
        mark("never")

    assert interrupted(work) == ["before", "after"]


def test_an_interruption_without_a_mark_is_raised_at_the_end() -> None:
    ended = []

    def work(mark: Callable[[str], None]) -> None:
        press_ctrl_c()
        ended.append(True)

    interrupted(work)
    assert ended


def test_a_second_interruption_waits_for_nothing() -> None:
    def work(mark: Callable[[str], None]) -> None:
        press_ctrl_c()
        press_ctrl_c()
        mark("the second one was put off")

    assert interrupted(work) == []


def test_an_interruption_takes_the_place_of_the_errors_it_causes() -> None:
    def work(mark: Callable[[str], None]) -> None:
        press_ctrl_c()
        raise ValueError

    assert interrupted(work) == []


def test_other_errors_pass_and_the_handler_returns() -> None:
    before = signal.getsignal(signal.SIGINT)
    with pytest.raises(ValueError), Interrupt():
        raise ValueError
    assert signal.getsignal(signal.SIGINT) is before


def test_what_was_rendered_is_kept_and_the_next_run_goes_on_from_there(
    here: Path, start: Run, lightgauge_apart: Run, write_scene: Write
) -> None:
    write_scene()
    process = start("run", "tiny.toml", before=TRUTH_OF_2048_SPP)
    deadline = time.monotonic() + 60
    while not list((here / ".lightgauge").rglob("block-002.exr")):
        assert process.poll() is None, "it ended before it could be interrupted"
        assert time.monotonic() < deadline
        time.sleep(0.005)
    process.send_signal(signal.SIGINT)
    _, err = process.communicate(timeout=60)
    assert process.returncode == 130
    assert err == SAID
    kept = {path: path.stat().st_mtime_ns for path in (here / ".lightgauge").rglob("*.exr")}
    assert all(read_exr(path).provenance for path in kept)

    assert lightgauge_apart("run", "tiny.toml", before=TRUTH_OF_2048_SPP).status == 0
    finished = {path: path.stat().st_mtime_ns for path in (here / ".lightgauge").rglob("*.exr")}
    assert finished.items() > kept.items()
    at_once = ("run", "tiny.toml", "--store", "other", "-o", "at-once")
    assert lightgauge_apart(*at_once, before=TRUTH_OF_2048_SPP).status == 0
    resumed, uninterrupted = (
        json.loads((here / folder / "results.json").read_text())["checks"] for folder in ("report", "at-once")
    )
    for check in (*resumed, *uninterrupted):
        check.update(cached=None, seconds=None, pass_seconds=None, baked_seconds=None)
    assert resumed == uninterrupted


def test_an_interrupted_import_is_not_taken_for_a_missing_compiler(lightgauge_apart: Run, write_scene: Write) -> None:
    write_scene()
    outcome = lightgauge_apart("run", "tiny.toml", before=INTERRUPT_THE_IMPORT_OF_MITSUBA)
    assert (outcome.status, outcome.err) == (130, SAID)
