"""Root of the mean squared error over the mean of the truth, near the outline of what is judged."""

from dataclasses import replace

import numpy as np

from comparisons.metrics.nrmse import nrmse
from comparisons.metrics.sample import Estimate, Samples
from scenes.image import Bool, Float64

# Of the distance from the outline to the pixel farthest from it: on a sphere, where it is seen at less than 26
# degrees from its surface.
BAND = 0.1
# Distances run between the centres of pixels, the outline half-way.
HALF_PIXEL = 0.5


def limb_nrmse(image_test: Float64, samples: Samples) -> Estimate:
    """`nrmse` over the limb: what is wrong at grazing angles shows there, and hardly in the mean of an image.

    Parameters
    ----------
    image_test : (H, W, C), linear.
    samples : the truth; any number of channels, with a positive mean on the limb.

    Returns
    -------
    A ratio, to the mean of the limb's own truth.
    """
    return nrmse(image_test, replace(samples, mask=limb(samples.mask)))


def limb(mask: Bool) -> Bool:
    """(H, W), the pixels of a mask at most a tenth of its half-width from its outline, and those next to it.

    What the image's border cuts off counts as not judged.
    """
    from scipy.ndimage import distance_transform_edt

    depth = distance_transform_edt(np.pad(mask, 1))[1:-1, 1:-1] - HALF_PIXEL
    near: Bool = mask & (depth <= max(HALF_PIXEL, BAND * float(depth.max())))
    return near
