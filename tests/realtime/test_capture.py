"""Laws that the captured and bounced surroundings obey, whatever the scene."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from realtime.capture import BOUNCES_LEFT, MOST_BOUNCES, bounces_for
from realtime.graph import Plan, plan
from realtime.render import Rendering
from scenes.errors import InputError
from scenes.exr import write_exr
from scenes.features import features_of
from scenes.image import Float32, Float64, Image
from scenes.model import Scene

Draw = Callable[..., Float32]
MakeScene = Callable[..., Scene]
MakeCavity = Callable[..., dict[str, Any]]

TECHNIQUES = ("indirect.grid", "indirect.irradiance", "indirect.probe")
both = pytest.mark.parametrize("name", TECHNIQUES)

FAST: dict[str, Any] = {"side": 24, "block": 3, "shadow_side": 64}
"""Enough for laws that hold at any resolution."""

COARSE: dict[str, Any] = {"side": 48, "block": 6}
"""Enough for laws that hold to a percent."""

LIGHT = {"type": "point", "position": [0.7, 0.9, 0.8], "intensity": [6.0, 5.0, 4.0]}
LAMP = {
    "type": "disk",
    "position": [-0.6, 1.1, 0.3],
    "normal": [0.2, -1.0, 0.1],
    "radius": 0.2,
    "radiance": [3.0, 2.0, 4.0],
}
SUN = {"type": "directional", "direction": [0.4, -1.0, -0.3], "irradiance": [2.0, 1.8, 1.5]}
SKY = {"type": "constant", "radiance": [0.4, 0.6, 1.0]}
BALL = {"name": "ball", "type": "sphere", "radius": 0.3, "detail": 3, "position": [0.1, 0.0, 0.0], "material": "skin"}
FLOOR = {
    "name": "floor",
    "type": "rectangle",
    "size": [6.0, 5.0],
    "position": [0.0, -0.5, 0.0],
    "rotation_deg": [-90.0, 0.0, 0.0],
    "material": "red",
}


def scaled(light: dict[str, Any], factor: float) -> dict[str, Any]:
    key = next(k for k in ("intensity", "radiance", "irradiance") if k in light)
    return light | {key: [factor * value for value in light[key]]}


def greys(**reflectances: float) -> dict[str, Any]:
    return {name: {"type": "diffuse", "reflectance": [value] * 3} for name, value in reflectances.items()}


def relative_difference(first: Float32, second: Float32) -> float:
    """Largest absolute difference over the largest value of the second."""
    return float(np.abs(first.astype(float) - second).max() / np.abs(second).max())


@both
@pytest.mark.parametrize("light", [LIGHT, LAMP], ids=["point", "disk"])
def test_twice_the_light_is_twice_the_radiance(
    make_scene: MakeScene, draw: Draw, name: str, light: dict[str, Any]
) -> None:
    once = draw(make_scene(emitters=[light]), name, **FAST)
    more = draw(make_scene(emitters=[scaled(light, 3.7)]), name, **FAST)
    assert once.max() > 0
    assert relative_difference(more / 3.7, once) < 1e-5


@pytest.mark.parametrize(("name", "tolerance"), [("indirect.irradiance", 1e-4), ("indirect.probe", 2e-3)])
def test_lights_add_up(make_scene: MakeScene, draw: Draw, name: str, tolerance: float) -> None:
    """Almost so for the probe, which cuts the negative lobes of its harmonics off."""
    shapes = [FLOOR, BALL]
    every = [LIGHT, scaled(LIGHT, 0.3) | {"position": [-0.5, 0.4, 0.9]}, SUN, SKY]
    together = draw(make_scene(shapes=shapes, emitters=every), name, **FAST)
    apart = sum(draw(make_scene(shapes=shapes, emitters=[light]), name, **FAST) for light in every)
    assert relative_difference(np.asarray(apart), together) < tolerance


def turned(vector: Sequence[float]) -> list[float]:
    """By 90 degrees about +y."""
    return [vector[2], vector[1], -vector[0]]


@both
def test_turning_the_whole_scene_changes_nothing(make_scene: MakeScene, draw: Draw, name: str) -> None:
    """To 1 %: the texels of the cube are the same, those of the surfels are grouped in another order."""
    straight = make_scene()
    sensor = straight.sensor.model_dump() | {
        "origin": turned(straight.sensor.origin),
        "target": turned(straight.sensor.target),
    }
    turn = {"rotation_deg": [0.0, 90.0, 0.0]}
    room = {"name": "room", "type": "room", "size": [3.0, 2.5, 3.0], "material": "white", "walls": {"left": "red"}}
    aside = make_scene(
        sensor=sensor,
        shapes=[room | turn, BALL | turn | {"position": turned(BALL["position"])}],  # type: ignore[arg-type]
        emitters=[LIGHT | {"position": turned(LIGHT["position"])}],  # type: ignore[arg-type]
    )
    assert relative_difference(draw(aside, name, **COARSE), draw(straight, name, **COARSE)) < 0.01


@both
def test_a_larger_scene_with_stronger_lights_looks_the_same(make_scene: MakeScene, draw: Draw, name: str) -> None:
    """Ten times the lengths and a hundred times the intensity."""
    small = make_scene()
    sensor = small.sensor.model_dump()
    sensor |= {key: [10 * value for value in sensor[key]] for key in ("origin", "target")}
    room = {"name": "room", "type": "room", "size": [30.0, 25.0, 30.0], "material": "white", "walls": {"left": "red"}}
    light = scaled(LIGHT, 100) | {"position": [7.0, 9.0, 8.0]}
    large = make_scene(
        sensor=sensor, shapes=[room, BALL | {"radius": 3.0, "position": [1.0, 0.0, 0.0]}], emitters=[light]
    )
    assert relative_difference(draw(large, name, **FAST), draw(small, name, **FAST)) < 1e-3


@both
def test_without_light_all_is_black(make_scene: MakeScene, draw: Draw, name: str) -> None:
    assert draw(make_scene(emitters=[]), name, **FAST).max() == 0


@both
def test_black_surroundings_bounce_nothing(make_scene: MakeScene, draw: Draw, name: str) -> None:
    """Neither lamps nor the sky count by themselves: that would be direct light."""
    dark = greys(white=0.0, red=0.0, skin=0.6)
    assert draw(make_scene(materials=dark, emitters=[LIGHT, LAMP]), name, **FAST).max() == 0
    assert draw(make_scene(materials=dark, shapes=[FLOOR, BALL], emitters=[SUN, SKY]), name, **FAST).max() == 0


@both
def test_a_black_subject_reflects_nothing(make_scene: MakeScene, draw: Draw, name: str) -> None:
    assert draw(make_scene(materials=greys(white=0.7, red=0.5, skin=0.0)), name, **FAST).max() == 0


def test_the_sky_does_not_wrap_from_nadir_to_zenith(make_scene: MakeScene, draw: Draw, tmp_path: Path) -> None:
    """Only the lowest row of the sky shines, which a floor that faces up never sees."""
    rows = np.zeros((4, 8, 3), dtype=np.float32)
    rows[3] = 1
    write_exr(tmp_path / "low.exr", Image(rows))
    write_exr(tmp_path / "high.exr", Image(rows[::-1]))
    skies = [{"type": "environment", "path": path} for path in ("low.exr", "high.exr")]
    low, high = (draw(make_scene(shapes=[FLOOR, BALL], emitters=[s]), "indirect.probe", **FAST) for s in skies)
    assert high.max() > 0
    assert low.max() == 0


def integrating_sphere(make_scene: MakeScene, make_cavity: MakeCavity, reflectance: float, light: list[float]) -> Scene:
    """A small ball (radius 1/20) in a cavity of radius 1 with a point light of 1 W/sr."""
    return make_scene(
        sensor={
            "type": "perspective",
            "origin": [0.6, 0.3, 0.5],
            "target": [0.0, 0.0, 0.5],
            "fov_deg": 5.0,
            "width": 12,
            "height": 12,
        },
        materials=greys(wall=reflectance, skin=0.6),
        shapes=[make_cavity(1.0, "wall"), BALL | {"radius": 0.05, "position": [0.0, 0.0, 0.5]}],
        emitters=[{"type": "point", "position": light, "intensity": [1.0, 1.0, 1.0]}],
    )


@both
@pytest.mark.parametrize("reflectance", [0.2, 0.5, 0.9])
def test_an_integrating_sphere_has_its_exact_radiance(
    make_scene: MakeScene, make_cavity: MakeCavity, draw: Draw, name: str, reflectance: float
) -> None:
    """Lit from its centre, a cavity has B = rho I / (R² (1 - rho)) everywhere, and a ball of albedo a shows a B / pi.

    The ball blocks and absorbs some (r/R)² = 0.25 % of the light, and throws a shadow of the same size.
    """
    scene = integrating_sphere(make_scene, make_cavity, reflectance, [0.0, 0.0, 0.0])
    expected = 0.6 * reflectance / (1 - reflectance) / np.pi
    image = draw(scene, name, **COARSE)
    assert image.mean() == pytest.approx(expected, rel=0.015)
    np.testing.assert_allclose(image, expected, rtol=0.03)


def close_light_radiance(facing: Float64, reflectance: float, distance: float) -> Float64:
    """Radiance of a ball of albedo 0.6 in the middle of a cavity of radius 1, by 1 W/sr at `distance` from its wall.

    First bounce by quadrature over polar angles that are dense near the light; all later ones are uniform: the cavity's
    mean radiosity after n bounces is rho^n times the flux over its area.
    """
    polar = np.concatenate([[0.0], np.geomspace(1e-5, np.pi, 1500)])
    theta, ring = (polar[1:] + polar[:-1]) / 2, 2 * np.pi * np.diff(-np.cos(polar))
    wall = np.stack([np.sin(theta), np.zeros_like(theta), np.cos(theta)], axis=1)
    to_wall = wall - np.array([0.0, 0.0, 1 - distance])
    r = np.linalg.norm(to_wall, axis=1)
    direct = np.sum(to_wall * wall, axis=1) / r**3
    azimuth = (np.arange(64) + 0.5) * 2 * np.pi / 64
    sine = np.sqrt(1 - facing**2)
    cosines = (
        sine[:, None, None] * np.outer(np.sin(theta), np.cos(azimuth)) + facing[:, None, None] * np.cos(theta)[:, None]
    )
    first = reflectance / np.pi * np.sum(direct * ring * np.maximum(cosines, 0).mean(axis=2), axis=1)
    later = reflectance**2 / (1 - reflectance)
    radiance: Float64 = 0.6 / np.pi * (first + later)
    return radiance


@pytest.mark.parametrize(("distance", "loss"), [(0.3, 0.015), (0.1, 0.02), (0.02, 0.03), (0.01, 0.1)])
def test_a_light_close_to_a_wall_costs_no_more_than_its_hot_spot(
    make_scene: MakeScene, make_cavity: MakeCavity, draw: Draw, distance: float, loss: float
) -> None:
    """Once the hot spot is as small as a texel of the capture, 1/60 of the wall's distance, the samples miss some."""
    scene = integrating_sphere(make_scene, make_cavity, 0.5, [0.0, 1 - distance, 0.0])
    moved = [s.model_dump() | ({"position": [0.0, 0.0, 0.0]} if s.name == "ball" else {}) for s in scene.shapes]
    scene = make_scene(
        sensor=scene.sensor.model_dump() | {"origin": [0.65, 0.2, 0.0], "target": [0.0, 0.0, 0.0]},
        materials=greys(wall=0.5, skin=0.6),
        shapes=moved,
        emitters=[e.model_dump() for e in scene.emitters],
    )
    normals = draw(scene, "raster.normal").reshape(-1, 3).astype(float)
    facing = normals[:, 1] / np.linalg.norm(normals, axis=1)
    expected = close_light_radiance(facing, 0.5, distance).mean()
    assert draw(scene, "indirect.irradiance").mean() == pytest.approx(expected, rel=loss)


