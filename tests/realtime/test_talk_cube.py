"""The talk's cube map for indirect light and soft shadows: what it holds, and who pays for what."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from realtime.frame import Frame
from realtime.graph import plan
from realtime.render import plan_of
from realtime.talk_cube import CHARACTER, SURROUNDINGS, cube_passes
from realtime.techniques import technique
from scenes.features import Features, features_of
from scenes.geometry import geometry_of
from scenes.image import Float32, Float64
from scenes.model import Scene

Draw = Callable[..., Float32]
MakeScene = Callable[..., Scene]
FrameWith = Callable[..., Frame]

BLURS = ["blur X", "blur Y", "blur Z"]
LIGHT = (0.7, 0.9, 0.8)
SKY = {"type": "constant", "radiance": [1.0] * 3}
LAMP = {"type": "disk", "position": [0.1, 1.2, 0.0], "normal": [0, -1, 0], "radius": 0.2, "radiance": [5.0] * 3}
ROOM = {"name": "room", "type": "room", "size": [3.0, 2.5, 3.0], "material": "white", "walls": {"left": "red"}}
BALL = {"name": "ball", "type": "sphere", "radius": 0.3, "detail": 3, "position": [0.1, 0.0, 0.0], "material": "skin"}


def passes_of(name: str, scene: Scene) -> tuple[list[str], dict[str, str]]:
    """Passes that run, and those that do not, with the reason."""
    made = plan_of(technique(name), scene, features_of(scene, geometry_of(scene)), {})
    return [step.name for step in made.passes], {skip.what: skip.why for skip in made.skipped}


def test_indirect_light_alone_draws_no_character(make_scene: MakeScene) -> None:
    run, skipped = passes_of("indirect.talk", make_scene())
    assert run == ["gbuffer", "clear cube", "draw surroundings", *BLURS, "look up", "resolve"]
    assert skipped == {"draw character": "nothing reads character"}


def test_soft_shadows_alone_draw_no_surroundings(make_scene: MakeScene) -> None:
    run, skipped = passes_of("shadow.soft_talk", make_scene())
    assert run == ["clear cube", "draw character", *BLURS, "receive", "resolve"]
    assert skipped == {"draw surroundings": "nothing reads cube_scale"}


def test_one_capture_serves_both(make_scene: MakeScene) -> None:
    run, skipped = passes_of("lighting.talk", make_scene())
    assert run == ["clear cube", "draw surroundings", "draw character", *BLURS, "shade", "resolve"]
    assert skipped == {}


def test_where_nothing_reads_either_there_is_no_capture(make_scene: MakeScene) -> None:
    def features(scene: Scene) -> Features:
        return features_of(scene, geometry_of(scene))

    made = plan([*cube_passes(features(make_scene())), *last()], "image")
    assert [skip.why for skip in made.skipped] == [
        f"nothing reads {name}" for name in ("cube", SURROUNDINGS, CHARACTER, "cube", "cube", "cube")
    ]
    alone = make_scene(shapes=[BALL])
    for name in ("indirect.talk", "shadow.soft_talk", "lighting.talk"):
        run, skipped = passes_of(name, alone)
        assert {"clear cube", "draw surroundings", "draw character", *BLURS} == set(skipped)
        assert all("nothing surrounds the subject" in skipped[blur] for blur in BLURS)
        assert run[-1] == "resolve"


def last() -> list[Any]:
    from realtime.graph import Pass

    return [Pass("last", lambda frame: None, ("image",))]


def test_under_the_sky_alone_there_is_nothing_to_draw(make_scene: MakeScene) -> None:
    _, skipped = passes_of("lighting.talk", make_scene(emitters=[SKY]))
    assert skipped["draw surroundings"] == "no light but the sky: the surroundings are black"
    assert skipped["draw character"] == "the subject casts the soft shadow of one point or sphere light"
    assert skipped["blur X"] == f"{skipped['draw surroundings']}; {skipped['draw character']}"


def test_two_point_lights_cast_no_soft_shadow(make_scene: MakeScene) -> None:
    lights = [{"type": "point", "position": [x, 1.0, 0.5], "intensity": [1.0] * 3} for x in (-0.5, 0.5)]
    run, skipped = passes_of("lighting.talk", make_scene(emitters=lights))
    assert skipped == {"draw character": "the subject casts the soft shadow of one point or sphere light"}
    assert run[:3] == ["clear cube", "draw surroundings", "blur X"]


def faces(frame: Frame) -> Float64:
    """The cube's texels (6, side, side, 4)."""
    cube = frame.resources["cube"]
    side = cube.size[0]
    return np.stack([np.frombuffer(cube.read(f), dtype=np.uint8).reshape(side, side, 4) for f in range(6)]) / 255


