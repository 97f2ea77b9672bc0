"""Where hair stands on a skin that bulges and bends: closed forms first, then what the talk's way loses."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from realtime.frame import Frame
from realtime.hair import faces_around
from realtime.hair_roots import Scalp, film_places, places_in, scalp_of
from scenes.errors import InputError, SceneError
from scenes.geometry import geometry_of
from scenes.grooming import film_uv, groom, shape_at
from scenes.image import Float32, Float64
from scenes.limbs import limb
from scenes.model import Scene
from scenes.procedural import normalised, rotation_xyz
from scenes.shapes import Limb
from scenes.topology import angle_weighted_normals
from scenes.units import Vec3

MakeScene = Callable[..., Scene]
Draw = Callable[..., Float32]
FrameWith = Callable[..., Frame]
StrandPoints = Callable[..., Float64]

MIRROR = np.array([-1.0, 1.0, 1.0])
BENT = {"bend_deg": 90.0}
BULGED = {"bulge": 1.0}
STRAIGHT = {"region": [0.0, 0.25, 1.0, 0.75]}
"""Where faces come in flat pairs, so that it does not matter how they are cut: a mirrored half is cut the other way."""

FINE = {"guides": 64}
"""So many guides that a talk's hair has one close by: what is left is the error of its basis."""


def angles(a: Float64, b: Float64) -> Float64:
    """Between vectors, in degrees."""
    turned: Float64 = np.degrees(np.arctan2(np.linalg.norm(np.cross(a, b), axis=-1), np.sum(a * b, axis=-1)))
    return turned


def film(scene: Scene) -> Float64:
    """(u, v) at the pixels (H, W, 2)."""
    sensor = scene.sensor
    uv, _ = film_uv(scene.shapes[0], scene.hair[0], sensor.width, sensor.height)
    return uv.reshape(sensor.height, sensor.width, 2)


def on_a_cylinder(scene: Scene, radius: float) -> tuple[Float64, Float64]:
    """Normals and tangents (H, W, 3) of a cylinder about y whose u runs from -z over -x to +z and on over +x."""
    turn = 2 * np.pi * film(scene)[..., 0] - np.pi
    sine, cosine = np.sin(turn), np.cos(turn)
    return np.stack([sine, 0 * turn, cosine], axis=-1), np.stack([cosine, 0 * turn, -sine], axis=-1)


def heights(scene: Scene) -> Float64:
    """y of the rest skin at the pixels, where its sides are straight: v is length along the skin."""
    shape = scene.shapes[0]
    assert isinstance(shape, Limb)
    profile = shape.length + np.pi * shape.radius
    return (film(scene)[..., 1] - 0.5) * profile


def held_hair(scene: Scene) -> Float64:
    """Control points (H, W, 4, 3) in the frames of the pixels' roots."""
    points = shape_at(scene, scene.hair[0], film(scene).reshape(-1, 2))
    return points.reshape(scene.sensor.height, scene.sensor.width, 4, 3)


# At rest.


def test_at_rest_hair_stands_on_a_cylinder(make_hair: MakeScene, draw: Draw) -> None:
    """Position, frame and tip in closed form. Facets of a turn / 128 lie up to 3.6e-3 below the circle."""
    scene = make_hair({"detail": 128}, {"region": [0.0, 0.3, 1.0, 0.7]})
    n, t = on_a_cylinder(scene, 12.0)
    np.testing.assert_allclose(draw(scene, "hair.frame_tangent"), t, atol=2e-6)
    tip = held_hair(scene)[..., 3, :, None] * np.stack([t, np.broadcast_to([0.0, 1.0, 0.0], t.shape), n], axis=-2)
    place = 12 * n + heights(scene)[..., None] * (0.0, 1.0, 0.0)
    np.testing.assert_allclose(draw(scene, "hair.frame_geometry"), place + tip.sum(axis=-2), atol=4e-3)


