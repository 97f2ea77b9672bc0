"""What an infinite slab reflects and transmits, baked into the table that the translucency techniques look up.

The slab scatters evenly in all directions and has the refractive index of its surroundings. Reflection and
transmission are those of light that was scattered at least once: van de Hulst 1980, "Multiple Light Scattering",
section 4.5 (adding and doubling of layers); Prahl 1995, "The Adding-Doubling Method", eqs. 5.19-5.22.
"""

from dataclasses import dataclass
from functools import cache

import numpy as np

from scenes.image import Float32, Float64

STREAMS = 16
"""Directions of the quadrature in each hemisphere: entries are within .1 % of those of 32."""

PER_OCTAVE = 24
"""Thicknesses between one and its double: straight lines between the table's logarithms are within .4 %."""

OCTAVES = 14
STEPS = PER_OCTAVE * OCTAVES
"""Thicknesses in the table."""

ANGLES = 48
"""Cosines of the light's direction in the table, evenly spaced from 0 to 1."""

THINNEST_OPTICAL_DEPTH = 1e-8
"""Doubling starts at layers so thin that what is scattered twice in them is left out."""


@dataclass(frozen=True)
class Layers:
    """Reflection and transmission (..., M, M) of layers that lie between `cosines` (M,), and of the beam (..., M).

    The kernels K give radiance I(mu) = integral of K(mu, mu') I(mu') 2 mu' dmu' (van de Hulst 1980, section 4.5), so
    a beam of irradiance E, measured across it, at mu0 makes I(mu) = K(mu, mu0) mu0 E / pi.
    """

    reflected: Float64
    transmitted: Float64
    beam: Float64


def quadrature(cosines: Float64) -> tuple[Float64, Float64]:
    """Nodes (M,) and weights 2 mu w (M,) of a hemisphere: Gauss-Legendre, then `cosines` with no weight."""
    nodes, weights = np.polynomial.legendre.leggauss(STREAMS)
    mu = (nodes + 1) / 2
    return np.concatenate([mu, cosines]), np.concatenate([mu * weights, np.zeros(len(cosines))])


def thin_layers(depth: Float64, albedo: float, mu: Float64) -> Layers:
    """Layers of optical thickness `depth` (L,), in which light is scattered once."""
    x = depth[:, None, None]
    inverse_out, inverse_in = 1 / mu[:, None], 1 / mu
    beam = np.exp(-depth[:, None] / mu)
    lost = -np.expm1(-x * (inverse_out + inverse_in)) / (inverse_out + inverse_in)
    difference = x * (inverse_out - inverse_in)
    between = x * np.where(np.abs(difference) < 1e-9, 1.0, -np.expm1(-difference) / _nonzero(difference))
    gain = albedo / 4 * inverse_out * inverse_in
    return Layers(gain * lost, gain * between * beam[:, None, :], beam)


def _nonzero(x: Float64) -> Float64:
    return np.where(x == 0, 1.0, x)


def doubled(layers: Layers, weights: Float64) -> Layers:
    """Two of the same layer on top of each other."""
    R, T, beam = layers.reflected, layers.transmitted, layers.beam
    unit = np.eye(len(weights))
    between = R * weights
    bounced = np.linalg.solve(unit - between @ between, between @ R)
    leaving, entering = beam[..., None] * unit + T * weights, beam[..., None] * unit + weights[:, None] * T
    reflected = R + leaving @ (R + (bounced * weights) @ R) @ entering
    direct = beam[..., :, None] * T + T * beam[..., None, :] + (T * weights) @ T
    return Layers(reflected, direct + leaving @ bounced @ entering, beam * beam)


def layers_of(depths: Float64, albedo: float, cosines: Float64) -> tuple[Layers, Float64, Float64]:
    """Layers of the optical thicknesses `depths` (L,), within a factor of 2 of each other; nodes and weights."""
    mu, weights = quadrature(cosines)
    doublings = max(0, int(np.ceil(np.log2(depths.max() / THINNEST_OPTICAL_DEPTH))))
    layers = thin_layers(depths / 2.0**doublings, albedo, mu)
    for _ in range(doublings):
        layers = doubled(layers, weights)
    return layers, mu, weights


