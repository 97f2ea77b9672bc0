"""The published technique: what it must still do, for all that it approximates."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from realtime.camera import FACES
from realtime.frame import Frame
from realtime.lights import lights_of
from realtime.render import Rendering
from realtime.talk_cube import two_lights
from realtime.techniques import technique
from scenes.errors import InputError
from scenes.geometry import geometry_of
from scenes.image import Float32, Float64
from scenes.model import Scene

Draw = Callable[..., Float32]
MakeScene = Callable[..., Scene]
FrameWith = Callable[..., Frame]

CENTRE = np.array([0.1, 0.0, 0.0])
SIDE = 32


def point(position: list[float], intensity: float = 1.0) -> dict[str, Any]:
    return {"type": "point", "position": position, "intensity": [intensity, 0.5 * intensity, 0.2 * intensity]}


def disk(position: list[float], normal: list[float], radiance: float = 1.0) -> dict[str, Any]:
    return {"type": "disk", "position": position, "normal": normal, "radius": 0.2, "radiance": [radiance] * 3}


def two_of(scene: Scene) -> list[tuple[tuple[float, ...], Float64]]:
    return two_lights(lights_of(scene, geometry_of(scene), facets=64), CENTRE)


def test_the_two_brightest_lights_at_the_centre_are_kept_in_order(make_scene: MakeScene) -> None:
    """The strongest lamp is too far away to be among them."""
    weak, strong, far = point([0.1, 0.5, 0.0], 0.1), point([0.1, 1.0, 0.0], 1.0), point([1.4, 1.2, 1.4], 2.0)
    places = [place for place, _ in two_of(make_scene(emitters=[far, weak, strong]))]
    assert places == [(0.1, 1.0, 0.0, 1.0), (0.1, 0.5, 0.0, 1.0)]


def test_a_point_light_gives_its_irradiance_at_the_centre(make_scene: MakeScene) -> None:
    (_, color), (_, nothing) = two_of(make_scene(emitters=[point([0.1, 0.0, 2.0], 3.0)]))
    np.testing.assert_allclose(np.pi * color, np.array([3.0, 1.5, 0.6]) / 4)
    assert not nothing.any()


def test_parallel_light_gives_its_irradiance_and_the_way_to_it(make_scene: MakeScene) -> None:
    sun = {"type": "directional", "direction": [0.0, -2.0, 0.0], "irradiance": [3.0, 2.0, 1.0]}
    place, color = two_of(make_scene(emitters=[sun]))[0]
    np.testing.assert_allclose(place, [0, 1, 0, 0])
    np.testing.assert_allclose(np.pi * color, [3, 2, 1])


def test_a_disk_gives_its_irradiance_at_the_centre(make_scene: MakeScene) -> None:
    """E = pi L R² / (h² + R²) on the axis of the disk."""
    place, color = two_of(make_scene(emitters=[disk([0.1, 1.0, 0.0], [0.0, -1.0, 0.0], 5.0)]))[0]
    np.testing.assert_allclose(place, [0.1, 1.0, 0.0, 1.0], atol=0.02)
    np.testing.assert_allclose(np.pi * color, np.pi * 5 * 0.2**2 / (1 + 0.2**2), rtol=0.03)


def test_a_disk_that_faces_away_gives_nothing(make_scene: MakeScene) -> None:
    assert not two_of(make_scene(emitters=[disk([0.1, 1.0, 0.0], [0.0, 1.0, 0.0])]))[0][1].any()


@pytest.mark.parametrize("name", ["indirect.talk", "lighting.talk"])
def test_a_lamp_at_the_subject_s_centre_has_no_colour_and_is_refused(
    make_scene: MakeScene, draw: Draw, name: str
) -> None:
    with pytest.raises(InputError, match=r"light at the subject's centre .* Move the light"):
        draw(make_scene(emitters=[point(list(CENTRE))]), name)


@pytest.mark.parametrize("name", ["indirect.talk", "lighting.talk"])
def test_a_subject_without_height_needs_a_c_of_zero(make_scene: MakeScene, draw: Draw, name: str) -> None:
    flat = {"name": "ball", "type": "rectangle", "size": [0.5, 0.5], "rotation_deg": [-90.0, 0.0, 0.0]}
    scene = make_scene(shapes=[*ball_or(flat | {"position": [0.1, -0.3, 0.0], "material": "skin"})])
    with pytest.raises(InputError, match=r"without height along y.* Set c_height to 0"):
        draw(scene, name)
    assert draw(scene, name, c_height=0.0).max() > 0


def test_two_equal_lamps_are_two_lights(make_scene: MakeScene) -> None:
    panel = {"type": "rectangle", "size": [0.5, 0.5], "rotation_deg": [90.0, 0.0, 0.0], "material": "white"}
    panels = [panel | {"name": f"panel-{i}", "position": [x, 1.0, 0.0]} for i, x in enumerate((-1.0, 1.0))]
    lamps = [{"type": "area", "shape": f"panel-{i}", "radiance": [2.0, 2.0, 2.0]} for i in range(2)]
    first, second = two_of(make_scene(shapes=[*ball_or(BALL), *panels], emitters=lamps))
    np.testing.assert_allclose(sorted([first[0][0], second[0][0]]), [-1, 1], atol=0.01)


def directions(side: int) -> tuple[Float64, Float64]:
    """Unit directions (6, side, side, 3) of a cube's texels in the order of its rows, and their solid angles."""
    centres = (np.arange(side) + 0.5) / side * 2 - 1
    t, s = np.meshgrid(centres, centres, indexing="ij")
    forward, right, up = (np.array([face[k] for face in FACES], dtype=float)[:, None, None] for k in range(3))
    vectors = forward + s[None, ..., None] * right + t[None, ..., None] * up
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True), 4 / side**2 / (1 + s * s + t * t) ** 1.5


