import math
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from scenes import procedural
from scenes.errors import SceneError
from scenes.image import Float64
from scenes.mesh import Surface
from scenes.topology import face_vectors, is_watertight, signed_volume, surface_area

SOLIDS = {
    "sphere": procedural.sphere(1.5, 4),
    "ellipsoid": procedural.ellipsoid((1.0, 2.0, 0.5), 4),
    "displaced": procedural.displaced_icosphere(1.2, 0.3, 4.0, 7, 5),
    "knot": procedural.torus_knot(2, 3, 1.0, 0.2, 256, 24),
    "other knot": procedural.torus_knot(3, 2, 0.5, 0.08, 256, 16),
    "box": procedural.box((1.0, 2.0, 3.0)),
}
SHEETS = {"rectangle": procedural.rectangle((2.0, 3.0)), "disk": procedural.disk(1.5)}
ROOM_SIZE = (2.0, 4.0, 6.0)
ROOM = procedural.room_walls(ROOM_SIZE)
EVERYTHING = {**SOLIDS, **SHEETS, **{f"room {name}": wall for name, wall in ROOM.items()}}

solids = pytest.mark.parametrize("surface", SOLIDS.values(), ids=SOLIDS.keys())
everything = pytest.mark.parametrize("surface", EVERYTHING.values(), ids=EVERYTHING.keys())


def unit_face_normals(surface: Surface) -> Float64:
    return procedural.normalised(face_vectors(surface.positions, surface.faces))


@solids
def test_solids_are_watertight_and_look_outward(surface: Surface) -> None:
    assert is_watertight(surface)
    assert signed_volume(surface) > 0


@everything
def test_arrays_are_what_the_contract_says(surface: Surface) -> None:
    vertices = len(surface.positions)
    assert surface.positions.shape == surface.normals.shape == (vertices, 3)
    assert surface.uvs.shape == (vertices, 2)
    assert {a.dtype for a in (surface.positions, surface.normals, surface.uvs)} == {np.dtype(np.float32)}
    assert surface.faces.dtype == np.uint32
    assert surface.faces.max() == vertices - 1
    assert surface.uvs.min() >= 0
    assert surface.uvs.max() <= 1


@everything
def test_normals_are_unit_and_on_the_side_of_the_faces(surface: Surface) -> None:
    np.testing.assert_allclose(np.linalg.norm(surface.normals, axis=1), 1, atol=1e-6)
    corner_cosines = np.sum(surface.normals[surface.faces] * unit_face_normals(surface)[:, None], axis=2)
    assert corner_cosines.min() > 0.9


def richardson(coarse: float, fine: float) -> float:
    """The limit of a measure whose loss falls by four when the edges are halved, as that of an inscribed mesh does."""
    return (4 * fine - coarse) / 3


@pytest.mark.parametrize(
    ("measure", "exact"), [(surface_area, 4 * math.pi * 2**2), (signed_volume, 4 / 3 * math.pi * 2**3)]
)
def test_sphere_converges_with_the_square_of_the_edge(measure: Callable[[Surface], float], exact: float) -> None:
    values = [measure(procedural.sphere(2.0, detail)) for detail in (3, 4, 5)]
    assert values == sorted(values)
    assert values[-1] < exact
    assert (exact - values[0]) / (exact - values[1]) == pytest.approx(4, rel=0.02)
    assert richardson(values[1], values[2]) == pytest.approx(exact, rel=1e-5)


def test_ellipsoid_volume_and_exact_normals() -> None:
    a, b, c = 1.0, 2.0, 0.5
    volumes = [signed_volume(procedural.ellipsoid((a, b, c), detail)) for detail in (4, 5)]
    assert richardson(*volumes) == pytest.approx(4 / 3 * math.pi * a * b * c, rel=1e-4)
    surface = procedural.ellipsoid((a, b, c), 3)
    np.testing.assert_allclose(np.sum((surface.positions / [a, b, c]) ** 2, axis=1), 1, atol=1e-5)
    gradient = procedural.normalised(surface.positions.astype(np.float64) / np.square([a, b, c]))
    np.testing.assert_allclose(surface.normals, gradient, atol=1e-5)


