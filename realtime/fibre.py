"""How a hair scatters light from afar: its lobes, baked into the table that shaders look up.

Marschner et al. 2003, "Light Scattering from Human Hair Fibers": light is reflected (R), passes through (TT), or is
reflected once inside (TRT); what goes round more often is a fourth lobe. Each is a longitudinal distribution (d'Eon
et al. 2011, "An Energy-Conserving Hair Reflectance Model", eq. 7) times an azimuthal one (Chiang et al. 2016, "A
Practical and Controllable Hair and Fur Model for Production Path Tracing"), the latter averaged over the fibre's width:
a function of the inclination and of the azimuth between eye and light, which is the table.

Angles: inclinations count from the plane across the fibre, sines are those of the angle towards its tip.
"""

import math
from dataclasses import dataclass
from functools import cache

import numpy as np

from realtime.fresnel import fresnel_dielectric
from scenes.image import Float32, Float64
from scenes.materials import Fibre

LOBES = 4
"""R, TT, TRT, and the rest."""

INCLINATIONS, AZIMUTHS = 48, 96
"""Of the table: from 0 to a right angle, and from 0 to pi. Straight lines between its entries are within .1 %."""

ACROSS = 400
"""Places across the fibre's width, those of Gauss and Legendre, of which the table is the mean."""

EYES = 512
"""Inclinations over which what a fibre sends is integrated."""

GRAZING = 1e-4
"""The cosine that stands for 0 where one looks along the fibre."""


@dataclass(frozen=True)
class FibreTable:
    """A fibre, baked.

    azimuthal : (LOBES, INCLINATIONS, AZIMUTHS, 3) what each lobe sends per unit of azimuth, the mean over the width
    albedo    : (INCLINATIONS, 3) the part of even light from everywhere that is sent to an eye at an inclination
    sent      : (INCLINATIONS, 3) the part of light from an inclination that is sent anywhere; the same, were the model
        reciprocal
    variances : (LOBES,) of the longitudinal distributions
    tilts     : (LOBES,) [rad] by which the scales turn each lobe
    """

    azimuthal: Float64
    albedo: Float64
    sent: Float64
    variances: Float64
    tilts: Float64


@cache
def fibre_table(fibre: Fibre) -> FibreTable:
    """The table of a fibre, kept for as long as the process runs."""
    h, weights = np.polynomial.legendre.leggauss(ACROSS)
    cosines = np.maximum(np.cos(np.linspace(0, np.pi / 2, INCLINATIONS)), GRAZING)
    parts, inside = attenuation(fibre, cosines, h)
    azimuths, scale = np.linspace(0, np.pi, AZIMUTHS), logistic_scale(fibre.beta_n)
    outside, weights = np.arcsin(h), weights / 2
    azimuthal = np.zeros((LOBES, INCLINATIONS, AZIMUTHS, 3))
    for p in range(LOBES - 1):
        turned = 2 * p * inside - 2 * outside + p * np.pi
        spread = trimmed_logistic(azimuths[None, :, None] - turned[:, None, :], scale)
        azimuthal[p] = np.einsum("tah,thc,h->tac", spread, parts[p], weights)
    azimuthal[-1] = np.einsum("thc,h->tc", parts[-1], weights)[:, None] / (2 * np.pi)
    albedo = np.einsum("pthc,h->tc", parts, weights)
    spreads, tilts = variances(fibre.beta_m), np.radians(fibre.tilt_deg) * np.array([-2.0, 1.0, 4.0, 0.0])
    whole = np.einsum("pthc,h->ptc", parts, weights)
    return FibreTable(azimuthal, albedo, _sent(whole, spreads, tilts), spreads, tilts)


