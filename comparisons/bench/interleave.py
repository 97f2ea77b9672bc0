"""Timing several things in one run, in turns, so that whatever else the machine does hits all of them alike.

Every round runs each task once, in an order of its own. A task is done once its median is known well enough, or has
taken as much time as it may.
"""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from statistics import median
from typing import Generic, TypeVar

import numpy as np

from comparisons.bench.result import FrameCost, Interval
from realtime.timing import FrameSample, Prepared, median_interval

T = TypeVar("T")

KNOWN_WELL = 0.05
"""A median whose 95 % interval spans less than this share of it needs no more rounds..."""

FEWEST_TO_KNOW = 15
"""...from so many samples on: fewer may agree by chance."""

FEWEST_FOR_INTERVAL = 6
"""A median of fewer samples has no 95 % interval."""

PATIENCE = 6.0
"""So many times its time a task may take to get that many."""


@dataclass
class Task(Generic[T]):
    """Something to time: `run` does it once, `seconds_of` reads from what it returns how long that took.

    It is run `most` times at most in each turn; samples of earlier turns count for the median alone.
    """

    name: str
    run: Callable[[], T]
    seconds_of: Callable[[T], float]
    most: int
    samples: list[T] = field(default_factory=list)
    spent: float = 0.0
    before: int = 0

    def once(self) -> float:
        """Run it and keep what it returns; returns the seconds that passed."""
        start = time.perf_counter()
        self.samples.append(self.run())
        passed = time.perf_counter() - start
        self.spent += passed
        return passed

    def again(self) -> None:
        """Begin another turn: what came before does not make it done."""
        self.before, self.spent = len(self.samples), 0.0

    @property
    def seconds(self) -> list[float]:
        return [self.seconds_of(sample) for sample in self.samples]

    def is_done(self, limit: float) -> bool:
        """Whether another round would be of no use, or take more than `limit` seconds in all."""
        count = len(self.samples) - self.before
        if count >= self.most or self.spent >= PATIENCE * limit:
            return True
        if self.spent >= limit:
            return count >= FEWEST_FOR_INTERVAL
        if count < FEWEST_TO_KNOW:
            return False
        known = middle(self.seconds)
        return known.high - known.low <= KNOWN_WELL * known.value


def interleave(
    tasks: Sequence[Task[T]], limit: float, step: Callable[[str, float], None], rng: np.random.Generator
) -> None:
    """Run all tasks in turns until each is done, after about `limit` seconds of its own.

    The first round is a warm-up and counts for nothing, but for tasks that use up their time with it: those are slow
    enough for a first run to be like any other. Tasks that have samples are warm.
    """
    for number, task in enumerate(tasks):
        if task.samples:
            continue
        step(f"{task.name}, warming up", number / len(tasks))
        if task.once() < limit:
            task.samples.clear()
            task.spent = 0.0
    while open_tasks := [task for task in tasks if not task.is_done(limit)]:
        for index in rng.permutation(len(open_tasks)):
            task = open_tasks[index]
            step(f"timing in turns: {task.name}", 1 - len(open_tasks) / len(tasks))
            task.once()


def middle(samples: Sequence[float]) -> Interval:
    """The median and its 95 % interval."""
    return Interval(median(samples), *median_interval(samples))


def frame_cost(prepared: Prepared, samples: Sequence[FrameSample]) -> FrameCost:
    """Medians of some frames of a technique, at least one."""
    return FrameCost(
        seconds=middle([sample.seconds for sample in samples]),
        wall_seconds=median(sample.wall_seconds for sample in samples),
        frames=len(samples),
        clock=prepared.clock,
        start_seconds=dict(prepared.start_seconds),
        passes={name: median(sample.passes[name] for sample in samples) for name in samples[0].passes},
        peak_bytes=prepared.peak_bytes,
    )
