"""The pure functions of glsl/lib/ on grids, against float64 and closed forms."""

from collections.abc import Callable

import numpy as np
import pytest
from numpy.polynomial.legendre import Legendre, leggauss
from scipy.special import sph_harm_y

from realtime.camera import cube_cameras, parallel_camera, unit
from realtime.lights import FACET, PARALLEL, POINT
from scenes.image import Float64
from scenes.procedural import normalised

Glsl = Callable[..., Float64]
UP, DOWN = np.array([0.0, 1.0, 0.0]), np.array([0.0, -1.0, 0.0])
SIDE = 64

FORM_FACTOR = "r[0].x = disk_form_factor(a[0].xyz, a[1].xyz, a[2].xyz, a[2].w);"
BASIS = "float[9] b = sh_basis(a[0].xyz); for (int k = 0; k < 9; ++k) r[k / 4][k % 4] = b[k];"
IRRADIANCE = "r[0].xyz = unshadowed_irradiance(Light(a[0], a[1], a[2]), a[3].xyz, a[4].xyz);"
SHADOW = f"r[0] = shadow_coordinates(Light(a[0], a[1], vec4(0.0)), a[2].xyz, {SIDE}.0, a[2].w);"
SURFEL = "r[0].x = surfel_factor(Surfel(a[0], a[1], vec4(0.0)), a[2].xyz, a[3].xyz);"


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(20050805)


def directions(rng: np.random.Generator, count: int) -> Float64:
    return normalised(rng.normal(size=(count, 3)))


def rows(count: int, *columns: tuple[Float64, float | Float64]) -> Float64:
    """Input (count, I, 4) of a grid: each column is a vector (3,) or (count, 3), and what stands in its w."""
    made = np.zeros((count, len(columns), 4))
    for k, (xyz, w) in enumerate(columns):
        made[:, k, :3], made[:, k, 3] = xyz, w
    return made


def numbers(values: Float64) -> Float64:
    """Input (N, 1, 4) of a grid with a number in x."""
    made = np.zeros((len(values), 1, 4))
    made[:, 0, 0] = values
    return made


def test_the_form_factor_of_a_coaxial_disk_is_the_exact_one(glsl: Glsl) -> None:
    """F = R² / (h² + R²), from far away to almost touching."""
    h, R = (v.ravel() for v in np.meshgrid(np.geomspace(0.01, 100, 9), np.geomspace(0.05, 20, 9)))
    grid = rows(len(h), (UP, 0.0), (h[:, None] * UP, 0.0), (DOWN, np.pi * R * R))
    np.testing.assert_allclose(glsl("lib/lambert.glsl", FORM_FACTOR, grid)[:, 0, 0], R**2 / (h**2 + R**2), rtol=2e-6)


def test_the_form_factor_of_a_small_disk_is_its_integral(glsl: Glsl, rng: np.random.Generator) -> None:
    """Its radius is a tenth of its distance: expect an error of the order of the square of that, 1 %."""
    count, R = 40, 0.1
    towards, normal, source = (directions(rng, count) for _ in range(3))
    normal *= np.sign(np.sum(normal * towards, axis=1, keepdims=True))
    source *= -np.sign(np.sum(source * towards, axis=1, keepdims=True))
    clear = (np.sum(normal * towards, axis=1) > 0.3) & (np.sum(source * towards, axis=1) < -0.3)
    grid = rows(count, (normal, 0.0), (towards, 0.0), (source, np.pi * R * R))[clear]
    made = glsl("lib/lambert.glsl", FORM_FACTOR, grid)[:, 0, 0]
    exact = np.array([integrated_form_factor(n, x, m, R) for n, x, m in grid[:, :, :3]])
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
    [(DOWN, UP), (UP, UP), (np.zeros(3), DOWN), (np.array([1.0, 0.0, 0.0]), np.array([-1.0, 0.0, 0.0]))],
    ids=["below the horizon", "seen from behind", "at the same place", "on the horizon"],
)
def test_a_disk_that_cannot_be_seen_has_no_form_factor(glsl: Glsl, to_source: Float64, source_normal: Float64) -> None:
    assert (
        glsl("lib/lambert.glsl", FORM_FACTOR, rows(1, (UP, 0.0), (to_source, 0.0), (source_normal, 1.0)))[0, 0, 0] == 0
    )


def sphere_quadrature() -> tuple[Float64, Float64]:
    """Directions (N, 3) and weights (N,): Gauss-Legendre in z times uniform in azimuth, exact to degree 15."""
    nodes, weights = leggauss(8)
    z, phi = np.meshgrid(nodes, np.arange(16) * 2 * np.pi / 16, indexing="ij")
    r = np.sqrt(1 - z * z)
    return np.stack([r * np.cos(phi), r * np.sin(phi), z], -1).reshape(-1, 3), np.repeat(weights, 16) * 2 * np.pi / 16


