"""The whole character: furnaces first, then each part against what draws it alone, then the switches."""

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from realtime.camera import ray_axes
from realtime.character_light import divided, mean_reflectance
from realtime.character_parts import DIFFUSE
from realtime.character_view import see, shade
from realtime.frame import Frame
from realtime.lens import lens_views
from realtime.render import Renderer, plan_of
from realtime.sky import sky_directions
from realtime.techniques import technique
from realtime.techniques.character import EFFECTS
from scenes.features import features_of
from scenes.geometry import geometry_of
from scenes.image import Float32
from scenes.load import library_scenes, load_scene
from scenes.materials import Diffuse, Translucent
from scenes.model import Scene, ThinLens
from scenes.procedural import box, rectangle
from scenes.topology import surface_area

if TYPE_CHECKING:
    import moderngl

MakeScene = Callable[..., Scene]

SKY = {"type": "constant", "radiance": [1.0, 1.0, 1.0]}
SENSOR = {
    "type": "perspective",
    "origin": [0.0, 0.0, 4.0],
    "target": [0.0, 0.0, 0.0],
    "fov_deg": 30.0,
    "width": 16,
    "height": 16,
}
BALL = {"name": "ball", "type": "sphere", "radius": 0.8, "detail": 3, "material": "white"}
QUICK = {"rays": 32, "views": 4, "shadow_side": 128, "light_side": 128, "cells": 16, "facets": 4}
EYE = {
    "name": "eye",
    "type": "eye",
    "material": "white",
    "iris": "white",
    "ior": 1.3375,
    "sclera_radius": 12.0,
    "cornea_radius": 7.8,
    "limbus_radius": 5.9,
    "detail": 96,
    "scale": 0.07,
    "rotation_deg": [70.0, 0.0, 0.0],
}


def grey(value: float) -> dict[str, Any]:
    return {"type": "diffuse", "reflectance": [value] * 3}


@pytest.fixture
def draw(gl: "moderngl.Context") -> Callable[..., Float32]:
    """The image of character.accurate, at settings that are quick, or of another technique."""

    def render(scene: Scene, name: str = "character.accurate", **settings: Any) -> Float32:
        given = QUICK | settings if name.startswith("character") else settings
        return Renderer(scene).render(technique(name), given, timed=False).image.pixels[..., :3]

    return render


def inside(image: Float32) -> Float32:
    """The pixels of the middle, which the subject covers."""
    return image[5:11, 5:11]


def test_a_surface_under_an_even_sky_shows_its_reflectance(make_scene: MakeScene, draw: Callable[..., Float32]) -> None:
    scene = make_scene(sensor=SENSOR, materials={"white": grey(0.6)}, shapes=[BALL], emitters=[SKY])
    image = draw(scene)
    np.testing.assert_allclose(inside(image), 0.6, atol=1e-3)
    np.testing.assert_allclose(image[0, 0], 1, atol=1e-6)


def test_a_white_wall_before_a_white_wall_is_as_bright_as_the_sky(
    make_scene: MakeScene, draw: Callable[..., Float32]
) -> None:
    """What a wall does not get of the sky, it gets of the ball before it: four bounces leave 2 % to be found."""
    wall = {"name": "wall", "type": "rectangle", "size": [2, 2], "position": [0, 0, -1.0], "material": "white"}
    scene = make_scene(sensor=SENSOR, materials={"white": grey(1.0)}, shapes=[BALL, wall], emitters=[SKY])
    assert abs(float(draw(scene).mean()) - 1) < 0.02


def test_a_body_that_absorbs_nothing_is_as_bright_as_the_sky(
    make_scene: MakeScene, draw: Callable[..., Float32]
) -> None:
    """Directions and cells are few. What leaks from the grid grows with its cells, of 0.1 to 0.4 mean free paths."""
    milk = {"type": "translucent", "sigma_a": [0, 0, 0], "sigma_s": [1.0, 2.0, 4.0]}
    scene = make_scene(sensor=SENSOR, materials={"milk": milk}, shapes=[BALL | {"material": "milk"}], emitters=[SKY])
    image = draw(scene, iterations=64)
    np.testing.assert_allclose(inside(image), 1, atol=0.12)
    assert (np.abs(inside(image).mean(axis=(0, 1)) - 1) < (0.02, 0.045, 0.075)).all()