def test_on_a_flat_skin_both_ways_are_one(make_hair: MakeScene, draw: Draw) -> None:
    """All frames are alike, so that it does not matter where hairs are interpolated."""
    scene = make_hair(hair={"region": [0.0, 0.0, 1.0, 1.0]}, skin={"type": "rectangle", "size": [30.0, 20.0]})
    talk, frame = (draw(scene, f"hair.{way}_geometry") for way in ("talk", "frame"))
    np.testing.assert_allclose(talk, frame, atol=1e-5)
    np.testing.assert_allclose(
        frame[..., :2], film(scene) * (30, 20) - (15, 10) + held_hair(scene)[..., 3, :2], atol=1e-5
    )
    for way in ("talk", "frame"):
        np.testing.assert_allclose(
            draw(scene, f"hair.{way}_tangent"), np.broadcast_to([1.0, 0, 0], frame.shape), atol=1e-6
        )


@pytest.mark.parametrize("way", ["talk", "frame"])
def test_hair_between_guides_on_a_round_skin(make_hair: MakeScene, draw: Draw, way: str) -> None:
    """In the world roots lie on chords between guides, R (1 - cos(pi / 7)) = 10 % of R below the skin."""
    scene = make_hair({"detail": 96}, {"guides": 8, "region": [0.0, 0.3, 1.0, 0.7], "length": 1e-3, "curl": 0.0})
    away = np.hypot(*np.moveaxis(draw(scene, f"hair.{way}_geometry")[..., [0, 2]].astype(float), -1, 0))
    expected = 12 * np.cos(np.pi / 7) if way == "talk" else 12.0
    assert away.min() == pytest.approx(expected, abs=0.05)
    assert away.max() == pytest.approx(12, abs=0.12)


# Deformed.


@pytest.mark.parametrize("degrees", [30.0, 90.0, -75.0])
def test_far_from_the_joint_hair_turns_with_the_bone(make_hair: MakeScene, draw: Draw, degrees: float) -> None:
    """A rigid motion: 1e-4 mm is what is asked for."""
    upper = {"region": [0.0, 0.8, 1.0, 0.9]}
    rest, bent = (draw(make_hair({"bend_deg": d}, upper), "hair.frame_geometry") for d in (0.0, degrees))
    np.testing.assert_allclose(bent, rest @ rotation_xyz((degrees, 0.0, 0.0)).T, atol=5e-5)


