"""What a rough clear film lets through, by numerical integration: a small table for shaders, made once.

As Mitsuba's `roughplastic` has it, from which a scene's films take their definition: light meets the facets once; 64
cosines; Gauss's nodes in a square that is mapped to the disk of visible normals, 32² for light that enters and 128² for
light from within. Against 256² nodes that leaves 1e-4 to 5e-4 of the light below the film. The mean over 64 cosines,
which counts both ends in full, makes internal reflection 1.5 % smaller than its integral.
"""

from dataclasses import dataclass
from functools import cache

import numpy as np

from realtime.fresnel import fresnel_dielectric
from scenes.image import Float64

COSINES = 64
ENTERING, INTERNAL = 32, 128
HORIZON = 1e-6
"""Stands for a cosine of 0, at which nothing is defined."""


@dataclass(frozen=True)
class FilmTable:
    """`transmittance` (64,) from outside, over cosines; `internal`, what it throws back of diffuse light."""

    transmittance: Float64
    internal: float


@cache
def film_table(alpha: float, ior: float) -> FilmTable:
    """The table of a film of GGX facets with that roughness and index."""
    cosines = np.linspace(0.0, 1.0, COSINES)
    through = np.array([_transmitted(max(c, HORIZON), alpha, ior) for c in cosines])
    back = np.array([_reflected(max(c, HORIZON), alpha, 1 / ior) for c in cosines])
    return FilmTable(through, float(2 * np.mean(back * cosines)))


def _transmitted(cosine: float, alpha: float, eta: float) -> float:
    m_z, d, weights = _facets(cosine, alpha, ENTERING)
    cos_t = np.sqrt(1 - (1 - d * d) / eta**2)
    below = -(m_z * (d / eta - cos_t) - cosine / eta)
    return float(np.sum(weights * (1 - fresnel_dielectric(d, eta)) * _smith(below, alpha)))


def _reflected(cosine: float, alpha: float, eta: float) -> float:
    m_z, d, weights = _facets(cosine, alpha, INTERNAL)
    above = 2 * d * m_z - cosine
    return float(np.sum(weights * fresnel_dielectric(d, eta) * _smith(above, alpha)))


def _facets(cosine: float, alpha: float, count: int) -> tuple[Float64, Float64, Float64]:
    """Visible facets under a direction: height of their normals, cosine to the direction, and weights that sum to 1.

    Heitz 2018, "Sampling the GGX Distribution of Visible Normals": facets are seen as parts of a hemisphere.
    """
    a, b, weights = _disk(count)
    sine = np.sqrt(1 - cosine**2)
    length = np.hypot(alpha * sine, cosine)
    s, c = alpha * sine / length, cosine / length
    share = (1 + c) / 2
    b = (1 - share) * np.sqrt(np.maximum(1 - a * a, 0)) + share * b
    height = np.sqrt(np.maximum(1 - a * a - b * b, 0))
    x, y, z = alpha * (height * s - b * c), alpha * a, height * c + b * s
    norm = np.sqrt(x * x + y * y + z * z)
    return z / norm, np.minimum((x * sine + z * cosine) / norm, 1.0), weights


@cache
def _disk(count: int) -> tuple[Float64, Float64, Float64]:
    """Points of the unit disk and weights that sum to 1.

    Shirley & Chiu 1997, "A Low Distortion Map Between Disk and Square"; the number of nodes is even, so that none is on
    a diagonal's centre.
    """
    nodes, w = np.polynomial.legendre.leggauss(count)
    u, v = (n.ravel() for n in np.meshgrid(nodes, nodes))
    along_u = np.abs(u) > np.abs(v)
    r = np.where(along_u, u, v)
    phi = np.where(along_u, v / u, 2 - u / v) * np.pi / 4
    return r * np.cos(phi), r * np.sin(phi), np.outer(w, w).ravel() / 4


def _smith(cosine: Float64, alpha: float) -> Float64:
    """Part of facets that a direction sees; nothing below the horizon."""
    c = np.maximum(cosine, 0.0)
    seen: Float64 = 2 * c / (c + np.sqrt(alpha**2 + (1 - alpha**2) * c * c))
    return seen
