"""Root of the mean squared error over the mean of the truth."""

import numpy as np

from comparisons.metrics.sample import Estimate, Samples, positive_mean
from comparisons.statistics import PixelEstimates, firefly_note, squared_errors
from scenes.image import Float64


def nrmse(image_test: Float64, samples: Samples) -> Estimate:
    """sqrt(mean (x - y)²) / mean(y) over the judged pixels and all channels, without the truth's noise.

    Parameters
    ----------
    image_test : (H, W, C), linear.
    samples : the truth; any number of channels, with a positive mean.

    Returns
    -------
    A ratio. The interval is that of the squared ratio, whose root is taken at the end: an estimate of a small error is
    often negative before it is clipped to 0.
    """
    mean = positive_mean(samples, "nrmse")
    test = image_test[samples.mask]
    if samples.is_exact:
        return Estimate.exact(float(np.sqrt(np.mean((test - samples.masked[0]) ** 2))) / mean)
    relative, error = relative_mse(test, samples.masked)
    half_width = error.half_width(samples.alpha)
    value, low, high = np.sqrt(np.maximum(0.0, [relative, relative - half_width, relative + half_width])).tolist()
    note = firefly_note(samples.masked - samples.masked.mean(axis=0))
    floor = float(np.sqrt(samples.variance_of_mean.mean())) / mean
    return Estimate(value, low, high, valid=not note, note=note, floor=floor)


def relative_mse(test: Float64, accumulators: Float64) -> tuple[float, PixelEstimates]:
    """Unbiased mean squared error over the squared mean E, and per-pixel terms whose mean has the noise of E.

    Parameters
    ----------
    test : (P, C)
    accumulators : (K, P, C)

    Notes
    -----
    E = T / m² with T the mean squared error and m the mean of the truth, both noisy. To first order (delta method)
    dE = dT / m² - 2 E dm / m, so the terms are U_p / (C m²) - 2 E mean_c(Y_p) / m.
    """
    k, _, channels = accumulators.shape
    errors = squared_errors(test - accumulators)
    mean = float(accumulators.mean())
    scale = 1 / (channels * mean**2)
    relative = float(errors.values.mean()) * scale
    level = accumulators.mean(axis=2)
    level_mean = level.mean(axis=0)
    slope = -2 * relative / mean
    terms = PixelEstimates(
        values=scale * errors.values + slope * level_mean,
        deviations=scale * errors.deviations + slope * (level_mean - level) / (k - 1),
    )
    return relative, terms