def _sent(whole: Float64, spreads: Float64, tilts: Float64) -> Float64:
    """`FibreTable.sent` from what lobes send (LOBES, INCLINATIONS, 3): the mean of light from both ends of the fibre.

    Eyes are weighted by the width that the fibre shows them.
    """
    nodes, weights = np.polynomial.legendre.leggauss(EYES)
    eye, weights = nodes * np.pi / 2, weights * np.pi / 2
    lights = np.linspace(0, np.pi / 2, INCLINATIONS)
    lights[-1] = np.arccos(GRAZING)
    at = np.abs(eye) / (np.pi / 2) * (INCLINATIONS - 1)
    low = np.minimum(at.astype(int), INCLINATIONS - 2)
    part = (at - low)[:, None]
    total = np.zeros((INCLINATIONS, 3))
    for p in range(LOBES):
        sin_p, cos_p = np.sin(eye + tilts[p]), np.abs(np.cos(eye + tilts[p]))
        lobe = whole[p, low] * (1 - part) + whole[p, low + 1] * part
        for end in (1, -1):
            sin_o, cos_o = end * np.sin(lights)[:, None], np.cos(lights)[:, None]
            M = longitudinal(sin_p, cos_p, sin_o, cos_o, spreads[p])
            total += np.einsum("te,ec,e->tc", M, lobe, weights * np.cos(eye) ** 2) / 2
    return total / np.cos(lights)[:, None]


def variances(beta_m: float) -> Float64:
    """Of the longitudinal lobes. Chiang et al. 2016, eq. 7, and Marschner et al. 2003, table 1, for TT and TRT."""
    v = (0.726 * beta_m + 0.812 * beta_m**2 + 3.7 * beta_m**20) ** 2
    return np.array([v, v / 4, 4 * v, 4 * v])


def logistic_scale(beta_n: float) -> float:
    """Scale of the azimuthal distributions. Chiang et al. 2016, eq. 8."""
    return float(np.sqrt(np.pi / 8) * (0.265 * beta_n + 1.194 * beta_n**2 + 5.372 * beta_n**22))


def trimmed_logistic(azimuth: Float64, scale: float) -> Float64:
    """The logistic distribution on a circle, cut off opposite its middle. Chiang et al. 2016, eq. 12."""
    x = np.abs((azimuth + np.pi) % (2 * np.pi) - np.pi) / scale
    decay = np.exp(-x)
    density: Float64 = decay / (scale * (1 + decay) ** 2 * np.tanh(np.pi / (2 * scale)))
    return density


def attenuation(fibre: Fibre, cosines: Float64, h: Float64) -> tuple[Float64, Float64]:
    """Parts (LOBES, T, H, 3) of light that leave by each lobe, and the angle (T, H) of the path inside to the normal.

    cosines (T,) are those of the inclination, h (H,) places across the width from -1 to 1. Chiang et al. 2016, eq. 9.
    """
    cos_i, h = cosines[:, None], h[None, :]
    sin2_i = 1 - cos_i**2
    sin_inside = h * cos_i / np.sqrt(fibre.ior**2 - sin2_i)
    path = 2 * np.sqrt(1 - sin_inside**2) / np.sqrt(1 - sin2_i / fibre.ior**2)
    kept = np.exp(-path[..., None] * np.array(fibre.sigma_a))
    F = fresnel_dielectric(cos_i * np.sqrt(1 - h**2), fibre.ior)[..., None]
    R = np.broadcast_to(F, kept.shape)
    TT = (1 - F) ** 2 * kept
    TRT = TT * kept * F
    return np.stack([R, TT, TRT, TRT * kept * F / (1 - kept * F)]), np.arcsin(sin_inside)


def longitudinal(sin_i: Float64, cos_i: Float64, sin_o: Float64, cos_o: Float64, variance: float) -> Float64:
    """d'Eon et al. 2011, eq. 7: its integral over the cosine-weighted inclination is 1 [1/rad]."""
    from scipy.special import i0e

    k = 1 / variance
    exponent = k * (cos_i * cos_o - sin_i * sin_o - 1)
    density: Float64 = i0e(k * cos_i * cos_o) * np.exp(exponent) * k / -np.expm1(-2 * k)
    return density


