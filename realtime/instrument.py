"""What looks into a frame while it is drawn: the shaders before they are compiled, the resources after each pass."""

from __future__ import annotations

from typing import TYPE_CHECKING

from realtime.graph import Pass
from realtime.shader import Source

if TYPE_CHECKING:
    from realtime.frame import Frame


class Instrument:
    """Does nothing. A subclass may change shaders and look at what they write; it must not change what is drawn."""

    def rewrite(self, source: Source, stage: str) -> Source:
        """The shader to compile in place of `source`; `stage` is a value of `realtime.shader.STAGES`."""
        return source

    def begin(self, frame: Frame) -> None:
        """Called before the first pass of a frame."""

    def after_pass(self, step: Pass, frame: Frame) -> None:
        """Called when a pass has run and the GPU is done with it."""


NO_INSTRUMENT = Instrument()
