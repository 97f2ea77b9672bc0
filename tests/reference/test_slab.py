"""Adding and doubling against published tables, closed forms and laws of conservation."""

import numpy as np
import pytest

from reference.slab import slab_bsdf, slab_radiance
from scenes import skin
from scenes.image import Float64
from scenes.media import MEDIA

HOPF = 2 * 0.7104460895987
"""Twice the extrapolation length of Milne's problem: Hopf's q(infinity), Chandrasekhar 1960, "Radiative Transfer"."""


def gauss(count: int) -> tuple[Float64, Float64]:
    """Nodes and weights on (0, 1)."""
    node, weight = np.polynomial.legendre.leggauss(count)
    return (node + 1) / 2, weight / 2


def test_a_published_table() -> None:
    """van de Hulst 1980, table 12 (p. 260-261): isotropic scattering, albedo 0.8, tau 2, five digits, pi f."""
    mu = np.array([0.5])
    R, _ = slab_bsdf(0.8, 2.0, mu, np.array([1.0, 0.9, 0.7, 0.5, 0.3, 0.1]))
    np.testing.assert_allclose(np.pi * R[0], [0.28616, 0.30277, 0.34188, 0.39102, 0.45353, 0.53214], atol=5.1e-6)
    _, T = slab_bsdf(0.8, 2.0, mu, np.array([1.0, 0.9, 0.7, 0.3, 0.1]))
    np.testing.assert_allclose(np.pi * T[0], [0.14864, 0.14731, 0.13963, 0.09425, 0.06601], atol=5.1e-6)


def chandrasekhar_H(albedo: float, mu: Float64) -> Float64:
    """H(mu) for isotropic scattering in a half-space, by iteration of its other equation.

    1 / H(mu) = sqrt(1 - albedo) + albedo / 2 * integral of mu' H(mu') / (mu + mu') over (0, 1).
    Chandrasekhar 1960, "Radiative Transfer". The nodes crowd towards 0, where H has an infinite slope.
    """
    root, weight = gauss(100)
    node, weight = root**3, 3 * root**2 * weight

    def iterate(at: Float64, H: Float64) -> Float64:
        integral = (weight * node * H / (at[:, None] + node)).sum(axis=1)
        return np.asarray(1 / (np.sqrt(1 - albedo) + albedo / 2 * integral))

    H = np.ones_like(node)
    for _ in range(2000):
        H = (H + iterate(node, H)) / 2
    return iterate(mu, H)


@pytest.mark.parametrize("albedo", [0.3, 0.9, 0.99])
def test_a_thick_slab_reflects_like_a_half_space(albedo: float) -> None:
    mu = np.array([0.02, 0.1, 0.5, 1.0])
    H = chandrasekhar_H(albedo, mu)
    R, T = slab_bsdf(albedo, 400.0, mu, mu)
    np.testing.assert_allclose(R, albedo / (4 * np.pi) * np.outer(H, H) / (mu[:, None] + mu), rtol=1e-6)
    assert T.max() < 1e-20


@pytest.mark.parametrize("tau", [1e-3, 0.03, 0.5, 2.0, 8.0, 100.0])
def test_nothing_is_lost_without_absorption(tau: float) -> None:
    """Reflected, scattered through and passed straight through: all of the light, whatever its angle."""
    root, weight = gauss(200)
    mu, weight = root**2, 2 * root * weight
    mu0 = np.array([0.05, 0.3, 0.8, 1.0])
    R, T = slab_bsdf(1.0, tau, mu, mu0)
    scattered = 2 * np.pi * ((R + T).T @ (mu * weight)) * mu0
    np.testing.assert_allclose(scattered / mu0 + np.exp(-tau / mu0), 1.0, atol=2e-6)


@pytest.mark.parametrize("tau", [5.0, 20.0])
def test_diffuse_light_through_a_thick_slab_that_absorbs_nothing(tau: float) -> None:
    """(4/3) / (tau + 2 q): exact but for what dies out as exp(-2 tau)."""
    mu, weight = gauss(40)
    _, T = slab_bsdf(1.0, tau, mu, mu)
    flux = mu * weight
    passed = 4 * np.pi * flux @ T @ flux + 2 * flux @ np.exp(-tau / mu)
    assert passed == pytest.approx(4 / 3 / (tau + HOPF), rel=1e-5)


