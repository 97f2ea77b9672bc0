"""What a smooth surface between two dielectrics reflects."""

import numpy as np

from scenes.image import Float64


def fresnel_dielectric(cos_i: Float64 | float, eta: float) -> Float64:
    """The part of unpolarised light that is reflected: F_dielectric of glsl/lib/fresnel.glsl, for arrays.

    Born & Wolf 1999, "Principles of Optics", section 1.5.2. `eta` is the index behind the surface over the one before
    it; 1 at total reflection.
    """
    cos2_t = 1 - (1 - cos_i**2) / eta**2
    cos_t = np.sqrt(np.maximum(cos2_t, 0))
    s = (cos_i - eta * cos_t) / (cos_i + eta * cos_t)
    p = (eta * cos_i - cos_t) / (eta * cos_i + cos_t)
    reflected: Float64 = np.where(cos2_t > 0, (s * s + p * p) / 2, 1.0)
    return reflected