def blurred(frame_with: FrameWith, scene: Scene, faces: Float64) -> Float64:
    """A cube (6, side, side) of greys in [0, 1] after the three blurs."""
    used = technique("indirect.talk")
    frame = frame_with(scene, "indirect.talk", "cube_scale", side=SIDE)
    texels = np.repeat(np.round(faces * 255).astype(np.uint8)[..., None], 4, axis=-1)
    for face in range(6):
        frame.resources["cube"].write(face, texels[face].tobytes())
    for step in used.passes(scene, frame.features, frame.settings):
        if step.name.startswith("blur"):
            step.run(frame)
    cube = frame.resources["cube"]
    read = [np.frombuffer(cube.read(face), dtype=np.uint8).reshape(SIDE, SIDE, 4)[..., 0] for face in range(6)]
    return np.stack(read) / 255


@pytest.mark.parametrize("grey", [0, 77, 255])
def test_blurring_a_constant_cube_changes_nothing(make_scene: MakeScene, frame_with: FrameWith, grey: int) -> None:
    made = blurred(frame_with, make_scene(), np.full((6, SIDE, SIDE), grey / 255))
    assert np.abs(made * 255 - grey).max() <= 1


@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize("sign", [-1, 1])
def test_the_blur_widens_a_spot_and_keeps_its_place_and_energy(
    make_scene: MakeScene, frame_with: FrameWith, axis: int, sign: int
) -> None:
    """Turns keep solid angles, so the mean stays, but for what 8 bits and the seam bias take. The far side is dark."""
    d, solid_angle = directions(SIDE)
    towards = sign * np.eye(3)[axis]
    spot = (d @ towards > np.cos(0.5)).astype(float)
    made = blurred(frame_with, make_scene(), spot)
    assert np.sum(made * solid_angle) == pytest.approx(np.sum(spot * solid_angle), rel=0.1)
    mean = np.sum(d * (made * solid_angle)[..., None], axis=(0, 1, 2))
    assert mean @ towards / np.linalg.norm(mean) > np.cos(0.02)
    assert made[d @ towards > np.cos(0.1)].min() < 0.95
    assert made[np.abs(d @ towards - np.cos(0.7)) < 0.02].min() > 0.05
    assert made[d @ towards < -0.7].max() == 0


def ball_or(shape: dict[str, Any]) -> list[dict[str, Any]]:
    room = {"name": "room", "type": "room", "size": [3.0, 2.5, 3.0], "material": "white", "walls": {"left": "red"}}
    return [room, {"name": "ball", "position": [0.1, 0.0, 0.0], "material": "skin"} | shape]


BALL = {"type": "sphere", "radius": 0.3}
CRATE = {"type": "box", "size": [0.5, 0.5, 0.5]}


def test_with_c_of_zero_the_place_on_a_flat_face_does_not_matter(make_scene: MakeScene, draw: Draw) -> None:
    scene = make_scene(shapes=ball_or(CRATE))
    front = (draw(scene, "raster.normal")[..., 2] == 1) & (draw(scene, "raster.coverage")[..., 0] == 1)
    assert front.sum() > 20
    fixed, moving = (draw(scene, "indirect.talk", c_height=c)[front] for c in (0.0, 2.5))
    assert np.ptp(fixed, axis=0).max() < 1e-6
    assert np.ptp(moving, axis=0).min() > 0.02 * moving.mean()


def test_a_sphere_around_the_cube_cannot_test_c(make_scene: MakeScene, draw: Draw) -> None:
    """Its relative position is parallel to the normal, whatever C: why scenes for C need another subject."""
    scene = make_scene(shapes=ball_or(BALL | {"detail": 5}))
    without, strong = (draw(scene, "indirect.talk", c_height=c) for c in (0.0, 7.0))
    assert np.abs(strong - without).max() < 0.02 * without.max()


def test_twice_the_light_is_twice_the_radiance(make_scene: MakeScene, draw: Draw) -> None:
    """Its 8 bits are relative to the brightest light."""
    dim, bright = (draw(make_scene(emitters=[point([0.7, 0.9, 0.8], i)]), "indirect.talk") for i in (1.0, 5.0))
    np.testing.assert_allclose(bright, 5 * dim, rtol=1e-5)


def test_distance_darkens(make_scene: MakeScene, draw: Draw) -> None:
    faded, plain = (draw(make_scene(), "indirect.talk", far_brightness=b) for b in (0.2, 1.0))
    assert 0.2 < faded.sum() / plain.sum() < 0.8


def test_under_the_sky_alone_nothing_is_blurred_because_nothing_is_lit(
    make_scene: MakeScene, render: Callable[..., Rendering]
) -> None:
    made = render(make_scene(emitters=[{"type": "constant", "radiance": [1.0] * 3}]), "indirect.talk")
    drawn = ["clear cube", "draw surroundings", "draw character"]
    assert [s.what for s in made.skipped] == [*drawn, "blur X", "blur Y", "blur Z"]
    assert made.image.pixels.max() == 0
