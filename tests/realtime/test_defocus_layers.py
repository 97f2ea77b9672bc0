"""Slices of depth blurred by scattering: energy, sizes and edges in closed form, and what the talk warns of."""

import math
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from realtime.camera import lens_camera
from realtime.frame import Frame
from realtime.lens import INVISIBLE_PX, coc_radius, coc_scale, vogel_disk
from realtime.render import Rendering
from realtime.techniques import defocus_layers
from realtime.techniques.defocus_layers import TEXEL, cuts, disk_areas, edge_width, slices, widened, within_reach
from realtime.views import background, draw_pinhole, draw_view
from scenes.errors import InputError
from scenes.image import Float32, Float64
from scenes.model import Scene, ThinLens

if TYPE_CHECKING:
    import moderngl

Draw = Callable[..., Float32]
MakeScene = Callable[..., Scene]


def lens(**changes: Any) -> dict[str, Any]:
    """A camera at the origin that looks along -z; 1 px is 0.01 of the depth."""
    return {
        "type": "thin_lens",
        "origin": [0.0, 0.0, 0.0],
        "target": [0.0, 0.0, -1.0],
        "fov_deg": math.degrees(2 * math.atan(0.24)),
        "width": 48,
        "height": 32,
        "aperture_radius": 0.06,
        "focus_distance": 2.0,
    } | changes


def lens_model(**changes: Any) -> ThinLens:
    return ThinLens.model_validate(lens(origin=(0.0, 0.0, 0.0), target=(0.0, 0.0, -1.0), **changes))


def card(name: str, depth: float, x: float, width: float, height: float = 40.0, **more: Any) -> dict[str, Any]:
    """An upright card whose left edge is `x` px right of the image's centre, `width` px wide."""
    size = [width * 0.01 * depth, height * 0.01 * depth]
    place = [(x + width / 2) * 0.01 * depth, 0.0, -depth]
    return {"name": name, "type": "rectangle", "material": "black", "size": size, "position": place} | more


def lamp(depth: float, x: float = 0.0, radius: float = 0.6, name: str = "lamp") -> dict[str, Any]:
    """A sphere of a radius in px, `x` px right of the image's centre."""
    place, r = [x * 0.01 * depth, 0.0, -depth], radius * 0.01 * depth
    return {"name": name, "type": "sphere", "material": "black", "radius": r, "detail": 4, "position": place}


def all_cuts(coc: Float64, most: int = 8) -> list[float]:
    return cuts(coc, np.ones(coc.shape, dtype=bool), most)


@pytest.fixture
def emissive(make_scene: MakeScene) -> MakeScene:
    """Makes a black scene from shapes with what they emit: emissive([(shape, radiance), ...], sky=..., **sensor)."""

    def make(things: list[tuple[dict[str, Any], float]], sky: float = 0.0, **sensor: Any) -> Scene:
        emitters: list[dict[str, Any]] = [
            {"type": "area", "shape": shape["name"], "radiance": [radiance] * 3}
            for shape, radiance in things
            if radiance
        ]
        if sky:
            emitters.append({"type": "constant", "radiance": [sky] * 3})
        return make_scene(
            subject=[things[0][0]["name"]],
            sensor=lens(**sensor),
            materials={"black": {"type": "diffuse", "reflectance": [0.0, 0.0, 0.0]}},
            shapes=[shape for shape, _ in things],
            emitters=emitters,
        )

    return make


def lens_of(scene: Scene) -> ThinLens:
    assert isinstance(scene.sensor, ThinLens)
    return scene.sensor


def signed_radius(scene: Scene, depth: float) -> float:
    return float(coc_radius(scene.sensor, np.array(depth)))


def edge_spread(x: Float64, radius: float) -> Float64:
    """How much of a disk about x lies at positive places."""
    t = np.clip(x / radius, -1, 1)
    spread: Float64 = 0.5 + (t * np.sqrt(1 - t**2) + np.arcsin(t)) / math.pi
    return spread


