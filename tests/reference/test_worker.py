"""A process that dies is replaced, and what it was doing is begun again."""

import importlib
import os
import pickle
import signal
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from reference import worker
from reference.worker import ATTEMPTS, Worker, means_elsewhere
from scenes.errors import RenderError, SceneError
from scenes.image import Float64
from scenes.load import find_scene, load_scene
from scenes.model import Scene


@pytest.fixture
def process() -> Iterator[Worker]:
    """A worker that is ended after the test."""
    made = Worker()
    yield made
    made.close()


def test_it_returns_what_a_function_returns(process: Worker) -> None:
    np.testing.assert_array_equal(process.call(np.add, np.arange(5), 2), np.arange(5) + 2)
    assert process.call(os.getpid) != os.getpid()


def test_a_killed_process_is_replaced(process: Worker) -> None:
    first = process.call(os.getpid)
    os.kill(first, signal.SIGSEGV)
    process.process.wait()
    assert process.call(os.getpid) != first


def test_a_launch_that_kills_its_process_once_is_begun_again(process: Worker, tmp_path: Path) -> None:
    """`mkdir` stands for a launch that crashes the first time: the shell that runs it kills its parent, then not."""
    marker = tmp_path / "crashed"
    script = f"mkdir {marker} 2>/dev/null && kill -SEGV $PPID; exit 7"
    assert process.call(os.system, script) == 7 << 8
    assert marker.is_dir()


def test_a_launch_that_always_crashes_is_an_error_in_words(process: Worker, tmp_path: Path) -> None:
    with pytest.raises(RenderError, match=r"Mitsuba crashed 4 times in a row \(exit status -11, -11, -11, -11\)"):
        process.call(os.system, f"echo once >> {tmp_path / 'count'}; kill -SEGV $PPID")
    assert (tmp_path / "count").read_text().count("once") == ATTEMPTS


def test_a_process_that_cannot_run_is_not_begun_again(process: Worker, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(worker, "SERVE", "raise SystemExit(3)")
    with pytest.raises(RenderError, match="ended with exit status 3 before it answered"):
        process.call(abs, -3)


def test_a_process_that_answers_with_what_is_no_answer_is_ended(
    process: Worker, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It stays alive after that: to wait for its end would take for ever."""
    stub = "import sys, time; sys.stdout.buffer.write(b'\\xff'); sys.stdout.flush(); time.sleep(600)"
    monkeypatch.setattr(worker, "SERVE", stub)
    monkeypatch.setattr(worker, "SECONDS_TO_END", 0.1)
    with pytest.raises(RenderError, match=r"crashed 4 times in a row \(exit status -9, -9, -9, -9\)"):
        process.call(abs, -3)


def test_an_answer_that_nobody_waited_for_is_not_that_to_the_next_call(
    process: Worker, monkeypatch: pytest.MonkeyPatch
) -> None:
    def interrupt(stream: Any) -> None:
        raise KeyboardInterrupt

    with monkeypatch.context() as patched:
        patched.setattr(pickle, "load", interrupt)
        with pytest.raises(KeyboardInterrupt):
            process.call(abs, -3)
    assert process.call(abs, -4) == 4


def test_it_imports_from_where_this_process_does(
    process: Worker, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "elsewhere.py").write_text("def answer(): return 42\n")
    monkeypatch.syspath_prepend(tmp_path)
    assert process.call(importlib.import_module("elsewhere").answer) == 42


def test_errors_come_back_as_they_are(process: Worker, tmp_path: Path) -> None:
    with pytest.raises(SceneError, match=r"gone\.toml"):
        process.call(load_scene, tmp_path / "gone.toml")
    with pytest.raises(ZeroDivisionError):
        process.call(divmod, 1, 0)
    assert process.call(abs, -3) == 3


def test_what_a_library_prints_does_not_end_up_in_the_answer(process: Worker) -> None:
    assert process.call(os.system, "echo noise") == 0


def test_launches_of_many_paths_are_split_and_their_seeds_differ(monkeypatch: pytest.MonkeyPatch) -> None:
    """Rows come back in order."""
    monkeypatch.setattr(worker, "PATHS_AT_ONCE", 64)
    calls: list[tuple[int, int]] = []

    class Here:
        def call(self, function: Any, *arguments: Any) -> Any:
            calls.append((len(arguments[1]), arguments[2]))
            return function(*arguments)

    monkeypatch.setattr(worker, "worker", Here)
    pixels = np.arange(100)
    rows = means_elsewhere(_echo, load_scene(find_scene("hair-limb-rest")), pixels, 5, 4, None)
    np.testing.assert_array_equal(rows[:, 0], pixels)
    assert len(calls) == 7
    assert max(count * 4 for count, _ in calls) <= 64
    assert len({seed for _, seed in calls}) == len(calls)


def _echo(scene: Scene, pixels: NDArray[np.int64], seed: int, spp: int, clamp: float | None) -> Float64:
    return pixels[:, None].astype(np.float64)
