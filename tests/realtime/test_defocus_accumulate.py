"""The mean of lens views, against blur in closed form."""

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from realtime.frame import Frame
from realtime.lens import INVISIBLE_PX, coc_radius
from realtime.render import Rendering
from realtime.techniques.defocus_accumulate import FEWEST_VIEWS, MOST_VIEWS, relative_variance, views_for
from scenes.image import Float32, Float64
from scenes.model import PIXEL_GRID, Perspective, Scene

Draw = Callable[..., Float32]
MakeScene = Callable[..., Scene]
FrameWith = Callable[..., Frame]
Render = Callable[..., Rendering]

NAME = "defocus.accumulate"
BLACK = {"black": {"type": "diffuse", "reflectance": [0.0, 0.0, 0.0]}}
EYE = {"origin": [0.0, 0.0, 0.0], "target": [0.0, 0.0, -1.0], "fov_deg": 40.0, "width": 64, "height": 16}
PINHOLE = {"type": "perspective"} | EYE
LENS = {"type": "thin_lens", "aperture_radius": 0.1, "focus_distance": 1.0} | EYE


def card(name: str, depth: float, left: float, size: float = 20.0) -> dict[str, Any]:
    """A square whose left side is in the middle of the picture, `left` to its right."""
    plain = {"name": name, "type": "rectangle", "material": "black", "size": [size, size]}
    return plain | {"position": [left + size / 2, 0.0, -depth]}


def glow(name: str, radiance: float = 1.0) -> dict[str, Any]:
    return {"type": "area", "shape": name, "radiance": [radiance] * 3}


@pytest.fixture
def edge(make_scene: MakeScene) -> Callable[..., Scene]:
    """A bright half plane to the right, at `depth`, seen by the lens with some of its keys replaced."""

    def make(depth: float = 2.0, left: float = 0.0, radiance: float = 1.0, **lens: Any) -> Scene:
        return make_scene(
            sensor=lens if lens.get("type") == "perspective" else LENS | lens,
            materials=BLACK,
            shapes=[card("card", depth, left, size=20 * depth)],
            emitters=[glow("card", radiance)],
            subject=["card"],
        )

    return make


def edge_spread(x: Float64, radius: float) -> Float64:
    """What is left of an edge at distances x [px] to its bright side: the part of a disk beyond a chord."""
    u = np.clip(x / radius, -1, 1)
    share: Float64 = 0.5 + (u * np.sqrt(1 - u * u) + np.arcsin(u)) / math.pi
    return share


def edge_spread_of_pixels(radius: float, width: int = 64) -> Float64:
    fine = (np.arange(width * 64) + 0.5) / 64 - width / 2
    means: Float64 = edge_spread(fine, radius).reshape(width, 64).mean(axis=1)
    return means


def radius_at(scene: Scene, depth: float) -> float:
    assert isinstance(scene.sensor, Perspective)
    return abs(float(coc_radius(scene.sensor, np.array(depth))))


@pytest.mark.parametrize("depth", [0.55, 2.0, 8.0])
def test_an_edge_is_spread_as_a_disk_spreads_it(edge: MakeScene, draw: Draw, depth: float) -> None:
    scene = edge(depth)
    pixels = draw(scene, NAME, views=256)[..., 0]
    np.testing.assert_allclose(
        pixels, np.broadcast_to(edge_spread_of_pixels(radius_at(scene, depth)), (16, 64)), atol=0.012
    )


def test_the_error_falls_faster_than_that_of_points_at_random(edge: MakeScene, draw: Draw) -> None:
    scene = edge(4.0)
    truth = edge_spread_of_pixels(radius_at(scene, 4.0))
    few, many = (np.sqrt(np.mean((draw(scene, NAME, views=n)[..., 0] - truth) ** 2)) for n in (32, 512))
    assert many < few / math.sqrt(512 / 32) / 1.5