@settings(max_examples=8, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(turn=st.tuples(*3 * [st.floats(-180, 180)]), place=st.tuples(*3 * [st.floats(-50, 50)]))
def test_hair_goes_where_the_limb_goes(make_hair: MakeScene, draw: Draw, turn: Vec3, place: Vec3) -> None:
    """Tips are told about the limb's position; frames turn with it."""
    pose = {"bend_deg": 60.0, "bulge": 0.3}
    here = draw(make_hair(pose, size=8), "hair.frame_geometry")
    there = make_hair(pose | {"rotation_deg": list(turn), "position": list(place)}, size=8)
    np.testing.assert_allclose(draw(there, "hair.frame_geometry"), here @ rotation_xyz(turn).T, atol=1e-4)


@pytest.mark.parametrize("way", ["talk", "frame"])
def test_hair_keeps_its_length_when_the_limb_is_scaled(make_hair: MakeScene, draw: Draw, way: str) -> None:
    """The frame is orthonormal: roots move apart, hairs do not grow. A matrix that scales would double them."""
    hair, larger = (hair_vectors(make_hair, draw, {"scale": scale}, way) for scale in (1.0, 2.0))
    np.testing.assert_allclose(larger, hair, atol=1e-4)


def test_a_limb_kilometres_away_has_the_same_hair(make_hair: MakeScene, draw: Draw) -> None:
    """Single precision there is 0.5 mm; what is near the origin is computed near it."""
    far = 5e6
    here = make_hair(BENT)
    sensor = here.sensor.model_dump() | {"origin": [far, 10.0, 160.0], "target": [far, 0.0, 0.0]}
    there = make_hair(BENT | {"position": [far, 0.0, 0.0]}, sensor=sensor)
    for name in ("hair.frame_geometry", "hair.talk_geometry"):
        np.testing.assert_allclose(draw(there, name), draw(here, name), atol=1e-5)


@pytest.mark.parametrize("pose", [BENT, BULGED, BENT | {"bulge": 0.5, "chart": "mirrored"}], ids=str)
def test_normals_of_the_deformed_skin(make_hair: MakeScene, frame_with: FrameWith, pose: dict[str, Any]) -> None:
    """Recomputed in single precision from skinned positions, against double."""
    scene = make_hair(pose)
    skin = limb(scene.shapes[0])  # type: ignore[arg-type]
    skinned = frame_with(scene, "hair.frame_coverage", "deformed").resources["deformed"]["skin"]
    positions, normals = (
        np.frombuffer(buffer.read(), dtype=np.float32).reshape(-1, 4)[:, :3]
        for buffer in (skinned.positions, skinned.normals)
    )
    np.testing.assert_allclose(positions, skin.positions, atol=1e-5)
    assert np.quantile(angles(normals.astype(float), skin.normals), 0.99) < 1e-3


def test_faces_around_a_seam_are_those_of_both_sides() -> None:
    """Each vertex there is a copy; both have all faces around the place."""
    skin = limb(Limb.model_validate({"type": "limb", "name": "a", "material": "b", "radius": 1.0, "length": 2.0}))
    starts, corners = faces_around(skin)
    positions = skin.rest.positions.astype(float)
    e, f = (positions[corners[:, k]] - positions[corners[:, 0]] for k in (1, 2))
    vertex = np.repeat(np.arange(len(starts) - 1), np.diff(starts))
    sums = np.zeros_like(positions)
    angle = np.arccos(np.sum(normalised(e) * normalised(f), axis=1))
    np.add.at(sums, vertex, angle[:, None] * normalised(np.cross(e, f)))
    expected = angle_weighted_normals(positions, skin.rest.faces, skin.places)[skin.places]
    np.testing.assert_allclose(sums, expected, atol=1e-6)


# What the talk's way loses.


def hair_vectors(make_hair: MakeScene, draw: Draw, pose: dict[str, Any], way: str, **hair: Any) -> Float64:
    """From roots to tips (H, W, 3), with guides everywhere."""
    long, bald = (draw(make_hair(pose, FINE | hair | more), f"hair.{way}_geometry") for more in ({}, {"length": 1e-6}))
    return long.astype(float) - bald


@pytest.mark.parametrize(
    ("pose", "low", "high"),
    [
        ({}, 0.0, 1.5),  # bases interpolated between guides, over facets
        ({"bulge": 1.0}, 0.0, 2.0),  # the morph target itself, for which a basis is stored
        ({"bulge": 0.5}, 1.8, 3.5),  # halfway, the mean of two bases that should turn
        ({"bulge": 2.0}, 6.0, 11.0),  # twice as far, where they are extrapolated
        ({"bend_deg": 60.0}, 20.0, 28.0),  # normals do not turn as positions do: a blended matrix squeezes the skin
        ({"bend_deg": 90.0}, 38.0, 50.0),
    ],
    ids=str,
)
def test_the_talks_hair_leans(make_hair: MakeScene, draw: Draw, pose: dict[str, Any], low: float, high: float) -> None:
    """99th percentile of the angle between its hairs, roots to tips, and those on recomputed frames, in degrees."""
    made, true = (hair_vectors(make_hair, draw, pose, way) for way in ("talk", "frame"))
    assert low <= np.quantile(angles(made, true), 0.99) <= high


def test_bent_by_90_degrees_the_talks_hair_shrinks(make_hair: MakeScene, draw: Draw) -> None:
    """The mean of two rotations a quarter turn apart is no rotation: across the bend it shrinks by cos(45 degrees)."""
    joint = {"region": [0.0, 0.49, 1.0, 0.51], "comb": [0.0, 0.0], "curl": 0.0}
    talk, frame = (hair_vectors(make_hair, draw, BENT, way, **joint) for way in ("talk", "frame"))
    ratio = np.linalg.norm(talk, axis=-1) / np.linalg.norm(frame, axis=-1)
    assert ratio.min() == pytest.approx(np.cos(np.pi / 4), abs=0.03)


@pytest.mark.parametrize(("bulge", "share"), [(0.0, 0.0), (0.5, 0.25), (1.0, 0.32)])
@pytest.mark.parametrize("way", ["talk", "frame"])
def test_hair_that_is_combed_flat_ends_below_a_skin_that_swells(
    make_hair: MakeScene, strand_points: StrandPoints, bulge: float, share: float, way: str
) -> None:
    """A hair does not know the skin beside its root: combed along the limb it is straight where the skin curves up.

    Nothing lifts it. None of it ends below the straight limb; swollen by half a quarter does, by all of it a third,
    some of it farther down than a third of its length.
    """
    flat = {"count": 3000, "comb": [0.0, 20.0], "guides": 24, "curl": 0.0, "spread": 0.0}
    scene = make_hair({"bulge": bulge, "detail": 64}, flat | {"region": [0.0, 0.2, 1.0, 0.8]})
    skin = limb(scene.shapes[0]).positions  # type: ignore[arg-type]
    skin, tips = skin[skin[:, 1].argsort()], strand_points(scene, f"hair.{way}_coverage")[:, 3]
    depth = np.interp(tips[:, 1], skin[:, 1], np.hypot(skin[:, 0], skin[:, 2])) - np.hypot(tips[:, 0], tips[:, 2])
    assert np.mean(depth > 0) == pytest.approx(share, abs=0.02)
    assert (depth.max() > 4.0) == (bulge == 1.0)


@pytest.mark.parametrize(
    ("stored", "part"),
    [
        (lambda x: x.astype(np.float16), 3.2e-4),
        (lambda x: np.round(x * 32767) / 32767, 2.6e-5),
        (lambda x: np.round(x * 127) / 127, 6.7e-3),
    ],
    ids=["fp16", "snorm16", "snorm8"],
)
def test_what_guides_lose_in_fewer_bits(
    make_hair: MakeScene, stored: Callable[[Float64], Float64], part: float
) -> None:
    """The farthest that a control point moves, as part of the largest coordinate, which is stored as 1.

    Hair between guides moves no farther.
    """
    scene = make_hair(hair={"guides": 64})
    guides = groom(scene, scene.hair[0]).guides
    unit = guides / np.abs(guides).max()
    moved = np.linalg.norm(stored(unit).astype(float) - unit, axis=-1).max()
    assert moved == pytest.approx(part, rel=0.1)


# Charts.


def test_hair_on_a_mirrored_half_is_mirrored(make_hair: MakeScene, draw: Draw) -> None:
    """The image's right half is the other half of the limb. Without handedness hair there is combed the wrong way."""
    scene = make_hair({"chart": "mirrored"}, STRAIGHT)
    for way in ("talk", "frame"):
        made = draw(scene, f"hair.{way}_geometry")
        np.testing.assert_allclose(made[:, 12:], made[:, :12] * MIRROR, atol=1e-4)
    true, lost = (draw(scene, "hair.frame_geometry", handedness=on) for on in (True, False))
    np.testing.assert_array_equal(lost[:, :12], true[:, :12])
    error = np.linalg.norm(lost[:, 12:] - true[:, 12:], axis=-1)
    assert 5 < np.median(error) < 20


@pytest.mark.parametrize("name", ["hair.talk_coverage", "hair.frame_coverage"])
def test_on_a_mirrored_chart_hair_grows_on_both_halves(
    make_hair: MakeScene, strand_points: StrandPoints, name: str
) -> None:
    plain, mirrored = (strand_points(make_hair({"chart": chart}, STRAIGHT), name) for chart in ("plain", "mirrored"))
    assert len(mirrored) == 2 * len(plain)
    np.testing.assert_allclose(mirrored[::2] * MIRROR, mirrored[1::2], atol=1e-4)


def test_a_chart_without_area_is_refused(make_hair: MakeScene, draw: Draw, tmp_path: Path) -> None:
    """A mesh without texture coordinates would make NaN of every frame."""
    corners = "v 0 0 0\nv 9 0 0\nv 9 9 0\nv 0 9 0\n"
    (tmp_path / "bare.obj").write_text(corners + "f 1 2 3\nf 1 3 4\n", encoding="ascii")
    scene = make_hair(skin={"type": "mesh", "path": "bare.obj"})
    for name in ("hair.frame_geometry", "hair.frame_tangent", "hair.frame_coverage", "hair.talk_geometry"):
        with pytest.raises(SceneError, match="have no area in"):
            draw(scene, name)


def half_covered(tmp_path: Path) -> dict[str, Any]:
    """A square whose texture coordinates cover the left half of the chart."""
    corners = "v 0 0 0\nv 9 0 0\nv 9 9 0\nv 0 9 0\nvt 0 0\nvt 0.5 0\nvt 0.5 1\nvt 0 1\n"
    (tmp_path / "half.obj").write_text(corners + "f 1/1 2/2 3/3\nf 1/1 3/3 4/4\n", encoding="ascii")
    return {"type": "mesh", "path": "half.obj"}


def test_a_region_beside_the_chart_is_refused(make_hair: MakeScene, draw: Draw, tmp_path: Path) -> None:
    scene = make_hair(hair={"region": [0.6, 0.2, 0.9, 0.8]}, skin=half_covered(tmp_path))
    with pytest.raises(InputError, match="where 'skin' has no face"):
        draw(scene, "hair.frame_geometry")
    with pytest.raises(InputError, match="No root of the hair 'hair' lies on a face of 'skin'"):
        draw(scene, "hair.frame_coverage")
    with pytest.raises(InputError, match="Found guides of hair 'hair' where 'skin' has no face"):
        draw(scene, "hair.talk_geometry")


def test_roots_beside_the_chart_grow_nothing(make_hair: MakeScene, frame_with: FrameWith, tmp_path: Path) -> None:
    scene = make_hair(hair={"region": [0.0, 0.0, 1.0, 1.0], "count": 400}, skin=half_covered(tmp_path))
    inside = np.count_nonzero(groom(scene, scene.hair[0]).uv[:, 0] < 0.5)
    assert frame_with(scene, "hair.frame_coverage", "strands").resources["strands"].count == inside


def test_a_scene_without_hair_is_refused(make_scene: MakeScene, draw: Draw) -> None:
    for way in ("talk", "frame"):
        for what in ("geometry", "tangent", "coverage"):
            with pytest.raises(InputError, match="Found no hair in"):
                draw(make_scene(), f"hair.{way}_{what}")


def scalp(scene: Scene) -> Scalp:
    return scalp_of(scene, geometry_of(scene), scene.hair[0])


@settings(max_examples=20, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(points=st.lists(st.tuples(st.floats(0, 1), st.floats(0.05, 0.95)), min_size=1, max_size=20))
@pytest.mark.parametrize("chart", ["plain", "mirrored"])
def test_places_are_found_in_every_face_that_holds_them(
    make_hair: MakeScene, chart: str, points: list[tuple[float, float]]
) -> None:
    """Weights give back the point; faces are those that a search through all of them finds."""
    skin, uv = scalp(make_hair({"chart": chart, "detail": 16})), np.array(points)
    places = places_in(skin, uv)
    corners = skin.uvs[skin.faces]
    e, f, p = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0], uv[:, None] - corners[:, 0]
    area = _cross(e, f)
    second, third = _cross(p, f) / area, _cross(e, p) / area
    held = np.min([second, third, 1 - second - third], axis=0)
    assert np.count_nonzero(held >= 1e-8) <= len(places.point) <= np.count_nonzero(held >= -1e-8)
    rebuilt = np.sum(places.weights[:, :, None] * skin.uvs[places.corners], axis=1)
    np.testing.assert_allclose(rebuilt, uv[places.point], atol=1e-7)
    assert set(places.point) == set(range(len(uv)))
    assert places.mirrored.any() == (chart == "mirrored")


def _cross(a: Float64, b: Float64) -> Float64:
    product: Float64 = a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]
    return product