@dataclass(frozen=True)
class SlabTable:
    """Logarithms of K_T and K_R times the albedo's 1 / pi, for a camera that looks along the slab's normal.

    transmitted, reflected : (ANGLES, STEPS, 3) float32; row i is for light at the cosine i / (ANGLES - 1) to the
        normal, column k for the thickness `thinnest` * 2^(k / PER_OCTAVE). Radiance is exp(entry) * cosine *
        irradiance across the beam. Below `thinnest` both are proportional to the thickness.
    """

    thinnest: float
    transmitted: Float32
    reflected: Float32

    def transmission(self, thickness: Float64, cosine: Float64) -> Float64:
        """Radiance behind the slab (N, 3) per unit of irradiance across the beam, from (N,) each."""
        return _looked_up(self.transmitted, self.thinnest, thickness, cosine)

    def reflection(self, thickness: Float64, cosine: Float64) -> Float64:
        """Radiance on the light's side, as `transmission`."""
        return _looked_up(self.reflected, self.thinnest, thickness, cosine)


def _looked_up(table: Float32, thinnest: float, thickness: Float64, cosine: Float64) -> Float64:
    """The float64 twin of glsl/lib/slab_table.glsl."""
    relative = thickness / thinnest
    column = np.clip(PER_OCTAVE * np.log2(np.maximum(relative, 1)), 0, STEPS - 1)
    row = np.clip(cosine, 0, 1) * (ANGLES - 1)
    i, k = np.minimum(row.astype(int), ANGLES - 2), np.minimum(column.astype(int), STEPS - 2)
    y, x = (row - i)[:, None], (column - k)[:, None]
    low = table[i, k] * (1 - x) + table[i, k + 1] * x
    high = table[i + 1, k] * (1 - x) + table[i + 1, k + 1] * x
    found: Float64 = np.exp(low * (1 - y) + high * y) * (np.minimum(relative, 1) * cosine)[:, None]
    return found


GRAZING = 1e-4
"""The cosine that stands for 0, where light would travel inside the slab for ever."""

FAINTEST = 1e-30
"""Darker entries are raised to this, whose logarithm fits the tables; it is as good as black."""


def slab_table(sigma_a: Float64, sigma_s: Float64, thickest: float) -> SlabTable:
    """The table for a medium (coefficients (3,) per unit of length) up to a slab of thickness `thickest`."""
    return _slab_table(tuple(map(float, sigma_a)), tuple(map(float, sigma_s)), thickest)


@cache
def _slab_table(sigma_a: tuple[float, ...], sigma_s: tuple[float, ...], thickest: float) -> SlabTable:
    thinnest = thickest / 2.0 ** ((STEPS - 1) / PER_OCTAVE)
    channels = [_channel(a + s, s, thinnest) for a, s in zip(sigma_a, sigma_s, strict=True)]
    tables = [np.log(np.maximum(np.stack(kind, axis=-1) / np.pi, FAINTEST)) for kind in zip(*channels, strict=True)]
    return SlabTable(thinnest, *(np.ascontiguousarray(t.transpose(1, 0, 2), dtype=np.float32) for t in tables))


def _channel(sigma_t: float, sigma_s: float, thinnest: float) -> tuple[Float64, Float64]:
    """K_T and K_R (STEPS, ANGLES) of light that leaves along the normal."""
    if sigma_s == 0:
        return np.zeros((STEPS, ANGLES)), np.zeros((STEPS, ANGLES))
    cosines = np.maximum(np.linspace(0, 1, ANGLES), GRAZING)
    depths = sigma_t * thinnest * 2 ** (np.arange(PER_OCTAVE) / PER_OCTAVE)
    layers, _, weights = layers_of(depths, sigma_s / sigma_t, cosines)
    transmitted, reflected = [], []
    for octave in range(OCTAVES):
        if octave:
            layers = doubled(layers, weights)
        transmitted.append(layers.transmitted[:, -1, STREAMS:])
        reflected.append(layers.reflected[:, -1, STREAMS:])
    return np.concatenate(transmitted), np.concatenate(reflected)


def normal_albedo(albedo: Float64) -> Float64:
    """Part of a beam along the normal that a half-space reflects in all, by channel.

    Chandrasekhar 1960, "Radiative Transfer", section 38, eq. 133: 1 - H(1) sqrt(1 - albedo), with H from the
    iteration of section 41, eq. 11 (the alternative form, which converges for every albedo).
    """
    mu, weights = quadrature(np.ones(1))
    psi = weights[:STREAMS] / (2 * mu[:STREAMS])
    H = np.ones((len(albedo), len(mu)))
    root = np.sqrt(1 - albedo)[:, None]
    for _ in range(500):
        inner = np.einsum("cj,j,ij->ci", H[:, :STREAMS], psi * mu[:STREAMS], 1 / (mu[:, None] + mu[:STREAMS]))
        H = 1 / (root + albedo[:, None] / 2 * inner)
    return 1 - H[:, -1] * root[:, 0]