def test_a_white_eye_is_as_bright_as_the_sky(make_scene: MakeScene, draw: Callable[..., Float32]) -> None:
    """But for what is lost beyond what light between iris and cornea is counted: a few per cent through the cornea."""
    scene = make_scene(sensor=SENSOR, materials={"white": grey(1.0)}, shapes=[EYE], emitters=[SKY], subject=["eye"])
    image = draw(scene, sky_rays=512)
    np.testing.assert_allclose(inside(image), 1, atol=0.06)


def test_a_wall_seen_through_thin_air_stays_as_it_is(make_scene: MakeScene, draw: Callable[..., Float32]) -> None:
    """A body that does nothing to light: what is behind it, and what sticks in it, is seen as if it were not there."""
    air = {"type": "translucent", "sigma_a": [1e-6] * 3, "sigma_s": [1e-6] * 3}
    wall = {"name": "wall", "type": "rectangle", "size": [3, 3], "position": [0, 0, -1.0], "material": "white"}
    stick = {"name": "stick", "type": "box", "size": [0.2, 3, 0.2], "material": "dark"}
    materials = {"air": air, "white": grey(0.5), "dark": grey(0.2)}
    lamp = {"type": "point", "position": [0.5, 3.0, 3.5], "intensity": [10.0, 10.0, 10.0]}
    rest = {"sensor": SENSOR, "materials": materials, "emitters": [lamp], "subject": ["stick"]}
    clear = make_scene(shapes=[stick, wall], **rest)
    plain = draw(clear, indirect="off")
    veiled = draw(make_scene(shapes=[stick, wall, BALL | {"material": "air"}], **rest), indirect="off", shadows="off")
    unshadowed = draw(clear, indirect="off", shadows="off")
    np.testing.assert_allclose(veiled, unshadowed, atol=1e-4)
    assert not np.allclose(plain, unshadowed, atol=1e-2)


@pytest.mark.parametrize("order", [("front", "back"), ("back", "front")])
def test_of_two_bodies_the_nearer_one_is_in_front(
    make_scene: MakeScene, draw: Callable[..., Float32], order: tuple[str, str]
) -> None:
    """Milk before what takes all but red light is white, in whatever order the scene has them."""
    milk = {"type": "translucent", "sigma_a": [0, 0, 0], "sigma_s": [9.0, 9.0, 9.0]}
    ink = {"type": "translucent", "sigma_a": [0, 9.0, 9.0], "sigma_s": [1.0, 1.0, 1.0]}
    shapes = {
        "front": {"name": "front", "type": "sphere", "radius": 0.4, "detail": 2, "material": "milk"},
        "back": {
            "name": "back",
            "type": "sphere",
            "radius": 0.4,
            "detail": 2,
            "material": "ink",
            "position": [0, 0, -2],
        },
    }
    scene = make_scene(
        sensor=SENSOR | {"fov_deg": 8.0},
        materials={"milk": milk, "ink": ink},
        shapes=[shapes[name] for name in order],
        emitters=[SKY],
        subject=["front"],
    )
    assert (inside(draw(scene)) > 0.7).all()


def test_a_closed_room_absorbs_what_its_lamp_sends(make_scene: MakeScene, frame_with: Callable[..., Frame]) -> None:
    """With walls that reflect nine tenths, most light has bounced more than six times."""
    walls = [
        {"name": f"wall{i}", "type": "rectangle", "size": [2, 2], "position": place, "rotation_deg": turn}
        for i, (place, turn) in enumerate(
            [
                ([0, 0, -1], [0, 0, 0]),
                ([0, 0, 1], [180, 0, 0]),
                ([0, -1, 0], [-90, 0, 0]),
                ([0, 1, 0], [90, 0, 0]),
                ([-1, 0, 0], [0, 90, 0]),
                ([1, 0, 0], [0, -90, 0]),
            ]
        )
    ]
    scene = make_scene(
        materials={"white": grey(0.9)},
        shapes=[wall | {"material": "white"} for wall in walls],
        emitters=[{"type": "point", "position": [0, 0, 0], "intensity": [1.0, 1.0, 1.0]}],
        subject=["wall0"],
    )
    frame = frame_with(scene, "character.accurate", "radiosity", **QUICK | {"shadow_side": 512})
    hierarchy = frame.resources["hierarchy"]
    sent = np.frombuffer(frame.resources["radiosity"].read(), dtype=np.float32).reshape(-1, 4)[: hierarchy.count, 0]
    assert np.pi * sent.mean() * 24 * (1 - 0.9) / 0.9 == pytest.approx(4 * np.pi, rel=0.05)


