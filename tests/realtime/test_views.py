"""What any camera sees: emitted light, and direct light reflected once."""

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from realtime.camera import sensor_camera
from realtime.frame import Frame
from realtime.graph import plan
from realtime.views import SHADING, background, draw_pinhole, draw_view, shading_passes
from scenes.errors import InputError
from scenes.features import features_of
from scenes.geometry import geometry_of
from scenes.image import Float32
from scenes.model import Scene

if TYPE_CHECKING:
    import moderngl

MakeScene = Callable[..., Scene]
MakeFrame = Callable[[Scene], Frame]

BLACK = {"black": {"type": "diffuse", "reflectance": [0.0, 0.0, 0.0]}}
CARD = {"name": "card", "type": "rectangle", "material": "black", "size": [1.0, 1.0], "position": [0.0, 0.0, -2.0]}
BALL = {
    "name": "card",
    "type": "sphere",
    "material": "black",
    "radius": 0.6,
    "detail": 0,
    "position": [0.0, 0.0, -2.0],
}
GLOW = {"type": "area", "shape": "card", "radiance": [3.0, 2.0, 0.5]}
SENSOR = {
    "type": "perspective",
    "origin": [0.0, 0.0, 0.0],
    "target": [0.0, 0.0, -1.0],
    "fov_deg": 60.0,
    "width": 32,
    "height": 24,
}


@pytest.fixture
def frame_of(gl: "moderngl.Context") -> MakeFrame:
    """A frame with all that `draw_view` needs."""

    def make(scene: Scene) -> Frame:
        meshes = geometry_of(scene)
        settings = {p.name: p.default for p in SHADING}
        frame = Frame(gl, scene, meshes, features_of(scene, meshes), settings, grid=4)
        for wanted in ("shadow_atlas",) if not frame.features.nothing_reflects else ():
            for step in plan(shading_passes(frame.features, settings), wanted).passes:
                step.run(frame)
        return frame

    return make


@pytest.fixture
def glowing(make_scene: MakeScene) -> Callable[..., Scene]:
    """A card that emits in front of the camera, with some of its keys and some of the scene's replaced."""

    def make(card: dict[str, Any] | None = None, **overrides: Any) -> Scene:
        plain = {"sensor": SENSOR, "materials": BLACK, "shapes": [CARD | (card or {})], "emitters": [GLOW]}
        return make_scene(**plain | {"subject": ["card"]} | overrides)

    return make


def seen(frame: Frame, near: float, far: float, **how: Any) -> tuple[Float32, Float32]:
    """Radiance (H, W, 4) and depth (H, W) of a view between two clip planes, cleared to 9."""
    sensor = frame.scene.sensor
    size = sensor.width, sensor.height
    color, depth = frame.texture(size, 4), frame.context.depth_texture(size)
    framebuffer = frame.context.framebuffer([color], depth)
    framebuffer.clear(9.0, 9.0, 9.0, 9.0)
    draw_view(frame, sensor_camera(sensor, near, far), framebuffer, **how)
    frame.resources["seen"] = color
    stored = np.frombuffer(depth.read(), dtype=np.float32).reshape(size[::-1])[::-1]
    return frame.read("seen", 4), stored


def test_an_emitter_shows_its_radiance_and_covers_with_alpha_one(glowing: MakeScene, frame_of: MakeFrame) -> None:
    pixels, depth = seen(frame_of(glowing()), 1.0, 4.0)
    hit = depth < 1
    assert 0.1 < hit.mean() < 0.9
    np.testing.assert_array_equal(pixels[hit], np.broadcast_to([3.0, 2.0, 0.5, 1.0], pixels[hit].shape))
    assert np.all(pixels[~hit] == 9)


def test_the_back_of_an_emitter_is_black_and_hides(glowing: MakeScene, frame_of: MakeFrame) -> None:
    pixels, depth = seen(frame_of(glowing({"rotation_deg": [0.0, 180.0, 0.0]})), 1.0, 4.0)
    assert np.all(pixels[depth < 1] == [0, 0, 0, 1])
    assert np.any(depth < 1)


def test_with_front_sides_only_the_back_is_not_drawn(glowing: MakeScene, frame_of: MakeFrame) -> None:
    frame = frame_of(glowing({"rotation_deg": [0.0, 180.0, 0.0]}))
    pixels, _ = seen(frame, 1.0, 4.0, front_sides_only=True)
    assert np.all(pixels == 9)


def test_a_near_plane_that_opens_a_body_shows_nothing_of_its_inside(glowing: MakeScene, frame_of: MakeFrame) -> None:
    """From inside, a closed box has back sides alone."""
    frame = frame_of(glowing({"type": "box", "size": [1.0, 1.0, 1.0]}))
    opened, _ = seen(frame, 2.0, 4.0, front_sides_only=True)
    assert np.all(opened == 9)
    inside, _ = seen(frame, 2.0, 4.0)
    assert np.any(inside == 0)


