"""Thickness by the talk's two passes and by signed sums, against rays that are cast in float64."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from realtime.camera import sensor_camera
from realtime.frame import Frame
from realtime.render import Renderer, Rendering
from realtime.techniques.translucency_additive import TECHNIQUES as ADDITIVE
from realtime.techniques.translucency_talk import TECHNIQUES as TALK
from realtime.thickness import additive_passes
from scenes.errors import RenderError
from scenes.features import features_of
from scenes.geometry import geometry_of
from scenes.image import Float32, Float64
from scenes.model import PIXEL_GRID, Scene

MakeScene = Callable[..., Scene]
TECHNIQUES = {**TALK, **ADDITIVE}
ADDITIVE_THICKNESS, TALK_THICKNESS = "translucency.additive_thickness", "translucency.talk_thickness"

FINGERS = [
    {"type": "capsule", "name": "near", "radius": 3.0, "length": 8.0, "detail": 16, "position": [-1.5, 0.0, 4.0]},
    {"type": "capsule", "name": "far", "radius": 3.0, "length": 8.0, "detail": 16, "position": [1.5, 1.0, -4.0]},
]
SHAPES: dict[str, list[dict[str, Any]]] = {
    "ball": [{"type": "sphere", "name": "ball", "radius": 6.0, "detail": 2}],
    "wedge": [{"type": "wedge", "name": "wedge", "size": [12.0, 10.0], "thin": 0.5, "thick": 6.0}],
    "fingers": FINGERS,
    "torus": [{"type": "torus", "name": "ring", "radius": 5.0, "tube": 2.0, "segments": 40, "sides": 14}],
}


@pytest.fixture
def body(make_scene: MakeScene) -> MakeScene:
    """Makes a scene of translucent shapes, in millimetres, seen along -z from `away`, 16 mm across."""

    def make(shapes: list[dict[str, Any]], away: float = 120.0, centre: float = 0.0, **overrides: Any) -> Scene:
        moved = [
            {"material": "flesh"} | s | {"position": [centre + p for p in s.get("position", [0.0, 0.0, 0.0])]}
            for s in shapes
        ]
        return make_scene(
            **{
                "length_unit": "mm",
                "subject": [s["name"] for s in shapes],
                "shapes": moved,
                "materials": {"flesh": {"type": "translucent", "medium": "skin1"}},
                "emitters": [{"type": "directional", "direction": [0.0, 0.0, 1.0], "irradiance": [1.0, 1.0, 1.0]}],
                "sensor": {
                    "type": "perspective",
                    "origin": [centre, centre, centre + away],
                    "target": [centre, centre, centre],
                    "fov_deg": float(2 * np.degrees(np.arctan(8.0 / away))),
                    "width": 12,
                    "height": 10,
                },
            }
            | overrides
        )

    return make


def drawn(scene: Scene, name: str, **settings: Any) -> Float32:
    return rendering(scene, name, **settings).image.pixels[..., 0]


def rendering(scene: Scene, name: str, **settings: Any) -> Rendering:
    return Renderer(scene).render(TECHNIQUES[name], settings, timed=False)


def cast(scene: Scene) -> Float64:
    """The length inside the subject of the ray through each sample (H, W, PIXEL_GRID²), from the camera on.

    All triangles against all rays: Moeller & Trumbore 1997, "Fast, Minimum Storage Ray/Triangle Intersection".
    """
    sensor = scene.sensor
    camera = sensor_camera(sensor, 1.0, 2.0)
    across, upward = camera.matrix[:2, :3]
    width, height = sensor.width * PIXEL_GRID, sensor.height * PIXEL_GRID
    x, y = (np.arange(width) + 0.5) / width * 2 - 1, 1 - (np.arange(height) + 0.5) / height * 2
    Y, X = np.meshgrid(y, x, indexing="ij")
    right, up = across / (across @ across), upward / (upward @ upward)
    rays = (camera.forward + X[..., None] * right + Y[..., None] * up).reshape(-1, 3)
    rays /= np.linalg.norm(rays, axis=1, keepdims=True)
    total = np.zeros(len(rays))
    for mesh in geometry_of(scene):
        corners = mesh.surface.positions.astype(float)[mesh.surface.faces.astype(np.int64)]
        a, edge1, edge2 = corners[:, 0], corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
        normal, s = np.cross(edge1, edge2), camera.eye - a
        volume = -rays @ normal.T
        with np.errstate(divide="ignore", invalid="ignore"):
            t = np.sum(s * normal, axis=1) / volume
            u = -(rays @ np.cross(s, edge2).T) / volume
            v = (rays @ np.cross(s, edge1).T) / volume
            is_hit = (u >= 0) & (v >= 0) & (u + v <= 1) & (t > 0)
        total += np.sum(np.where(is_hit, -np.sign(volume) * t, 0.0), axis=1)
    grouped = total.reshape(sensor.height, PIXEL_GRID, sensor.width, PIXEL_GRID)
    return grouped.transpose(0, 2, 1, 3).reshape(sensor.height, sensor.width, -1)


def rms(error: Float32 | Float64) -> float:
    return float(np.sqrt(np.mean(error.astype(float) ** 2)))


@pytest.mark.parametrize("shapes", SHAPES.values(), ids=SHAPES)
def test_signed_sums_are_exact_on_closed_shapes_whether_convex_or_not(
    body: MakeScene, shapes: list[dict[str, Any]]
) -> None:
    """What is left is that vertices are rounded to a 256th of a sample before they are drawn."""
    scene = body(shapes)
    exact = cast(scene).mean(axis=-1)
    assert exact.max() > 2
    assert rms(drawn(scene, ADDITIVE_THICKNESS) - exact) < 1e-3


@pytest.mark.parametrize("away", [1e3, 1e4])
def test_signed_sums_stay_exact_however_far_the_camera_is(body: MakeScene, away: float) -> None:
    """At 1 m and at 10 m, with the lens that fits. A plain float32 distance of 10 m is good to 1e-3 mm at best."""
    scene = body(SHAPES["torus"], away=away)
    assert rms(drawn(scene, ADDITIVE_THICKNESS) - cast(scene).mean(axis=-1)) < 1e-3


def test_a_face_that_lies_on_samples_is_counted_once(body: MakeScene) -> None:
    """A box whose edges run exactly through the middles of samples, where a careless rule counts twice or never."""
    scene = body([{"type": "box", "name": "box", "size": [8.0 + 1 / 6, 4.0 + 1 / 6, 3.0]}], away=1e4)
    made = drawn(scene, ADDITIVE_THICKNESS)
    assert np.isclose(made, 3.0, atol=1e-3).sum() > 10
    assert made.max() < 3.001


@pytest.mark.parametrize(("near", "far"), [(119.0, 121.0), (1.0, 10.0), (200.0, 201.0)])
def test_clip_planes_cut_nothing_off(body: MakeScene, gl: Any, near: float, far: float) -> None:
    """Planes through the subject, before it, behind it: without GL_DEPTH_CLAMP most pixels are wrong."""
    scene = body(SHAPES["torus"])
    meshes = geometry_of(scene)
    frame = Frame(gl, scene, meshes, features_of(scene, meshes), {}, PIXEL_GRID)
    frame.__dict__["camera"] = sensor_camera(scene.sensor, near, far)
    for step in additive_passes(allow_open=False):
        step.run(frame)
    exact = cast(scene)
    made = frame.read("thickness", 1)[..., 0]
    grouped = made.reshape(exact.shape[0], PIXEL_GRID, exact.shape[1], PIXEL_GRID).mean(axis=(1, 3))
    assert rms(grouped - exact.mean(axis=-1)) < 1e-3


def test_an_open_mesh_is_refused_with_the_number_of_its_pixels(body: MakeScene, sheet: dict[str, Any]) -> None:
    """3 x 3 mm² of 16/12 mm pixels, at least in part."""
    shapes = [sheet, {"type": "box", "name": "box", "size": [3.0, 3.0, 3.0], "position": [5.0, 0.0, 0.0]}]
    with pytest.raises(RenderError, match=r"In 16 of the \d+ pixels .* mesh is open, or the camera is inside it"):
        drawn(body(shapes), ADDITIVE_THICKNESS)


def test_an_open_mesh_is_accepted_when_asked_for(body: MakeScene, sheet: dict[str, Any]) -> None:
    """A sheet that faces the camera has a front and no back, and no thickness."""
    assert drawn(body([sheet]), ADDITIVE_THICKNESS, allow_open=True).max() == 0


def test_inside_the_subject_thickness_counts_from_the_camera(body: MakeScene) -> None:
    """A camera in the middle of a ball of 50 mm, whose front faces are behind it."""
    scene = body([{"type": "sphere", "name": "ball", "radius": 50.0, "detail": 2}], away=10.0)
    with pytest.raises(RenderError, match="In 120 of the 120 pixels"):
        drawn(scene, ADDITIVE_THICKNESS)
    assert rms(drawn(scene, ADDITIVE_THICKNESS, allow_open=True) - cast(scene).mean(axis=-1)) < 1e-2


def test_the_talk_is_right_where_a_ray_enters_once(body: MakeScene) -> None:
    scene = body(SHAPES["wedge"])
    assert rms(drawn(scene, TALK_THICKNESS, half_float=False) - cast(scene).mean(axis=-1)) < 1e-3


def test_the_talk_sees_only_the_nearest_layer(body: MakeScene) -> None:
    """The slide says "But...": on two fingers, one behind the other, it loses what the far one adds."""
    scene = body(FINGERS)
    made = drawn(scene, TALK_THICKNESS, half_float=False)
    near, far = (cast(body([finger])) for finger in FINGERS)
    in_both = ((near > 0) & (far > 0)).all(axis=-1)
    in_one = (far == 0).all(axis=-1)
    assert min(in_both.sum(), in_one.sum()) > 5
    assert rms((made - near.mean(axis=-1))[in_both | in_one]) < 1e-3
    assert made[in_both].sum() < 0.6 * cast(scene)[in_both].mean(axis=-1).sum()


@pytest.mark.parametrize(("centre", "at_least", "at_most"), [(0.0, 1e-4, 1e-2), (1000.0, 0.05, 1.0)])
def test_half_floats_lose_the_subject_far_from_the_origin(
    body: MakeScene, centre: float, at_least: float, at_most: float
) -> None:
    """fp16 keeps 11 bits of a world position: .5 mm at 1 m. Some drivers truncate, so only bounds are known."""
    scene = body(SHAPES["wedge"], centre=centre)
    exact = cast(scene).mean(axis=-1)
    assert at_least < rms(drawn(scene, TALK_THICKNESS) - exact) < at_most
    assert rms(drawn(scene, TALK_THICKNESS, half_float=False) - exact) < 2e-3
    assert rms(drawn(scene, ADDITIVE_THICKNESS) - exact) < 1e-3


def test_the_talk_knows_nothing_thicker_than_its_maximum(body: MakeScene) -> None:
    """A quarter of the diagonal of a box of 6 x 6 x 7 mm."""
    scene = body([{"type": "box", "name": "box", "size": [6.0, 6.0, 7.0]}])
    assert drawn(scene, TALK_THICKNESS, max_thickness=0.25).max() == pytest.approx(11 / 4, rel=1e-3)


def test_thickness_alone_shades_nothing(body: MakeScene) -> None:
    scene = body(SHAPES["ball"])
    assert list(rendering(scene, ADDITIVE_THICKNESS).pass_seconds) == ["signed sums", "close sums", "resolve"]
    assert list(rendering(scene, TALK_THICKNESS).pass_seconds) == ["back faces", "front faces", "resolve"]
