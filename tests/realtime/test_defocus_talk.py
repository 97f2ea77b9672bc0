"""The published depth of field: what it must still do, for all that it approximates, and the traps that it names."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from realtime.frame import Frame
from realtime.render import Rendering
from realtime.techniques.defocus_talk import FAR_WIDTH, RAMP_START, Planes, focused_boundary
from scenes.errors import InputError
from scenes.image import Bool, Float32, Float64
from scenes.model import Scene

Draw = Callable[..., Float32]
Glsl = Callable[..., Float64]
MakeScene = Callable[..., Scene]
FrameWith = Callable[..., Frame]
Render = Callable[..., Rendering]

NAME = "defocus.talk"
BLACK = {"black": {"type": "diffuse", "reflectance": [0.0, 0.0, 0.0]}}
EYE = {"origin": [0.0, 0.0, 0.0], "target": [0.0, 0.0, -1.0], "fov_deg": 40.0, "width": 96, "height": 64}
PINHOLE = {"type": "perspective"} | EYE
LENS = {"type": "thin_lens", "aperture_radius": 0.1, "focus_distance": 1.0} | EYE
PLANES = {"near_plane": 0.5, "boundary": 2.0}


def card(
    name: str,
    place: tuple[float, float, float],
    size: tuple[float, float],
    turn: tuple[float, float, float] = (0, 0, 0),
) -> dict[str, Any]:
    plain = {"name": name, "type": "rectangle", "material": "black", "size": list(size)}
    return plain | {"position": list(map(float, place)), "rotation_deg": list(map(float, turn))}


def stripes(depth: float, count: int = 24) -> dict[str, dict[str, Any]]:
    """Bright strips with gaps as wide as they are, across the picture."""
    step = 1.6 * depth / count
    return {
        f"strip-{i}": card(f"strip-{i}", ((i - count / 2) * step, 0, -depth), (step / 2, 2 * depth))
        for i in range(count)
    }


@pytest.fixture
def glowing(make_scene: MakeScene) -> MakeScene:
    """A scene of black shapes that emit, with the radiance that `radiance` names or 1; the first is the subject."""

    def make(
        *shapes: dict[str, Any], radiance: dict[str, float] | None = None, sensor: Any = LENS, sky: float = 0.0
    ) -> Scene:
        given = radiance or {}
        emitters = [{"type": "area", "shape": s["name"], "radiance": [given.get(s["name"], 1.0)] * 3} for s in shapes]
        emitters.append({"type": "constant", "radiance": [sky] * 3})
        return make_scene(
            sensor=sensor, materials=BLACK, shapes=list(shapes), emitters=emitters, subject=[shapes[0]["name"]]
        )

    return make


def values(frame: Frame, name: str) -> tuple[Float32, Float32]:
    """Colour (H, W, 4) and depth (H, W) of a pass, row 0 at the top."""
    picture = frame.resources[name]
    width, height = picture.color.size
    color = np.frombuffer(picture.color.read(), dtype=np.float16).reshape(height, width, 4)[::-1].astype(np.float32)
    return color, np.frombuffer(picture.depth.read(), dtype=np.float32).reshape(height, width)[::-1]


def grown(mask: Bool) -> Bool:
    """A mask and its neighbours."""
    wide = mask.copy()
    for axis in (0, 1):
        wide |= np.roll(wide, 1, axis) | np.roll(wide, -1, axis)
    return wide


def test_the_ramps_are_those_of_the_talk(glsl: Glsl) -> None:
    """saturate((f.xx - half2(0, 1) * 0.5) * 2) and saturate((f - 0.85) * (1.0 / (1 - 0.85)))."""
    f = np.linspace(0, 1, 101)
    given = np.zeros((101, 1, 4))
    given[:, 0, 0] = f
    body = "r[0].xy = far_blur(a[0].x, 1.0); r[0].z = near_blur(a[0].x, 0.85);"
    made = glsl("defocus_talk/ramps.glsl", body, given)[:, 0]
    np.testing.assert_allclose(made[:, 0], np.clip(2 * f, 0, 1), atol=1e-6)
    np.testing.assert_allclose(made[:, 1], np.clip(2 * f - 1, 0, 1), atol=1e-6)
    np.testing.assert_allclose(made[:, 2], np.clip((f - 0.85) / 0.15, 0, 1), atol=1e-5)


@pytest.mark.parametrize(("near", "farthest"), [(0.5, 1.0), (0.2, 1.3), (2.0, 2.5), (0.2, 0.21)])
def test_the_near_ramp_begins_at_the_subject_s_farthest_point(near: float, farthest: float) -> None:
    boundary = focused_boundary(near, farthest)
    assert (1 / near - 1 / farthest) / (1 / near - 1 / boundary) == pytest.approx(RAMP_START)


@pytest.mark.parametrize(("near", "farthest"), [(0.1, 1.0), (1e-3, 2.0), (0.5, 0.5)])
def test_where_no_boundary_keeps_the_subject_in_focus_it_is_just_behind(near: float, farthest: float) -> None:
    assert focused_boundary(near, farthest) == pytest.approx(1.001 * farthest)


@pytest.mark.parametrize("layers", [2, 3])
def test_without_an_aperture_nothing_is_blurred(glowing: MakeScene, render: Render, layers: int) -> None:
    shapes = [card("subject", (0, 0, -1), (0.3, 0.3), (0, 0, 10)), card("far", (0.4, 0, -5), (2, 2), (0, 0, 20))]
    closed = LENS | {"aperture_radius": 0.0}
    made = render(glowing(*shapes, sensor=closed), NAME, layers=layers)
    plain = render(glowing(*shapes, sensor=PINHOLE), "defocus.accumulate")
    np.testing.assert_array_equal(made.image.pixels, plain.image.pixels)
    assert {s.why for s in made.skipped if s.what in ("far pass", "blur near", "blend")} == {
        "the camera is a pinhole: everything is sharp"
    }


@pytest.mark.parametrize("layers", [2, 3])
def test_a_scene_of_one_radiance_stays_one(glowing: MakeScene, draw: Draw, layers: int) -> None:
    """Every blur is a mean, and the third layer's colour is not darkened by the empty pixels beside it."""
    shapes = [
        card("subject", (0, 0, -1), (0.3, 0.3), (0, 0, 10)),
        card("front", (-0.1, 0.1, -0.5), (0.1, 0.2), (0, 0, 30)),
        card("far", (0.4, 0, -5), (2, 2), (0, 0, 20)),
    ]
    np.testing.assert_allclose(draw(glowing(*shapes, sky=1.0), NAME, layers=layers), 1, atol=2e-3)


