"""The interval of a metric that has no unbiased form."""

from collections.abc import Callable

from comparisons.metrics.sample import Estimate, Samples
from scenes.image import Float64

# What noise adds falls as N^-1 where an image is clearly wrong, as N^-1/2 near a perfect one, and slower where the
# metric saturates (dssim_tonemapped) or is steep at zero (flip: power 0.7). N^-1/4 is slower than all measured decays.
SLOWEST_DECAY = 0.25


def bracket(error: Callable[[Float64], float], samples: Samples) -> Estimate:
    """A perceptual error between an extrapolation below the noise-free value, and its raw value above it.

    Parameters
    ----------
    error : takes a truth (H, W, C) that is 0 outside the mask, returns an error >= 0.
    samples : the truth.

    Notes
    -----
    Noise in the truth adds to these metrics: the raw value M(N) is too large. With M(N/2) the mean over the two halves,
    and an excess that falls as N^-p or faster, the noise-free value is at least M(N) - (M(N/2) - M(N)) / (2^p - 1).
    With p = 1/2, the decay to expect near a perfect image, this reads up to 0.1 for a perfect image under strong noise.
    Random ups and downs of M are not covered: measured, 1 % of the value at 32x32 pixels, less for larger images.
    """
    raw = error(samples.mean)
    if samples.is_exact:
        return Estimate.exact(raw)
    first, second = samples.half_means
    excess = (error(first) + error(second)) / 2 - raw
    limit = raw - excess / (2**SLOWEST_DECAY - 1)
    return Estimate(raw, low=min(raw, max(0.0, limit)), high=raw)
