"""Measure one batch: draw every variant and judge it, then time them all and the path tracer in turns."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from comparisons.bench.interleave import Task, frame_cost, interleave
from comparisons.bench.points import Judge, Judged
from comparisons.bench.result import Point, Slope, Traced
from comparisons.bench.sweep import Batch, Variant
from comparisons.bench.traced import Shot, Tracer, peak_bytes, slope_of, traced_of, tracing_tasks
from comparisons.runner import fault_of
from realtime.render import Renderer
from realtime.techniques import technique
from realtime.timing import FrameSample, Prepared
from reference.estimator import Reference
from reference.store import Store
from scenes.errors import LightgaugeError, NoCompiler, NoGraphics

MOST_BYTES = 1 << 30
"""Of textures and buffers of all techniques that are ready at once. What is beyond that is timed in a turn of its own,
with the path tracer again."""

Step = Callable[[str, float], None]


@dataclass(frozen=True)
class Pace:
    """How long is measured: `seconds` for each point, `frames` at most."""

    seconds: float
    frames: int


@dataclass
class Measured:
    """What came out of a batch. `skipped` has what was left out, and why."""

    points: list[Point] = field(default_factory=list)
    traced: list[Traced] = field(default_factory=list)
    slopes: list[Slope] = field(default_factory=list)
    skipped: list[dict[str, str]] = field(default_factory=list)
    gl_renderer: str = ""


@dataclass(frozen=True)
class Ready:
    """A variant whose image is judged, and which is timed next."""

    variant: Variant
    prepared: Prepared
    judged: Judged
    task: Task[FrameSample]


def measured(batch: Batch, store: Store, pace: Pace, step: Step) -> Measured:
    """Errors and times of a batch.

    Raises
    ------
    NoGraphics, NoCompiler
        Nothing can be rendered on this machine.
    LightgaugeError
        There is no truth to judge by.
    """
    reference = Reference(batch.scene, store, step)
    reference.require_defined(batch.quantity)
    bench = _Bench(batch, reference, pace, step)
    bench.measure()
    return bench.found


class _Bench:
    """A batch that is being measured."""

    def __init__(self, batch: Batch, reference: Reference, pace: Pace, step: Step) -> None:
        self.batch = batch
        self.pace = pace
        self.step: Step = lambda what, done: step(f"{batch.name}: {what}", done)
        self.step("truth", 0.0)
        self.judge = Judge(reference, batch.quantity, batch.metric)
        self.tracer = Tracer(reference.studio, self.judge.truth)
        self.renderer = Renderer(batch.scene)
        self.rng = np.random.default_rng(0)
        self.found = Measured()

    def measure(self) -> None:
        """Measure all variants, as many at a time as there is memory for, each time beside the path tracer."""
        self.step("path tracer", 0.0)
        shots = tracing_tasks(self.tracer, self.judge, self.pace.frames) if self.batch.is_traced else {}
        left = list(self.batch.variants)
        while left:
            left = self._turn(left, list(shots.values()))
        self.found.traced = [
            traced_of(self.batch.effect, self.tracer, self.batch.metric, spp, task, peak_bytes(self.tracer, spp))
            for spp, task in shots.items()
        ]
        slope = slope_of(self.found.traced)
        self.found.slopes = [slope] if slope else []

    def _turn(self, variants: Sequence[Variant], shots: Sequence[Task[Shot]]) -> list[Variant]:
        """Measure the first of the variants; returns the others, for which there was no memory."""
        ready: list[Ready] = []
        left = list(variants)
        while left and sum(one.prepared.peak_bytes for one in ready) < MOST_BYTES:
            self.step(left[0].name, 1 - len(left) / len(self.batch.variants))
            ready += self._ready(left.pop(0))
        tasks: list[Task[Any]] = [*(one.task for one in ready), *shots]
        for shot in shots:
            shot.again()
        interleave(tasks, self.pace.seconds, self.step, self.rng)
        self.found.points += [self._point(one) for one in ready]
        return left

    def _ready(self, variant: Variant) -> list[Ready]:
        """The variant, drawn and judged; nothing, and the reason among what was skipped, if that cannot be done."""
        try:
            prepared = self.renderer.prepared(technique(variant.technique), variant.settings)
            image = prepared.rendering.image
            judged = self.judge.judged(image.pixels, variant.is_fitted)
        except (NoGraphics, NoCompiler):
            raise
        except LightgaugeError as error:
            why = str(error)
        except Exception as error:  # noqa: BLE001  # techniques and drivers may raise anything; the other ones go on
            why = fault_of(error)
        else:
            self.found.gl_renderer = str(image.provenance["renderer"])
            task = Task(variant.name, prepared.frame, lambda frame: frame.seconds, self.pace.frames)
            return [Ready(variant, prepared, judged, task)]
        self.found.skipped.append({"what": f"{self.batch.name}: {variant.name}", "why": why})
        return []

    def _point(self, ready: Ready) -> Point:
        batch, sensor = self.batch, self.batch.scene.sensor
        return Point(
            scene=batch.scene.name,
            effect=batch.effect,
            quantity=batch.quantity,
            technique=ready.variant.technique,
            settings=ready.variant.settings,
            swept=ready.variant.swept,
            width=sensor.width,
            height=sensor.height,
            metric=batch.metric,
            error=ready.judged.error,
            cost=frame_cost(ready.prepared, ready.task.samples),
            is_fitted=ready.variant.is_fitted,
            spp=ready.judged.spp,
            note=ready.judged.note,
        )