@pytest.mark.parametrize("tau", [1e-12, 1e-3, 0.4, 3.0])
def test_weak_scattering_happens_once(tau: float) -> None:
    """For an albedo of 1e-10 what is scattered twice is a part of that order, as long as the slab is not thick."""
    mu, mu0 = np.array([0.2, 0.7, 1.0])[:, None], np.array([0.3, 0.9])[None, :]
    R, T = slab_bsdf(1e-10, tau, mu[:, 0], mu0[0])
    scale = 1e-10 / (4 * np.pi)
    np.testing.assert_allclose(R, scale * -np.expm1(-tau * (1 / mu + 1 / mu0)) / (mu + mu0), rtol=1e-6)
    minus = np.exp(-tau / mu) * -np.expm1(-tau * (1 / mu0 - 1 / mu))
    np.testing.assert_allclose(T, scale * minus / (mu - mu0), rtol=1e-6)


@pytest.mark.parametrize(("albedo", "tau"), [(0.5, 0.1), (0.96, 3.0), (1.0, 12.0)])
def test_reciprocity(albedo: float, tau: float) -> None:
    mu = np.array([1e-6, 0.01, 0.2, 0.55, 1.0])
    for kernel in slab_bsdf(albedo, tau, mu, mu):
        assert (kernel >= 0).all()
        np.testing.assert_allclose(kernel, kernel.T, rtol=1e-10)


def test_light_leaves_in_the_direction_it_came_as_in_those_beside() -> None:
    """The closed form for thin layers is 0 / 0 there."""
    mu0 = np.array([0.6])
    _, T = slab_bsdf(0.9, 1.0, np.array([0.6 - 1e-4, 0.6, 0.6 + 1e-4]), mu0)
    assert T[1, 0] == pytest.approx((T[0, 0] + T[2, 0]) / 2, rel=1e-7)


@pytest.mark.parametrize(("albedo", "tau"), [(0.0, 1.0), (0.9, 0.0)])
def test_what_scatters_nothing_shows_nothing(albedo: float, tau: float) -> None:
    for kernel in slab_bsdf(albedo, tau, np.array([0.5, 1.0]), np.array([0.5, 1.0])):
        assert not kernel.any()


@pytest.mark.parametrize("tau", [1e-3, 0.4, 20.0])
@pytest.mark.parametrize("mu0", [0.003, 0.7, 1.0])
def test_the_table_between_its_entries(tau: float, mu0: float) -> None:
    mu = np.linspace(1e-3, 1, 301)
    for tabulated, direct in zip(
        slab_radiance(0.97, tau, mu, mu0), slab_bsdf(0.97, tau, mu, np.array([mu0])), strict=True
    ):
        np.testing.assert_allclose(tabulated, direct[:, 0], rtol=1e-5)


@pytest.mark.parametrize(("thickness", "most"), [(0.2, 0.02), (1.0, 0.02), (4.0, 0.02), (8.0, 0.04)])
def test_dermis_in_three_channels_looks_like_its_spectrum(thickness: float, most: float) -> None:
    """What `scenes.skin.rgb_of` says about light from straight ahead and from 60 degrees, seen from straight ahead."""
    spectrum, medium = skin.dermis(), MEDIA["dermis"]
    angles = np.array([1.0, 0.5])

    def both(sigma_a: float, sigma_s: float) -> Float64:
        sigma_t = sigma_a + sigma_s
        return np.stack(slab_bsdf(sigma_s / sigma_t, sigma_t * thickness, angles[:1], angles))

    exact = [both(a, s) for a, s in zip(spectrum.sigma_a, spectrum.sigma_s, strict=True)]
    wanted = np.tensordot(skin.rec709_weights(spectrum.wavelengths), exact, axes=1)
    found = np.stack([both(a, s) for a, s in zip(medium.sigma_a, medium.sigma_s, strict=True)])
    assert (np.abs(found - wanted) / wanted.max(axis=0)).max() < most
