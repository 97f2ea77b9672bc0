"""Media that scatter light, by name: skin, as measured."""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from scenes.errors import unknown_name
from scenes.image import Float64
from scenes.materials import Translucent
from scenes.units import Rgb

PER_MM = {"mm": 1.0, "m": 1000.0}
"""What a coefficient per mm is per unit of length."""


@dataclass(frozen=True)
class Medium:
    """A homogeneous medium.

    sigma_a : absorption, sigma_s : reduced scattering, both RGB per mm
    source  : key of the bibliography
    """

    sigma_a: Rgb
    sigma_s: Rgb
    source: str
    note: str


MEDIA = {
    "skin1": Medium(
        sigma_a=(0.032, 0.17, 0.48),
        sigma_s=(0.74, 0.88, 1.01),
        source="jensen-2001",
        note="Skin, fitted to what a camera saw of the light around a focused beam.",
    ),
    "skin2": Medium(
        sigma_a=(0.013, 0.070, 0.145),
        sigma_s=(1.09, 1.59, 1.79),
        source="jensen-2001",
        note="As skin1, of other skin, which absorbs less.",
    ),
    "dermis": Medium(
        sigma_a=(0.0367, 0.0888, 0.246),
        sigma_s=(3.19, 4.13, 5.43),
        source="jacques-2013",
        note=(
            "Skin without pigment, with 0.2 % of blood, as a spectrum; in three channels within 5 % of the brightest "
            "one for slabs of 0.2 to 10 mm. scenes/skin.py tells how."
        ),
    ),
}


def coefficients(material: Translucent, length_unit: Literal["m", "mm"]) -> tuple[Float64, Float64]:
    """Absorption sigma_a and reduced scattering sigma_s of a material, each (3,) RGB per unit of length of the scene.

    Raises
    ------
    InputError
        There is no medium of that name.
    """
    if material.medium is None:
        return np.array(material.sigma_a), np.array(material.sigma_s)
    if material.medium not in MEDIA:
        raise unknown_name("medium", material.medium, MEDIA)
    medium = MEDIA[material.medium]
    return PER_MM[length_unit] * np.array(medium.sigma_a), PER_MM[length_unit] * np.array(medium.sigma_s)