def directions(side: int) -> Float64:
    """Unit directions (6, side, side, 3) of a cube's texels in the order of its rows."""
    from realtime.camera import FACES

    centres = (np.arange(side) + 0.5) / side * 2 - 1
    t, s = np.meshgrid(centres, centres, indexing="ij")
    forward, right, up = (np.array([face[k] for face in FACES], dtype=float)[:, None, None] for k in range(3))
    vectors = forward + s[None, ..., None] * right + t[None, ..., None] * up
    normalised: Float64 = vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)
    return normalised


def test_drawing_the_one_leaves_the_other_as_it_is(make_scene: MakeScene, frame_with: FrameWith) -> None:
    scene = make_scene()
    light_alone = faces(frame_with(scene, "indirect.talk", SURROUNDINGS))
    shadow_alone = faces(frame_with(scene, "shadow.soft_talk", CHARACTER))
    frame = frame_with(scene, "lighting.talk", SURROUNDINGS)
    next(p for p in cube_passes(frame.features, CHARACTER) if p.name == "draw character").run(frame)
    both = faces(frame)
    np.testing.assert_array_equal(both[..., :3], light_alone[..., :3])
    np.testing.assert_array_equal(both[..., 3], shadow_alone[..., 3])
    assert light_alone[..., 3].min() == 1
    assert shadow_alone[..., :3].max() == 0


def test_alpha_is_the_silhouette_of_all_subjects_from_the_light(make_scene: MakeScene, frame_with: FrameWith) -> None:
    """Balls of which the light sees caps of sin = radius / distance; a crate before one of them does not matter."""
    balls = {"ball": np.array([0.1, 0.0, 0.0]), "other": np.array([-0.6, 0.2, 0.9])}
    shapes = [BALL | {"name": name, "detail": 5, "position": list(map(float, p))} for name, p in balls.items()]
    crate = {"name": "crate", "type": "box", "size": [0.1] * 3, "position": [0.4, 0.45, 0.4], "material": "white"}
    scene = make_scene(subject=list(balls), shapes=[ROOM, *shapes, crate])
    alpha = faces(frame_with(scene, "shadow.soft_talk", CHARACTER))[..., 3]
    d = directions(alpha.shape[1])
    hidden = np.zeros(alpha.shape, dtype=bool)
    near_edge = np.zeros(alpha.shape, dtype=bool)
    for place in balls.values():
        v = place - np.array(LIGHT)
        angle = np.arccos(np.clip(d @ (v / np.linalg.norm(v)), -1, 1))
        cap = np.arcsin(0.3 / np.linalg.norm(v))
        hidden |= angle < cap
        near_edge |= np.abs(angle - cap) < 0.03
    np.testing.assert_array_equal(alpha[~near_edge], 1.0 - hidden[~near_edge])


def test_blurred_alpha_is_exactly_one_far_from_the_character(make_scene: MakeScene, frame_with: FrameWith) -> None:
    """A pass turns a direction by up to three steps; three passes by less than nine steps and the jitter."""
    frame = frame_with(make_scene(), "shadow.soft_talk", "visibility", step_rad=0.1)
    alpha = faces(frame)[..., 3]
    v = np.array([0.1, 0.0, 0.0]) - np.array(LIGHT)
    angle = np.arccos(np.clip(directions(alpha.shape[1]) @ (v / np.linalg.norm(v)), -1, 1))
    assert alpha[angle > np.arcsin(0.3 / np.linalg.norm(v)) + 1.1].min() == 1
    assert alpha[angle < 0.05].max() < 0.9


def test_from_within_the_character_there_is_no_light(make_scene: MakeScene, frame_with: FrameWith) -> None:
    inside = {"type": "point", "position": [0.1, 0.05, 0.0], "intensity": [1.0] * 3}
    alpha = faces(frame_with(make_scene(emitters=[inside]), "shadow.soft_talk", CHARACTER))[..., 3]
    assert alpha.max() == 0


def interior(scene: Scene, draw: Draw) -> Any:
    """Pixels that see the subject alone, and pixels that do not see it."""
    coverage = draw(scene, "raster.coverage")[..., 0]
    return coverage == 1, coverage == 0


