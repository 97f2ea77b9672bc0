"""How much smaller an error has become: with a paired interval, over any number of scenes together."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from comparisons.difference import error_named, with_accumulators
from comparisons.metrics import Samples, check_image
from comparisons.metrics.rel_mse import weight_allowance, weights_are_blurred
from comparisons.statistics import PixelEstimates, effective_count, student_quantile
from scenes.image import Float64


@dataclass(frozen=True)
class Pair:
    """Two images (H, W, C) of one scene and the truth that both are held against."""

    before: Float64
    after: Float64
    samples: Samples


@dataclass(frozen=True)
class Gain:
    """1 - (sum of E after) / (sum of E before) with its interval: above 0 is better, and 1 is no error left."""

    value: float
    low: float
    high: float


def gain(metric: str, pairs: Sequence[Pair]) -> Gain | None:
    """The part of the error E that is gone, over all scenes together.

    Both images of a scene are held against the same samples, whose noise nearly cancels. By the delta method the ratio
    r of the sums has, in each scene, the terms (after - r before) / (sum of E before) of each pixel; scenes have
    samples of their own, so that their variances add up.

    Parameters
    ----------
    metric : a name in `comparisons.difference.ERRORS`.
    pairs : one a scene; the `alpha` of their samples is the probability that the interval misses on either side.

    Returns
    -------
    None if the error before may have been 0: no part of it can be stated.
    """
    before = [_terms(metric, pair.before, pair.samples) for pair in pairs]
    after = [_terms(metric, pair.after, pair.samples) for pair in pairs]
    samples = [pair.samples for pair in pairs]
    total = sum(error for error, _ in before)
    if total - _half_width(metric, [terms for _, terms in before], samples) <= 0:
        return None
    ratio = sum(error for error, _ in after) / total
    changes = [
        PixelEstimates((a.values - ratio * b.values) / total, (a.deviations - ratio * b.deviations) / total)
        for (_, b), (_, a) in zip(before, after, strict=True)
    ]
    half_width = _half_width(metric, changes, samples)
    return Gain(1 - ratio, 1 - ratio - half_width, 1 - ratio + half_width)


def _terms(metric: str, image: Float64, samples: Samples) -> tuple[float, PixelEstimates]:
    return error_named(metric)(check_image(image, samples)[samples.mask], with_accumulators(samples))


def _half_width(metric: str, terms: Sequence[PixelEstimates], samples: Sequence[Samples]) -> float:
    """Of the interval of the sum over scenes of the means over their pixels."""
    variance = sum(t.standard_error_of_mean**2 for t in terms)
    if variance == 0:
        return 0.0
    contributions = np.concatenate([t.variances / len(t.values) ** 2 for t in terms])
    quantile = student_quantile(samples[0].alpha, max(1.0, effective_count(contributions)))
    return quantile * math.sqrt(variance) + sum(_allowance(metric, t, s) for t, s in zip(terms, samples, strict=True))


def _allowance(metric: str, terms: PixelEstimates, samples: Samples) -> float:
    """What noisy weights may add, as in `comparisons.difference.difference`."""
    if metric != "rel_mse_eps1e-2" or samples.is_exact or weights_are_blurred(samples):
        return 0.0
    changes = np.abs(terms.values)
    return weight_allowance(samples, changes) * float(changes.mean())
