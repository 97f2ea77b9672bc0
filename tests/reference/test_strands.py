"""Frames on a deformed skin: closed forms of a cylinder and of a rigid turn, differences of positions, brute force."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from reference.quantities.hair_frames import tangents, tips
from reference.strands import Chart, barycentric, chart_of, film_frames, frames, roots, strands_of
from scenes.errors import SceneError
from scenes.image import Float64
from scenes.limbs import BLEND_RADII
from scenes.model import Scene
from scenes.procedural import normalised, rotation_xyz

MakeScene = Callable[..., Scene]
RADIUS, LENGTH = 10.0, 80.0
LIMB = {"name": "limb", "type": "limb", "material": "skin", "radius": RADIUS, "length": LENGTH, "detail": 32}
HAIR: dict[str, Any] = {
    "name": "fur",
    "on": "limb",
    "material": "fibre",
    "count": 500,
    "guides": 5,
    "length": 6.0,
    "radius": 0.05,
    "region": [0.0, 0.2, 1.0, 0.8],
    "comb": [0.3, 0.6],
    "curl": 0.1,
}
MATERIALS = {
    "skin": {"type": "diffuse", "reflectance": [0.5, 0.4, 0.3]},
    "fibre": {"type": "fibre", "sigma_a": [0.1, 0.2, 0.3]},
}


@pytest.fixture
def hairy(make_scene: MakeScene) -> MakeScene:
    """Makes a limb with hair, some keys of both replaced."""

    def make(hair: dict[str, Any] | None = None, **shape: Any) -> Scene:
        return make_scene(
            subject=["limb"], materials=MATERIALS, shapes=[LIMB | shape], hair=[HAIR | (hair or {})], emitters=[]
        )

    return make


def height(v: Float64) -> Float64:
    """The y on the resting limb beside its ends."""
    end = 0.5 * np.pi * RADIUS
    return np.asarray(v * (2 * end + LENGTH) - end - LENGTH / 2)


def test_frames_on_a_straight_limb_are_those_of_a_cylinder(hairy: MakeScene) -> None:
    """u goes round it from -z over -x and +z to +x. Facets of 32 sides turn interpolated normals by 1e-3 at most."""
    scene = hairy()
    found, _ = film_frames(scene, 16, 8)
    u = (np.arange(16) + 0.5) / 16
    turn = np.tile(2 * np.pi * u - np.pi, 8)
    normal = np.stack([np.sin(turn), 0 * turn, np.cos(turn)], axis=1)
    tangent = np.stack([np.cos(turn), 0 * turn, -np.sin(turn)], axis=1)
    side = np.tile([0.0, 1.0, 0.0], (128, 1))
    np.testing.assert_allclose(found.axes, np.stack([tangent, side, normal], axis=1), atol=1e-3)
    v = np.repeat(0.8 - 0.6 * (np.arange(8) + 0.5) / 8, 16)
    place = RADIUS * normal + height(v)[:, None] * (0, 1, 0)
    np.testing.assert_allclose(found.position, place, atol=RADIUS * (1 - np.cos(np.pi / 32)))


@given(st.floats(-120, 120))
@settings(max_examples=10, deadline=None)
def test_hair_on_the_straight_part_moves_with_its_bone(bend_deg: float) -> None:
    """A frame that is skinned by the blended matrix would too; one that is not recomputed at all would not."""
    rest, bent = (scene_of(LIMB | {"bend_deg": degrees}, HAIR) for degrees in (0.0, bend_deg))
    before, after = strands_of(rest).points, strands_of(bent).points
    upper = before[:, 0, 1] > BLEND_RADII * RADIUS + 3  # a face beyond the blend
    lower = before[:, 0, 1] < -BLEND_RADII * RADIUS - 3
    assert upper.sum() > 20
    np.testing.assert_allclose(after[upper], before[upper] @ rotation_xyz((bend_deg, 0, 0)).T, atol=1e-10)
    np.testing.assert_allclose(after[lower], before[lower], atol=1e-10)


def scene_of(shape: dict[str, Any], hair: dict[str, Any]) -> Scene:
    """Without a file, for property-based tests."""
    sensor = {"type": "perspective", "origin": (0.0, 0.0, 9.0), "target": (0.0, 0.0, 0.0), "fov_deg": 30.0}
    raw = {
        "name": "scene",
        "folder": ".",
        "title": "A limb",
        "sensor": sensor,
        "materials": MATERIALS,
        "shapes": (shape,),
        "hair": (hair,),
        "subject": ("limb",),
    }
    return Scene.model_validate(raw, strict=False)


def test_hair_is_turned_and_moved_with_its_shape_but_never_scaled(hairy: MakeScene) -> None:
    """The policy: a frame is orthonormal. Roots go with the shape's size, lengths of hair do not."""
    plain = strands_of(hairy(bend_deg=40.0)).points
    placed = strands_of(
        hairy(bend_deg=40.0, scale=2.0, rotation_deg=[10.0, 20.0, 30.0], position=[1.0, 2.0, 3.0])
    ).points
    turn = rotation_xyz((10.0, 20.0, 30.0))
    np.testing.assert_allclose(placed[:, 0], 2 * plain[:, 0] @ turn.T + (1, 2, 3), atol=1e-10)
    np.testing.assert_allclose(placed - placed[:, :1], (plain - plain[:, :1]) @ turn.T, atol=1e-10)