@pytest.mark.parametrize("detail", range(4))
def test_icosphere_has_the_counts_of_a_subdivided_icosahedron(detail: int) -> None:
    directions, faces = procedural.icosphere(detail)
    assert (len(directions), len(faces)) == (10 * 4**detail + 2, 20 * 4**detail)


@settings(max_examples=20, deadline=None)
@given(
    amplitude=st.floats(0, 0.9),
    frequency=st.floats(0.1, 12),
    seed=st.integers(0, 2**64),
)
def test_bumps_stay_within_the_amplitude(amplitude: float, frequency: float, seed: int) -> None:
    surface = procedural.displaced_icosphere(2.0, amplitude, frequency, seed, 3)
    radii = np.linalg.norm(surface.positions, axis=1) / 2.0
    assert radii.min() >= 1 - amplitude - 1e-6
    assert radii.max() <= 1 + amplitude + 1e-6


def test_bumps_are_a_sphere_without_amplitude_and_differ_with_the_seed() -> None:
    flat = procedural.displaced_icosphere(1.5, 0.0, 3.0, 0, 3)
    np.testing.assert_array_equal(flat.positions, procedural.sphere(1.5, 3).positions)
    one, again, other = (procedural.displaced_icosphere(1.0, 0.3, 3.0, seed, 3) for seed in (1, 1, 2))
    np.testing.assert_array_equal(one.positions, again.positions)
    assert np.abs(one.positions - other.positions).max() > 0.05


def test_bump_normals_are_the_limit_of_the_face_normals() -> None:
    """Face normals around a vertex differ from its exact normal by about the edge length times the curvature."""
    worst = []
    for detail in (4, 5):
        surface = procedural.displaced_icosphere(1.0, 0.3, 4.0, 3, detail)
        sums = np.zeros(surface.normals.shape)
        vectors = face_vectors(surface.positions, surface.faces)
        for corner in range(3):
            np.add.at(sums, surface.faces[:, corner], vectors)
        worst.append(np.linalg.norm(procedural.normalised(sums) - surface.normals, axis=1).max())
    assert worst[1] < 0.65 * worst[0]
    assert worst[1] < 0.02


def test_knot_volume_is_that_of_a_tube_with_polygonal_sections() -> None:
    """Pappus: the section's area times the length of the curve through its centre, whatever the bends."""
    p, q, radius, tube, sides = 2, 3, 1.0, 0.2, 24
    t = np.linspace(0, 2 * np.pi, 100_001)
    ring = 1 + 0.5 * np.cos(q * t)
    curve = radius * np.stack([ring * np.cos(p * t), 0.5 * np.sin(q * t), ring * np.sin(p * t)], axis=1)
    length = np.linalg.norm(np.diff(curve, axis=0), axis=1).sum()
    section = 0.5 * sides * math.sin(2 * math.pi / sides) * tube**2
    coarse, fine = (signed_volume(procedural.torus_knot(p, q, radius, tube, n, sides)) for n in (1024, 2048))
    limit = 2 * fine - coarse  # cells are twisted, and their diagonals err in proportion to the segments' length
    assert limit == pytest.approx(section * length, rel=1e-4)


def test_knot_vertices_are_one_tube_radius_from_the_curve_along_the_normal() -> None:
    surface = procedural.torus_knot(2, 5, 1.0, 0.1, 64, 8)
    centres = surface.positions.reshape(64, 8, 3).mean(axis=1)
    np.testing.assert_allclose(
        surface.positions.reshape(64, 8, 3) - 0.1 * surface.normals.reshape(64, 8, 3),
        np.repeat(centres[:, None], 8, axis=1),
        atol=1e-6,
    )


