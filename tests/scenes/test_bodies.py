import math
from functools import partial

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from scenes import bodies
from scenes.distances import Field, gradient, isosurface
from scenes.errors import SceneError
from scenes.image import Float64
from scenes.mesh import Surface
from scenes.procedural import make_surface, normalised
from scenes.topology import face_vectors, is_watertight, signed_volume, surface_area

HEIGHT, MEMBRANE = 25.0, 0.6
EAR = bodies.ear(HEIGHT, MEMBRANE, 160)
BODIES = {
    "slab": bodies.slab(0.5, 4.0),
    "wedge": bodies.wedge((2.0, 3.0), 0.5, 2.0),
    "capsule": bodies.capsule(1.0, 2.0, 64),
    "torus": bodies.torus(2.0, 0.5, 192, 64),
    "tube": bodies.tube(0.1, 2.0),
    "ear": EAR,
}
everything = pytest.mark.parametrize("surface", BODIES.values(), ids=BODIES.keys())

sizes = st.floats(0.1, 10)


@everything
def test_bodies_are_watertight_and_look_outward(surface: Surface) -> None:
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
    np.testing.assert_allclose(np.linalg.norm(surface.normals, axis=1), 1, atol=1e-6)


@pytest.mark.parametrize("name", sorted(set(BODIES) - {"ear"}))
def test_normals_are_on_the_side_of_the_faces(name: str) -> None:
    surface = BODIES[name]
    faces = normalised(face_vectors(surface.positions, surface.faces))
    assert np.sum(surface.normals[surface.faces] * faces[:, None], axis=2).min() > 0.99


@settings(max_examples=30, deadline=None)
@given(thickness=sizes, width=sizes)
def test_slab_and_wedge_have_the_volume_of_their_formula(thickness: float, width: float) -> None:
    assert signed_volume(bodies.slab(thickness, width)) == pytest.approx(width**2 * thickness, rel=1e-5)
    wedge = bodies.wedge((width, 2.0), thickness, 3.0)
    assert signed_volume(wedge) == pytest.approx(2 * width * 0.5 * (thickness + 3), rel=1e-5)


def test_slab_lies_about_the_plane_z_0() -> None:
    np.testing.assert_array_equal(np.unique(np.abs(BODIES["slab"].positions), axis=0), [[2, 2, 0.25]])


def test_wedge_is_thin_at_minus_x_and_thick_at_plus_x_with_flat_faces() -> None:
    surface = BODIES["wedge"]
    assert {(float(x), abs(float(z))) for x, _, z in surface.positions} == {(-1.0, 0.25), (1.0, 1.0)}
    slope = np.array([-0.75, 0, 2.0]) / math.hypot(0.75, 2.0)
    front = surface.normals[surface.normals[:, 2] > 0.5]
    np.testing.assert_allclose(front, np.tile(slope, (4, 1)), atol=1e-7)
    assert len(np.unique(surface.normals.round(5), axis=0)) == 6


def richardson(coarse: float, fine: float) -> float:
    """The limit of a measure whose loss falls by four when the edges are halved, as that of an inscribed mesh does."""
    return (4 * fine - coarse) / 3


def test_capsule_has_the_volume_and_area_of_a_cylinder_and_a_sphere() -> None:
    r, length = 1.5, 4.0
    coarse, fine = bodies.capsule(r, length, 64), bodies.capsule(r, length, 128)
    volume = math.pi * r**2 * length + 4 / 3 * math.pi * r**3
    assert richardson(signed_volume(coarse), signed_volume(fine)) == pytest.approx(volume, rel=1e-5)
    area = 2 * math.pi * r * length + 4 * math.pi * r**2
    assert richardson(surface_area(coarse), surface_area(fine)) == pytest.approx(area, rel=1e-5)


@settings(max_examples=20, deadline=None)
@given(radius=sizes, length=sizes, detail=st.integers(8, 80))
def test_capsule_lies_at_its_radius_from_its_line_with_exact_normals(radius: float, length: float, detail: int) -> None:
    surface = bodies.capsule(radius, length, detail)
    nearest = np.zeros_like(surface.positions)
    nearest[:, 1] = np.clip(surface.positions[:, 1], -0.5 * length, 0.5 * length)
    scale = radius + length
    np.testing.assert_allclose(surface.positions - nearest, radius * surface.normals, atol=1e-6 * scale)
    assert surface.positions[:, 1].max() == pytest.approx(radius + 0.5 * length, rel=1e-6)
    assert is_watertight(surface)


def test_torus_has_the_volume_and_area_of_pappus() -> None:
    radius, tube = 2.0, 0.7
    coarse, fine = bodies.torus(radius, tube, 96, 32), bodies.torus(radius, tube, 192, 64)
    volume, area = 2 * math.pi**2 * radius * tube**2, 4 * math.pi**2 * radius * tube
    assert richardson(signed_volume(coarse), signed_volume(fine)) == pytest.approx(volume, rel=1e-5)
    assert richardson(surface_area(coarse), surface_area(fine)) == pytest.approx(area, rel=1e-5)


def test_torus_lies_at_its_tube_from_its_middle_with_exact_normals() -> None:
    surface = bodies.torus(2.0, 0.5, 48, 24)
    flat = surface.positions * [1, 0, 1]
    middle = 2 * normalised(flat.astype(np.float64))
    np.testing.assert_allclose(surface.positions - middle, 0.5 * surface.normals, atol=1e-6)


