"""Root of the mean squared error."""

import numpy as np

from comparisons.metrics.rms import rms
from comparisons.metrics.sample import Estimate, Samples
from comparisons.statistics import PixelEstimates, firefly_note, squared_errors
from scenes.image import Float64


def rmse(image_test: Float64, samples: Samples) -> Estimate:
    """sqrt(mean (x - y)²) over the judged pixels and all channels, without the truth's noise.

    Parameters
    ----------
    image_test : (H, W, C), linear.
    samples : the truth; any number of channels, noisy or exact.

    Returns
    -------
    In the quantity's unit. The interval is that of the square, whose root is taken at the end: an estimate of a small
    error is often negative before it is clipped to 0.
    """
    if samples.is_exact:
        return rms(image_test, samples)
    errors = mean_squared_errors(image_test, samples)
    square, half_width = float(errors.values.mean()), errors.half_width(samples.alpha)
    note = firefly_note(samples.masked - samples.masked.mean(axis=0))
    return rooted(square, square - half_width, square + half_width, samples, note)


def mean_squared_errors(image_test: Float64, samples: Samples) -> PixelEstimates:
    """Unbiased squared errors of the judged pixels, each the mean over its channels."""
    errors = squared_errors(image_test[samples.mask] - samples.masked)
    channels = samples.masked.shape[2]
    return PixelEstimates(errors.values / channels, errors.deviations / channels)


def rooted(square: float, low: float, high: float, samples: Samples, note: str = "") -> Estimate:
    """The estimate of a root from that of its square; what is below 0 becomes 0."""
    value, low, high = np.sqrt(np.maximum(0.0, [square, low, high])).tolist()
    floor = float(np.sqrt(samples.variance_of_mean.mean()))
    return Estimate(value, low, high, valid=not note, note=note, floor=floor)
