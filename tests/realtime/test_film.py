"""What a rough film lets through, in its limits and by another way of integration."""

import math

import numpy as np
import pytest

from realtime import film
from realtime.eye import diffuse_internal_reflectance
from realtime.film import COSINES, film_table
from scenes.image import Float64

COSINE = np.linspace(0.0, 1.0, COSINES)


def smith(cosine: Float64, alpha: float) -> Float64:
    return np.asarray(2 / (1 + np.sqrt(1 + alpha**2 * (1 / cosine**2 - 1))))


def fresnel(cosine: Float64, eta: float) -> Float64:
    """By complex amplitudes, whose size is 1 where all is reflected."""
    inside = np.sqrt(np.asarray(eta**2 - (1 - cosine**2), dtype=complex))
    s, p = (cosine - inside) / (cosine + inside), (eta**2 * cosine - inside) / (eta**2 * cosine + inside)
    return np.asarray((np.abs(s) ** 2 + np.abs(p) ** 2) / 2)


def test_a_smooth_film_lets_through_what_fresnel_says() -> None:
    table = film_table(1e-3, 1.5)
    np.testing.assert_allclose(table.transmittance[4:], 1 - fresnel(COSINE[4:], 1.5), rtol=2e-3)


def test_a_smooth_film_throws_back_what_is_known_of_diffuse_light() -> None:
    """A mean over 64 cosines with both ends in full is 1.5 % less than the integral."""
    assert film_table(1e-3, 1.5).internal == pytest.approx(0.985 * diffuse_internal_reflectance(1.5), rel=2e-3)


@pytest.mark.parametrize("alpha", [0.1, 0.35, 1.0])
def test_a_film_like_air_only_hides(alpha: float) -> None:
    """Without refraction light goes straight on, through what facets of either side do not shadow."""
    table = film_table(alpha, 1.0001)
    np.testing.assert_allclose(table.transmittance[8:], smith(COSINE[8:], alpha), rtol=2e-3)
    assert table.internal < 0.02


@pytest.mark.parametrize("eta", [1.5, 1 / 1.5])
@pytest.mark.parametrize("cosine", [0.2, 0.6, 1.0])
def test_mirrored_light_is_the_integral_over_the_hemisphere(cosine: float, eta: float) -> None:
    """Of Torrance and Sparrow's reflection, by directions of light in place of facets.

    From within, total reflection begins between few of the nodes.
    """
    alpha = 0.35
    z, weight = np.polynomial.legendre.leggauss(200)
    z, weight = (z + 1) / 2, weight / 2
    phi = (np.arange(400) + 0.5) / 400 * 2 * math.pi
    s = np.sqrt(1 - z**2)[:, None]
    L = np.stack([s * np.cos(phi), s * np.sin(phi), np.broadcast_to(z[:, None], (200, 400))], axis=-1)
    V = np.array([math.sqrt(1 - cosine**2), 0.0, cosine])
    H = (V + L) / np.linalg.norm(V + L, axis=-1, keepdims=True)
    D = alpha**2 / (math.pi * (H[..., 2] ** 2 * (alpha**2 - 1) + 1) ** 2)
    F = fresnel(H @ V, eta)
    G = smith(np.array(cosine), alpha) * smith(z[:, None], alpha)
    exact = float(((D * F * G / (4 * cosine)).mean(axis=1) * 2 * math.pi * weight).sum())
    assert film._reflected(cosine, alpha, eta) == pytest.approx(exact, rel=2e-3 if eta > 1 else 3e-2)


@pytest.mark.parametrize("alpha", [0.01, 0.35, 1.0])
@pytest.mark.parametrize("ior", [1.1, 1.5, 3.0])
def test_nothing_comes_from_nowhere(alpha: float, ior: float) -> None:
    """Up to what rules of 32² and 128² nodes differ by."""
    table = film_table(alpha, ior)
    mirrored = np.array([film._reflected(max(c, film.HORIZON), alpha, ior) for c in COSINE[::9]])
    assert (table.transmittance >= 0).all()
    assert (table.transmittance[::9] + mirrored <= 1 + 1e-4).all()
    assert 0 < table.internal < 1
