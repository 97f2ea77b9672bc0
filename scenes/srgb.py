"""The sRGB transfer curve. IEC 61966-2-1:1999, "Default RGB colour space - sRGB", equations 5 to 8."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from scenes.image import Float64

# Where the linear toe meets the power curve. The standard rounds these two, which leaves a step of 3e-8 between the
# branches.
LINEAR_TOE = 0.0031308
ENCODED_TOE = 0.04045


def encode(linear: NDArray[Any]) -> Float64:
    """Linear values to sRGB code values. Domain and range [0, 1]; values outside are clipped."""
    clipped = np.clip(np.asarray(linear, dtype=np.float64), 0.0, 1.0)
    return np.where(clipped <= LINEAR_TOE, 12.92 * clipped, 1.055 * clipped ** (1 / 2.4) - 0.055)


def decode(encoded: NDArray[Any]) -> Float64:
    """sRGB code values to linear values. Domain and range [0, 1]; values outside are clipped."""
    clipped = np.clip(np.asarray(encoded, dtype=np.float64), 0.0, 1.0)
    return np.where(clipped <= ENCODED_TOE, clipped / 12.92, ((clipped + 0.055) / 1.055) ** 2.4)
