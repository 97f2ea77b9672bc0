import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from scenes import eyes
from scenes.bodies import joined
from scenes.geometry import placed
from scenes.mesh import Surface
from scenes.procedural import normalised
from scenes.shapes import Eye
from scenes.topology import face_vectors, is_watertight, signed_volume, surface_area
from scenes.units import Vec3

ANATOMICAL: dict[str, Any] = {"sclera_radius": 12.0, "cornea_radius": 7.8, "limbus_radius": 5.9}
TALK: dict[str, Any] = {"sclera_radius": 1.0, "cornea_radius": 1.0, "limbus_radius": math.sqrt(1 - 0.805**2)}
ENDOTHELIUM = {"radius": 6.5, "thickness": 0.55, "ior": 1.336}

angles = st.floats(-180, 180)


def eye(**changes: Any) -> Eye:
    given = {"type": "eye", "name": "eye", "material": "white", "iris": "brown", "ior": 1.376, **ANATOMICAL, **changes}
    return Eye.model_validate(given)


def both(shape: Eye) -> Surface:
    return joined([eyes.sclera(shape), eyes.cornea(shape)])


both_eyes = pytest.mark.parametrize("shape", [eye(), eye(**TALK)], ids=["anatomical", "talk"])


@both_eyes
def test_sclera_and_cornea_meet_in_the_limbus(shape: Eye) -> None:
    """The circle lies on both spheres, and the apex on that of the cornea."""
    h, r = eyes.limbus_height(shape), shape.limbus_radius
    assert math.hypot(h, r) == pytest.approx(shape.sclera_radius)
    assert math.hypot(h - eyes.cornea_centre(shape), r) == pytest.approx(shape.cornea_radius)
    assert eyes.apex(shape) == pytest.approx(eyes.cornea_centre(shape) + shape.cornea_radius)
    assert eyes.apex(shape) > h > eyes.cornea_centre(shape)


def test_the_eye_of_the_talk_is_one_sphere_whose_limbus_is_at_0_805() -> None:
    shape = eye(**TALK)
    assert eyes.limbus_height(shape) == pytest.approx(0.805)
    assert eyes.cornea_centre(shape) == pytest.approx(0, abs=1e-12)
    assert eyes.apex(shape) == pytest.approx(1)
    np.testing.assert_allclose(np.linalg.norm(both(shape).positions, axis=1), 1, atol=1e-6)


def test_the_endothelium_lies_its_thickness_behind_the_apex() -> None:
    assert eyes.endothelium_centre(eye()) is None
    centre = eyes.endothelium_centre(eye(endothelium=ENDOTHELIUM))
    assert centre is not None
    assert centre + 6.5 == pytest.approx(eyes.apex(eye()) - 0.55)


@pytest.mark.parametrize("depth", [None, 3.55])
def test_the_iris_is_a_bowl_behind_its_rim(depth: float | None) -> None:
    flat, bowl = eye(iris_depth=depth), eye(iris_depth=depth, iris_curvature=9.0)
    plane = eyes.limbus_height(flat) if depth is None else eyes.apex(flat) - depth
    assert eyes.iris_plane(flat) == eyes.iris_plane(bowl) == pytest.approx(plane)
    assert eyes.iris_centre(flat) is None
    centre = eyes.iris_centre(bowl)
    assert centre is not None
    assert math.hypot(centre - plane, bowl.limbus_radius) == pytest.approx(9)
    assert centre > plane > centre - 9


@both_eyes
def test_the_two_meshes_close_the_eye_and_share_their_seam(shape: Eye) -> None:
    sclera, cornea = eyes.sclera(shape), eyes.cornea(shape)
    rims = [part.positions[part.positions[:, 1] == np.float32(eyes.limbus_height(shape))] for part in (sclera, cornea)]
    np.testing.assert_array_equal(*rims)
    assert len(rims[0]) == shape.detail + 1
    assert not is_watertight(sclera)
    assert not is_watertight(cornea)
    assert is_watertight(both(shape))
    assert sclera.positions[:, 1].max() == cornea.positions[:, 1].min()