def test_spherical_harmonics_are_orthonormal(glsl: Glsl) -> None:
    d, weights = sphere_quadrature()
    basis = glsl("lib/sh.glsl", BASIS, rows(len(d), (d, 0.0)), outputs=3).reshape(-1, 12)[:, :9]
    np.testing.assert_allclose(basis.T * weights @ basis, np.eye(9), atol=1e-6)


def test_spherical_harmonics_are_those_of_scipy(glsl: Glsl, rng: np.random.Generator) -> None:
    """Real form without the Condon-Shortley phase; within a band from m = -l to l."""
    d = directions(rng, 50)
    basis = glsl("lib/sh.glsl", BASIS, rows(50, (d, 0.0)), outputs=3).reshape(-1, 12)[:, :9]
    theta, phi = np.arccos(d[:, 2]), np.arctan2(d[:, 1], d[:, 0])
    orders = [(degree, m) for degree in range(3) for m in range(-degree, degree + 1)]
    for k, (degree, m) in enumerate(orders):
        value = sph_harm_y(degree, abs(m), theta, phi) * (-1) ** m * (np.sqrt(2) if m else 1)
        np.testing.assert_allclose(basis[:, k], value.imag if m < 0 else value.real, atol=2e-6)


def test_cosine_factors_are_integrals_of_legendre_polynomials(glsl: Glsl) -> None:
    """A_l = 2 pi times the integral of t P_l(t) from 0 to 1."""
    made = glsl("lib/sh.glsl", "r[0].x = sh_cosine_factor(int(a[0].x));", numbers(np.arange(9.0)))[:, 0, 0]
    nodes, weights = leggauss(8)
    t = (nodes + 1) / 2
    bands = [np.pi * np.sum(weights * t * Legendre.basis(degree)(t)) for degree in range(3)]
    np.testing.assert_allclose(made, np.repeat(bands, (1, 3, 5)), rtol=1e-6)


STRENGTH = np.array([3.0, 2.0, 1.0])


def irradiance(glsl: Glsl, kind: int, place: Float64, axis: Float64, area: float, x: Float64, n: Float64) -> Float64:
    grid = rows(len(x), (place, float(kind)), (axis, area), (STRENGTH, 0.0), (x, 0.0), (n, 0.0))
    return glsl("lib/lights.glsl", IRRADIANCE, grid)[:, 0, :3]


def test_irradiance_of_a_point_light(glsl: Glsl, rng: np.random.Generator) -> None:
    place, x, n = np.array([0.4, 1.2, -0.3]), rng.uniform(-2, 2, (60, 3)), directions(rng, 60)
    v = place - x
    expected = np.maximum(np.sum(v * n, axis=1), 0) / np.linalg.norm(v, axis=1) ** 3
    made = irradiance(glsl, POINT, place, np.zeros(3), 0.0, x, n)
    np.testing.assert_allclose(made, expected[:, None] * STRENGTH, rtol=1e-4, atol=1e-5)


def test_irradiance_of_parallel_light_is_the_same_everywhere(glsl: Glsl, rng: np.random.Generator) -> None:
    axis, x, n = unit(np.array([0.3, -0.8, 0.1])), rng.uniform(-2, 2, (60, 3)), directions(rng, 60)
    made = irradiance(glsl, PARALLEL, np.zeros(3), axis, 0.0, x, n)
    np.testing.assert_allclose(made, np.maximum(-n @ axis, 0)[:, None] * STRENGTH, rtol=1e-5, atol=1e-6)


def test_irradiance_of_a_facet_far_away_is_that_of_its_intensity(glsl: Glsl, rng: np.random.Generator) -> None:
    """`strength` is radiance times area: the intensity along the axis, falling off with the cosine."""
    place, x, n = np.array([0.0, 3.0, 0.0]), rng.uniform(-1, 1, (60, 3)), directions(rng, 60)
    v = place - x
    cosines = np.maximum(np.sum(v * n, axis=1), 0) * np.maximum(-v @ DOWN, 0)
    made = irradiance(glsl, FACET, place, DOWN, 1e-4, x, n)
    expected = cosines / np.linalg.norm(v, axis=1) ** 4
    np.testing.assert_allclose(made, expected[:, None] * STRENGTH, rtol=2e-4, atol=1e-5)