def test_a_point_on_an_edge_is_one_place_of_the_film(make_hair: MakeScene) -> None:
    """It lies in the faces on both sides: the first one counts, and not a hair for each."""
    skin = scalp(make_hair({"detail": 16}))
    corner = skin.uvs[skin.faces[40]]
    uv = np.array([corner.mean(axis=0), 0.5 * (corner[0] + corner[1])])
    places = places_in(skin, uv)
    assert len(places.point) > 2
    np.testing.assert_array_equal(film_places(places, np.zeros(2, dtype=bool)).point, [0, 1])


# Many hairs, and what textures say about them.


def test_several_kinds_of_hair_follow_one_another(make_hair: MakeScene, frame_with: FrameWith) -> None:
    (hair,) = (scene := make_hair()).hair
    kinds = tuple(hair.model_copy(update={"count": n, "radius": r}) for n, r in ((5, 0.1), (7, 0.2)))
    scene = scene.model_copy(update={"hair": kinds})
    for name in ("hair.talk_coverage", "hair.frame_coverage"):
        strands = frame_with(scene, name, "strands").resources["strands"]
        assert strands.count == 12
        rows = np.frombuffer(strands.points.read(), dtype=np.float32).reshape(-1, 4, 4)
        colors = np.frombuffer(strands.colors.read(), dtype=np.float32).reshape(-1, 4)
        np.testing.assert_allclose(rows[:, :, 3], np.repeat([0.1, 0.2], [5, 7])[:, None].repeat(4, axis=1))
        np.testing.assert_array_equal(colors[:, 3], np.repeat([0, 1], [5, 7]))
        np.testing.assert_array_equal(colors[:, :3], 1)