def test_what_is_blurred_in_the_far_pass_is_not_blurred_again(glowing: MakeScene, frame_with: FrameWith) -> None:
    """Pixels with the depth of the background leave the near pass' blur as they entered it."""
    scene = glowing(card("subject", (-0.4, 0, -1), (0.3, 2)), *stripes(5.0).values(), radiance={"subject": 0.5})
    frame = frame_with(scene, NAME, "image", **PLANES)
    color, depth = values(frame, "close")
    behind = depth == 1
    assert 0.3 < behind.mean() < 0.9
    np.testing.assert_array_equal(frame.read("image", 4)[behind][:, :3], color[behind][:, :3])


def test_a_crisp_foreground_does_not_bleed_onto_the_background(glowing: MakeScene, frame_with: FrameWith) -> None:
    """The background is, up to the foreground's own edge, what it is without the foreground."""
    subject, behind = card("subject", (0, 0, -1), (0.3, 0.4), (0, 0, 8)), stripes(5.0).values()
    hidden = card("subject", (0, 3, -1), (0.3, 0.4))
    lit, without = (
        frame_with(glowing(s, *behind, radiance={"subject": 100.0}), NAME, "image", **PLANES) for s in (subject, hidden)
    )
    _, depth = values(lit, "close")
    away = ~grown(depth < 1)
    images = [frame.read("image", 4) for frame in (lit, without)]
    np.testing.assert_array_equal(images[0][away], images[1][away])
    assert images[0].max() > 50


def test_a_surface_exactly_at_the_boundary_belongs_to_the_far_pass_alone(
    glowing: MakeScene, frame_with: FrameWith
) -> None:
    """LESS keeps it out of the near pass, where its depth would be that of the background: its neighbours' colours."""
    scene = glowing(card("subject", (-0.1, 0, -1), (0.2, 0.2)), card("border", (0.2, 0, -2), (0.4, 3)), sky=0.25)
    frame = frame_with(scene, NAME, "image", near_plane=1 - 2**-10, boundary=2.0)
    _, far_depth = values(frame, "far")
    near, near_depth = values(frame, "close")
    assert np.any(far_depth == 0)
    assert near_depth[32, 60] == 1
    assert near[32, 60, 0] > 0.9
    np.testing.assert_array_equal(frame.read("image", 4)[near_depth == 1], near[near_depth == 1])