@pytest.fixture
def through_the_lens(frame_with: Callable[..., Frame]) -> Callable[..., Float64]:
    """The mean of views from all over the lens: what blur converges to."""

    def mean(scene: Scene, count: int) -> Float64:
        frame = frame_with(scene, "defocus.layers", "coc")
        size = frame.size
        total = np.zeros((size[1], size[0], 3))
        texture = frame.texture(size, 4)
        framebuffer = frame.context.framebuffer([texture], frame.context.depth_renderbuffer(size))
        for place in lens_of(scene).aperture_radius * vogel_disk(count):
            camera = lens_camera(scene.sensor, *frame.clip_planes, tuple(place))
            framebuffer.clear(*background(frame), 1.0)
            draw_view(frame, camera, framebuffer)
            frame.resources["view"] = texture
            total += frame.read("view", 4)[..., :3]
        grid = frame.grid
        pixels: Float64 = total.reshape(size[1] // grid, grid, size[0] // grid, grid, 3).mean(axis=(1, 3))
        return pixels / count

    return mean


def test_a_cut_lies_in_the_middle_of_what_is_empty() -> None:
    coc = np.zeros((40, 60))
    coc[10:30, 20:40] = -8.0
    (plane,) = all_cuts(coc)
    assert plane == pytest.approx(-4.0, abs=8 / defocus_layers.BINS)


def test_a_continuous_surface_is_not_cut_even_where_it_is_sharp() -> None:
    ramp = np.broadcast_to(np.linspace(-6.0, 6.0, 400), (60, 400))
    assert all_cuts(ramp) == []
    before = ramp.copy()
    before[20:40, 150:250] = -10.0
    (plane,) = all_cuts(before)
    assert -10.0 < plane < -6.0


@pytest.mark.parametrize("most", [1, 2, 3, 4])
def test_no_more_layers_than_allowed_and_no_more_than_there_are(most: int) -> None:
    coc = np.zeros((40, 90))
    coc[:, 30:60], coc[:, 60:] = 5.0, 12.0
    planes = all_cuts(coc, most)
    assert len(planes) == min(most, 3) - 1
    assert planes == sorted(planes)


def test_what_does_not_reach_the_image_has_no_part_in_the_cuts() -> None:
    coc = np.full((2 * 30, 2 * 40), 0.5)
    coc[:, :2] = 9.0
    reaches = within_reach(coc, 10)
    assert not reaches[:, :2].any()
    assert reaches[20:-20, 20:-20].all()
    assert cuts(coc, reaches, 8) == []
    coc[:, :2] = 10.5
    assert len(cuts(coc, within_reach(coc, 10), 8)) == 1


def test_what_is_apart_is_cut_apart_where_the_blur_of_one_reaches_the_other() -> None:
    """A lamp behind, near a sharp card but not beside it in the picture, must not shine over the card."""
    coc = np.full((60, 80), 10.0)
    coc[:, 40:], coc[29:31, 32:34] = 0.0, 9.0
    first, *_ = all_cuts(coc)
    assert 0.0 < first < 9.0


def test_slices_touch_and_hold_everything() -> None:
    sensor = lens_model()
    depths = np.array([1.0, 2.0, 6.0])
    coc = coc_radius(sensor, depths)
    planes = [float(coc_radius(sensor, np.array(z))) for z in (1.5, 4.0)]
    found = slices(coc, planes, sensor, 0.1, 50.0)
    assert [round(s.near, 6) for s in found] == [0.1, 1.5, 4.0]
    assert [round(s.far, 6) for s in found] == [1.5, 4.0, 50.0]
    np.testing.assert_allclose([s.radius for s in found], np.abs(coc), atol=1e-12)


def test_a_wider_sensor_keeps_the_pixels_where_they_are() -> None:
    for axis in ("x", "y"):
        sensor = lens_model(width=33, height=20, fov_axis=axis)
        wide = widened(sensor, 7)
        across = {"x": (33, 47), "y": (20, 34)}[axis]
        pixels = [math.tan(math.radians(s.fov_deg) / 2) / n for s, n in zip((sensor, wide), across, strict=True)]
        assert pixels[0] == pytest.approx(pixels[1], rel=1e-12)


@pytest.mark.parametrize("octave", [0, 1, 2, 3, 4])
def test_the_weights_of_a_disk_add_up_to_one(octave: int) -> None:
    """You should see the whole of a source in the pixels around it, wherever it lies among them."""
    finest = TEXEL * math.sqrt(400 / math.pi)
    texel, areas = TEXEL * 2**octave, disk_areas(finest, octave + 1)[octave]
    edge, radii = edge_width(texel), np.linspace(0, finest * 2**octave, len(areas))
    points = (np.arange(-200, 200) + 0.5) / 2
    for i in (0, 5, 37, 256, 512) if octave == 0 else (257, 400, 512):
        for phase in (0.5, 1.5):
            source = phase * texel
            weights = np.clip((radii[i] - np.hypot(points - source, (points - source)[:, None])) / edge + 0.5, 0, 1) / 4
            assert weights.sum() == pytest.approx(areas[i], rel=2e-3)


@pytest.mark.parametrize("depth", [0.8, 1.5, 3.0, 8.0])
def test_a_lamp_becomes_a_disk_with_all_of_its_light(emissive: MakeScene, draw: Draw, depth: float) -> None:
    """The disk has the radius of the circle of confusion to 0.2 px, in front of the focus and behind it."""
    scene = emissive([(lamp(depth), 1000.0)])
    image = draw(scene, "defocus.layers")[..., 0].astype(float)
    sharp = emissive([(lamp(depth), 1000.0)], aperture_radius=0.0)
    light = draw(sharp, "defocus.layers")[..., 0].astype(float).sum()
    assert image.sum() == pytest.approx(light, rel=1e-3)
    y, x = (axis - (n - 1) / 2 for axis, n in zip(np.indices(image.shape), image.shape, strict=True))
    # A disk of radius r has the mean squared distance r² / 2 from its centre, to which lamp and pixel add theirs.
    spread = float((image * (x**2 + y**2)).sum() / image.sum()) - 0.6**2 / 2 - 1 / 6
    assert math.sqrt(max(0.0, 2 * spread)) == pytest.approx(abs(signed_radius(scene, depth)), abs=0.2)


def test_light_is_blurred_in_linear_radiance(emissive: MakeScene, draw: Draw) -> None:
    """A lamp a thousand times as bright gives a disk a thousand times as bright: nothing is clipped on the way."""
    dim, bright = (draw(emissive([(lamp(6.0), r)]), "defocus.layers") for r in (1.0, 1000.0))
    np.testing.assert_allclose(bright, 1000 * dim, rtol=1e-5, atol=1e-5)


@pytest.mark.parametrize("depth", [1.0, 5.0])
def test_an_edge_spreads_beyond_its_outline_as_a_disk_does(emissive: MakeScene, draw: Draw, depth: float) -> None:
    """Empty pixels have no depth of their own, and yet a blurred card reaches into them; what it hides shows."""
    scene = emissive([(card("near", depth, 0.0, 60.0, 80.0), 3.0)], sky=1.0)
    profile = draw(scene, "defocus.layers")[16, :, 0]
    places = np.arange(48, dtype=np.float64) + 0.5 - 24
    alpha = edge_spread(places, abs(signed_radius(scene, depth)))
    np.testing.assert_allclose(profile, 1 + 2 * alpha, atol=0.03)


def test_sharp_things_keep_their_light_and_take_none(emissive: MakeScene, draw: Draw) -> None:
    """A lamp far behind is a disk that stops at a sharp card, and the card does not bleed.

    The lamp's own circle of confusion counts, not that of the pixel where its light arrives.
    """
    shapes = [(card("card", 2.0, 0.0, 40.0), 0.5), (lamp(20.0, -3.0), 500.0)]
    image = draw(emissive(shapes, aperture_radius=0.2), "defocus.layers")[..., 0]
    np.testing.assert_allclose(image[:, 24:], 0.5, atol=5e-3)
    alone = draw(emissive([(lamp(20.0, -3.0), 500.0)], aperture_radius=0.2), "defocus.layers")[..., 0]
    np.testing.assert_allclose(image[:, :23], alone[:, :23], atol=0.02 * alone.max())
    assert alone[16, 27] > 0.5 * alone.max()


def test_circles_of_confusion_come_from_planar_depth_in_full_precision(
    emissive: MakeScene, frame_with: Callable[..., Frame]
) -> None:
    """A plane has one circle of confusion though its corners are farther away, and a far wall makes no step in it.

    The near plane is at 1e-3 of the scene's radius: a depth buffer of 16 bits would be wrong by K / (n 2^17) px.
    """
    behind = {"name": "behind", "type": "sphere", "material": "black", "radius": 1.0, "position": [0.0, 0.0, 50.0]}
    scene = emissive([(card("plane", 9.0, -60.0, 120.0, 120.0), 1.0), (lamp(900.0), 1.0), (behind, 1.0)])
    frame = frame_with(scene, "defocus.layers", "coc")
    assert frame.clip_planes[0] < 1.0
    seen = frame.resources["coc"][frame.resources["reaches"]]
    np.testing.assert_allclose(seen, signed_radius(scene, 9.0), atol=1e-5)


def test_what_is_empty_is_blurred_as_what_is_infinitely_far(
    emissive: MakeScene, frame_with: Callable[..., Frame]
) -> None:
    scene = emissive([(lamp(3.0), 1.0)], sky=1.0)
    coc = frame_with(scene, "defocus.layers", "coc").resources["coc"]
    assert coc.max() == pytest.approx(coc_scale(scene.sensor) / 2.0, rel=1e-6)


@pytest.mark.parametrize("size", [(1, 1), (7, 5), (33, 1), (2, 19)])
def test_where_everything_is_equally_bright_the_image_is(
    emissive: MakeScene, draw: Draw, size: tuple[int, int]
) -> None:
    things = [(lamp(0.7, 3.0, 4.0, "near"), 1.0), (card("card", 2.0, -3.0, 5.0), 1.0), (lamp(9.0), 1.0)]
    scene = emissive(things, sky=1.0, width=size[0], height=size[1])
    image = draw(scene, "defocus.layers")
    assert image.shape == (size[1], size[0], 3)
    np.testing.assert_allclose(image, 1.0, atol=1e-4)


@pytest.mark.parametrize("planes", [[0.0, 1.4], [-1.0, 1.4], [-1.5, 0.0, 0.7, 1.4]])
def test_a_cut_through_a_surface_does_not_show(
    emissive: MakeScene, draw: Draw, monkeypatch: pytest.MonkeyPatch, planes: list[float]
) -> None:
    """A bright floor from near blur through what is sharp to far blur, over black: no band at a plane that cuts it.

    What is lost is what the fit of the largest moment misses, where the disks overlap: less than 3 %.
    """
    floor = {"type": "rectangle", "material": "black", "name": "floor", "size": [6.0, 11.3]}
    floor |= {"position": [0.0, -0.2, -6.35], "rotation_deg": [-90.0, 0.0, 0.0]}
    scene = emissive([(floor, 1.0)], height=64, aperture_radius=0.03)
    monkeypatch.setattr(defocus_layers, "cuts", lambda coc, reaches, most: planes)
    column = draw(scene, "defocus.layers")[:, 24, 0]
    np.testing.assert_allclose(column[37:54], 1.0, atol=0.03)


def test_a_solid_cut_open_is_not_seen_from_inside(
    emissive: MakeScene, draw: Draw, monkeypatch: pytest.MonkeyPatch
) -> None:
    scene = emissive([(lamp(2.5, radius=12.0), 1.0)], sky=1.0)
    monkeypatch.setattr(defocus_layers, "cuts", lambda coc, reaches, most: [signed_radius(scene, 2.4)])
    np.testing.assert_allclose(draw(scene, "defocus.layers"), 1.0, atol=0.01)


def test_a_shape_that_crosses_the_plane_of_the_camera_is_blurred_too(emissive: MakeScene, draw: Draw) -> None:
    """A rail that starts behind the camera: its circles of confusion have no bound but the image.

    Where cuts run through it 1 % may be lost.
    """
    rail = {"name": "rail", "type": "box", "material": "black", "size": [0.1, 0.1, 4.0], "position": [0.1, -0.1, -1.0]}
    image = draw(emissive([(rail, 1.0)], sky=1.0), "defocus.layers")
    np.testing.assert_allclose(image, 1.0, atol=0.01)
    dark = draw(emissive([(rail, 0.0)], sky=1.0), "defocus.layers")
    assert 0 <= dark.min() < 0.2
    assert dark.max() <= 1.0 + 1e-4


@pytest.mark.parametrize("sensor", [{"aperture_radius": 0.0}, {"aperture_radius": 1e-4}])
def test_where_nothing_is_out_of_focus_the_image_is_the_pinholes(
    emissive: MakeScene,
    render: Callable[..., Rendering],
    frame_with: Callable[..., Frame],
    sensor: dict[str, float],
) -> None:
    """To the last bit, and the reason is told, with the numbers where they show at run time alone."""
    scene = emissive([(card("card", 1.5, -8.0, 12.0, 9.0), 2.0), (lamp(6.0, 8.0, 5.0), 40.0)], sky=0.3, **sensor)
    frame = frame_with(
        scene.model_copy(update={"sensor": lens_of(scene).model_copy(update={"aperture_radius": 0.0})}),
        "defocus.layers",
        "image",
    )
    draw_pinhole(frame)
    rendering = render(scene, "defocus.layers")
    np.testing.assert_array_equal(rendering.image.pixels, frame.read("image", 4)[..., :3])
    reasons = {skip.what: skip.why for skip in rendering.skipped}
    if sensor["aperture_radius"]:
        assert f"{INVISIBLE_PX} px" in reasons["layers and blur"]
    else:
        assert "pinhole" in reasons["layers and blur"]


def test_blur_that_needs_too_large_a_texture_is_refused(
    gl: "moderngl.Context", emissive: MakeScene, draw: Draw, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(gl.info, "GL_MAX_TEXTURE_SIZE", 512)
    with pytest.raises(InputError, match=r"radius of 48 px .* allows 512\. Lower the sensor's"):
        draw(emissive([(lamp(3.0), 1.0)], aperture_radius=5.0), "defocus.layers")


@pytest.mark.parametrize("focus", [1e5, 1e9])
def test_the_lens_may_focus_at_infinity(emissive: MakeScene, draw: Draw, focus: float) -> None:
    scene = emissive([(lamp(3.0), 1000.0)], focus_distance=focus)
    image = draw(scene, "defocus.layers")[..., 0].astype(float)
    assert signed_radius(scene, 3.0) == pytest.approx(-2.0, rel=1e-4)
    assert image[16, 24] == pytest.approx(image.sum() / (math.pi * 2.0**2), rel=0.02)


SCENES: dict[str, tuple[list[tuple[dict[str, Any], float]], float, float]] = {
    "a blurred edge over a sharp stripe": (
        [(card("near", 0.9, -30.0, 28.0), 0.7), (card("stripe", 2.0, -6.0, 3.0), 3.0)],
        0.2,
        3e-4,
    ),
    "one that starts beside the image": (
        [(card("beside", 0.7, -60.0, 34.0), 3.0), (lamp(2.0, 8.0, 3.0), 1.0)],
        0.1,
        3e-4,
    ),
    "three depths": (
        [(card("near", 1.2, -40.0, 36.0), 0.5), (card("middle", 2.2, -10.0, 16.0), 2.0), (lamp(9.0, 8.0, 4.0), 6.0)],
        0.3,
        1e-3,
    ),
}


@pytest.mark.parametrize("name", SCENES)
def test_layers_come_near_the_mean_of_views_through_the_lens(
    emissive: MakeScene, draw: Draw, through_the_lens: Callable[..., Float64], name: str
) -> None:
    """The relative squared error, clipped by nothing, is a fiftieth of a pinhole's or less."""
    things, sky, allowed = SCENES[name]
    scene = emissive(things, sky=sky)
    truth = through_the_lens(scene, 128)

    def error(image: Float32) -> float:
        return float(np.mean((image - truth) ** 2 / (truth**2 + 1e-4)))

    blurred = error(draw(scene, "defocus.layers"))
    sharp = error(draw(emissive(things, sky=sky, aperture_radius=0.0), "defocus.layers"))
    assert blurred < allowed
    assert blurred < sharp / 50


def test_how_many_layers_suffice_is_told(emissive: MakeScene, render: Callable[..., Rendering]) -> None:
    scene = emissive([(card("card", 2.0, -10.0, 20.0, 16.0), 1.0), (lamp(20.0, 12.0, 8.0), 10.0)], sky=0.1)
    told = [skip.what for skip in render(scene, "defocus.layers", max_layers=8).skipped]
    (count,) = [int(what.split()[2]) for what in told if what.startswith("more than")]
    assert 2 <= count < 8
    allowed = [skip.what for skip in render(scene, "defocus.layers", max_layers=2).skipped]
    assert not any(what.startswith("more than") for what in allowed)


def test_one_layer_lets_a_sharp_card_bleed_and_two_do_not(
    emissive: MakeScene, draw: Draw, through_the_lens: Callable[..., Float64]
) -> None:
    scene = emissive([(card("card", 2.0, -10.0, 20.0, 16.0), 1.0), (lamp(20.0, 12.0, 8.0), 10.0)], sky=0.1)
    truth = through_the_lens(scene, 128)
    one, two = (float(np.mean((draw(scene, "defocus.layers", max_layers=n) - truth) ** 2)) for n in (1, 2))
    assert two < one / 20


def test_parts_of_the_lens_overlap_as_their_areas_and_moments_say(glsl: Callable[..., Float64]) -> None:
    """Exact for independent parts, and to 0.03 for those beyond chords on opposite sides or on the same one."""
    chord = np.linspace(-0.95, 0.95, 39)
    area = edge_spread(chord, 1.0)
    moment = 2 / (3 * math.pi) * (1 - chord**2) ** 1.5
    inputs = np.zeros((39, 39, 2, 4))
    inputs[:, :, 0, 0], inputs[:, :, 0, 1] = area[:, None], moment[:, None]
    inputs[:, :, 1, 0], inputs[:, :, 1, 1] = area, moment
    body = (
        "r[0] = vec4(overlap(a[0].x, a[0].yz, a[1].x, a[1].yz), overlap(a[0].x, a[0].yz, a[1].x, -a[1].yz),"
        " overlap(a[0].x, a[0].yz, a[1].x, a[1].zy), 0.0);"
    )
    made = glsl("defocus_layers/overlap.glsl", body, inputs.reshape(-1, 2, 4))[:, 0].reshape(39, 39, 4)
    np.testing.assert_allclose(made[..., 0], np.minimum(area[:, None], area), atol=0.03)
    np.testing.assert_allclose(made[..., 1], np.maximum(0, area[:, None] + area - 1), atol=0.03)
    np.testing.assert_allclose(made[..., 2], area[:, None] * area, atol=1e-6)