def texture(tmp_path: Path, name: str, values: Float64) -> dict[str, str]:
    """Values (H, W) in [0, 1] as a grey image, row 0 at the top."""
    import PIL.Image

    PIL.Image.fromarray((255 * values + 0.5).astype(np.uint8)).save(tmp_path / name)
    return {"path": name, "color_space": "linear"}


FLAT = {"type": "rectangle", "size": [20.0, 20.0]}
WHOLE = {"region": [0.0, 0.0, 1.0, 1.0], "count": 2000, "curl": 0.0}


@pytest.mark.parametrize("name", ["hair.talk_coverage", "hair.frame_coverage"])
def test_density_thins_hair_out_in_proportion(
    make_hair: MakeScene, strand_points: StrandPoints, tmp_path: Path, name: str
) -> None:
    """From none at the left to all at the right: in each quarter as many as its mean, within four deviations."""
    ramp = texture(tmp_path, "ramp.png", np.tile(np.linspace(0, 1, 256), (2, 1)))
    scene = make_hair(hair=WHOLE | {"density": ramp}, skin=FLAT)
    roots = strand_points(scene, name)[:, 0]
    counts, _ = np.histogram(roots[:, 0], np.linspace(-10, 10, 5))
    expected = 500 * np.array([1, 3, 5, 7]) / 8
    assert (np.abs(counts - expected) < 4 * np.sqrt(expected)).all()