def scattering(table: FibreTable, tangent: Float64, to_eye: Float64, to_light: Float64) -> Float64:
    """Radiance (N, 3) that the fibre sends to the eye, mean over its width, per unit of irradiance across the beam.

    All directions are unit vectors (N, 3). The integral over all lights is the albedo. The float64 twin of
    glsl/hair_light/scattering.glsl.
    """
    sin_i, sin_o = (np.sum(tangent * w, axis=-1) for w in (to_eye, to_light))
    cos_i, cos_o = (np.sqrt(np.maximum(1 - s * s, 0)) for s in (sin_i, sin_o))
    across = np.sum(to_eye * to_light, axis=-1) - sin_i * sin_o
    azimuth = np.arccos(np.clip(across / np.maximum(cos_i * cos_o, GRAZING**2), -1, 1))
    looked_up = _azimuthal_at(table, cos_i, azimuth)
    total = np.zeros((*sin_i.shape, 3))
    for p in range(LOBES):
        turn, lift = np.cos(table.tilts[p]), np.sin(table.tilts[p])
        sin_p, cos_p = sin_i * turn + cos_i * lift, np.abs(cos_i * turn - sin_i * lift)
        total += longitudinal(sin_p, cos_p, sin_o, cos_o, table.variances[p])[..., None] * looked_up[p]
    return total


def _azimuthal_at(table: FibreTable, cos_i: Float64, azimuth: Float64) -> Float64:
    y = np.arccos(np.clip(cos_i, 0, 1)) / (np.pi / 2) * (INCLINATIONS - 1)
    x = azimuth / np.pi * (AZIMUTHS - 1)
    i, k = np.minimum(y.astype(int), INCLINATIONS - 2), np.minimum(x.astype(int), AZIMUTHS - 2)
    y, x = (y - i)[..., None], (x - k)[..., None]
    B = table.azimuthal
    low, high = (B[:, j, k] * (1 - x) + B[:, j, k + 1] * x for j in (i, i + 1))
    found: Float64 = low * (1 - y) + high * y
    return found


def at_inclination(values: Float64, cos_i: Float64) -> Float64:
    """The albedo or what is sent, from (INCLINATIONS, 3), at inclinations whose cosines are given: (..., 3)."""
    y = np.arccos(np.clip(cos_i, 0, 1)) / (np.pi / 2) * (INCLINATIONS - 1)
    i = np.minimum(y.astype(int), INCLINATIONS - 2)
    part = (y - i)[..., None]
    found: Float64 = values[i] * (1 - part) + values[i + 1] * part
    return found


def kajiya_of(fibre: Fibre) -> tuple[Float64, Float64, float]:
    """Colours (3,) of the diffuse and the glossy part of a fibre after Kajiya and Kay 1989, and the exponent.

    Such colours were painted. These send as much in all as the fibre does to an eye at its side: what it reflects
    becomes the highlight, as wide as the fibre's; the rest is diffuse.
    """
    table = fibre_table(fibre)
    reflected = np.full(3, 2 * np.trapezoid(table.azimuthal[0, 0, :, 0], dx=np.pi / (AZIMUTHS - 1)))
    exponent = 1 / float(table.variances[0])
    highlight = 2 * math.pi**1.5 * math.exp(math.lgamma(exponent / 2 + 1) - math.lgamma(exponent / 2 + 1.5))
    return (table.albedo[0] - reflected) / np.pi**2, reflected / highlight, exponent


def table_layers(fibres: list[Fibre]) -> Float32:
    """The layers (7 for each fibre, INCLINATIONS, AZIMUTHS, 4) that glsl/hair_light/tables.glsl describes."""
    layers = np.zeros((len(fibres), LOBES + 3, INCLINATIONS, AZIMUTHS, 4), dtype=np.float32)
    for layer, fibre in zip(layers, fibres, strict=True):
        table = fibre_table(fibre)
        layer[:LOBES, ..., :3] = table.azimuthal
        layer[LOBES, ..., :3], layer[LOBES + 1, ..., :3] = table.albedo[:, None], table.sent[:, None]
        constants = layer[-1, 0]
        constants[:LOBES, :3] = np.stack([table.variances, np.sin(table.tilts), np.cos(table.tilts)], axis=1)
        diffuse, glossy, exponent = kajiya_of(fibre)
        constants[LOBES, :3], constants[LOBES + 1] = diffuse, [*glossy, exponent]
    return layers.reshape(-1, INCLINATIONS, AZIMUTHS, 4)
