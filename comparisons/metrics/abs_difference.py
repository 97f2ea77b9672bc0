"""The largest absolute differences."""

import numpy as np

from comparisons.metrics.sample import Estimate, Samples, require_exact
from scenes.image import Float64


def p99_abs(image_test: Float64, samples: Samples) -> Estimate:
    """99th percentile of |x - y| over judged pixels and channels, in the quantity's unit. The truth must be exact."""
    require_exact(samples, "p99_abs")
    return Estimate.exact(float(np.percentile(np.abs(image_test[samples.mask] - samples.masked[0]), 99)))


def max_abs(image_test: Float64, samples: Samples) -> Estimate:
    """max |x - y| over judged pixels and channels, in the quantity's unit. The truth must be exact."""
    require_exact(samples, "max_abs")
    return Estimate.exact(float(np.max(np.abs(image_test[samples.mask] - samples.masked[0]))))