@pytest.mark.parametrize(
    ("reflectance", "expected"), [(0.0, 0), (1e-4, 1), (0.1, 3), (0.5, 10), (0.9, 66), (1.0, None)]
)
def test_bounces_go_on_until_little_is_left(reflectance: float, expected: int | None) -> None:
    bounces = bounces_for(reflectance)
    assert bounces == (MOST_BOUNCES if expected is None else expected)
    assert reflectance in (0, 1) or reflectance**bounces <= BOUNCES_LEFT * (1 + 1e-9)


def without_skipping(why: str) -> Callable[..., Plan]:
    """A planner that takes no notice of one reason for leaving passes out."""
    return lambda passes, wanted, *rest: plan(
        [replace(p, skip="") if p.skip == why else p for p in passes], wanted, *rest
    )


@both
@pytest.mark.parametrize(
    ("skipped", "changes"),
    [
        ("shadow atlas", {"emitters": [SKY], "shapes": [FLOOR, BALL]}),
        ("bounce", {"materials": greys(white=0.0, red=0.0, skin=0.6)}),
    ],
)
def test_what_is_skipped_would_have_changed_nothing(
    make_scene: MakeScene,
    render: Callable[..., Rendering],
    monkeypatch: pytest.MonkeyPatch,
    name: str,
    skipped: str,
    changes: dict[str, Any],
) -> None:
    scene = make_scene(**changes)
    short = render(scene, name, **FAST)
    why = {s.what: s.why for s in short.skipped}[skipped]
    monkeypatch.setattr("realtime.render.plan", without_skipping(why))
    whole = render(scene, name, **FAST)
    assert why not in [s.why for s in whole.skipped]
    np.testing.assert_array_equal(short.image.pixels, whole.image.pixels)