def test_direct_light_is_that_of_the_defocus_techniques(make_scene: MakeScene, draw: Callable[..., Float32]) -> None:
    scene = make_scene()
    alone = draw(scene, indirect="off", shadow_side=512)
    np.testing.assert_allclose(alone, draw(scene, "defocus.accumulate"), rtol=0.02, atol=0.02)


def test_through_a_lens_it_is_that_of_the_mean_of_views(make_scene: MakeScene, draw: Callable[..., Float32]) -> None:
    lens = make_scene().sensor.model_dump() | {"type": "thin_lens", "aperture_radius": 0.05, "focus_distance": 0.7}
    scene = make_scene(sensor=lens)
    alone = draw(scene, indirect="off", shadow_side=512, views=16)
    np.testing.assert_allclose(alone, draw(scene, "defocus.accumulate", views=16), rtol=0.02, atol=0.02)


FUR = {
    "name": "fur",
    "on": "ball",
    "material": "fibre",
    "count": 1000,
    "length": 0.25,
    "radius": 0.01,
    "region": [0.0, 0.1, 1.0, 0.9],
}
FURRY = {"white": grey(1.0), "fibre": {"type": "fibre", "sigma_a": [0.0, 0.0, 0.0]}}
SUN = {"type": "directional", "direction": [0.5, 0.0, -1.0], "irradiance": [3.0, 3.0, 3.0]}


@pytest.mark.slow
def test_hair_beside_a_bright_panel_is_as_bright_as_under_the_sky_that_it_hides(
    make_scene: MakeScene, draw: Callable[..., Float32]
) -> None:
    """A white panel behind a white ball sends what it hides of the sky: four bounces leave 2 % to be found."""
    panel = {"name": "panel", "type": "rectangle", "size": [6, 6], "position": [0, 0, -1.2], "material": "white"}
    rest = {"sensor": SENSOR, "materials": FURRY, "hair": [FUR], "emitters": [SKY], "subject": ["ball"]}
    beside, alone = (draw(make_scene(shapes=shapes, **rest)) for shapes in ([BALL, panel], [BALL]))
    np.testing.assert_allclose(beside, alone, atol=0.04)
    assert beside.mean() == pytest.approx(float(alone.mean()), rel=0.01)


@pytest.mark.slow
def test_the_sky_lights_hair_only_if_indirect_light_is_accurate(
    make_scene: MakeScene, draw: Callable[..., Float32]
) -> None:
    rest = {"sensor": SENSOR, "materials": FURRY, "hair": [FUR], "subject": ["ball"], "shapes": [BALL]}
    lit, unlit = make_scene(emitters=[SKY, SUN], **rest), make_scene(emitters=[SUN], **rest)
    by_lamp = inside(draw(unlit))
    for indirect in ("talk", "off"):
        np.testing.assert_allclose(inside(draw(lit, indirect=indirect)), by_lamp, rtol=0.05)
    assert (inside(draw(lit)) > by_lamp + 0.5).all()


@pytest.mark.slow
def test_nothing_but_hair_shades_hair_if_shadows_are_off(make_scene: MakeScene, draw: Callable[..., Float32]) -> None:
    """A screen hides a lamp from it, or most of the points that stand for the lamp: the talk has one."""
    screen = {"name": "screen", "type": "rectangle", "size": [2, 4], "position": [-2, 0, 2.0], "material": "white"}
    lamp = {"type": "sphere", "position": [-4.0, 0.0, 4.0], "radius": 1.0, "radiance": [20.0, 20.0, 20.0]}
    rest = {"sensor": SENSOR, "materials": FURRY, "hair": [FUR], "subject": ["ball"], "emitters": [lamp]}

    def drawn(shapes: list[dict[str, Any]], shadows: str) -> Float32:
        return inside(draw(make_scene(shapes=shapes, **rest), indirect="off", shadows=shadows))

    free = drawn([BALL], "off")
    np.testing.assert_allclose(drawn([BALL, screen], "off"), free, rtol=1e-3)
    accurate, talk = (drawn([BALL, screen], shadows) for shadows in ("accurate", "talk"))
    assert accurate.mean() < 0.2 * free.mean()
    assert abs(talk.mean() - accurate.mean()) > 0.01