def test_the_bokeh_of_a_lamp_is_the_disk_of_the_lens_with_all_of_its_light(make_scene: MakeScene, draw: Draw) -> None:
    """Second moment: half the squared radius of the disk, and a sixth of the squared sides of the lamp and a pixel."""
    lamp = {"name": "lamp", "type": "rectangle", "size": [0.1, 0.1], "position": [0.0, 0.0, -3.0], "material": "black"}
    scene = make_scene(
        sensor=LENS | {"width": 48, "height": 48},
        materials=BLACK,
        shapes=[lamp],
        emitters=[glow("lamp", 50.0)],
        subject=["lamp"],
    )
    image = draw(scene, NAME, views=1024)[..., 0].astype(float)
    side = 0.1 / 3 * 48 / (2 * math.tan(math.radians(20)))
    assert image.sum() == pytest.approx(50 * side**2, rel=0.01)
    y, x = np.mgrid[:48, :48] - 23.5
    moment = np.sum((x * x + y * y) * image) / image.sum()
    assert moment == pytest.approx(radius_at(scene, 3.0) ** 2 / 2 + side**2 / 6 + 1 / 6, rel=0.01)


LIT: dict[str, Any] = {"sensor": PINHOLE | {"origin": [0.2, 0.3, 1.2], "target": [0.1, 0.05, 0.0], "height": 48}}


def test_without_an_aperture_the_picture_is_the_pinhole_s_bit_by_bit(make_scene: MakeScene, render: Render) -> None:
    plain = render(make_scene(**LIT), NAME)
    closed = {"type": "thin_lens", "aperture_radius": 0.0, "focus_distance": 0.7}
    made = render(make_scene(sensor=LIT["sensor"] | closed), NAME)
    np.testing.assert_array_equal(made.image.pixels, plain.image.pixels)
    assert plain.image.pixels.std() > 0
    reasons = {s.what: s.why for s in made.skipped}
    assert reasons["measure blur"] == reasons["predict"] == "the camera is a pinhole: everything is sharp"


def test_the_pinhole_picture_is_the_mean_over_a_grid_of_samples(
    make_scene: MakeScene, draw: Draw, frame_with: FrameWith
) -> None:
    scene = make_scene(**LIT)
    fine = frame_with(scene, NAME, "image").read("pinhole", 4)
    means = fine.reshape(48, PIXEL_GRID, 64, PIXEL_GRID, 4).astype(float).mean(axis=(1, 3))
    np.testing.assert_allclose(draw(scene, NAME), means[..., :3], rtol=1e-5, atol=1e-7)


def test_blur_that_cannot_be_seen_is_left_out_and_says_so(edge: MakeScene, render: Render) -> None:
    aperture = 0.88 * INVISIBLE_PX / radius_at(edge(2.0, aperture_radius=1.0), 2.0)
    made = render(edge(2.0, aperture_radius=aperture), NAME)
    reasons = {s.what: s.why for s in made.skipped}
    assert reasons["views through the lens"] == (
        "the largest circle of confusion has a radius of 0.22 px; up to 0.25 px cannot be seen"
    )
    np.testing.assert_array_equal(made.image.pixels, render(edge(2.0, **PINHOLE), NAME).image.pixels)


def test_leaving_out_what_cannot_be_seen_costs_what_an_edge_loses(edge: MakeScene, draw: Draw) -> None:
    """An edge between two pixels takes 2 r / (3 pi) from one of them: 5 % of its contrast at .25 px."""
    scale = 1 / radius_at(edge(2.0, aperture_radius=1.0), 2.0)
    below, above = (draw(edge(2.0, aperture_radius=r * scale), NAME, views=256) for r in (0.249, 0.251))
    assert np.abs(below - above).max() == pytest.approx(2 * INVISIBLE_PX / (3 * math.pi), rel=0.1)


def test_blur_that_can_be_seen_is_drawn(edge: MakeScene, render: Render) -> None:
    aperture = 1.1 * INVISIBLE_PX / radius_at(edge(2.0, aperture_radius=1.0), 2.0)
    made = render(edge(2.0, aperture_radius=aperture), NAME)
    assert "views through the lens" not in {s.what for s in made.skipped}