@pytest.mark.parametrize("name", ["hair.talk_coverage", "hair.frame_coverage"])
def test_killed_hair_is_gone(make_hair: MakeScene, strand_points: StrandPoints, tmp_path: Path, name: str) -> None:
    """White kills. Where all is killed nothing is left to judge, and that is said."""
    left = np.repeat([[1.0, 0.0]], 8, axis=1).repeat(8, axis=0)
    scene = make_hair(hair=WHOLE | {"kill": texture(tmp_path, "kill.png", left)}, skin=FLAT)
    roots = strand_points(scene, name)[:, 0]
    assert 800 < len(roots) < 1200
    assert roots[:, 0].min() > -0.01
    everywhere = make_hair(hair=WHOLE | {"kill": texture(tmp_path, "all.png", np.ones((2, 2)))}, skin=FLAT)
    with pytest.raises(SceneError, match="leave none"):
        strand_points(everywhere, name)


@pytest.mark.parametrize("name", ["hair.talk_coverage", "hair.frame_coverage"])
def test_the_length_texture_scales_hair(
    make_hair: MakeScene, strand_points: StrandPoints, tmp_path: Path, name: str
) -> None:
    half = texture(tmp_path, "half.png", np.full((2, 2), 0.4))
    full, short = (strand_points(make_hair(hair=WHOLE | more, skin=FLAT), name) for more in ({}, {"length_map": half}))
    np.testing.assert_allclose(short - short[:, :1], 0.4 * (full - full[:, :1]), atol=1e-5)


