"""Progress for people: a bar on a terminal, plain lines elsewhere."""

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from types import TracebackType
from typing import Any

from comparisons.countdown import Countdown
from comparisons.interrupt import Interrupt
from comparisons.result import CheckResult
from comparisons.suite import Progress
from comparisons.summary import line_of

PLAIN_EVERY_SECONDS = 10.0
"""How often a long step says so where there is no terminal."""

TIME_LEFT_EVERY_SECONDS = 60.0
"""How often the time left is said there between checks that are quicker than that."""


class Display(AbstractContextManager["Display"]):
    """Shows `total` checks being finished, or with 0 just the steps of other long work.

    Use `progress` as the suite's callbacks within the `with` block. A `countdown` is told of the checks, and the time
    left that it tells is shown.
    """

    def __init__(
        self,
        total: int,
        line_of: Callable[[CheckResult], str],
        write: Callable[[str], None],
        countdown: Countdown | None = None,
    ) -> None:
        self.total = total
        self.done = 0
        self._countdown = countdown or Countdown({}, {})
        self._line_of = line_of
        self._write = write
        self._bar: Any = None
        self._task: Any = None
        self._last = self._last_left = time.monotonic()

    @property
    def progress(self) -> Progress:
        return Progress(self._step, self._finished, self._countdown.took)

    def __enter__(self) -> "Display":
        if sys.stderr.isatty():
            from rich.console import Console
            from rich.progress import BarColumn, MofNCompleteColumn, TextColumn, TimeElapsedColumn
            from rich.progress import Progress as Bar

            columns = (
                *([MofNCompleteColumn()] if self.total else []),
                BarColumn(),
                TimeElapsedColumn(),
                TextColumn("{task.fields[left]}"),
                TextColumn("{task.description}", markup=False),
            )
            self._bar = Bar(*columns, console=Console(stderr=True), transient=True)
            self._task = self._bar.add_task("", total=self.total or 1, left=self._time_left)
            self._bar.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._bar is not None:
            self._bar.stop()

    def _step(self, what: str, fraction: float) -> None:
        if self._bar is not None:
            completed = self.done + min(fraction, 0.99)
            self._bar.update(self._task, completed=completed, description=what, left=self._time_left)
            return
        now = time.monotonic()
        if now - self._last >= PLAIN_EVERY_SECONDS:
            self._last = now
            self._write(", ".join(filter(None, (f"{self._count}{what}, {fraction:.0%}", self._time_left))))
            self._last_left = now

    @property
    def _time_left(self) -> str:
        return self._countdown.said(time.monotonic())

    @property
    def _count(self) -> str:
        return f"[{self.done}/{self.total}] " if self.total else ""

    def _finished(self, result: CheckResult) -> None:
        self.done += 1
        self._last = time.monotonic()
        self._countdown.finished(result.id, self._last)
        line = f"{self._count}{self._line_of(result)}"
        if self._bar is not None:
            self._bar.update(self._task, completed=self.done, left=self._time_left)
            self._bar.console.print(line, markup=False, highlight=False)
            return
        self._write(line)
        if self._last - self._last_left >= TIME_LEFT_EVERY_SECONDS and self._time_left:
            self._last_left = self._last
            self._write(f"{self._count}{self._time_left}")


@contextmanager
def steps(write: Callable[[str], None]) -> Iterator[Callable[[str, float], None]]:
    """What shows the steps of long work that has no checks to count."""
    with Interrupt() as interrupt, Display(0, line_of, write) as display:
        yield interrupt.after(display.progress.step)
