"""The path tracer as a technique among others: the error and the time of images of few samples a pixel.

Its error is measured as that of any technique: images are really rendered, with seeds of their own, and held against
the truth. That the error falls as spp^-1/2 is not put in: where samples are stratified over a lens or a lamp, it falls
faster. Rendered are the pixels that are judged and no others, by kernels that are compiled already.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from statistics import fmean

import numpy as np

from comparisons.bench.interleave import Task, middle
from comparisons.bench.points import ALPHA, Judge
from comparisons.bench.powerlaw import LEAST_SIZES, fit_power_law
from comparisons.bench.result import Interval, Slope, Traced
from comparisons.metrics import Estimate, metric_named
from comparisons.statistics import student_quantile
from reference.estimator import LARGEST_BLOCK, PATHS_A_LAUNCH, Truth, seed_of
from reference.studio import Launch, Studio
from scenes.image import Float32

SPP = tuple(1 << doublings for doublings in range(11))

FEWEST_SPP = 8
"""Images of up to so many samples a pixel are always rendered; of more, as long as one takes `LONGEST` at most."""

LONGEST = 1.0
"""Seconds."""

HEADROOM = 4
"""The truth has at least so many times the samples of an image that is held against it."""

IMAGES = 8
"""So many images of one number of samples are judged at most."""


@dataclass(frozen=True)
class Shot:
    """An image that was rendered to be timed; the error is that of the first ones only."""

    seconds: float
    error: Estimate | None = None


class Tracer:
    """Renders images of a quantity with few samples; each has its own seeds."""

    def __init__(self, studio: Studio, truth: Truth) -> None:
        self.studio = studio
        self.truth = truth
        self._images = 0

    def image(self, spp: int) -> tuple[Float32, float]:
        """An image (H, W, C), 0 where it is not judged, and the seconds that rendering it took."""
        self._images += 1
        mask = self.truth.mask
        pixels = np.zeros((*mask.shape, self.truth.accumulators.shape[-1]), dtype=np.float32)
        total = np.zeros((int(mask.sum()), pixels.shape[-1]))
        seconds = 0.0
        for launch in self._launches(spp, len(total)):
            rendered = self.studio.launch(launch, mask)
            total[launch.first : launch.last] += launch.spp / spp * rendered.pixels[:, : pixels.shape[-1]]
            seconds += rendered.seconds
        pixels[mask] = total
        return pixels, seconds

    def exact(self) -> float:
        """Seconds that an exact image takes."""
        return self.studio.exact(self.truth.quantity, self.truth.key).seconds

    def _launches(self, spp: int, rows: int) -> Iterator[Launch]:
        """As those of a truth: at most so many samples and paths at a time."""
        for first_sample in range(0, spp, LARGEST_BLOCK):
            count = min(LARGEST_BLOCK, spp - first_sample)
            step = max(1, PATHS_A_LAUNCH // count)
            for first in range(0, rows, step):
                seed = seed_of(f"{self.truth.key}/bench", self._images, first_sample, first)
                what = f"path tracing with {spp} spp"
                yield Launch(
                    self.truth.quantity, self.truth.key, count, seed, first, min(rows, first + step), what, 0.0
                )


def tracing_tasks(tracer: Tracer, judge: Judge, most: int) -> dict[int, Task[Shot]]:
    """What is timed, by the samples a pixel: 1, 2, 4 ..., or 0 for an exact truth. Kernels are compiled by this."""
    if tracer.truth.is_exact:
        tracer.exact()
        return {0: Task("path tracer, exact", lambda: Shot(tracer.exact()), lambda shot: shot.seconds, most)}
    tracer.image(1)
    tasks: dict[int, Task[Shot]] = {}
    for spp in SPP:
        if HEADROOM * spp > judge.limit or (spp > FEWEST_SPP and _is_long(tracer, spp)):
            break
        tasks[spp] = _task(tracer, judge, spp, most)
    judge.grow(HEADROOM * max(tasks, default=1))
    return tasks


def _is_long(tracer: Tracer, spp: int) -> bool:
    """Whether images take longer than `LONGEST`; of one that does, it may be chance."""
    return min(tracer.image(spp)[1] for _ in range(2)) > LONGEST


def _task(tracer: Tracer, judge: Judge, spp: int, most: int) -> Task[Shot]:
    def shoot() -> Shot:
        image, seconds = tracer.image(spp)
        is_judged = len(task.samples) < IMAGES
        return Shot(seconds, judge.estimate(image) if is_judged else None)

    task = Task(f"path tracer, {spp} spp", shoot, lambda shot: shot.seconds, most)
    return task


def expected_error(metric: str, errors: Sequence[Estimate]) -> Interval:
    """The error to expect of an image, from those of several, and its 95 % interval.

    A root mean square is taken of errors that are roots, a mean of all others. The interval is Student's t over the
    images, and what the truth leaves open in each, together.
    """
    power = metric_named(metric).noise_power or 1
    powers = [[e.low**power, e.value**power, e.high**power] for e in errors]
    low, value, high = (fmean(column) for column in zip(*powers, strict=True))
    spread = float(np.std([p[1] for p in powers], ddof=1)) / math.sqrt(len(powers)) if len(powers) > 1 else 0.0
    over_images = student_quantile(ALPHA, len(powers) - 1) * spread if len(powers) > 1 else 0.0
    below, above = (math.hypot(over_images, known) for known in (value - low, high - value))
    rooted = [max(0.0, x) ** (1 / power) for x in (value, value - below, value + above)]
    return Interval(*rooted)


def traced_of(effect: str, tracer: Tracer, metric: str, spp: int, task: Task[Shot], peak_bytes: int) -> Traced:
    """What was measured of the images of so many samples a pixel."""
    truth, scene = tracer.truth, tracer.studio.scene
    errors = [shot.error for shot in task.samples if shot.error is not None]
    return Traced(
        scene=scene.name,
        effect=effect,
        quantity=truth.quantity,
        integrator=truth.integrator.name,
        variant=str(tracer.studio.mitsuba.variant()),
        width=scene.sensor.width,
        height=scene.sensor.height,
        spp=spp,
        metric=metric,
        error=expected_error(metric, errors) if errors else Interval(0.0, 0.0, 0.0),
        seconds=middle(task.seconds),
        peak_bytes=peak_bytes,
        images=len(task.samples),
    )


def peak_bytes(tracer: Tracer, spp: int) -> int:
    """The most memory that rendering an image takes; it is what Dr.Jit has allocated, the scene included."""
    import drjit as dr

    backend = dr.backend_v(tracer.studio.mitsuba.Float)
    dr.detail.malloc_clear_statistics()
    if spp:
        tracer.image(spp)
    else:
        tracer.exact()
    return int(dr.detail.malloc_watermark(backend))


def slope_of(traced: Sequence[Traced]) -> Slope | None:
    """How the error of the path tracer falls with its samples; None if there are too few images, or exact ones."""
    law_of = [one for one in traced if one.spp > 0 and one.error.value > 0]
    if len(law_of) < LEAST_SIZES:
        return None
    law = fit_power_law([one.spp for one in law_of], [one.error.value for one in law_of])
    first = law_of[0]
    return Slope(
        first.scene,
        first.quantity,
        first.metric,
        first.width,
        first.height,
        law.exponent,
        law.coefficient,
        law.r2,
    )