def test_irradiance_of_a_facet_never_exceeds_that_of_its_radiance_all_around(glsl: Glsl) -> None:
    """However close: E <= pi L."""
    area, x = 0.5, np.geomspace(1e-4, 10, 30)[:, None] * DOWN
    made = irradiance(glsl, FACET, np.zeros(3), DOWN, area, x, np.tile(UP, (30, 1)))
    limit = np.pi * STRENGTH / area
    assert (made <= limit * (1 + 1e-6)).all()
    np.testing.assert_allclose(made[0], limit, rtol=1e-3)


def test_a_surfel_of_a_surface_counts_by_its_form_factor(glsl: Glsl) -> None:
    grid = rows(1, (2 * UP, np.pi), (DOWN, 0.3), (UP, 0.0), (UP, 0.0))
    assert glsl("lib/receive.glsl", SURFEL, grid)[0, 0, 0] == pytest.approx(1 / (1 + 1))


@pytest.mark.parametrize("cosine", [-0.5, 0.0, 0.6, 1.0])
def test_a_surfel_of_the_sky_counts_by_its_solid_angle(glsl: Glsl, cosine: float) -> None:
    """Wherever the receiver is."""
    towards = np.array([np.sqrt(1 - cosine**2), cosine, 0.0])
    grid = rows(1, (towards, 0.0), (np.zeros(3), 0.3), (np.array([5.0, 6.0, 7.0]), 0.0), (UP, 0.0))
    assert glsl("lib/receive.glsl", SURFEL, grid)[0, 0, 0] == pytest.approx(max(cosine, 0) * 0.3 / np.pi, rel=1e-5)


@pytest.mark.parametrize(("total", "closed", "scale"), [(0.9, 1, 0.9), (1.2, 1, 1.2), (0.4, 0, 1.0), (1.2, 0, 1.2)])
def test_factors_are_made_to_add_up_where_the_room_is_closed(
    glsl: Glsl, total: float, closed: float, scale: float
) -> None:
    """In the open they may add up to less than one, and nothing but the sky is missing."""
    grid = rows(1, (np.array([total, closed, 0.0]), 0.0))
    assert glsl("lib/receive.glsl", "r[0].x = closure_scale(a[0].x, a[0].y);", grid)[0, 0, 0] == pytest.approx(scale)


@pytest.mark.parametrize(
    ("direction", "u", "v"),
    [
        ((0, 1, 0), None, 0.5 / 8),
        ((0, -1, 0), None, 7.5 / 8),
        ((0, 0, -1), 0.5, 0.5),
        ((1, 0, 0), 0.75, 0.5),
        ((-1, 0, 0), 0.25, 0.5),
    ],
)
def test_the_sky_has_its_top_at_plus_y_and_its_middle_at_minus_z(
    glsl: Glsl, direction: tuple[float, ...], u: float | None, v: float
) -> None:
    made = glsl("lib/sky.glsl", "r[0].xy = sky_uv(a[0].xyz, 8.0);", rows(1, (2.0 * np.array(direction), 0.0)))[0, 0]
    assert made[1] == pytest.approx(v, abs=1e-6)
    assert u is None or made[0] == pytest.approx(u, abs=1e-6)


def test_a_point_light_looks_up_its_shadow_where_its_cameras_draw(glsl: Glsl, rng: np.random.Generator) -> None:
    place, x = np.array([0.2, -0.1, 0.4]), rng.uniform(-2, 2, (200, 3))
    grid = rows(200, (place, float(POINT)), (np.zeros(3), 0.0), (x, 2.0))
    cameras = cube_cameras(place, 0.01, 10.0)
    for point, (column, row, distance, texel) in zip(x, glsl("lib/shadow.glsl", SHADOW, grid)[:, 0], strict=True):
        clip = cameras[int(column // SIDE)].matrix @ np.append(point, 1.0)
        assert clip[3] > 0
        np.testing.assert_allclose((column % SIDE, row), (clip[:2] / clip[3] * 0.5 + 0.5) * SIDE, atol=1e-3)
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
    made = glsl("lib/shadow.glsl", SHADOW, rows(100, (camera.eye, float(PARALLEL)), (forward, 0.0), (x, radius)))[:, 0]
    ndc = np.concatenate([x, np.ones((100, 1))], axis=1) @ camera.matrix.T
    np.testing.assert_allclose(made[:, :2], (ndc[:, :2] * 0.5 + 0.5) * SIDE, atol=1e-3)
    np.testing.assert_allclose(made[:, 2], (x - camera.eye) @ forward, rtol=1e-5)
    np.testing.assert_allclose(made[:, 3], 2 * radius / SIDE, rtol=1e-6)
