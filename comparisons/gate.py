"""From a criterion and a measurement to a verdict."""

import math
from collections.abc import Iterable
from dataclasses import dataclass
from enum import StrEnum
from typing import Any

import numpy as np
from numpy.typing import NDArray

from comparisons.metrics.metric import check_image
from comparisons.metrics.sample import Estimate, Samples
from scenes.checks import Bounds, Criterion, RendererBounds
from scenes.errors import ImageError

# Past this many times the samples already spent, a prediction is no plan.
MAX_GROWTH = 4096


class Verdict(StrEnum):
    """From best to worst."""

    PASS = "PASS"
    INCONCLUSIVE = "INCONCLUSIVE"
    REGRESSED = "REGRESSED"
    FAIL = "FAIL"
    ERROR = "ERROR"


@dataclass(frozen=True)
class CriterionResult:
    """A criterion held against an estimate. An estimate that is not `valid` decides nothing.

    `renderer` names the OpenGL renderer that its bounds are written for, empty if they are for all. `place` is where
    they are written, FILE:LINE.
    """

    metric: str
    value: float
    low: float
    high: float
    min: float | None
    max: float | None
    verdict: Verdict
    reason: str
    note: str
    valid: bool = True
    floor: float | None = None
    renderer: str = ""
    place: str = ""


def judge(criterion: Criterion, estimate: Estimate, renderer: str = "") -> CriterionResult:
    """Hold an estimate against the bounds of a criterion for images that an OpenGL renderer of that name drew.

    PASS if the whole interval is within the bounds, FAIL if it is wholly outside one, else INCONCLUSIVE.

    A value that is not finite is an ERROR; an estimate that is not valid is INCONCLUSIVE.
    """
    bounds = criterion.bounds_on(renderer)
    return CriterionResult(
        metric=criterion.metric,
        value=estimate.value,
        low=estimate.low,
        high=estimate.high,
        min=bounds.min,
        max=bounds.max,
        verdict=_verdict(bounds, estimate),
        reason=bounds.reason,
        note=estimate.note,
        valid=estimate.valid,
        floor=estimate.floor,
        renderer=bounds.renderer if isinstance(bounds, RendererBounds) else "",
    )


def _verdict(bounds: Bounds, estimate: Estimate) -> Verdict:
    if not all(math.isfinite(number) for number in (estimate.value, estimate.low, estimate.high)):
        return Verdict.ERROR
    if not estimate.valid:
        return Verdict.INCONCLUSIVE
    least = -math.inf if bounds.min is None else bounds.min
    most = math.inf if bounds.max is None else bounds.max
    if least <= estimate.low and estimate.high <= most:
        return Verdict.PASS
    if estimate.high < least or estimate.low > most:
        return Verdict.FAIL
    return Verdict.INCONCLUSIVE


def worst(verdicts: Iterable[Verdict]) -> Verdict:
    """The last one in the order of `Verdict`. No verdict at all is an ERROR: nothing was judged."""
    order = list(Verdict)
    return max(verdicts, key=order.index, default=Verdict.ERROR)


def fit_exposure(image_test: NDArray[Any], samples: Samples) -> float:
    """The factor a for which a x is closest to the truth y: a = sum x y / sum x², over judged pixels and channels.

    The noise of the truth is in the numerator only, and linearly: the factor is unbiased.

    Parameters
    ----------
    image_test : (H, W, C), linear.
    samples : the truth.
    """
    test = check_image(image_test, samples)[samples.mask]
    energy = float(np.sum(test**2))
    if energy == 0:
        raise ImageError(
            "no exposure can be fitted: the image is black at every judged pixel. Check what the technique drew."
        )
    factor = float(np.sum(test * samples.masked.mean(axis=0))) / energy
    if factor <= 0:
        raise ImageError(
            f"no exposure can be fitted: the best factor is {factor:g}, it must be positive. Image and truth have "
            "nothing in common: check that both show the same quantity."
        )
    return factor


def spp_needed(result: CriterionResult, spp: int) -> int | None:
    """How many samples a pixel would decide an INCONCLUSIVE result that `spp` samples left open.

    The interval shrinks towards the value as N^-1/2.

    Returns
    -------
    None if samples are not the reason (decided, invalid, no noise), or if the centre is too close to a bound to tell.
    """
    if result.verdict is not Verdict.INCONCLUSIVE or not result.valid:
        return None
    centre = result.value
    least = -math.inf if result.min is None else result.min
    most = math.inf if result.max is None else result.max
    below, above = centre - result.low, result.high - centre
    if centre > most:
        growth = _growth(below, centre - most)
    elif centre < least:
        growth = _growth(above, least - centre)
    else:
        growth = max(_growth(above, most - centre), _growth(below, centre - least))
    if not 1 < growth <= MAX_GROWTH:
        return None
    return math.ceil(spp * growth)


def _growth(half_width: float, distance: float) -> float:
    """By which factor N must grow for the half-width to shrink to the distance; infinite if there is no distance."""
    return (half_width / distance) ** 2 if distance > 0 else math.inf