def test_a_lit_scene_skips_neither_shadows_nor_bounces(make_scene: MakeScene, render: Callable[..., Rendering]) -> None:
    skipped = [s.what for s in render(make_scene(), "indirect.irradiance", **FAST).skipped]
    assert "shadow atlas" not in skipped
    assert "bounce" not in skipped


@both
@pytest.mark.parametrize("settings", [{"block": 5}, {"side": 0}, {"facets": -1}, {"shadow_side": 4096}])
def test_settings_that_fit_no_capture_are_refused(
    make_scene: MakeScene, draw: Draw, name: str, settings: dict[str, Any]
) -> None:
    name_of_it, value = next(iter(settings.items()))
    with pytest.raises(InputError, match=rf"\b{name_of_it}\b.* {value}[; ].*allowed|{name_of_it} = {value}; "):
        draw(make_scene(), name, **settings)


@both
def test_a_black_screen_is_as_dark_from_behind(make_scene: MakeScene, draw: Draw, name: str) -> None:
    """Surfaces are one-sided: their back reflects nothing, like a black front, and blocks as much."""
    room = {"name": "room", "type": "room", "size": [3.0, 2.5, 3.0], "material": "white"}
    screen = {
        "name": "screen",
        "type": "rectangle",
        "size": [1.5, 1.5],
        "position": [-0.7, 0.0, 0.0],
        "material": "black",
    }
    images = [
        draw(
            make_scene(
                materials=greys(white=0.7, black=0.0, skin=0.6),
                shapes=[room, BALL, screen | {"rotation_deg": [0.0, angle, 0.0]}],
            ),
            name,
            **COARSE,
        )
        for angle in (90.0, -90.0)
    ]
    assert images[1].mean() == pytest.approx(images[0].mean(), rel=0.01)


