"""The functions of glsl/lib/ that the translucency techniques are made of, on grids against float64."""

from collections.abc import Callable

import numpy as np
import pytest

from realtime.backlight import ELEMENT, beam
from realtime.lights import FACET, PARALLEL, POINT, Light
from realtime.slab import PER_OCTAVE, slab_table
from scenes.image import Float64
from scenes.procedural import normalised

Glsl = Callable[..., Float64]

CENTRED = "r[0].x = centred_distance(a[0].xyz, a[1].xyz);"
LENGTH = "r[0].xy = signed_length(a[0].x, a[0].y, a[0].z);"
NORMALISED = "r[0].x = normalised_thickness(a[0].xyz, a[1].xyz, a[0].w);"
INFLUENCE = "r[0].x = area_of_influence(a[0].xyz, a[1].xyz, a[0].w);"
BEAM = "Beam b = beam_of(Light(a[0], a[1], a[2]), a[3].xyz); r[0].xyz = b.travel; r[1].xyz = b.irradiance;"
UV = "r[0].xy = slab_table_uv(a[0].x, a[0].y, a[0].z, vec2(512.0, 48.0));"
RADIANCE = "r[0].xyz = slab_table_radiance(a[1].xyz, a[0].x, a[0].y, a[0].z);"
TAP = "r[0].xy = gaussian_tap(int(a[0].x), int(a[0].y));"
CROSSING = """
    Crossing c = step_characteristic(a[0].xyz, a[1].xyz, a[2].xyz, a[0].w);
    r[0].xyz = c.leaving;
    r[1].xyz = c.mean;
"""


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(7800)


def grid(*columns: Float64) -> Float64:
    """Input (N, I, 4) from columns (N, up to 4)."""
    made = np.zeros((len(columns[0]), len(columns), 4))
    for k, column in enumerate(columns):
        made[:, k, : column.shape[1]] = column
    return made


@pytest.mark.parametrize("away", [20.0, 1e3, 1e5])
def test_the_centred_distance_keeps_the_precision_of_the_subject(
    glsl: Glsl, rng: np.random.Generator, away: float
) -> None:
    """Its error is that of a float32 of the subject's size; subtracting two distances would lose away * 6e-8."""
    v = rng.uniform(-6, 6, (200, 3)).astype(np.float32).astype(float)
    offset = (away * normalised(rng.normal(size=(200, 3)))).astype(np.float32).astype(float)
    exact = np.linalg.norm(v + offset, axis=1) - np.linalg.norm(offset, axis=1)
    made = glsl("lib/centred_distance.glsl", CENTRED, grid(v, offset))[:, 0, 0]
    np.testing.assert_allclose(made, exact, atol=5e-6)


def test_signed_lengths_sum_to_the_length_inside(glsl: Glsl) -> None:
    """Two layers, 1 to 2 and 4 to 7, in any order; the second number counts the bodies around the end."""
    faces = np.array([(4.0, -1.0), (2.0, 1.0), (7.0, 1.0), (1.0, -1.0)])
    ends = np.array([0.5, 1.5, 3.0, 5.0, 9.0])
    rows = np.array([(*face, end) for end in ends for face in faces])
    summed = glsl("lib/signed_length.glsl", LENGTH, grid(rows))[:, 0, :2].reshape(5, 4, 2).sum(axis=1)
    np.testing.assert_allclose(summed[:, 0], [0, 0.5, 1, 2, 4], atol=1e-6)
    np.testing.assert_array_equal(summed[:, 1], [0, 1, 0, 1, 0])


def test_normalised_thickness_is_a_part_of_the_longest_and_at_most_1(glsl: Glsl) -> None:
    front = np.array([[0, 0, 0, 4.0], [0, 0, 1, 4.0], [0, 0, -9, 4.0]])
    back = np.array([[0, 0, -3.0], [0, 0, 1], [0, 0, 3]])
    np.testing.assert_allclose(glsl("lib/talk_translucency.glsl", NORMALISED, grid(front, back))[:, 0, 0], [0.75, 0, 1])


@pytest.mark.parametrize("n", [0.5, 1.0, 2.0, 8.0])
def test_influence_is_the_power_of_the_cosine_and_nothing_where_the_light_is_in_front(glsl: Glsl, n: float) -> None:
    """The slide's pow(dot(V, L), n) alone is undefined for a negative cosine: NaN on many GPUs."""
    angle = np.linspace(0, np.pi, 41)
    V = np.tile([0.0, 0.0, 1.0, n], (41, 1))
    L = np.stack([np.sin(angle), 0 * angle, np.cos(angle)], axis=1)
    made = glsl("lib/talk_translucency.glsl", INFLUENCE, grid(V, L))[:, 0, 0]
    np.testing.assert_allclose(made, np.maximum(np.cos(angle), 0) ** n, atol=5e-4)
    assert not made[angle > np.pi / 2 + 1e-6].any()


