"""The interval of a metric that has no unbiased form."""

from collections.abc import Callable

import numpy as np

from comparisons.metrics.sample import Estimate, Samples
from scenes.image import Float64

# What noise adds falls as N^-1 where an image is clearly wrong, as N^-1/2 near a perfect one, and slower where the
# metric saturates (dssim_tonemapped) or is steep at zero (flip: power 0.7). N^-1/4 is slower than all measured decays.
SLOWEST_DECAY = 0.25


Error = Callable[[Float64, Float64], float]
"""Of two displayed images (H, W, C), the true one first."""


def bracket(error: Error, display: Callable[[Float64], Float64], image_test: Float64, samples: Samples) -> Estimate:
    """A perceptual error between a bound below the noise-free value, and its raw value above it.

    Parameters
    ----------
    error : takes two images as `display` returns them, the true one first, returns an error >= 0.
    display : takes linear values (H, W, C) that are 0 outside the mask.
    image_test : (H, W, C), linear.
    samples : the truth.

    Returns
    -------
    `value` is the extrapolation 2 M(N) - M(N/2), within the bracket; `high` the raw value, on which a PASS rests;
    `floor` the error between two independent halves of the truth: what their noise alone reads.

    Notes
    -----
    Noise in the truth adds to these metrics: the raw value M(N) is too large. With M(N/2) the mean over the two halves,
    and an excess that falls as N^-p or faster, the noise-free value is at least M(N) - (M(N/2) - M(N)) / (2^p - 1).
    With p = 1/2, the decay to expect near a perfect image, this reads up to 0.1 for a perfect image under strong noise.
    The extrapolation is p = 1, right where the image is clearly wrong. Random ups and downs of M are not covered:
    measured, 1 % of the value at 32x32 pixels, less for larger images.
    """
    test = display(np.where(samples.mask[..., None], image_test, 0.0))
    raw = error(display(samples.mean), test)
    if samples.is_exact:
        return Estimate.exact(raw)
    first, second = (display(half) for half in samples.half_means)
    excess = (error(first, test) + error(second, test)) / 2 - raw
    low = min(raw, max(0.0, raw - excess / (2**SLOWEST_DECAY - 1)))
    return Estimate(min(raw, max(low, raw - excess)), low, raw, floor=error(first, second))