def test_far_blur_grows_with_depth(glowing: MakeScene, draw: Draw) -> None:
    """Contrast of stripes: least at the end of the ramp."""
    subject = card("subject", (0, 5, -1), (0.2, 0.2))
    backdrop = card("backdrop", (0, 0, -40), (0.1, 0.1))
    contrasts = []
    for depth in (2.05, 2.5, 4.0, 30.0):
        image = draw(glowing(subject, *stripes(depth).values(), backdrop), NAME, **PLANES)
        contrasts.append(float(image[20:40, 10:86, 0].std()))
    assert contrasts == sorted(contrasts, reverse=True)
    assert contrasts[-1] < 0.7 * contrasts[0]


@pytest.mark.parametrize("kernel", [65.0, 129.0])
def test_the_largest_blur_is_a_disk_of_the_talk_s_size(glowing: MakeScene, draw: Draw, kernel: float) -> None:
    """65 of the far pass' 912 pixels. A lamp at the end of the ramp has a second moment of r² / 2 more than sharp."""
    subject, lamp = card("subject", (0, 5, -1), (0.2, 0.2)), card("lamp", (0, 0, -30), (4.0, 4.0))
    width = {"width": 192, "height": 128}
    far, sharp = (
        draw(glowing(subject, lamp, sensor=sensor | width), NAME, kernel=kernel, **PLANES)[..., 0].astype(float)
        for sensor in (LENS, PINHOLE)
    )
    y, x = np.mgrid[:128, :192] - np.array([63.5, 95.5]).reshape(2, 1, 1)
    moments = [np.sum((x * x + y * y) * image) / image.sum() for image in (far, sharp)]
    radius = kernel / 2 / FAR_WIDTH * 192
    assert moments[0] - moments[1] == pytest.approx(radius**2 / 2, rel=0.2)
    assert far.sum() == pytest.approx(sharp.sum(), rel=0.05)


def test_the_near_plane_changes_the_look_of_the_near_ramp(glowing: MakeScene, frame_with: FrameWith) -> None:
    """At 1 with the boundary at 2, f is .67 with a near plane at .5, and .98 with one at .02: sharp, and blurred."""
    scene = glowing(*stripes(1.0).values())
    changed = []
    for near in (0.5, 0.02):
        frame = frame_with(scene, NAME, "image", near_plane=near, boundary=2.0)
        color, depth = values(frame, "close")
        assert np.median(depth[depth < 1]) == pytest.approx((1 / near - 1) / (1 / near - 1 / 2), abs=1e-3)
        changed.append(np.abs(frame.read("image", 4) - color)[depth < 1].mean())
    assert changed[0] == 0
    assert changed[1] > 0.05


def test_few_bits_of_depth_leave_a_crispy_band(glowing: MakeScene, frame_with: FrameWith) -> None:
    """The farthest surfaces of the near pass have a depth that rounds to 1 in 16 bits: they are not blurred."""
    tilted = [card(f"strip-{i}", ((i - 12) * 0.06, 0, -1.5), (0.03, 4), (-80, 0, 0)) for i in range(24)]
    near, boundary = 1e-4, 2.0
    frames = {
        bits: frame_with(glowing(*tilted), NAME, "image", near_plane=near, boundary=boundary, depth_bits=bits)
        for bits in (16, 24)
    }
    color, depth = values(frames[24], "close")
    band = (depth < 1) & (np.round(depth * 65535) == 65535)
    assert band.sum() > 20
    sixteen, full = (frames[bits].read("image", 4)[..., :3] for bits in (16, 24))
    np.testing.assert_array_equal(sixteen[band], color[band][:, :3])
    assert np.abs(full - color[..., :3])[band].mean() > 0.02
    np.testing.assert_allclose(sixteen[~band], full[~band], atol=1e-4)


