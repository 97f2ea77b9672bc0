"""The share of the area that is wrongly lit or wrongly in shadow."""

import numpy as np

from comparisons.metrics.sample import Estimate, Samples, require_exact, require_fractions
from scenes.image import Float64


def misclassified(image_test: Float64, samples: Samples) -> Estimate:
    """mean |x - y| over the judged pixels and all channels, of a truth that is exact and a fraction at each pixel.

    Where every point is either lit or not, that is the share of the area on which image and truth differ, but for
    errors of both signs in one pixel, which cancel.
    """
    require_exact(samples, "misclassified")
    require_fractions(samples, "misclassified")
    return Estimate.exact(float(np.mean(np.abs(image_test[samples.mask] - samples.masked[0]))))