@pytest.mark.parametrize("kind", [POINT, FACET, PARALLEL, ELEMENT])
def test_a_beam_is_its_float64_twin(glsl: Glsl, rng: np.random.Generator, kind: int) -> None:
    count = 30
    place, point = rng.normal(size=(count, 3)), 3 * rng.normal(size=(count, 3))
    axis, strength = normalised(rng.normal(size=(count, 3))), rng.uniform(size=(count, 3))
    area = rng.uniform(0.1, 1, (count, 1))
    rows = grid(np.hstack([place, np.full((count, 1), kind)]), np.hstack([axis, area]), strength, point)
    made = glsl("lib/beam.glsl", BEAM, rows, outputs=2)[..., :3]
    for k in range(count):
        light = Light(kind, place[k], axis[k], strength[k], float(area[k, 0]), 0)
        np.testing.assert_allclose(made[k], np.stack(beam(light, point[k])), rtol=1e-4, atol=1e-5)


def test_table_coordinates_are_the_centres_of_texels(glsl: Glsl) -> None:
    """Thicknesses of 1/2, 1, 2 and 2^100 thinnest ones; cosines beyond both ends."""
    rows = np.array([(0.5, 0.0, 1.0), (1.0, 1.0, 1.0), (2.0, 2.0, 1.0), (2.0**100, -1.0, 1.0)])
    made = glsl("lib/slab_table.glsl", UV, grid(rows), defines={"PER_OCTAVE": PER_OCTAVE})[:, 0, :2]
    columns, lines = np.array([0, 0, PER_OCTAVE, 511]), np.array([0, 47, 47, 0])
    np.testing.assert_allclose(made, np.stack([(columns + 0.5) / 512, (lines + 0.5) / 48], axis=1), rtol=1e-5)


def test_table_entries_become_radiance_as_in_float64(glsl: Glsl) -> None:
    table = slab_table(np.full(3, 0.1), np.full(3, 1.0), 8.0)
    thickness = table.thinnest * np.array([0.3, 1.0, 2.0**3, 2.0**7])
    columns = np.array([0, 0, 3, 7]) * PER_OCTAVE
    rows = np.stack([thickness, np.ones(4), np.full(4, table.thinnest)], axis=1)
    entries = table.transmitted[-1, columns].astype(float)
    made = glsl("lib/slab_table.glsl", RADIANCE, grid(rows, entries), defines={"PER_OCTAVE": PER_OCTAVE})[:, 0, :3]
    np.testing.assert_allclose(made, table.transmission(thickness, np.ones(4)), rtol=1e-4)


@pytest.mark.parametrize(("count", "tolerance"), [(48, 0.1), (2048, 0.01)])
def test_taps_are_spread_like_a_gaussian_of_standard_deviation_1(glsl: Glsl, count: int, tolerance: float) -> None:
    """Of 48 taps the outermost few make the variances differ by a tenth from one axis to the other."""
    made = glsl("lib/coverage_taps.glsl", TAP, grid(np.array([(i, count) for i in range(count)], dtype=float)))[:, 0]
    assert np.abs(made[:, :2].mean(axis=0)).max() < 0.05
    np.testing.assert_allclose(np.cov(made[:, :2].T, bias=True), np.eye(2), atol=tolerance)


def test_a_step_through_matter_is_its_integral(glsl: Glsl) -> None:
    """From paths with next to nothing in the way to opaque ones, on both sides of where the series takes over."""
    tau = np.concatenate([np.geomspace(1e-7, 0.099, 12), np.geomspace(0.101, 30, 12)])[:, None] * np.ones(3)
    path, entering, emitted = 0.5, np.array([0.0, 1.0, 3.0]), np.array([2.0, 0.0, 1.0])
    rows = grid(np.tile([*entering, path], (24, 1)), np.tile(emitted, (24, 1)), tau / path)
    leaving, mean = glsl("lib/step_characteristic.glsl", CROSSING, rows, outputs=2)[..., :3].transpose(1, 0, 2)
    averaged = -np.expm1(-tau) / tau
    # (1 - averaged) / tau, where float64 would cancel as well, from its series
    own = np.where(tau < 1e-3, 0.5 - tau / 6, (1 - averaged) / tau)
    np.testing.assert_allclose(leaving, entering * np.exp(-tau) + emitted * path * averaged, rtol=2e-5, atol=1e-9)
    np.testing.assert_allclose(mean, entering * averaged + emitted * path * own, rtol=3e-5, atol=1e-9)
