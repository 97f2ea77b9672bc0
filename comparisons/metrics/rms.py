"""Root mean square difference, absolute and relative."""

import numpy as np

from comparisons.metrics.sample import Estimate, Samples, require_exact
from scenes.errors import ImageError
from scenes.image import Float64


def rms(image_test: Float64, samples: Samples) -> Estimate:
    """sqrt(mean (x - y)²) over the judged pixels and all channels, in the quantity's unit. The truth must be exact."""
    require_exact(samples, "rms")
    return Estimate.exact(_rms(image_test[samples.mask] - samples.masked[0]))


def rel_rms(image_test: Float64, samples: Samples) -> Estimate:
    """sqrt(mean (x - y)² / mean y²) over the judged pixels and all channels. The truth must be exact and not all 0."""
    require_exact(samples, "rel_rms")
    truth = _rms(samples.masked[0])
    if truth == 0:
        raise ImageError(
            "rel_rms divides by the truth, which is 0 at every judged pixel: choose rms or max_abs instead."
        )
    return Estimate.exact(_rms(image_test[samples.mask] - samples.masked[0]) / truth)


def _rms(values: Float64) -> float:
    return float(np.sqrt(np.mean(values**2)))