def test_a_layered_ball_is_that_of_ggx(make_scene: MakeScene, draw: Callable[..., Float32]) -> None:
    suit = {"type": "layered", "reflectance": [0.1, 0.2, 0.5], "metals": [{"metal": "Cr", "alpha": 0.3, "weight": 0.4}]}
    sun = {"type": "directional", "direction": [0.2, -0.4, -1.0], "irradiance": [3.0, 3.0, 3.0]}
    scene = make_scene(sensor=SENSOR, materials={"suit": suit}, shapes=[BALL | {"material": "suit"}], emitters=[sun])
    np.testing.assert_allclose(inside(draw(scene)), inside(draw(scene, "layered.ggx")), rtol=1e-4)


def test_a_talk_part_is_that_of_its_own_technique(make_scene: MakeScene, draw: Callable[..., Float32]) -> None:
    """But for the samples of a pixel, which are 16 in one and 64 in the other."""
    skin = {"type": "translucent", "sigma_a": [0.2, 0.4, 0.8], "sigma_s": [2.0, 2.0, 2.0]}
    sun = {"type": "directional", "direction": [0.2, -0.4, 1.0], "irradiance": [3.0, 3.0, 3.0]}
    scene = make_scene(sensor=SENSOR, materials={"skin": skin}, shapes=[BALL | {"material": "skin"}], emitters=[sun])
    own = draw(scene, "translucency.talk")
    np.testing.assert_allclose(inside(draw(scene, "character.talk")), inside(own), rtol=5e-3)


def test_the_talks_lens_is_that_of_its_own_technique(make_scene: MakeScene, draw: Callable[..., Float32]) -> None:
    """Far and near pass: a ball in focus, bars before a wall far behind it. Only antialiasing is another."""
    wall = {"name": "wall", "type": "rectangle", "size": [9, 9], "position": [0, 0, -4.0], "material": "dark"}
    bar = {"type": "box", "size": [0.6, 9, 0.1], "material": "white"}
    bars = [bar | {"name": f"bar{i}", "position": [1.2 * i, 0, -3.8]} for i in range(-2, 3)]
    lens = {"type": "thin_lens", "aperture_radius": 0.05, "focus_distance": 4.0, "width": 48, "height": 48}
    rest = {"materials": {"white": grey(0.8), "dark": grey(0.1)}, "emitters": [SUN], "subject": ["ball"]}
    scene = make_scene(sensor=SENSOR | lens, shapes=[BALL, wall, *bars], **rest)
    given = {"indirect": "off", "shadow_side": 512}
    image, sharp = (draw(scene, "character.talk", lens=lens, **given) for lens in ("talk", "off"))
    own = draw(scene, "defocus.talk")
    assert np.median(np.abs(image - own)) < 0.01 * own.mean()
    assert np.abs(image - own).mean() < 0.04 * own.mean()
    assert np.abs(image - own).mean() < 0.5 * np.abs(sharp - own).mean()


def test_a_relief_of_the_talk_is_blurred_too(make_scene: MakeScene, draw: Callable[..., Float32]) -> None:
    """A wall far behind the subject: it is as bright as before, but its bricks run into each other."""
    wall = {"name": "wall", "type": "relief", "size": [8, 8], "depth": 0.5, "heights": "brick", "resolution": 32}
    wall |= {"position": [0, 0, -6.0], "material": "white"}
    lens = {"type": "thin_lens", "aperture_radius": 0.05, "focus_distance": 4.0, "width": 48, "height": 48}
    ball = BALL | {"radius": 0.2}
    rest = {"materials": {"white": grey(0.5)}, "shapes": [ball, wall], "emitters": [SUN], "subject": ["ball"]}
    scene = make_scene(sensor=SENSOR | lens, **rest)
    blurred, sharp = (draw(scene, "character.talk", indirect="off", lens=lens) for lens in ("talk", "off"))
    assert blurred[:12].mean() == pytest.approx(float(sharp[:12].mean()), rel=0.1)
    assert np.abs(np.diff(blurred[:12], axis=0)).mean() < 0.5 * np.abs(np.diff(sharp[:12], axis=0)).mean()


def test_what_is_nearer_than_the_blurred_surroundings_is_not_lost(
    make_scene: MakeScene, draw: Callable[..., Float32]
) -> None:
    """A floor runs below the ball from behind it to before it: all of it is seen."""
    floor = {"name": "floor", "type": "rectangle", "size": [8, 8], "position": [0, -0.8, 0], "material": "white"}
    floor |= {"rotation_deg": [-90.0, 0.0, 0.0]}
    lens = {"type": "thin_lens", "aperture_radius": 0.05, "focus_distance": 4.0}
    rest = {"materials": {"white": grey(0.5)}, "shapes": [BALL, floor], "emitters": [SUN | {"direction": [0, -1, -1]}]}
    scene = make_scene(sensor=SENSOR | lens, subject=["ball"], **rest)
    through, sharp = (draw(scene, "character.talk", lens=lens, shadows="off") for lens in ("talk", "off"))
    assert (sharp[-3:] > 0.1).all()
    assert (through[-3:] > 0.8 * sharp[-3:]).all()
    np.testing.assert_allclose(through[-3:].mean(axis=0), sharp[-3:].mean(axis=0), rtol=0.1)