def test_five_lamps_are_drawn(make_scene: MakeScene, draw: Draw) -> None:
    """With the default settings, each lamp takes 16 rows of 256 texels; OpenGL 4.3 promises 16384."""
    lamps = [LAMP | {"position": [0.4 * i - 0.8, 1.1, 0.3]} for i in range(5)]
    assert draw(make_scene(emitters=lamps), "indirect.irradiance", **COARSE).max() > 0


def test_a_convex_subject_needs_no_search_for_what_it_hides_from_itself(
    make_scene: MakeScene, render: Callable[..., Rendering], monkeypatch: pytest.MonkeyPatch
) -> None:
    """To 3 %: what is skipped also interpolates between vertices."""
    scene = make_scene(shapes=[make_scene().shapes[0].model_dump(), BALL | {"detail": 4}])
    short = render(scene, "indirect.irradiance", **COARSE)
    assert "self-visibility" in [s.what for s in short.skipped]
    monkeypatch.setattr(
        "realtime.render.features_of", lambda *given: replace(features_of(*given), subject_is_convex=False)
    )
    whole = render(scene, "indirect.irradiance", **COARSE)
    assert "self-visibility" not in [s.what for s in whole.skipped]
    assert relative_difference(whole.image.pixels, short.image.pixels) < 0.03
