from types import SimpleNamespace
from typing import Any

import pytest

from realtime.clock import QueryClock, WallClock, clock_for, is_software


class Query:
    """Takes the seconds of work that a `Gpu` was given while it was open."""

    def __init__(self, gpu: "Gpu") -> None:
        self.gpu = gpu
        self.elapsed = 0

    def __enter__(self) -> None:
        assert not self.gpu.is_measured, "OpenGL nests no queries"
        self.gpu.is_measured = True
        self.gpu.measured = 0.0

    def __exit__(self, *error: object) -> None:
        self.gpu.is_measured = False
        self.elapsed = round(self.gpu.measured * 1e9)


class Gpu:
    """A context whose work takes the time that it is told to; queries see that, and idle gaps within them."""

    def __init__(self, renderer: str = "NVIDIA H200") -> None:
        self.info = {"GL_RENDERER": renderer}
        self.is_measured, self.measured, self.made, self.finished = False, 0.0, 0, 0

    def query(self, time: bool) -> Query:
        assert time
        self.made += 1
        return Query(self)

    def finish(self) -> None:
        self.finished += 1

    def takes(self, seconds: float) -> None:
        self.measured += seconds


def pass_of(clock: Any, gpu: Gpu, *works: float, gap: float = 100.0) -> Any:
    """A pass that submits work, and leaves the GPU idle for `gap` seconds after each."""

    def run() -> None:
        for seconds in works:
            with clock.submission():
                gpu.takes(seconds)
            gpu.takes(gap)

    return run


@pytest.fixture
def gpu() -> Gpu:
    return Gpu()


def test_submissions_are_summed_for_each_pass_and_gaps_left_out(gpu: Gpu) -> None:
    clock = QueryClock(gpu)  # type: ignore[arg-type]
    found = clock.seconds_of(
        [("a", pass_of(clock, gpu, 1.0, 2.0)), ("none", pass_of(clock, gpu)), ("b", pass_of(clock, gpu, 4.0))]
    )
    assert found == pytest.approx({"a": 3.0, "none": 0.0, "b": 4.0})


def test_passes_of_one_name_are_added_up(gpu: Gpu) -> None:
    clock = QueryClock(gpu)  # type: ignore[arg-type]
    assert clock.seconds_of([("a", pass_of(clock, gpu, 1.0)), ("a", pass_of(clock, gpu, 2.0))]) == {"a": 3.0}


def test_a_submission_within_another_is_counted_once(gpu: Gpu) -> None:
    clock = QueryClock(gpu)  # type: ignore[arg-type]

    def nested() -> None:
        with clock.submission():
            gpu.takes(1.0)
            with clock.submission():
                gpu.takes(2.0)

    assert clock.seconds_of([("a", nested)]) == {"a": 3.0}


def test_around_whole_passes_nothing_is_missed_and_gaps_count(gpu: Gpu) -> None:
    clock = QueryClock(gpu, whole_steps=True)  # type: ignore[arg-type]
    assert clock.seconds_of([("a", pass_of(clock, gpu, 1.0, gap=0.5)), ("b", lambda: gpu.takes(7.0))]) == {
        "a": 1.5,
        "b": 7.0,
    }
    assert "whole passes" in clock.name


def test_queries_are_used_again_and_what_was_submitted_before_does_not_count(gpu: Gpu) -> None:
    clock = QueryClock(gpu)  # type: ignore[arg-type]
    pass_of(clock, gpu, 9.0)()
    for _ in range(3):
        assert clock.seconds_of([("a", pass_of(clock, gpu, 1.0, 2.0))]) == {"a": 3.0}
    assert gpu.made == 2


def test_a_pass_that_fails_leaves_the_clock_usable(gpu: Gpu) -> None:
    clock = QueryClock(gpu)  # type: ignore[arg-type]

    def fails() -> None:
        with clock.submission():
            gpu.takes(1.0)
            raise ValueError

    with pytest.raises(ValueError):
        clock.seconds_of([("a", fails)])
    assert clock.seconds_of([("a", pass_of(clock, gpu, 2.0))]) == {"a": 2.0}


def test_the_wall_clock_waits_for_the_gpu_after_each_pass(monkeypatch: pytest.MonkeyPatch) -> None:
    now = 0.0

    def finish() -> None:
        nonlocal now
        now += 1.0

    def run() -> None:
        nonlocal now
        now += 0.25

    monkeypatch.setattr("realtime.clock.time.perf_counter", lambda: now)
    clock = WallClock(SimpleNamespace(finish=finish))  # type: ignore[arg-type]
    assert clock.seconds_of([("a", run), ("b", run), ("a", run)]) == {"a": 2.5, "b": 1.25}


@pytest.mark.parametrize(
    ("renderer", "software"),
    [
        ("llvmpipe (LLVM 15.0.6, 256 bits)", True),
        ("softpipe", True),
        ("ANGLE (Google, Vulkan 1.3.0 (SwiftShader Device (Subzero)))", True),
        ("NVIDIA H200/PCIe/SSE2", False),
        ("AMD Radeon RX 6800 (radeonsi, navi21, LLVM 15.0.6)", False),
    ],
)
def test_timer_queries_are_for_gpus_alone(renderer: str, software: bool) -> None:
    assert is_software(renderer) is software
    assert isinstance(clock_for(Gpu(renderer)), WallClock if software else QueryClock)  # type: ignore[arg-type]