def test_a_bulge_does_not_stretch_hair(hairy: MakeScene) -> None:
    slim, swollen = (strands_of(hairy(bulge=bulge)).points for bulge in (0.0, 0.5))
    before, after = (np.linalg.norm(points[:, 3] - points[:, 0], axis=1) for points in (slim, swollen))
    np.testing.assert_allclose(after, before, rtol=1e-12)


def test_the_tangent_is_the_difference_of_positions_along_u(hairy: MakeScene) -> None:
    """Where both ends of the difference lie on one face, and but for what lies along the normal."""
    scene = hairy(bend_deg=90.0, bulge=0.3)
    chart = chart_of(scene, scene.hair[0])
    rng = np.random.default_rng(1)
    uv = np.column_stack([rng.uniform(0.1, 0.9, 200), rng.uniform(0.25, 0.75, 200)])
    root, face = roots(chart, uv)
    step = np.array([1e-7, 0.0])
    here, there = frames(chart, face, uv[root] - step), frames(chart, face, uv[root] + step)
    along = there.position - here.position
    normal = frames(chart, face, uv[root]).axes[:, 2]
    along -= np.sum(along * normal, axis=1, keepdims=True) * normal
    np.testing.assert_allclose(frames(chart, face, uv[root]).axes[:, 0], normalised(along), atol=1e-6)


@pytest.mark.parametrize("chart", ["plain", "mirrored"])
def test_frames_are_orthonormal_and_mirrored_where_the_chart_is(hairy: MakeScene, chart: str) -> None:
    scene = hairy(chart=chart, bend_deg=90.0, bulge=0.3)
    found, _ = film_frames(scene, 16, 16)
    np.testing.assert_allclose(found.axes @ found.axes.transpose(0, 2, 1), np.tile(np.eye(3), (256, 1, 1)), atol=1e-12)
    handedness = np.linalg.det(found.axes).reshape(16, 16)
    expected = np.where(np.arange(16) < 8, 1.0, -1.0) if chart == "mirrored" else np.ones(16)
    np.testing.assert_allclose(handedness, np.broadcast_to(expected, (16, 16)))


def test_a_mirrored_chart_grows_mirrored_hair(hairy: MakeScene) -> None:
    """Each root twice. Diagonals of facets are not mirrored, so that the halves differ by what facets do."""
    points = strands_of(hairy(chart="mirrored", detail=64)).points
    assert len(points) == 2 * HAIR["count"]
    right, left = points[points[:, 0, 0] > 0, 3], points[points[:, 0, 0] < 0, 3]
    apart = np.linalg.norm(right[:, None] * (-1, 1, 1) - left[None], axis=2)
    assert len(right) == len(left)
    assert max(apart.min(axis=0).max(), apart.min(axis=1).max()) < 0.05


