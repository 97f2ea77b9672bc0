import time
from collections import Counter
from itertools import pairwise
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from comparisons.bench.interleave import FEWEST_FOR_INTERVAL, FEWEST_TO_KNOW, Task, frame_cost, interleave, middle
from comparisons.bench.result import Interval
from realtime.timing import FrameSample


def unheard(what: str, fraction: float) -> None:
    assert 0 <= fraction <= 1


def steady(name: str, seconds: float, most: int = 50) -> Task[float]:
    """A task that says it took exactly so long."""
    return Task(name, lambda: seconds, lambda sample: sample, most)


def sleeping(name: str, seconds: float) -> Task[float]:
    """A task that takes at least so long."""

    def run() -> float:
        time.sleep(seconds)
        return seconds

    return Task(name, run, lambda sample: sample, 100)


def test_all_tasks_take_turns_in_an_order_of_their_own() -> None:
    order: list[str] = []
    rng = np.random.default_rng(1)

    def task(name: str) -> Task[float]:
        def run() -> float:
            order.append(name)
            return float(rng.uniform())

        return Task(name, run, lambda sample: sample, 20)

    interleave([task(name) for name in "abc"], 10.0, unheard, np.random.default_rng(0))
    rounds = [order[i : i + 3] for i in range(0, len(order), 3)]
    assert len(rounds) == 21
    assert all(Counter(one) == Counter("abc") for one in rounds)
    assert any(one != two for one, two in pairwise(rounds[1:]))


def test_the_warm_up_counts_for_nothing() -> None:
    taken = iter([100.0] + 60 * [1.0])
    task = Task("first is slow", lambda: next(taken), float, 50)
    interleave([task], 10.0, unheard, np.random.default_rng(0))
    assert 100.0 not in task.seconds


def test_a_median_that_is_known_well_ends_the_rounds_and_most_does_too() -> None:
    known = steady("known", 1.0)
    interleave([known], 10.0, unheard, np.random.default_rng(0))
    assert len(known.samples) == FEWEST_TO_KNOW
    limited = steady("limited", 1.0, most=3)
    interleave([limited], 10.0, unheard, np.random.default_rng(0))
    assert len(limited.samples) == 3


def test_what_is_known_from_an_earlier_turn_takes_part_in_the_next_one() -> None:
    known, late = steady("known", 1.0), steady("late", 2.0)
    interleave([known], 10.0, unheard, np.random.default_rng(0))
    known.again()
    interleave([known, late], 10.0, unheard, np.random.default_rng(0))
    assert [len(one.samples) for one in (known, late)] == [2 * FEWEST_TO_KNOW, FEWEST_TO_KNOW]


def test_time_ends_the_rounds_once_there_is_an_interval_and_patience_before() -> None:
    quick, slow = sleeping("quick", 0.004), sleeping("slow", 0.03)
    interleave([quick, slow], 0.01, unheard, np.random.default_rng(0))
    assert len(quick.samples) == FEWEST_FOR_INTERVAL
    assert len(slow.samples) < FEWEST_FOR_INTERVAL


def test_the_interval_of_a_median_holds_it_as_often_as_it_says() -> None:
    rng = np.random.default_rng(3)
    held = [(i := middle(rng.exponential(size=20).tolist())).low <= np.log(2) <= i.high for _ in range(500)]
    assert np.mean(held) == pytest.approx(0.959, abs=0.03)  # 95.9 % is the coverage of the 6th to the 15th of 20


def test_the_cost_of_a_frame_is_the_median_of_several() -> None:
    prepared: Any = SimpleNamespace(clock="a clock", start_seconds={"compile": 1.0}, peak_bytes=7)
    samples = [FrameSample(s, 2 * s, {"a": s / 3, "b": 2 * s / 3}) for s in (3.0, 1.0, 2.0, 9.0, 2.5)]
    cost = frame_cost(prepared, samples)
    assert cost.seconds == Interval(2.5, 1.0, 9.0)
    assert (cost.wall_seconds, cost.frames) == (5.0, 5)
    assert cost.passes == pytest.approx({"a": 2.5 / 3, "b": 5 / 3})
    assert (cost.clock, cost.start_seconds, cost.peak_bytes) == ("a clock", {"compile": 1.0}, 7)