@settings(max_examples=15, deadline=None)
@given(degrees=st.tuples(angles, angles, angles), detail=st.integers(16, 64))
def test_a_placed_eye_is_closed(degrees: Vec3, detail: int) -> None:
    shape = eye(rotation_deg=degrees, position=(1.0, -2.0, 3.0), scale=0.5, detail=detail)
    assert is_watertight(joined([placed(eyes.sclera(shape), shape), placed(eyes.cornea(shape), shape)]))


def cap_volume(radius: float, height: float) -> float:
    return math.pi * height**2 * (3 * radius - height) / 3


def richardson(coarse: float, fine: float) -> float:
    """The limit of a measure whose loss falls by four when the edges are halved, as that of an inscribed mesh does."""
    return (4 * fine - coarse) / 3


def test_volume_and_areas_are_those_of_two_caps() -> None:
    coarse, fine = eye(detail=128), eye(detail=256)
    front, back = eyes.apex(fine) - eyes.limbus_height(fine), 12 + eyes.limbus_height(fine)
    volume = cap_volume(7.8, front) + cap_volume(12, back)
    assert richardson(signed_volume(both(coarse)), signed_volume(both(fine))) == pytest.approx(volume, rel=2e-5)
    for part, area in [(eyes.cornea, 2 * math.pi * 7.8 * front), (eyes.sclera, 2 * math.pi * 12 * back)]:
        assert richardson(surface_area(part(coarse)), surface_area(part(fine))) == pytest.approx(area, rel=1e-4)


@both_eyes
def test_normals_are_those_of_the_spheres(shape: Eye) -> None:
    for surface, radius, centre in [
        (eyes.sclera(shape), shape.sclera_radius, 0.0),
        (eyes.cornea(shape), shape.cornea_radius, eyes.cornea_centre(shape)),
    ]:
        expected = (surface.positions.astype(np.float64) - [0, centre, 0]) / radius
        np.testing.assert_allclose(surface.normals, expected, atol=1e-6)
        faces = normalised(face_vectors(surface.positions, surface.faces))
        assert np.sum(surface.normals[surface.faces] * faces[:, None], axis=2).min() > 0.999


def test_the_texture_of_the_cornea_is_that_of_the_iris() -> None:
    """The contract of the iris: u along +x, v along -z, the disk spans the texture."""
    surface = eyes.cornea(eye())
    disk = np.column_stack([surface.positions[:, 0], -surface.positions[:, 2]]) / (2 * 5.9)
    np.testing.assert_allclose(surface.uvs, 0.5 + disk, atol=1e-6)


def test_the_texture_of_the_sclera_is_that_of_a_whole_sphere_without_a_squeezed_seam() -> None:
    shape = eye()
    surface = eyes.sclera(shape)
    np.testing.assert_allclose(np.cos(np.pi * surface.uvs[:, 1]), -surface.positions[:, 1] / 12, atol=1e-6)
    across = surface.uvs[surface.faces][:, :, 0]
    assert np.ptp(across, axis=1).max() < 1.01 / shape.detail


def test_an_iris_that_pierces_the_cornea_or_the_endothelium_is_a_problem() -> None:
    chamber = eyes.apex(eye()) - eyes.limbus_height(eye())
    assert eyes.eye_problem(eye()) is None
    assert eyes.eye_problem(eye(iris_depth=float(f"{chamber:.6g}"), endothelium=ENDOTHELIUM)) is None
    found = eyes.eye_problem(eye(iris_depth=2.0))
    assert found == ("iris_depth = 2", f"at least {chamber:.6g}, where the cornea is as wide as the iris")
    found = eyes.eye_problem(eye(endothelium={**ENDOTHELIUM, "thickness": 3.0}))
    assert found == ("endothelium.thickness = 3", f"less than {chamber:.6g}, the depth of the iris")
