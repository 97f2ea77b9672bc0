"""Light that a plane-parallel scattering layer reflects and transmits, by adding and doubling.

The layer is homogeneous, scatters evenly in all directions and has the refractive index of its surroundings. Two
numbers describe it: the albedo sigma_s / sigma_t and the optical thickness tau = sigma_t d. Cosines are taken against
the layer's normal on the side where the light is, in (0, 1].

Sources: van de Hulst 1980, "Multiple Light Scattering"; Prahl 1995, "The Adding-Doubling Method", in Welch
and van Gemert (eds.), "Optical-Thermal Response of Laser-Irradiated Tissue".
"""

import math

import numpy as np

from scenes.image import Float64

NODES = 64
"""Gauss-Legendre points over the cosines."""

COSINES = 400
"""Entries of a table over the cosine."""

THINNEST = 1e-9
"""Optical thickness, at most, of the layer that doubling starts from, in which light is scattered once.

What is scattered there twice is lost: of the whole layer's light a part of about THINNEST log(1 / THINNEST).
"""


def slab_bsdf(albedo: float, tau: float, mu: Float64, mu0: Float64) -> tuple[Float64, Float64]:
    """Reflection R and transmission T of light that is scattered at least once.

    Radiance that leaves at mu is R or T times mu0 times the irradiance on a plane that faces the light, which arrives
    at mu0. Light that passes unscattered, the part exp(-tau / mu0), does not belong to T.

    Parameters
    ----------
    albedo : 0 to 1
    tau : optical thickness, 0 or more
    mu : (M,) cosines of directions in which light leaves, at least 1e-6
    mu0 : (K,) cosines of directions from which light arrives, at least 1e-6

    Returns
    -------
    R, T : (M, K) [1/sr], both reciprocal: f(mu, mu0) = f(mu0, mu)

    With `up` and `down` the light between two equal layers,
        up = R straight_in + R down,    down = T + R up    (Prahl 1995, written as fields),
    where a product of two kernels is an integral over the hemisphere: a sum over the nodes of a quadrature. The
    cosines asked for are further rows and columns, which no sum runs over.
    """
    node, gauss = np.polynomial.legendre.leggauss(NODES)
    node = (node + 1) / 2
    weight = 2 * np.pi * node * gauss / 2
    leaving, arriving = np.concatenate([node, mu])[:, None], np.concatenate([node, mu0])[None, :]

    doublings = max(0, math.ceil(math.log2(max(tau, THINNEST) / THINNEST)))
    depth = tau / 2**doublings
    R, T = _scattered_once(albedo, depth, leaving, arriving)
    for _ in range(doublings):
        straight_in, straight_out = np.exp(-depth / arriving), np.exp(-depth / leaving)
        R_from_nodes, T_from_nodes = R[:, :NODES] * weight, T[:, :NODES] * weight
        there_and_back = np.eye(NODES) - R_from_nodes[:NODES] @ R_from_nodes[:NODES]
        up_nodes = np.linalg.solve(there_and_back, (R * straight_in)[:NODES] + R_from_nodes[:NODES] @ T[:NODES])
        down = T + R_from_nodes @ up_nodes
        up = R * straight_in + R_from_nodes @ down[:NODES]
        R, T = (
            R + straight_out * up + T_from_nodes @ up[:NODES],
            T * straight_in + straight_out * down + T_from_nodes @ down[:NODES],
        )
        depth *= 2
    return R[NODES:, NODES:], T[NODES:, NODES:]


def _scattered_once(albedo: float, tau: float, mu: Float64, mu0: Float64) -> tuple[Float64, Float64]:
    """Exact single scattering: what reaches a depth, is scattered there and leaves, summed over all depths.

    R = albedo (1 - exp(-tau / mu - tau / mu0)) / (4 pi (mu + mu0)),
    T = albedo (exp(-tau / mu) - exp(-tau / mu0)) / (4 pi (mu - mu0)),
    written with exprel(x) = (exp(x) - 1) / x, so that neither thin layers nor mu = mu0 cancel.
    """
    from scipy.special import exprel

    scale = albedo * tau / (4 * np.pi * mu * mu0)
    R = scale * exprel(-tau * (1 / mu + 1 / mu0))
    T = scale * np.exp(-tau / mu) * exprel(-tau * (1 / mu0 - 1 / mu))
    return R, T


def slab_radiance(albedo: float, tau: float, mu: Float64, mu0: float) -> tuple[Float64, Float64]:
    """Radiance per irradiance on the slab's face for any number of directions: R and T of `slab_bsdf`, each like mu.

    A cubic spline over the root of mu, which spreads the steep part near grazing, through COSINES values: its error
    is below 1e-5 of R and T.
    """
    from scipy.interpolate import CubicSpline

    root = np.linspace(0, 1, COSINES + 1)[1:]
    R, T = slab_bsdf(albedo, tau, root**2, np.array([mu0]))
    spline = CubicSpline(root, np.stack([R[:, 0], T[:, 0]], axis=1))
    values = spline(np.sqrt(np.clip(mu, root[0] ** 2, 1.0)))
    return values[..., 0], values[..., 1]