def test_what_a_lost_handedness_would_cost(hairy: MakeScene) -> None:
    """Tips of mirrored hair that is not mirrored lie twice their reach along v away."""
    scene = hairy(chart="mirrored")
    found, shape = film_frames(scene, 16, 16)
    wrong = shape * (1, -1, 1)
    lost = np.linalg.norm(found.to_world(wrong[:, 3:]) - found.to_world(shape[:, 3:]), axis=2).reshape(16, 16)
    np.testing.assert_allclose(lost.reshape(-1), 2 * np.abs(shape[:, 3, 1]), atol=1e-12)
    assert np.median(lost) > 3


@given(st.integers(1, 400), st.integers(0, 100))
@settings(max_examples=50, deadline=None)
def test_faces_that_hold_a_place_are_those_of_brute_force(count: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    uvs = rng.random((count, 1, 2)) + 0.3 * rng.random((count, 3, 2)) * rng.choice([0.05, 1.0])
    chart = Chart(np.zeros((count, 3, 3)), np.zeros((count, 3, 3)), uvs)
    uv = rng.random((50, 2))
    every = barycentric(np.tile(uvs, (50, 1, 1)), np.repeat(uv, count, axis=0))
    holds = (every >= 0).all(axis=1)
    expected = np.argwhere(holds.reshape(50, count))
    np.testing.assert_array_equal(np.column_stack(roots(chart, uv)), expected)


def test_a_place_that_no_face_holds_is_refused(hairy: MakeScene) -> None:
    """Half of each cell beside a pole is empty."""
    with pytest.raises(SceneError, match=r'hair "fur": \d+ of 1024 places of its region lie on no face of "limb"'):
        film_frames(hairy(hair={"region": [0.0, 0.0, 1.0, 0.01]}), 32, 32)


def test_hair_outside_the_chart_is_refused(make_scene: MakeScene) -> None:
    flat = {"name": "limb", "type": "mesh", "path": "corner.obj", "material": "skin"}
    scene = make_scene(subject=["limb"], materials=MATERIALS, shapes=[LIMB], hair=[HAIR])
    text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 0.1 0\nvt 0 0.1\nf 1/1 2/2 3/3\n"
    (scene.folder / "corner.obj").write_text(text, encoding="ascii")
    with pytest.raises(SceneError, match='hair "fur": none of 500 roots lies on a face of "limb"'):
        strands_of(make_scene(subject=["limb"], materials=MATERIALS, shapes=[flat], hair=[HAIR]))


def test_a_mesh_without_texture_coordinates_is_refused(make_scene: MakeScene) -> None:
    flat = {"name": "limb", "type": "mesh", "path": "corner.obj", "material": "skin"}
    scene = make_scene(subject=["limb"], materials=MATERIALS, shapes=[LIMB], hair=[HAIR])
    (scene.folder / "corner.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", encoding="ascii")
    with pytest.raises(SceneError, match=r'shape "limb": 1 of 1 faces have no area in \(u, v\)'):
        strands_of(make_scene(subject=["limb"], materials=MATERIALS, shapes=[flat], hair=[HAIR]))


def test_images_over_the_chart_are_the_same_for_a_limb_far_away(hairy: MakeScene) -> None:
    near, far = hairy(bend_deg=60.0), hairy(bend_deg=60.0, position=[1e6, 0.0, 0.0])
    np.testing.assert_allclose(tips(far, 8, 8), tips(near, 8, 8), atol=1e-5)
    np.testing.assert_allclose(tangents(far, 8, 8), tangents(near, 8, 8), atol=1e-6)
    np.testing.assert_allclose(np.linalg.norm(tangents(near, 8, 8), axis=2), 1, rtol=1e-6)