def test_a_scene_without_an_effect_skips_its_passes(make_scene: MakeScene) -> None:
    scene = make_scene()
    features = features_of(scene, geometry_of(scene))
    used = technique("character.accurate")
    skipped = {skip.what: skip.why for skip in plan_of(used, scene, features, {}).skipped}
    assert skipped["light bodies"] == "no body that light enters is drawn as one"
    assert skipped["light eyes"] == "no eye is drawn with its true cornea"
    assert skipped["grow"] == "the scene has no hair"
    assert skipped["parts"] == "no part is drawn by a technique of the talk"
    assert "far pass" in skipped


@pytest.mark.parametrize("hair", [[], [FUR]])
def test_a_switch_leaves_out_the_passes_of_its_effect(make_scene: MakeScene, hair: list[dict[str, Any]]) -> None:
    """Hair lists its lamps in any case: they are others then."""
    scene = make_scene(materials=FURRY, shapes=[BALL], emitters=[SUN, SKY], subject=["ball"], hair=hair)
    features = features_of(scene, geometry_of(scene))
    used = technique("character.accurate")

    def drawn(**settings: Any) -> set[str]:
        return {step.name for step in plan_of(used, scene, features, settings).passes}

    assert drawn() - drawn(indirect="off") == {"hierarchy", "trace rays", "radiosity", "receive"}
    assert drawn() - drawn(shadows="off") == {"shadow atlas"}
    assert ("lamps of hair" in drawn() - drawn(hair="off")) == bool(hair)


@pytest.fixture(scope="module", params=["character.talk", "character.accurate"])
def whole(request: pytest.FixtureRequest, gl: "moderngl.Context") -> tuple[str, Scene, Float32]:
    """A technique, the shipped scene, and its picture with every effect."""
    scene = load_scene(library_scenes()["character"])
    return request.param, scene, Renderer(scene).render(technique(request.param), dict(QUICK), timed=False).image.pixels


@pytest.mark.slow
@pytest.mark.parametrize("effect", EFFECTS)
def test_every_effect_can_be_switched_off(
    effect: str, whole: tuple[str, Scene, Float32], draw: Callable[..., Float32]
) -> None:
    """It changes one in two hundred pixels of the shipped scene, as many as the eyes have, or more."""
    name, scene, picture = whole
    parameters = {parameter.name: parameter for parameter in technique(name).parameters}
    assert parameters[effect].off == "off"
    assert parameters[effect].default != "off"
    less = draw(scene, name, **{effect: "off"})
    assert (np.abs(picture[..., :3] - less).max(axis=-1) > 0.01 * picture[..., :3].mean()).mean() > 0.005


def test_a_relief_that_is_off_is_as_high_as_it_is_on_the_whole(
    make_scene: MakeScene, draw: Callable[..., Float32]
) -> None:
    """You should see an even plate in place of the steps."""
    steps = {"name": "ball", "type": "relief", "size": [3, 3], "depth": 0.4, "heights": "steps", "resolution": 16}
    sun = {"type": "directional", "direction": [0.0, 0.0, -1.0], "irradiance": [3.0, 3.0, 3.0]}
    scene = make_scene(
        sensor=SENSOR, materials={"white": grey(0.5)}, shapes=[steps | {"material": "white"}], emitters=[sun]
    )
    flat, carved = (draw(scene, indirect="off", relief=relief) for relief in ("off", "accurate"))
    np.testing.assert_allclose(inside(flat), 0.5 / np.pi * 3, rtol=1e-3)
    assert inside(carved).std() > 0.02


