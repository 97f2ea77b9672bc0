"""Ctrl-C, put off until nothing is half done."""

import signal
from collections.abc import Callable
from contextlib import AbstractContextManager
from types import FrameType, TracebackType
from typing import ParamSpec

P = ParamSpec("P")


class Interrupt(AbstractContextManager["Interrupt"]):
    """Within the `with` block the first SIGINT is noted and raised at the next point that `after` marks.

    A second one is raised at once. Libraries that are interrupted amid their own work report something else: Mitsuba,
    while it is imported, a missing compiler.
    """

    def __init__(self) -> None:
        self._is_noted = False

    def __enter__(self) -> "Interrupt":
        self._before = signal.signal(signal.SIGINT, self._note)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        signal.signal(signal.SIGINT, self._before)
        self._raise_if_noted()

    def after(self, callback: Callable[P, None]) -> Callable[P, None]:
        """A callback after which a noted interruption is raised."""

        def called(*arguments: P.args, **named: P.kwargs) -> None:
            callback(*arguments, **named)
            self._raise_if_noted()

        return called

    def _raise_if_noted(self) -> None:
        if self._is_noted:
            raise KeyboardInterrupt

    def _note(self, number: int, frame: FrameType | None) -> None:
        self._raise_if_noted()
        self._is_noted = True
