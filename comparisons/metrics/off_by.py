"""The share of the area that is far off: a root mean square would belong to a few wild values alone."""

import numpy as np

from comparisons.metrics.sample import Estimate, Samples, require_exact
from scenes.image import Float64


def off_by_1(image_test: Float64, samples: Samples) -> Estimate:
    """Share of the judged pixels with |x - y| > 1, over all channels as a vector, in the quantity's unit.

    The truth must be exact.
    """
    require_exact(samples, "off_by_1")
    distance = np.linalg.norm(image_test[samples.mask] - samples.masked[0], axis=-1)
    return Estimate.exact(float(np.mean(distance > 1)))
