"""Which of two images is closer to the truth, judged against the same samples of it.

Both errors E contain nearly the same noise, which therefore nearly cancels in their difference: common random numbers,
Kahn and Marshall, 1953, "Methods of reducing sample size in Monte Carlo computations". For squared errors, what is left
is even simpler than each of the two. With images a, b and accumulators Y_i of mean Y, the estimates U of
`comparisons.statistics.squared_errors` differ by

    U_A - U_B = (a - b) . (a + b - 2 Y):

the products of the accumulators are gone, and the difference is linear in the noise. For a linear statistic the
jackknife is unbiased, so that the sum of the pixels' jackknife variances is the variance of the mean. The spread over
pixels, of which `PixelEstimates.standard_error_of_mean` takes the smaller, contains the variation of the true
differences as well: it is smaller by chance only, by up to a fifth where the images differ in few pixels. There, the
quantile of Student's t for so few pixels more than makes up for it: 95 % intervals hold 94 to 99 %, measured with gamma
noise for 1 to 480 pixels and 16 to 256 samples. Only one or two pixels at 16 samples with a skewness of 6 hold 89 and
93 %.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum
from typing import Any

import numpy as np
from numpy.typing import NDArray

from comparisons.gate import MAX_GROWTH, fit_exposure
from comparisons.metrics import Estimate, Samples, check_image, evaluate
from comparisons.metrics.nrmse import relative_mse
from comparisons.metrics.rel_mse import denominator_floor, weight_allowance, weighted_errors, weights_are_blurred
from comparisons.metrics.sample import MIN_ACCUMULATORS
from comparisons.sequential import ALPHA_PER_SIDE, looks
from comparisons.statistics import PixelEstimates
from reference.estimator import Truth
from scenes.errors import InputError
from scenes.image import Float64

RELATIVE_MARGIN = 0.01
"""Of the larger E: half a percent of the error itself, which no budget and no choice of a technique hangs on."""

ABSOLUTE_MARGIN = 0.01**2
"""The E of an image that is 1 % off everywhere, about the least contrast that is seen at all. Between two images that
are both nearly perfect, a relative margin would ask for differences that nobody can see."""

"""Key of the provenance that tells which scene a linear image shows."""


class Preference(StrEnum):
    A = "A is better"
    B = "B is better"
    NEITHER = "no difference that matters"
    UNDECIDED = "undecided"


@dataclass(frozen=True)
class Candidate:
    """An image (H, W, C), linear; with `fit_exposure` it is judged times the one factor that suits it best."""

    image: NDArray[Any]
    fit_exposure: bool = False

    def exposed(self, samples: Samples) -> Float64:
        image = check_image(self.image, samples)
        return image * fit_exposure(image, samples) if self.fit_exposure else image


@dataclass(frozen=True)
class Difference:
    """The difference of two errors E, which are mean squares: the square of nrmse, or a relative squared error.

    a, b               : each error by itself, as its metric states it
    value, low, high   : E_A - E_B with its interval: below 0, A is better
    saving             : 1 - E_better / E_worse with its interval, within 0 and 1; None where the worse one may be 0
    margin             : differences up to this do not matter
    variance_reduction : what independent truths for A and B would multiply the variance of the difference by
    note               : why nothing can be decided on this, or empty
    """

    a: Estimate
    b: Estimate
    value: float
    low: float
    high: float
    saving: Estimate | None
    margin: float
    variance_reduction: float
    note: str

    @property
    def preference(self) -> Preference:
        """NEITHER if the whole interval is within the margin; else the better one if the interval excludes 0."""
        if self.note:
            return Preference.UNDECIDED
        if -self.margin <= self.low and self.high <= self.margin:
            return Preference.NEITHER
        if self.high < 0:
            return Preference.A
        return Preference.B if self.low > 0 else Preference.UNDECIDED

    def spp_needed(self, spp: int) -> int | None:
        """Samples a pixel that would decide what `spp` left open, as the interval shrinks with N^-1/2.

        None if something else than the interval keeps it open, or if no affordable number would do.
        """
        if self.note:
            return None
        distance = max(abs(self.value), self.margin - abs(self.value))
        growth = ((self.high - self.low) / 2 / distance) ** 2
        return math.ceil(spp * growth) if growth <= MAX_GROWTH else None


@dataclass(frozen=True)
class Comparison:
    """What was found, and the truth that it was found with."""

    difference: Difference
    truth: Truth


def compare(metric: str, a: Candidate, b: Candidate, truth_at: Callable[[int], Truth], limit: int) -> Comparison:
    """Double the samples until a preference is clear or `limit` of them are spent.

    Each side of the interval is missed with probability ALPHA_PER_SIDE over all looks, as in `sequential.decide`.

    Parameters
    ----------
    metric : a name in ERRORS.
    truth_at : gives the truth with at least that many samples a pixel.

    Raises
    ------
    InputError
        The metric is no sum over pixels.
    ImageError
        An image cannot be judged: its shape differs from the truth's, or a value is not finite; or the truth is black.
    """
    error_named(metric)
    planned = looks(limit)
    for spp in planned:
        truth = truth_at(spp)
        samples = Samples(truth.accumulators, truth.mask, ALPHA_PER_SIDE / len(planned))
        found = difference(metric, a.exposed(samples), b.exposed(samples), samples)
        if truth.is_exact or found.preference is not Preference.UNDECIDED:
            break
    return Comparison(found, truth)


def difference(metric: str, image_a: NDArray[Any], image_b: NDArray[Any], samples: Samples) -> Difference:
    """The difference of the errors of two images (H, W, C), both held against the same samples of the truth.

    Raises
    ------
    InputError
        The metric is no sum over pixels.
    ImageError
        An image cannot be judged, or the truth has no positive mean.
    """
    terms_of = error_named(metric)
    a, b = (evaluate(metric, image, samples) for image in (image_a, image_b))
    test_a, test_b = (check_image(image, samples)[samples.mask] for image in (image_a, image_b))
    errors_a, errors_b = (terms_of(test, with_accumulators(samples)) for test in (test_a, test_b))
    (error_a, terms_a), (error_b, terms_b) = errors_a, errors_b
    terms = PixelEstimates(terms_a.values - terms_b.values, terms_a.deviations - terms_b.deviations)
    standard_error = 0.0 if samples.is_exact else terms.standard_error_of_mean
    half_width = 0.0 if samples.is_exact else terms.half_width(samples.alpha)
    if metric == "rel_mse_eps1e-2" and not samples.is_exact and not weights_are_blurred(samples):
        changes = np.abs(terms.values)
        half_width += weight_allowance(samples, changes) * float(changes.mean())
    independent = math.hypot(terms_a.standard_error_of_mean, terms_b.standard_error_of_mean)
    value = error_a - error_b
    better, worse = (errors_a, errors_b) if value < 0 else (errors_b, errors_a)
    return Difference(
        a=a,
        b=b,
        value=value,
        low=value - half_width,
        high=value + half_width,
        saving=_saving(better, worse, samples.alpha) if (b if value < 0 else a).low > 0 else None,
        margin=max(RELATIVE_MARGIN * max(error_a, error_b), ABSOLUTE_MARGIN),
        variance_reduction=(independent / standard_error) ** 2 if standard_error > 0 else math.inf,
        note=_note(metric, a, samples) if standard_error > 0 else "",
    )


Terms = tuple[float, PixelEstimates]
"""An error E, and per-pixel terms whose mean has the noise of E."""


def _squared_nrmse(test: Float64, samples: Samples) -> Terms:
    return relative_mse(test, samples.masked)


def _rel_mse(test: Float64, samples: Samples) -> Terms:
    terms = weighted_errors(test, samples, denominator_floor(samples))
    return float(terms.values.mean()), terms


ERRORS: dict[str, Callable[[Float64, Samples], Terms]] = {
    "nrmse": _squared_nrmse,
    "rel_mse_eps1e-2": _rel_mse,
}
"""Metrics whose E is a mean over pixels, so that the noise of two of them can be subtracted pixel by pixel."""


def error_named(metric: str) -> Callable[[Float64, Samples], Terms]:
    """What gives the E of a metric, from judged pixels (P, C) and the truth.

    Raises
    ------
    InputError
        It has none.
    """
    if metric not in ERRORS:
        raise InputError(
            f"Found the metric '{metric}'; two images can be compared by {' or '.join(ERRORS)}, which are means over "
            "pixels and know their noise at each. Choose one of these."
        )
    return ERRORS[metric]


def with_accumulators(samples: Samples) -> Samples:
    """An exact truth as accumulators that agree."""
    if not samples.is_exact:
        return samples
    return Samples(np.repeat(samples.accumulators, MIN_ACCUMULATORS, axis=0), samples.mask, samples.alpha)


def _saving(better: Terms, worse: Terms, alpha: float) -> Estimate:
    """1 - r with r = E_better / E_worse, within 0 and 1. Delta method: r has the terms (better - r worse) / E_worse."""
    ratio = better[0] / worse[0]
    terms = PixelEstimates(
        (better[1].values - ratio * worse[1].values) / worse[0],
        (better[1].deviations - ratio * worse[1].deviations) / worse[0],
    )
    half_width = terms.half_width(alpha)
    value, low, high = np.clip([1 - ratio, 1 - ratio - half_width, 1 - ratio + half_width], 0.0, 1.0).tolist()
    return Estimate(value, low, high)


def _note(metric: str, estimate: Estimate, samples: Samples) -> str:
    """Why an interval cannot be trusted. Fireflies are the truth's: what one estimate says of them holds for both."""
    if not estimate.valid:
        return estimate.note
    if metric == "rel_mse_eps1e-2" and weights_are_blurred(samples):
        return (
            f"the truth is still so noisy that {metric} weights by blurred pixels, which moves the difference by more "
            "than its interval is wide"
        )
    return ""
