"""Mean of the squared relative error as far as a display shows it."""

import numpy as np

from comparisons.metrics.rel_mse import denominator_floor, rel_mse
from comparisons.metrics.sample import Estimate, Samples, positive_mean
from comparisons.tonemap import exposure_for
from scenes.image import Float64


def rel_mse_clipped(image_test: Float64, samples: Samples) -> Estimate:
    """`rel_mse_eps1e-2` of image and truth, both clipped at display white: highlights count up to there, dark parts do.

    White is what the truth's exposure shows as 1, 5.6 times the truth's mean.

    Parameters
    ----------
    image_test : (H, W, C), linear.
    samples : the truth; any number of channels, with a positive mean.

    Returns
    -------
    A ratio of squares, clipped to 0 from below.

    Notes
    -----
    Each accumulator is clipped by itself. Where the truth y is near white, their mean is too low: by b = min(y, w) -
    E min(Y_i, w) >= 0 (Jensen), at most 0.4 standard deviations of one accumulator for Gaussian noise, and 0 a few of
    them from white on. An error e is thus read as e + b. Clipping the mean of all K accumulators is too low as well, by
    b / sqrt(K) at white and by less elsewhere, so that the gap g between the two, which is measured at each pixel,
    bounds b by g / (1 - 1 / sqrt(K)). What that may do to the result, the mean of (2 |e| b + b²) / (y² + floor), is
    added to both sides of the interval.
    """
    positive_mean(samples, "rel_mse_clipped")
    white = 1 / exposure_for(samples.mean, samples.mask)
    clipped = Samples(np.minimum(samples.accumulators, white), samples.mask, samples.alpha)
    image = np.minimum(image_test, white)
    estimate = rel_mse(image, clipped)
    if samples.is_exact:
        return estimate
    truth = np.minimum(samples.masked.mean(axis=0), white)
    gap = truth - clipped.masked.mean(axis=0)
    loss = gap / (1 - len(samples.accumulators) ** -0.5)
    changes = (2 * np.abs(image[samples.mask] - truth) + loss) * loss / (truth**2 + denominator_floor(clipped))
    allowance = float(changes.mean())
    low, high = max(0.0, estimate.low - allowance), estimate.high + allowance
    return Estimate(estimate.value, low, high, estimate.valid, estimate.note, estimate.floor)