def test_the_character_reads_no_shadow_and_casts_it_before_itself_too(make_scene: MakeScene, draw: Draw) -> None:
    """There is no depth test: a screen between the light and the ball is darkened as if it were behind the ball."""
    toward = np.array([0.1, 0.0, 0.0]) - np.array(LIGHT)
    place = np.array(LIGHT) + 0.35 * toward
    screen = {"name": "screen", "type": "sphere", "radius": 0.05, "position": place.tolist(), "material": "white"}
    sensor = make_scene().sensor.model_dump() | {
        "origin": [1.2, 0.9, 1.2],
        "target": [0.1, 0.1, 0.1],
        "width": 48,
        "height": 36,
    }
    scene = make_scene(sensor=sensor, shapes=[ROOM, BALL, screen])
    without = make_scene(sensor=sensor, shapes=[ROOM, BALL])
    ball, _ = interior(scene, draw)
    made = draw(scene, "shadow.soft_talk", step_rad=0.0)[..., 0]
    lit = draw(scene, "shadow.soft", side=128)[..., 0]
    assert made[ball].max() == 1
    on_screen = (draw(scene, "raster.depth")[..., 0] < draw(without, "raster.depth")[..., 0] - 0.05) & ~ball
    assert on_screen.sum() > 2
    assert np.median(lit[on_screen]) > 0.9
    assert np.median(made[on_screen]) < 0.1


def test_a_subject_out_of_sight_casts_its_shadow(make_scene: MakeScene, draw: Draw) -> None:
    sensor = {"type": "perspective", "origin": [-0.2, -0.4, -0.4], "target": [-0.5, -1.25, -0.8], "fov_deg": 60.0}
    scene = make_scene(sensor=sensor | {"width": 12, "height": 12})
    assert draw(scene, "raster.coverage").max() == 0
    blurred, sharp = (draw(scene, "shadow.soft_talk", step_rad=step) for step in (0.2, 0.0))
    assert sharp.min() < 0.05
    assert 0.05 < blurred.min() < 0.95


def test_the_final_equation_on_the_character(make_scene: MakeScene, draw: Draw) -> None:
    """Where it faces the light: N.L colour + env_diffuse; where it does not: 0.8 env_diffuse."""
    crate = BALL | {"type": "box", "size": [0.5, 0.5, 0.5]}
    del crate["radius"], crate["detail"]
    sensor = make_scene().sensor.model_dump()
    for origin, lit in (([0.2, 0.3, 1.2], True), ([-1.2, 0.1, 0.1], False)):
        scene = make_scene(sensor=sensor | {"origin": origin}, shapes=[ROOM, crate])
        inside, _ = interior(scene, draw)
        normal = draw(scene, "raster.normal")
        face = inside & (np.abs(normal).max(axis=-1) > 0.999) & (np.abs(normal[..., 1]) < 0.5)
        assert face.sum() > 10
        whole, indirect = (draw(scene, name)[face] for name in ("lighting.talk", "indirect.talk"))
        if lit:
            to_light = np.array(LIGHT) - np.array([0.1, 0.0, 0.25])
            cosine = to_light[2] / np.linalg.norm(to_light)
            color = 6.0 / np.pi / np.sum((np.array(LIGHT) - np.array([0.1, 0.0, 0.0])) ** 2)
            middle = 0.6 * cosine * color
            assert np.median(whole[:, 0] - indirect[:, 0]) == pytest.approx(middle, rel=0.1)
        else:
            np.testing.assert_allclose(whole, 0.8 * indirect, rtol=0.02, atol=1e-3)


def test_the_room_gets_direct_light_times_alpha(make_scene: MakeScene, draw: Draw) -> None:
    """Against the same with a second light of next to nothing, because of which nothing casts a soft shadow."""
    point = make_scene().emitters[0].model_dump()
    sensor = {"type": "perspective", "origin": [-0.2, -0.4, -0.4], "target": [-0.5, -1.25, -0.8], "fov_deg": 60.0}
    scene, bare = (
        make_scene(sensor=sensor | {"width": 12, "height": 12}, emitters=lights)
        for lights in ([point], [point, point | {"intensity": [1e-9] * 3}])
    )
    alpha = draw(scene, "shadow.soft_talk")
    assert alpha.min() < 0.9
    np.testing.assert_allclose(draw(scene, "lighting.talk"), alpha * draw(bare, "lighting.talk"), rtol=1e-3)


def test_lamps_are_drawn_with_their_radiance(make_scene: MakeScene, draw: Draw) -> None:
    """Unclipped: 8 bits are the cube's."""
    up = make_scene().sensor.model_dump() | {"origin": [0.1, 0.5, 0.3], "target": [0.1, 1.2, 0.0], "fov_deg": 10.0}
    made = draw(make_scene(sensor=up, emitters=[LAMP]), "lighting.talk")
    np.testing.assert_allclose(made, 5.0)


def test_twice_the_light_is_twice_the_radiance(make_scene: MakeScene, draw: Draw) -> None:
    point = make_scene().emitters[0].model_dump()
    once = draw(make_scene(emitters=[point]), "lighting.talk")
    twice = draw(make_scene(emitters=[point | {"intensity": [12.0, 10.0, 8.0]}]), "lighting.talk")
    assert once.mean() > 0
    np.testing.assert_allclose(twice, 2 * once, rtol=1e-4)
