"""How long passes take: by the driver's timer queries on a GPU, by the wall clock where these are wrong."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager, nullcontext
from typing import TYPE_CHECKING, Any, Protocol

if TYPE_CHECKING:
    import moderngl

SOFTWARE = ("llvmpipe", "softpipe", "swiftshader", "swrast")
"""Renderers whose timer queries are wrong: llvmpipe's end when the work is queued, not when it is done."""

Step = tuple[str, Callable[[], Any]]


class Clock(Protocol):
    """Times the passes of a frame; whatever gives work to the GPU does so within `submission`."""

    @property
    def name(self) -> str:
        """What is measured, in words."""

    def submission(self) -> AbstractContextManager[Any]:
        """Around one command that gives work to the GPU."""

    def seconds_of(self, steps: Sequence[Step]) -> dict[str, float]:
        """Run named steps one after the other, and return what each took; the GPU is done when this returns."""


class WallClock:
    """By the wall clock, the GPU finished after each step: what the CPU does meanwhile counts too."""

    name = "wall clock around finish()"

    def __init__(self, context: moderngl.Context) -> None:
        self._context = context

    def submission(self) -> AbstractContextManager[Any]:
        return nullcontext()

    def seconds_of(self, steps: Sequence[Step]) -> dict[str, float]:
        self._context.finish()
        seconds: dict[str, float] = {}
        for name, run in steps:
            start = time.perf_counter()
            run()
            self._context.finish()
            seconds[name] = seconds.get(name, 0.0) + time.perf_counter() - start
        return seconds


class QueryClock:
    """By a TIME_ELAPSED query around each submission, summed for each step.

    A query around a whole step would count the gaps in which the GPU waits for the CPU. It is still the only one that
    misses nothing where steps submit work on their own: `whole_steps`. OpenGL nests no queries, so a submission within
    one is not timed apart.
    """

    def __init__(self, context: moderngl.Context, whole_steps: bool = False) -> None:
        self._context = context
        self._whole_steps = whole_steps
        self._idle: list[moderngl.Query] = []
        self._used: list[moderngl.Query] = []
        self._is_open = False

    @property
    def name(self) -> str:
        return "GPU timer queries around whole passes" if self._whole_steps else "GPU timer queries"

    @contextmanager
    def submission(self) -> Iterator[None]:
        if self._is_open:
            yield
            return
        query = self._idle.pop() if self._idle else self._context.query(time=True)
        self._used.append(query)
        self._is_open = True
        try:
            with query:
                yield
        finally:
            self._is_open = False

    def seconds_of(self, steps: Sequence[Step]) -> dict[str, float]:
        self._collected()
        ends = []
        for name, run in steps:
            with self.submission() if self._whole_steps else nullcontext():
                run()
            ends.append((name, len(self._used)))
        each = self._collected()
        seconds: dict[str, float] = {}
        begin = 0
        for name, end in ends:
            seconds[name] = seconds.get(name, 0.0) + sum(each[begin:end])
            begin = end
        return seconds

    def _collected(self) -> list[float]:
        """Seconds of all queries since the last time, once the GPU is done; they may be used again."""
        self._context.finish()
        seconds = [float(query.elapsed) * 1e-9 for query in self._used]
        self._idle += self._used
        self._used = []
        return seconds


def is_software(renderer: str) -> bool:
    """Whether GL_RENDERER names a driver that draws on the CPU."""
    return any(name in renderer.lower() for name in SOFTWARE)


def clock_for(context: moderngl.Context, whole_steps: bool = False) -> Clock:
    """The clock that is right for the driver."""
    if is_software(str(context.info["GL_RENDERER"])):
        return WallClock(context)
    return QueryClock(context, whole_steps)