@pytest.mark.parametrize("name", ["hair.talk_coverage", "hair.frame_coverage"])
def test_the_color_texture_gives_each_hair_its_own(
    make_hair: MakeScene, frame_with: FrameWith, strand_points: StrandPoints, tmp_path: Path, name: str
) -> None:
    ramp = texture(tmp_path, "ramp.png", np.tile(np.linspace(0, 1, 256), (2, 1)))
    scene = make_hair(hair=WHOLE | {"color": ramp}, skin=FLAT)
    strands = frame_with(scene, name, "strands").resources["strands"]
    colors = np.frombuffer(strands.colors.read(), dtype=np.float32).reshape(-1, 4)
    u = strand_points(scene, name)[:, 0, 0] / 20 + 0.5
    inner = np.abs(u - 0.5) < 0.49
    np.testing.assert_allclose(colors[inner, 0], (256 * u[inner] - 0.5) / 255, atol=2e-3)


# Curves.


def test_a_curve_in_the_shader_is_that_of_de_casteljau(glsl: Callable[..., Float64]) -> None:
    rng = np.random.default_rng(3)
    points, t = rng.normal(size=(50, 4, 3)), rng.uniform(size=50)
    rows = np.zeros((50, 5, 4))
    rows[:, :4, :3], rows[:, 4, 0] = points, t
    body = "r[0].xyz = bezier_point(a[0].xyz, a[1].xyz, a[2].xyz, a[3].xyz, a[4].x);"
    body += "r[1].xyz = bezier_derivative(a[0].xyz, a[1].xyz, a[2].xyz, a[3].xyz, a[4].x);"
    made = glsl("lib/bezier.glsl", body, rows, outputs=2)[..., :3]
    between = points
    for _ in range(2):
        between = between[:, :-1] + t[:, None, None] * np.diff(between, axis=1)
    np.testing.assert_allclose(made[:, 1], 3 * (between[:, 1] - between[:, 0]), atol=1e-5)
    np.testing.assert_allclose(made[:, 0], between[:, 0] + t[:, None] * (between[:, 1] - between[:, 0]), atol=1e-5)


def test_samples_run_from_root_to_tip_with_unit_tangents(
    make_hair: MakeScene, frame_with: FrameWith, strand_points: StrandPoints
) -> None:
    scene = make_hair(BENT)
    frame = frame_with(scene, "hair.frame_coverage", "hair_samples", segments=8)
    strands, samples = frame.resources["strands"], frame.resources["hair_samples"]
    assert samples.per_hair == 9
    rows = np.frombuffer(samples.buffer.read(), dtype=np.float32).reshape(strands.count, 9, 2, 4)
    points = strand_points(scene)
    np.testing.assert_allclose(rows[:, [0, 8], 0, :3], points[:, [0, 3]], atol=1e-5)
    np.testing.assert_allclose(rows[:, 0, 1, :3], normalised(points[:, 1] - points[:, 0]), atol=1e-5)
    np.testing.assert_allclose(rows[:, 8, 1, :3], normalised(points[:, 3] - points[:, 2]), atol=1e-5)
    np.testing.assert_allclose(np.linalg.norm(rows[:, :, 1, :3], axis=-1), 1, atol=1e-6)
    np.testing.assert_allclose(rows[:, 4, 0, :3], points.transpose(0, 2, 1) @ [0.125, 0.375, 0.375, 0.125], atol=1e-5)
    np.testing.assert_allclose(rows[:, :, 0, 3], 0.1)