@pytest.mark.parametrize(("p", "q", "tube", "said"), [(2, 4, 0.1, "common divisor"), (2, 3, 0.8, "tightest bend")])
def test_impossible_knots_are_refused(p: int, q: int, tube: float, said: str) -> None:
    with pytest.raises(SceneError, match=said):
        procedural.torus_knot(p, q, 1.0, tube, 64, 8)


def test_box_has_exact_area_volume_and_four_vertices_a_face() -> None:
    surface = procedural.box((1.0, 2.0, 3.0))
    assert surface_area(surface) == pytest.approx(22)
    assert signed_volume(surface) == pytest.approx(6)
    assert len(surface.positions) == 24
    np.testing.assert_allclose(np.abs(np.sum(surface.positions * surface.normals, axis=1)).max(), 1.5)


def test_room_walls_stand_where_their_names_say_and_look_inward() -> None:
    outward = {
        "left": (-1, 0, 0),
        "right": (1, 0, 0),
        "floor": (0, -1, 0),
        "ceiling": (0, 1, 0),
        "back": (0, 0, -1),
        "front": (0, 0, 1),
    }
    assert set(ROOM) == set(outward)
    for name, wall in ROOM.items():
        np.testing.assert_allclose(wall.positions.mean(axis=0), 0.5 * np.multiply(outward[name], ROOM_SIZE))
        np.testing.assert_allclose(wall.normals, np.tile(-np.array(outward[name]), (4, 1)))
    assert sum(surface_area(wall) for wall in ROOM.values()) == pytest.approx(2 * (2 * 4 + 4 * 6 + 6 * 2))


def test_joined_walls_enclose_the_room_from_inside() -> None:
    faces = np.concatenate([4 * i + wall.faces for i, wall in enumerate(ROOM.values())])
    positions = np.concatenate([wall.positions for wall in ROOM.values()])
    normals = np.concatenate([wall.normals for wall in ROOM.values()])
    whole = procedural.make_surface(positions, normals, np.zeros((24, 2)), faces)
    assert is_watertight(whole)
    assert signed_volume(whole) == pytest.approx(-2 * 4 * 6)


@pytest.mark.parametrize(
    "surface",
    [procedural.rectangle((2.0, 3.0)), *[wall for name, wall in ROOM.items() if name not in {"floor", "ceiling"}]],
)
def test_textures_stand_upright_on_upright_faces_and_are_not_mirrored(surface: Surface) -> None:
    """U grows along up × normal, which is to the right of someone who looks at the face; v grows upward."""
    lower_left, lower_right, upper_left = (
        surface.positions[np.flatnonzero((surface.uvs == uv).all(axis=1))[0]] for uv in ((0, 0), (1, 0), (0, 1))
    )
    up = upper_left - lower_left
    np.testing.assert_allclose(procedural.normalised(up), [0, 1, 0], atol=1e-7)
    right = procedural.normalised(lower_right - lower_left)
    np.testing.assert_allclose(right, np.cross([0, 1, 0], surface.normals[0]), atol=1e-6)


def test_sphere_texture_is_upright_and_not_mirrored_from_the_front() -> None:
    surface = procedural.sphere(1.0, 3)
    front = surface.positions[:, 2] > 0.5
    order = np.argsort(surface.positions[front, 0] / surface.positions[front, 2])
    assert (np.diff(surface.uvs[front, 0][order]) >= -1e-6).all()
    order = np.argsort(surface.positions[:, 1])
    assert (np.diff(surface.uvs[order, 1]) >= -1e-6).all()


def test_disk_has_exactly_the_area_of_the_circle() -> None:
    surface = procedural.disk(1.5)
    assert surface_area(surface) == pytest.approx(math.pi * 1.5**2, rel=1e-6)
    np.testing.assert_allclose(surface.positions[:, 2], 0)
    np.testing.assert_allclose(surface.normals, np.tile([0, 0, 1], (len(surface.normals), 1)))
