"""Complex refractive indices of metals at Rec. 709 primaries.

Mitsuba 3.9 keeps spectra of them, and renders in RGB with the colours that stand here: each spectrum as light of equal
energy would show it, by the CIE's colour matching functions of 1931. Its files say that they are from
the Luxpop database, those of Cr and W in the visible from Palik 1985, "Handbook of Optical Constants of Solids".
"""

import numpy as np

from scenes.image import Float64
from scenes.materials import MetalName

INDICES: dict[MetalName, tuple[tuple[float, float, float], tuple[float, float, float]]] = {
    "Ag": ((0.155276, 0.116728, 0.138388), (4.828354, 3.122222, 2.146901)),
    "Al": ((1.657501, 0.880405, 0.521244), (9.223812, 6.269502, 4.837004)),
    "Au": ((0.143036, 0.375307, 1.442045), (3.982997, 2.385556, 1.603359)),
    "Cr": ((4.369668, 2.916505, 1.654905), (5.206547, 4.231306, 3.754699)),
    "Cu": ((0.201005, 0.923750, 1.102215), (3.913262, 2.453045, 2.142090)),
    "W": ((4.370817, 3.300246, 2.998407), (3.500641, 2.604874, 2.273233)),
}


def refractive_index(metal: MetalName) -> tuple[Float64, Float64]:
    """Refractive index and extinction coefficient, each (3,) for R, G and B."""
    eta, k = INDICES[metal]
    return np.array(eta), np.array(k)