def test_tube_has_flat_ends_and_the_side_of_the_cylinder() -> None:
    surface = bodies.tube(0.1, 2.0)
    areas = 0.5 * np.linalg.norm(face_vectors(surface.positions, surface.faces), axis=1)
    is_end = np.abs(surface.normals[surface.faces[:, 0], 1]) == 1
    assert areas[~is_end].sum() == pytest.approx(2 * math.pi * 0.1 * 2, rel=1e-5)
    assert areas[is_end].sum() == pytest.approx(2 * math.pi * 0.1**2, rel=2e-3)  # their rim is that of the prism


def cast(surface: Surface, origins: Float64, directions: Float64) -> Float64:
    """Distance (R,) from each origin to the nearest face that is more than 1e-6 away; infinity if there is none.

    Möller and Trumbore 1997, "Fast, minimum storage ray/triangle intersection".
    """
    a, b, c = surface.positions.astype(np.float64)[surface.faces].transpose(1, 0, 2)
    edge1, edge2 = b - a, c - a
    nearest = np.full(len(origins), np.inf)
    for i, (o, d) in enumerate(zip(origins, directions, strict=True)):
        p = np.cross(d, edge2)
        with np.errstate(divide="ignore", invalid="ignore"):
            inverse = 1 / np.sum(edge1 * p, axis=1)
            s = o - a
            u = np.sum(s * p, axis=1) * inverse
            q = np.cross(s, edge1)
            v, t = q @ d * inverse, np.sum(edge2 * q, axis=1) * inverse
            nearest[i] = t[(u >= 0) & (v >= 0) & (u + v <= 1) & (t > 1e-6)].min(initial=np.inf)
    return nearest


@pytest.mark.parametrize("membrane", [0.35, 0.6, 0.8])
def test_the_ear_is_as_thick_as_asked_all_over_its_dish(membrane: float) -> None:
    """You should see the same thickness from the middle of the dish to close to its rim, to 1 %."""
    ear = bodies.ear(HEIGHT, membrane, 160)
    vertices = ear.positions.astype(np.float64)
    within = (vertices[:, 1] > -5) & (np.hypot(vertices[:, 0] / 6.5, vertices[:, 1] / 11) < 1)
    chosen = np.random.default_rng(1).choice(np.flatnonzero(within), 40, replace=False)
    thickness = cast(ear, vertices[chosen], -ear.normals[chosen].astype(np.float64))
    np.testing.assert_allclose(thickness, membrane, rtol=0.01)


def test_the_ear_is_as_tall_as_asked_and_opens_towards_plus_z() -> None:
    top = EAR.positions[:, 1].max()
    assert top == pytest.approx(0.5 * HEIGHT, rel=1e-3)
    dish = EAR.positions[EAR.positions[:, 1] > -5]
    middle = dish[np.hypot(dish[:, 0], dish[:, 1]) < 0.3]
    assert middle[:, 2].max() == pytest.approx(0.5 * MEMBRANE, rel=0.02)
    assert dish[np.abs(dish[:, 0]) > 7, 2].min() > middle[:, 2].max()
    assert EAR.positions[:, 1].min() == pytest.approx(-0.88 * HEIGHT, rel=1e-3)


def test_the_ear_keeps_its_shape_when_it_is_scaled() -> None:
    large = bodies.ear(2 * HEIGHT, 2 * MEMBRANE, 160)
    np.testing.assert_allclose(large.positions, 2 * EAR.positions, rtol=1e-6)


def test_the_normals_of_the_ear_are_those_of_its_faces_but_for_slivers() -> None:
    faces = face_vectors(EAR.positions, EAR.faces)
    areas = np.linalg.norm(faces, axis=1)
    cosines = np.sum(EAR.normals[EAR.faces] * normalised(faces)[:, None], axis=2).min(axis=1)
    assert areas[cosines < 0.9].sum() < 0.02 * areas.sum()


def test_a_membrane_thinner_than_two_cells_is_refused() -> None:
    with pytest.raises(SceneError, match=r"a membrane of 0.3 .* cells of 0.156.* at least 167 cells"):
        bodies.ear(25.0, 0.3, 160)
    bodies.ear(25.0, 0.3, 167)


def ball(x: Float64, y: Float64, z: Float64, radius: float) -> Float64:
    distance: Float64 = np.sqrt(x * x + y * y + z * z) - radius
    return distance


def meshed(field: Field, axis: Float64) -> Surface:
    positions, faces = isosurface(field, [axis, axis, axis])
    return make_surface(positions, gradient(field, positions, 1e-4), np.zeros((len(positions), 2)), faces)


def test_an_isosurface_looks_outward_and_has_outward_normals() -> None:
    """The trap of marching cubes: with faces that look outward its own normals look inward."""
    surface = meshed(partial(ball, radius=1.0), np.linspace(-1.3, 1.37, 40))
    assert is_watertight(surface)
    assert signed_volume(surface) == pytest.approx(4 / 3 * math.pi, rel=5e-3)
    np.testing.assert_allclose(surface.normals, normalised(surface.positions.astype(np.float64)), atol=1e-4)


def test_samples_of_exactly_0_leave_an_isosurface_closed() -> None:
    """The trap of marching cubes: a radius of five cells puts samples on the sphere, which would collapse triangles."""
    axis = np.arange(-7.0, 8.0)
    samples = ball(axis[:, None, None], axis[None, :, None], axis[None, None, :], 5.0)
    assert (samples == 0).sum() == 30
    surface = meshed(partial(ball, radius=5.0), axis)
    assert np.linalg.norm(face_vectors(surface.positions, surface.faces), axis=1).min() > 0
    assert is_watertight(surface)