def test_a_scene_far_from_the_origin_is_lit_as_one_around_it(make_scene: MakeScene, draw: Draw) -> None:
    """Places at centroids are right to what float32 holds at 1000; llvmpipe alone would be off by up to 5 % of that."""
    offset = np.array([1000.0, 1000.0, -1000.0])

    def image(origin: Float64) -> Float32:
        def at(*place: float) -> list[float]:
            return [float(x) for x in origin + place]

        room = {"name": "room", "type": "room", "size": [3.0, 2.5, 3.0], "material": "white", "position": at(0, 0, 0)}
        ball = {"name": "ball", "type": "sphere", "radius": 0.3, "position": at(0.1, 0, 0), "material": "skin"}
        sensor = LENS | {"origin": at(0.2, 0.3, 1.2), "target": at(0.1, 0.05, 0), "width": 32, "height": 24}
        lamp = {"type": "point", "position": at(0.7, 0.9, 0.8), "intensity": [6.0, 5.0, 4.0]}
        return draw(make_scene(sensor=sensor, shapes=[room, ball], emitters=[lamp]), NAME)

    here, there = image(np.zeros(3)), image(offset)
    assert np.abs(here - there).mean() < 0.01 * here.mean()


def test_eight_bits_clamp_highlights(glowing: MakeScene, draw: Draw) -> None:
    """A lamp of radiance 20 keeps a twentieth of its light."""
    scene = glowing(card("subject", (0, 5, -1), (0.2, 0.2)), card("lamp", (0, 0, -6), (1, 1)), radiance={"lamp": 20.0})
    half, eight = (draw(scene, NAME, eight_bit=e, **PLANES).astype(float).sum() for e in (False, True))
    assert eight / half == pytest.approx(1 / 20, rel=0.02)


FRONT = card("front", (-0.05, 0, -0.5), (0.15, 0.6), (0, 0, 20))
SUBJECT = card("subject", (0, 0, -1), (0.4, 0.3))


def steepest(image: Float32) -> float:
    return float(np.abs(np.diff(image[..., 0], axis=1)).max())


def test_the_third_layer_blurs_what_is_in_front(glowing: MakeScene, draw: Draw) -> None:
    scene = glowing(SUBJECT, FRONT, radiance={"front": 4.0})
    two, three = (draw(scene, NAME, layers=layers) for layers in (2, 3))
    assert steepest(three) < 0.6 * steepest(two)


def test_the_third_layer_keeps_its_colour(glowing: MakeScene, draw: Draw) -> None:
    """Samples without alpha are thrown out: in its middle, and anywhere that it is opaque, it is as bright as it is."""
    scene = glowing(SUBJECT, FRONT | {"size": [0.3, 2.0]}, radiance={"front": 4.0, "subject": 0.0})
    image = draw(scene, NAME, layers=3)[..., 0]
    assert image[32, 40] == pytest.approx(4.0, rel=1e-3)
    assert image.max() <= 4.0 * (1 + 1e-3)


def test_with_nothing_in_front_the_third_layer_is_left_out(glowing: MakeScene, render: Render) -> None:
    scene = glowing(SUBJECT, card("far", (0.1, 0, -5), (2, 2)))
    two, three = (render(scene, NAME, layers=layers) for layers in (2, 3))
    np.testing.assert_array_equal(two.image.pixels, three.image.pixels)
    assert "nothing is in front of the near pass" in {s.why for s in three.skipped}
    assert {s.why for s in two.skipped if s.what in ("third layer", "blend")} == {"layers = 2, as published"}


def test_planes_are_around_the_subject(glowing: MakeScene, frame_with: FrameWith) -> None:
    scene = glowing(SUBJECT, FRONT, card("far", (0.1, 0, -5), (2, 2)))
    planes: Planes = frame_with(scene, NAME, "planes", layers=3).resources["planes"]
    assert planes.near == pytest.approx(0.5, rel=2e-3)
    assert planes.front == pytest.approx(1.0, rel=2e-3)
    assert 1 < planes.boundary < 5 < planes.far


@pytest.mark.parametrize(
    "settings", [{"near_plane": 3.0, "boundary": 2.0}, {"layers": 3, "front": 2.5, "boundary": 2.0}]
)
def test_planes_that_are_not_in_order_are_refused(glowing: MakeScene, draw: Draw, settings: dict[str, Any]) -> None:
    with pytest.raises(InputError, match=r"each must be farther away.*Set boundary farther"):
        draw(glowing(SUBJECT, FRONT), NAME, **settings)


def test_light_is_linear_in_half_floats(glowing: MakeScene, draw: Draw) -> None:
    dim, bright = (draw(glowing(SUBJECT, FRONT, radiance={"subject": r, "front": r}), NAME) for r in (1.0, 64.0))
    np.testing.assert_allclose(bright, 64 * dim, rtol=2e-3)