def test_what_only_the_rim_of_the_lens_sees_counts(make_scene: MakeScene, draw: Draw) -> None:
    """A near card beside the pinhole's picture reaches into that of the lens; everything else is sharp."""
    shapes = [card("sharp", 1.0, -10.0), card("beside", 0.4, 0.15)]
    emitters = [glow("sharp"), glow("beside", 5.0)]
    scenes = [
        make_scene(sensor=sensor, materials=BLACK, shapes=shapes, emitters=emitters, subject=["sharp"])
        for sensor in (PINHOLE, LENS)
    ]
    sharp, blurred = (draw(scene, NAME) for scene in scenes)
    assert sharp.max() == 1
    assert blurred[:, -1].min() > 1.5
    np.testing.assert_allclose(blurred[:, :32], 1, rtol=1e-5)


def test_focused_at_infinity_what_is_far_away_is_sharp(edge: MakeScene, draw: Draw) -> None:
    far, near = (draw(edge(depth, focus_distance=1e9), NAME, views=64)[..., 0] for depth in (500.0, 2.0))
    assert np.all((far < 0.02) | (far > 0.98))
    assert np.sum((near > 0.1) & (near < 0.9)) > 16 * 4


def test_light_is_linear(edge: MakeScene, draw: Draw) -> None:
    dim, bright = (draw(edge(radiance=r), NAME, views=32) for r in (1.0, 1e4))
    np.testing.assert_allclose(bright, 1e4 * dim, rtol=1e-5)


@pytest.mark.parametrize("wanted", [0.1, 0.03, 0.01])
def test_the_wanted_error_is_reached_within_a_factor_of_two(edge: MakeScene, draw: Draw, wanted: float) -> None:
    scene = edge(3.0)
    truth = edge_spread_of_pixels(radius_at(scene, 3.0))[None, :, None]
    made = draw(scene, NAME, wanted_error=wanted).astype(float)
    assert math.sqrt(np.mean((made - truth) ** 2 / (truth**2 + (0.01 * truth.mean()) ** 2))) < 2 * wanted


def predicted(rendering: Rendering) -> int:
    (found,) = [s.what for s in rendering.skipped if s.what.startswith("more than")]
    return int(found.split()[2])


def test_small_bright_lamps_need_more_views(make_scene: MakeScene, render: Render) -> None:
    lamp = {"name": "lamp", "type": "sphere", "radius": 0.02, "detail": 2, "material": "black"}
    lamps = [lamp | {"name": f"lamp-{i}", "position": [x, 0.02, -3.0]} for i, x in enumerate((-0.5, 0.1, 0.6))]
    back, glows = card("back", 5.0, -10.0), [glow("back", 0.1)]
    plain, lit = (
        make_scene(sensor=LENS, materials=BLACK, shapes=shapes, emitters=emitters, subject=["back"])
        for shapes, emitters in (
            ([back, card("half", 4.0, 0.0)], [*glows, glow("half", 0.2)]),
            ([back, *lamps], [*glows, *(glow(f"lamp-{i}", 100.0) for i in range(3))]),
        )
    )
    few, many = (predicted(render(scene, NAME, wanted_error=0.04)) for scene in (plain, lit))
    assert many > 4 * few


def test_given_views_are_not_predicted(edge: MakeScene, render: Render) -> None:
    reasons = {s.what: s.why for s in render(edge(), NAME, views=16).skipped}
    assert reasons["predict"] == "views = 16 are given"


def test_half_the_error_takes_three_times_the_views_within_bounds() -> None:
    assert views_for(0.01, 0.5) / views_for(0.02, 0.5) == pytest.approx(2**1.6, rel=0.01)
    assert views_for(1.0, 1e-6) == FEWEST_VIEWS
    assert views_for(1e-3, 1e6) == MOST_VIEWS


def test_the_relative_variance_is_that_of_the_views() -> None:
    rng = np.random.default_rng(3)
    views = rng.gamma(2.0, size=(64, 5, 4, 3))
    mean, squares = views.mean(axis=0), (views**2).mean(axis=0)
    expected = np.mean(views.var(axis=0, ddof=1) / (mean**2 + (0.01 * mean.mean()) ** 2))
    assert relative_variance(mean, squares, 64) == pytest.approx(expected)
    assert relative_variance(np.ones((2, 2, 3)), np.ones((2, 2, 3)) - 1e-9, 16) == 0
    assert relative_variance(np.zeros((2, 2, 3)), np.zeros((2, 2, 3)), 16) == 0