def test_a_surface_exactly_at_the_far_plane_is_drawn_by_less_or_equal_only(
    glowing: MakeScene, frame_of: MakeFrame
) -> None:
    """Its depth is 1.0, as that of nothing: with LESS, as the talk asks, such pixels all come from the far pass."""
    frame = frame_of(glowing())
    strict, depth = seen(frame, 1.0, 2.0, depth_func="<")
    assert np.all(strict == 9)
    lax, _ = seen(frame, 1.0, 2.0, depth_func="<=")
    assert np.any(lax == 3)
    assert np.all(depth == 1)


def surfaces(frame: Frame, near: float, far: float) -> tuple[Float32, Float32]:
    """Positions (w: hit) and normals (H, W, 4) between two clip planes, drawn without `draw_view`."""
    sensor = frame.scene.sensor
    size = sensor.width, sensor.height
    targets = [frame.texture(size, 4) for _ in range(3)]
    framebuffer = frame.context.framebuffer(targets, frame.context.depth_renderbuffer(size))
    framebuffer.use()
    framebuffer.clear()
    frame.draw(frame.program("raster/mesh.vert", "raster/gbuffer.frag"), sensor_camera(sensor, near, far))
    frame.resources |= {"position": targets[0], "normal": targets[1]}
    return frame.read("position", 4), frame.read("normal", 4)


def test_the_depth_function_is_less_again_afterwards(glowing: MakeScene, frame_of: MakeFrame) -> None:
    frame = frame_of(glowing())
    seen(frame, 1.0, 2.0, depth_func="<=")
    position, _ = surfaces(frame, 1.0, 2.0)
    assert not position[..., 3].any()


def test_normals_that_turn_away_before_their_faces_do_show_black(glowing: MakeScene, frame_of: MakeFrame) -> None:
    """As in the truth, whose emitters and reflectors know the angle to the shading normal."""
    frame = frame_of(glowing(shapes=[BALL], sensor=SENSOR | {"width": 128, "height": 96}))
    pixels, depth = seen(frame, 1.0, 4.0)
    position, normal = surfaces(frame, 1.0, 4.0)
    away = (np.sum(normal[..., :3] * -position[..., :3], axis=-1) <= 0) & (depth < 1)
    assert away.any()
    np.testing.assert_array_equal(pixels[..., 0] == 0, away)


def test_a_lit_card_reflects_the_irradiance_of_a_point_light(glowing: MakeScene, frame_of: MakeFrame) -> None:
    """I cos / d² times rho / pi at the middle of the card."""
    lamp = {"type": "point", "position": [0.0, 1.5, 0.0], "intensity": [6.0, 5.0, 4.0]}
    white = {"black": {"type": "diffuse", "reflectance": [0.8, 0.5, 0.2]}}
    pixels, _ = seen(frame_of(glowing(materials=white, emitters=[lamp])), 1.0, 4.0)
    expected = np.array([6.0, 5.0, 4.0]) * (2 / 2.5) / 2.5**2 * np.array([0.8, 0.5, 0.2]) / np.pi
    np.testing.assert_allclose(pixels[11:13, 15:17, :3].mean(axis=(0, 1)), expected, rtol=1e-3)


def test_the_background_is_the_sum_of_the_constant_lights(glowing: MakeScene, frame_of: MakeFrame) -> None:
    sky = {"type": "constant", "radiance": [0.1, 0.2, 0.3]}
    assert background(frame_of(glowing(emitters=[GLOW, sky, sky]))) == pytest.approx((0.2, 0.4, 0.6))


def test_a_pinhole_picture_is_the_mean_over_its_samples(glowing: MakeScene, frame_of: MakeFrame) -> None:
    frame = frame_of(glowing(emitters=[GLOW, {"type": "constant", "radiance": [1.0, 1.0, 1.0]}]))
    draw_pinhole(frame)
    fine = frame.read("pinhole", 4)
    np.testing.assert_allclose(
        frame.read("image", 4), fine.reshape(24, 4, 32, 4, 4).mean(axis=(1, 3)), rtol=1e-6, atol=1e-7
    )


def test_black_scenes_cast_no_shadows(glowing: MakeScene, frame_of: MakeFrame) -> None:
    frame = frame_of(glowing())
    assert {step.skip for step in shading_passes(frame.features, frame.settings)} == {
        "nothing reflects light: what is seen is emitted"
    }


def test_the_sky_alone_casts_no_shadows(make_scene: MakeScene) -> None:
    scene = make_scene(emitters=[{"type": "constant", "radiance": [1.0, 1.0, 1.0]}])
    lights, atlas = shading_passes(features_of(scene, geometry_of(scene)), {"shadow_side": 64, "facets": 1})
    assert (lights.skip, atlas.skip) == ("", "no emitter but the sky")


def test_a_sky_from_an_image_is_refused_rather_than_black(
    glowing: MakeScene, frame_of: MakeFrame, tmp_path: Path
) -> None:
    (tmp_path / "sky.exr").write_bytes(b"never read")
    scene = glowing(emitters=[GLOW, {"type": "environment", "path": "sky.exr"}])
    with pytest.raises(InputError, match="draws constant skies only"):
        background(frame_of(scene))
