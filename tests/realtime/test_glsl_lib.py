"""The pure functions of glsl/lib/ on grids, against float64 and closed forms."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from scipy.special import sph_harm_y

from realtime.camera import cube_cameras, parallel_camera, unit
from realtime.lights import FACET, PARALLEL, POINT
from scenes.image import Float64

Glsl = Callable[..., Float64]
UP, DOWN = (0.0, 1.0, 0.0, 0.0), (0.0, -1.0, 0.0, 0.0)

FORM_FACTOR = "r[0].x = disk_form_factor(a[0].xyz, a[1].xyz, a[2].xyz, a[2].w);"
IRRADIANCE = "Light l = Light(a[0], a[1], a[2]); r[0].xyz = unshadowed_irradiance(l, a[3].xyz, a[4].xyz);"


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(20050805)


def directions(rng: np.random.Generator, count: int) -> Float64:
    vectors = rng.normal(size=(count, 3))
    return vectors / np.linalg.norm(vectors, axis=1, keepdims=True)


def sphere_quadrature() -> tuple[Float64, Float64]:
    """Directions (N, 3) and weights (N,): Gauss-Legendre in z times uniform in azimuth, exact to degree 15."""
    z, wz = np.polynomial.legendre.leggauss(8)
    phi = np.arange(16) * 2 * np.pi / 16
    z, phi = np.meshgrid(z, phi, indexing="ij")
    r = np.sqrt(1 - z * z)
    return np.stack([r * np.cos(phi), r * np.sin(phi), z], -1).reshape(-1, 3), np.repeat(wz, 16) * 2 * np.pi / 16


def vec4(xyz: NDArray[Any], w: float = 0.0) -> Float64:
    """Rows (N, 4) from vectors (N, 3) or one vector, or from numbers (N,) as x."""
    if xyz.ndim == 1 and len(xyz) != 3:
        xyz = np.stack([xyz, np.zeros_like(xyz), np.zeros_like(xyz)], axis=1)
    rows = np.atleast_2d(xyz)
    return np.concatenate([rows, np.full((len(rows), 1), w)], axis=1)


def test_the_form_factor_of_a_coaxial_disk_is_the_exact_one(glsl: Glsl) -> None:
    """F = R² / (h² + R²), from far away to almost touching."""
    h, R = (v.ravel() for v in np.meshgrid(np.geomspace(0.01, 100, 9), np.geomspace(0.05, 20, 9)))
    rows = [[UP, (0.0, y, 0.0, 0.0), (0.0, -1.0, 0.0, np.pi * r * r)] for y, r in zip(h, R, strict=True)]
    made = glsl("lib/lambert.glsl", FORM_FACTOR, np.array(rows))[:, 0, 0]
    np.testing.assert_allclose(made, R**2 / (h**2 + R**2), rtol=2e-6)


def test_the_form_factor_of_a_small_disk_is_its_integral(glsl: Glsl, rng: np.random.Generator) -> None:
    """Radius up to a tenth of the distance, turned anywhere: expect an error of the order of (R/r)² = 1 %."""
    count, R = 40, 0.1
    to_source = directions(rng, count)
    normal, source_normal = (np.where((v * s).sum(1)[:, None] * sign > 0, v, -v) for v, s, sign in (
        (directions(rng, count), to_source, 1), (directions(rng, count), to_source, -1)))  # fmt: skip
    slanted = (np.abs((normal * to_source).sum(1)) > 0.3) & (np.abs((source_normal * to_source).sum(1)) > 0.3)
    rows = np.stack([vec4(normal), vec4(to_source), vec4(source_normal, np.pi * R * R)], axis=1)[slanted]
    made = glsl("lib/lambert.glsl", FORM_FACTOR, rows)[:, 0, 0]
    exact = [integrated_form_factor(n, s, m, R) for n, s, m in rows[:, :, :3]]
    np.testing.assert_allclose(made, exact, rtol=0.03)


def integrated_form_factor(normal: Float64, centre: Float64, source_normal: Float64, radius: float) -> float:
    """Integral of cos cos / (pi r²) over the disk, by 64 x 64 midpoints in polar coordinates."""
    side = unit(np.cross(source_normal, [0.3, 0.5, 0.8]))
    other = np.cross(source_normal, side)
    rho, phi = np.meshgrid((np.arange(64) + 0.5) / 64 * radius, (np.arange(64) + 0.5) / 64 * 2 * np.pi)
    x = centre + rho[..., None] * (np.cos(phi)[..., None] * side + np.sin(phi)[..., None] * other)
    r2 = np.sum(x * x, axis=-1)
    kernel = (x @ normal) * -(x @ source_normal) / (np.pi * r2 * r2)
    return float(np.sum(kernel * rho) * radius / 64 * 2 * np.pi / 64)


@pytest.mark.parametrize(
    ("to_source", "source_normal"),
    [
        ((0.0, -1.0, 0.0, 0.0), DOWN),
        ((0.0, 1.0, 0.0, 0.0), UP),
        ((0.0, 0.0, 0.0, 0.0), DOWN),
        ((1.0, 0.0, 0.0, 0.0), DOWN),
    ],
    ids=["below the horizon", "seen from behind", "at the same place", "on the horizon"],
)
def test_a_disk_that_cannot_be_seen_has_no_form_factor(
    glsl: Glsl, to_source: tuple[float, ...], source_normal: tuple[float, ...]
) -> None:
    made = glsl("lib/lambert.glsl", FORM_FACTOR, np.array([[UP, to_source, (*source_normal[:3], 1.0)]]))
    assert made[0, 0, 0] == 0


def test_spherical_harmonics_are_orthonormal(glsl: Glsl) -> None:
    d, weights = sphere_quadrature()
    body = "float[9] b = sh_basis(a[0].xyz); for (int k = 0; k < 9; ++k) r[k / 4][k % 4] = b[k];"
    basis = glsl("lib/sh.glsl", body, vec4(d)[:, None], outputs=3).reshape(-1, 12)[:, :9]
    np.testing.assert_allclose(basis.T * weights @ basis, np.eye(9), atol=1e-6)


def test_spherical_harmonics_are_those_of_scipy(glsl: Glsl, rng: np.random.Generator) -> None:
    """Real form without the Condon-Shortley phase; bands in the order m = -l .. l."""
    d = directions(rng, 50)
    body = "float[9] b = sh_basis(a[0].xyz); for (int k = 0; k < 9; ++k) r[k / 4][k % 4] = b[k];"
    basis = glsl("lib/sh.glsl", body, vec4(d)[:, None], outputs=3).reshape(-1, 12)[:, :9]
    theta, phi = np.arccos(d[:, 2]), np.arctan2(d[:, 1], d[:, 0])
    for k, (band, m) in enumerate((band, m) for band in range(3) for m in range(-band, band + 1)):
        value = sph_harm_y(band, abs(m), theta, phi) * (-1) ** m * (np.sqrt(2) if m else 1)
        np.testing.assert_allclose(basis[:, k], value.imag if m < 0 else value.real, atol=2e-6)


def test_cosine_factors_are_the_integrals_of_the_legendre_polynomials(glsl: Glsl) -> None:
    """A_l = 2 pi times the integral of t P_l(t) from 0 to 1."""
    made = glsl("lib/sh.glsl", "r[0].x = sh_cosine_factor(int(a[0].x));", vec4(np.arange(9.0))[:, None])[:, 0, 0]
    t, w = np.polynomial.legendre.leggauss(8)
    t, w = (t + 1) / 2, w / 2
    bands = [2 * np.pi * np.sum(w * t * np.polynomial.legendre.Legendre.basis(band)(t)) for band in (0, 1, 2)]
    np.testing.assert_allclose(made, np.repeat(bands, (1, 3, 5)), rtol=1e-6)


def irradiance(glsl: Glsl, kind: int, place: Float64, axis: Float64, area: float, x: Float64, n: Float64) -> Float64:
    strength = np.array([[3.0, 2.0, 1.0]])
    count = len(x)
    rows = [vec4(np.broadcast_to(place, (count, 3)), float(kind)), vec4(np.broadcast_to(axis, (count, 3)), area)]
    rows += [vec4(np.broadcast_to(strength, (count, 3))), vec4(x), vec4(n)]
    return glsl("lib/lights.glsl", IRRADIANCE, np.stack(rows, axis=1))[:, 0, :3]


STRENGTH = np.array([3.0, 2.0, 1.0])


def test_irradiance_of_a_point_light(glsl: Glsl, rng: np.random.Generator) -> None:
    place, x, n = np.array([0.4, 1.2, -0.3]), rng.uniform(-2, 2, (60, 3)), directions(rng, 60)
    v = place - x
    r = np.linalg.norm(v, axis=1)
    expected = np.maximum(np.sum(v * n, axis=1), 0) / r**3
    made = irradiance(glsl, POINT, place, np.zeros(3), 0.0, x, n)
    np.testing.assert_allclose(made, expected[:, None] * STRENGTH, rtol=1e-4, atol=1e-5)


def test_irradiance_of_parallel_light_is_the_same_everywhere(glsl: Glsl, rng: np.random.Generator) -> None:
    axis, x, n = unit(np.array([0.3, -0.8, 0.1])), rng.uniform(-2, 2, (60, 3)), directions(rng, 60)
    made = irradiance(glsl, PARALLEL, np.zeros(3), axis, 0.0, x, n)
    np.testing.assert_allclose(made, np.maximum(-n @ axis, 0)[:, None] * STRENGTH, rtol=1e-5, atol=1e-6)


def test_irradiance_of_a_facet_far_away_is_that_of_its_intensity(glsl: Glsl, rng: np.random.Generator) -> None:
    """`strength` is radiance times area: the intensity along the axis, falling off with the cosine."""
    place, axis, area = np.array([0.0, 3.0, 0.0]), np.array([0.0, -1.0, 0.0]), 1e-4
    x, n = rng.uniform(-1, 1, (60, 3)), directions(rng, 60)
    v = place - x
    r = np.linalg.norm(v, axis=1)
    expected = np.maximum(np.sum(v * n, axis=1), 0) * np.maximum(-v @ axis, 0) / r**4
    made = irradiance(glsl, FACET, place, axis, area, x, n)
    np.testing.assert_allclose(made, expected[:, None] * STRENGTH, rtol=2e-4, atol=1e-5)


def test_irradiance_of_a_facet_never_exceeds_that_of_its_radiance_all_around(glsl: Glsl) -> None:
    """However close: E <= pi L."""
    area, distance = 0.5, np.geomspace(1e-4, 10, 30)
    x = np.stack([np.zeros(30), -distance, np.zeros(30)], axis=1)
    n = np.tile(UP[:3], (30, 1))
    made = irradiance(glsl, FACET, np.zeros(3), np.array([0.0, -1.0, 0.0]), area, x, n)
    assert (made <= np.pi * STRENGTH / area * (1 + 1e-6)).all()
    assert made[0] == pytest.approx(np.pi * STRENGTH / area, rel=1e-3)


def test_the_sky_has_its_top_at_plus_y_and_its_middle_at_minus_z(glsl: Glsl) -> None:
    axes = {
        (0, 1, 0): (None, 0.0),
        (0, -1, 0): (None, 1.0),
        (0, 0, -1): (0.5, 0.5),
        (1, 0, 0): (0.75, 0.5),
        (-1, 0, 0): (0.25, 0.5),
    }
    made = glsl("lib/sky.glsl", "r[0].xy = sky_uv(2.0 * a[0].xyz);", vec4(np.array(list(axes), dtype=float))[:, None])
    for (u, v), found in zip(axes.values(), made[:, 0], strict=True):
        assert found[1] == pytest.approx(v, abs=1e-6)
        assert u is None or found[0] == pytest.approx(u, abs=1e-6)


SIDE = 64
SHADOW = f"Light l = Light(a[0], a[1], vec4(0.0)); r[0] = shadow_coordinates(l, a[2].xyz, {SIDE}.0, a[2].w);"


def test_a_point_light_looks_up_its_shadow_where_its_cameras_draw(glsl: Glsl, rng: np.random.Generator) -> None:
    place, x = np.array([0.2, -0.1, 0.4]), rng.uniform(-2, 2, (200, 3))
    rows = [vec4(np.broadcast_to(place, (200, 3)), float(POINT)), np.zeros((200, 4)), vec4(x, 2.0)]
    made = glsl("lib/shadow.glsl", SHADOW, np.stack(rows, axis=1))[:, 0]
    cameras = cube_cameras(place, 0.01, 10.0)
    for point, (column, row, distance, texel) in zip(x, made, strict=True):
        clip = cameras[int(column // SIDE)].matrix @ np.append(point, 1.0)
        assert clip[3] > 0
        window = (clip[:2] / clip[3] * 0.5 + 0.5) * SIDE
        np.testing.assert_allclose((column % SIDE, row), window, atol=1e-3)
        assert distance == pytest.approx(np.linalg.norm(point - place), rel=1e-5)
        assert texel == pytest.approx(2 * clip[3] / SIDE, rel=1e-5)


@pytest.mark.parametrize(
    "direction",
    [(0.3, -0.8, 0.1), (0, -1, 0), (0, 1, 0), (1, 0, 0), (0.3, -0.9, 0.3162277661), (0.3, -0.9, 0.3162277659)],
)
def test_parallel_light_looks_up_its_shadow_where_its_camera_draws(
    glsl: Glsl, rng: np.random.Generator, direction: tuple[float, ...]
) -> None:
    """The last two are where the helper axis changes: both sides must change it together."""
    forward, centre, radius = unit(np.array(direction, dtype=float)), np.array([0.3, 0.2, -0.1]), 2.0
    camera = parallel_camera(forward, centre, radius)
    x = centre + rng.uniform(-1, 1, (100, 3))
    rows = [vec4(np.broadcast_to(camera.eye, (100, 3)), float(PARALLEL)), vec4(np.broadcast_to(forward, (100, 3)))]
    made = glsl("lib/shadow.glsl", SHADOW, np.stack([*rows, vec4(x, radius)], axis=1))[:, 0]
    ndc = np.concatenate([x, np.ones((100, 1))], axis=1) @ camera.matrix.T
    np.testing.assert_allclose(made[:, :2], (ndc[:, :2] * 0.5 + 0.5) * SIDE, atol=1e-3)
    np.testing.assert_allclose(made[:, 2], (x - camera.eye) @ forward, rtol=1e-5)
