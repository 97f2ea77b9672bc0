"""How linear radiance is shown: one exposure from the truth, then the sRGB curve. Nothing else here tone-maps."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from scenes import srgb
from scenes.errors import ImageError
from scenes.image import Bool, Float64

# Linear display value that the mean gets: the reflectance of a photographer's grey card. Up to 5.5 times the mean is
# shown without clipping. The mean is used, not a bright percentile: it does not rise with the noise of the truth.
MEAN_VALUE = 0.18


def exposure_for(truth_mean: NDArray[Any], mask: Bool) -> float:
    """The factor that brings the truth's mean over judged pixels and channels to 0.18.

    Parameters
    ----------
    truth_mean : (H, W, C), linear.
    mask : (H, W), the pixels that count.
    """
    if not mask.any():
        raise ImageError(
            "no exposure can be chosen: the mask is empty. At least one pixel is needed: check the sensor's view."
        )
    mean = float(np.mean(truth_mean[mask], dtype=np.float64))
    if not (np.isfinite(mean) and mean > 0):
        raise ImageError(
            f"no exposure can be chosen: the truth's mean is {mean:g}; it must be positive and finite: light the "
            "subject."
        )
    return MEAN_VALUE / mean


def to_display(pixels: NDArray[Any], exposure: float) -> Float64:
    """sRGB code values in [0, 1] of linear pixels (H, W, C); what exceeds the range is clipped."""
    return srgb.encode(np.asarray(pixels, dtype=np.float64) * exposure)
