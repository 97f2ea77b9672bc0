"""A technique that is ready to draw frame after frame, and what a frame takes."""

from __future__ import annotations

import math
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

from realtime.clock import Clock
from realtime.context import renderer_name
from realtime.frame import Frame
from realtime.graph import Pass, Plan, Skip
from realtime.technique import Technique
from scenes.image import Float32, Image, require_finite


@dataclass(frozen=True)
class Rendering:
    """An image of a technique, and what a frame takes once everything is compiled and baked, reading back left out.

    `seconds` is the sum of `pass_seconds`; what is baked once is in `baked_seconds` alone.
    """

    image: Image
    skipped: tuple[Skip, ...]
    seconds: float
    pass_seconds: dict[str, float]
    baked_seconds: dict[str, float]


@dataclass(frozen=True)
class FrameSample:
    """What one frame took. `seconds` is the sum of `passes` by the clock of its technique."""

    seconds: float
    wall_seconds: float
    passes: Mapping[str, float]


class Prepared:
    """A technique once its first frame is drawn: compiled, uploaded, baked.

    Later frames run the passes that are not baked, with what the baked ones left. Frames of several techniques may
    alternate.

    Attributes
    ----------
    rendering : the first frame's image, and the time of its passes by the wall clock
    start_seconds : what is spent once: "compile", "upload", "bake", and the rest of the "first frame"
    """

    def __init__(self, technique: Technique, frame: Frame, plan: Plan, clock: Clock) -> None:
        """`frame` has run nothing yet; `clock` times the frames after the first."""
        self.technique = technique
        self._frame, self._plan, self._clock = frame, plan, clock
        self._baked: dict[str, dict[str, Any]] = {}
        took = self._first_frame()
        baked = {name: took.pop(name) for name in self._baked}
        self.start_seconds: Mapping[str, float] = {
            **frame.spent,
            "bake": sum(baked.values()),
            "first frame": sum(took.values()),
        }
        frame.clock = clock
        provenance: dict[str, Any] = {
            "scene": frame.scene.name,
            "technique": technique.name,
            "settings": dict(frame.settings),
            "renderer": renderer_name(frame.context),
        }
        pixels = require_finite(self.pixels(), f"image of {frame.scene.name}, {technique.name}")
        skipped = (*plan.skipped, *frame.skipped)
        self.rendering = Rendering(Image(pixels, provenance), skipped, sum(took.values()), took, baked)

    @property
    def clock(self) -> str:
        """How frames are timed, in words."""
        return self._clock.name

    @property
    def peak_bytes(self) -> int:
        """Bytes of all textures, renderbuffers and buffers that were alive at once so far."""
        return self._frame.device.peak

    def frame(self) -> FrameSample:
        """Draw one more frame."""
        self._frame.resources.clear()
        self._frame.skipped.clear()
        self._frame.device.release_target()
        steps = []
        kept: dict[str, Any] = {}
        for step in self._plan.passes:
            if step.is_baked:
                kept |= self._baked[step.name]
            else:
                steps.append((step.name, partial(self._run, step, kept)))
                kept = {}
        start = time.perf_counter()
        passes = self._clock.seconds_of(steps)
        wall = time.perf_counter() - start
        return FrameSample(sum(passes.values()), wall, passes)

    def pixels(self) -> Float32:
        """The quantity (H, W, C) in the last frame that was drawn."""
        return self._frame.read("image", 4)[..., list(self.technique.channels)]

    def _run(self, step: Pass, kept: Mapping[str, Any]) -> None:
        self._frame.resources.update(kept)
        step.run(self._frame)

    def _first_frame(self) -> dict[str, float]:
        """Run every pass, and keep what the baked ones write.

        Returns what each took by the wall clock, less compiling and uploading.
        """
        frame, seconds = self._frame, {}
        frame.instrument.begin(frame)
        for step in self._plan.passes:
            spent = sum(frame.spent.values())
            start = time.perf_counter()
            step.run(frame)
            frame.context.finish()
            seconds[step.name] = time.perf_counter() - start - (sum(frame.spent.values()) - spent)
            if step.is_baked:
                self._baked[step.name] = {name: frame.resources[name] for name in step.writes}
            frame.instrument.after_pass(step, frame)
        return seconds


def median_interval(values: Sequence[float]) -> tuple[float, float]:
    """The 95 % interval of the median of whatever distribution some values are drawn from, by their order.

    The interval from the k-th smallest to the k-th largest misses the median with the probability 2 P(B < k), B
    binomial with n trials of 1/2 (Conover 1999, "Practical Nonparametric Statistics", section 3.2). Fewer than six
    values cannot tell with 95 % confidence: theirs is all of their range.
    """
    ordered, n = sorted(values), len(values)
    k, missed = 1, 2 * 0.5**n
    while k < (n + 1) // 2:
        missed += 2 * math.comb(n, k) * 0.5**n
        if missed > 0.05:
            break
        k += 1
    return ordered[k - 1], ordered[n - k]