@pytest.mark.parametrize("view", [60.0, 75.0])
def test_no_outline_of_a_relief_is_black_under_an_even_sky(
    make_relief: MakeScene, frame_with: Callable[..., Frame], view: float
) -> None:
    """No sample is. Saddles between tops and pits are where its mesh is farthest from what rays meet."""
    white = {"stone": grey(0.8)}
    saddles = np.indices((4, 4)).sum(axis=0) % 2.0
    given = {"materials": white, "emitters": [SKY]}
    scene = make_relief(saddles, view, width=1.5, depth=0.4, pixels=(48, 48), overrides=given)
    frame = frame_with(scene, "character.accurate", "received")
    see(frame)
    shade(frame)
    shaded = frame.read("shaded", 4)[..., :3]
    assert 0.1 < shaded.min() < 0.8
    assert shaded.max() == 1


@pytest.mark.parametrize("azimuth", [25.0, 205.0])
def test_rays_mark_a_relief_with_what_its_vertices_receive(
    make_relief: MakeScene, frame_with: Callable[..., Frame], azimuth: float
) -> None:
    """Vertices that receive their own place: rays then mark where they hit, on the carved side and on all walls."""
    heights = np.array([[0.5, 0.9, 0.3], [0.2, 1.0, 0.6], [0.7, 0.4, 0.8], [0.9, 0.1, 0.5]])
    scene = make_relief(heights, 60.0, azimuth=azimuth, width=1.6, depth=0.4)
    frame = frame_with(scene, "character.accurate", "lights")
    places = np.ones((len(frame.meshes[0].surface.positions), 4), dtype=np.float32)
    places[:, :3] = frame.meshes[0].surface.positions
    frame.resources["received"] = {"block": frame.context.buffer(places.tobytes())}
    see(frame)
    position, around, normal = (frame.read(name, 4) for name in ("position", "around", "normal"))
    is_hit = position[..., 3] > 0
    np.testing.assert_array_equal(around[..., 3], is_hit * DIFFUSE)
    np.testing.assert_allclose(around[is_hit][:, :3], position[is_hit][:, :3], atol=1e-5)
    assert (normal[is_hit][:, 2] == 0).sum() > 100


def test_rays_go_through_their_place_in_the_picture_of_any_view_through_a_lens() -> None:
    sensor = ThinLens(
        type="thin_lens", origin=(1, 2, 3), target=(0, 0, 0), fov_deg=35, aperture_radius=0.3, focus_distance=2
    )
    for camera in lens_views(sensor, 0.1, 50.0, 7):
        forward, right, up = ray_axes(camera)
        for x, y in ((0.0, 0.0), (-0.7, 0.4), (1.0, 1.0)):
            clip = camera.matrix @ (*(camera.eye + 5 * (forward + x * right + y * up)), 1.0)
            np.testing.assert_allclose(clip[:2] / clip[3], (x, y), atol=1e-12)


def test_directions_of_an_image_are_where_the_sky_is_looked_up() -> None:
    """The inverse of glsl/lib/sky.glsl: row 0 is +Y, the last -Y, the middle between two columns is -Z."""
    directions = sky_directions(5, 8)[0].reshape(5, 8, 3)
    np.testing.assert_allclose(np.linalg.norm(directions, axis=2), 1)
    np.testing.assert_allclose(directions[0], np.tile([0, 1, 0], (8, 1)), atol=1e-15)
    np.testing.assert_allclose(directions[2, 3:5].sum(axis=0)[:2], 0, atol=1e-12)
    assert directions[2, 3, 2] < 0
    assert directions[2, 4, 0] > 0


@pytest.mark.parametrize("longest", [0.1, 0.35, 10.0])
def test_triangles_are_divided_until_they_are_short_and_cover_what_they_did(longest: float) -> None:
    for surface in (rectangle((2.0, 1.0)), box((1.0, 0.3, 0.2))):
        corners = divided(surface, longest).astype(np.float64)
        edges = np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2)
        assert edges.max() <= longest * (1 + 1e-6)
        cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        assert np.linalg.norm(cross, axis=1).sum() / 2 == pytest.approx(surface_area(surface), rel=1e-6)


def test_what_surfaces_reflect_on_the_whole(make_scene: MakeScene) -> None:
    scene = make_scene()
    clear = Translucent(type="translucent", sigma_a=(0, 0, 0), sigma_s=(1, 1, 1))
    np.testing.assert_allclose(mean_reflectance(scene, clear), 1)
    black = Translucent(type="translucent", sigma_a=(1, 1, 1), sigma_s=(0, 0, 0))
    np.testing.assert_allclose(mean_reflectance(scene, black), 0)
    red = Diffuse(type="diffuse", reflectance=(0.6, 0.15, 0.1))
    np.testing.assert_allclose(mean_reflectance(scene, red), (0.6, 0.15, 0.1))
