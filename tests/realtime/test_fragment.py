"""A technique from one fragment shader: its card, what it is given, and what is refused."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from realtime.graph import Skip
from realtime.own import load_own
from realtime.render import Renderer, Rendering, plan_of
from realtime.techniques import OWN, technique
from scenes.errors import InputError
from scenes.features import features_of
from scenes.geometry import geometry_of
from scenes.image import Float32
from scenes.model import Scene

CARD = """\
/*
name = "mine.shade"
approximates = "radiance"
summary = "for tests"
source = "nobody"
limits = "all"

[parameters.level]
default = 0.5
sweep = [0.25, 1]
bounds = [0.0, 2.0]
summary = "how bright"
*/
#version 430
#include "own/interface.glsl"
uniform float level;
void main() {
    color = vec4(BODY);
}
"""
BRIGHT_SKY: list[dict[str, Any]] = [{"type": "constant", "radiance": [0.25, 0.5, 1.0]}]


@pytest.fixture
def load(tmp_path: Path, techniques_forgotten: None) -> Callable[..., Path]:
    """Writes CARD with some of its text replaced and loads it; it is forgotten after the test."""

    def loaded(body: str = "level", *changes: tuple[str, str]) -> Path:
        text = CARD.replace("BODY", body)
        for old, new in changes:
            assert old in text
            text = text.replace(old, new)
        path = tmp_path / "shade.frag"
        path.write_text(text, encoding="utf-8")
        load_own(path)
        return path

    return loaded


def rendered(scene: Scene, **settings: Any) -> Rendering:
    return Renderer(scene).render(technique("mine.shade"), settings, timed=False)


def drawn(scene: Scene, **settings: Any) -> Float32:
    return rendered(scene, **settings).image.pixels


@pytest.fixture
def subject(make_scene: Callable[..., Scene]) -> tuple[Scene, Any]:
    """The small room, and its pixels that the ball covers completely."""
    scene = make_scene()
    coverage = Renderer(scene).render(technique("raster.coverage"), {}, timed=False).image.pixels
    return scene, coverage[..., 0] == 1


def refusal(load: Callable[..., Path], *arguments: Any) -> str:
    with pytest.raises(InputError) as refused:
        load(*arguments)
    return str(refused.value)


def test_the_card_is_the_technique(load: Callable[..., Path]) -> None:
    load()
    found = technique("mine.shade")
    assert (found.approximates, found.summary, found.source, found.limits) == ("radiance", "for tests", "nobody", "all")
    assert (found.channels, found.grid) == ((0, 1, 2), 2)
    (level,) = found.parameters
    assert (level.name, level.default, level.bounds, level.summary) == ("level", 0.5, (0.0, 2.0), "how bright")
    assert level.sweep == (0.25, 1.0)
    assert all(isinstance(value, float) for value in level.sweep)


def test_a_parameter_is_a_uniform_and_only_the_subject_is_drawn(
    load: Callable[..., Path], subject: tuple[Scene, Any]
) -> None:
    load()
    scene, covered = subject
    assert np.all(drawn(scene)[covered] == 0.5)
    assert np.all(drawn(scene, level=2)[covered] == 2.0)
    corner = drawn(scene)[0, 0]
    assert np.all(corner == 0.0), "there the room is seen, which is not part of the subject"


def test_everything_is_drawn_where_the_card_says_so(
    load: Callable[..., Path], make_scene: Callable[..., Scene]
) -> None:
    load("level * is_subject, level, 0.0, 1.0", ("limits", 'draws = "everything"\nlimits'))
    image = drawn(make_scene())
    assert np.all(image[0, 0] == (0.0, 0.5, 0.0))
    assert np.all(image[..., 1] == 0.5)
    assert np.any(image[..., 0] == 0.5)


def test_behind_everything_is_the_sky(load: Callable[..., Path], make_scene: Callable[..., Scene]) -> None:
    load("level", ("limits", 'draws = "everything"\nlimits'))
    alone = make_scene(
        emitters=BRIGHT_SKY, shapes=[{"name": "ball", "type": "sphere", "radius": 0.2, "material": "skin"}]
    )
    assert np.all(drawn(alone)[0, 0] == (0.25, 0.5, 1.0))


@pytest.mark.parametrize(
    ("body", "name"),
    [
        ("normalize(normal) * (2.0 * level), 1.0", "raster.normal"),
        ("albedo() * (2.0 * level), 1.0", "raster.albedo"),
    ],
)
def test_what_the_interface_gives_is_what_the_rasteriser_sees(
    load: Callable[..., Path], make_scene: Callable[..., Scene], body: str, name: str
) -> None:
    load(body, ("limits", 'draws = "everything"\ngrid = 8\nlimits'))
    scene = make_scene()
    expected = Renderer(scene).render(technique(name), {}, timed=False).image.pixels
    assert expected.any()
    assert np.array_equal(drawn(scene), expected)


def test_lamps_emit_and_walls_do_not(load: Callable[..., Path], make_scene: Callable[..., Scene]) -> None:
    load("emitted() * (2.0 * level), 1.0", ("limits", 'draws = "everything"\nlimits'))
    image = drawn(make_scene(emitters=[{"type": "area", "shape": "ball", "radiance": [3.0, 2.0, 1.0]}]))
    assert np.all(image.max(axis=(0, 1)) == (3.0, 2.0, 1.0))
    assert not image[0, 0].any()


def test_places_are_in_the_world(load: Callable[..., Path], subject: tuple[Scene, Any]) -> None:
    scene, covered = subject
    load("position * (2.0 * level), 1.0")
    places = drawn(scene)[covered]
    assert np.allclose(np.linalg.norm(places - (0.1, 0.0, 0.0), axis=1), 0.3, atol=3e-3), "on a ball of radius 0.3"
    load("eye * (2.0 * level), 1.0")
    assert np.allclose(drawn(scene)[covered], (0.2, 0.3, 1.2))
    load("(subject_high - subject_low) * (2.0 * level), 1.0")
    assert np.allclose(drawn(scene)[covered], 0.6, atol=0.01)
    load("(scene_high - scene_low) * (2.0 * level), 1.0")
    assert np.allclose(drawn(scene)[covered], (3.0, 2.5, 3.0))


def test_lights_come_with_their_shadows(load: Callable[..., Path], make_scene: Callable[..., Scene]) -> None:
    """The formula of a point light, and darkness where a wall stands in its way."""
    lit = ('#include "own/interface.glsl"', '#include "own/interface.glsl"\n#include "own/lights.glsl"')
    load("direct_irradiance(position, normalize(normal)) * (2.0 * level), 1.0", lit, ("limits", "grid = 1\nlimits"))
    light = {"type": "point", "position": [0.1, 0.0, 1.1], "intensity": [2.0, 2.0, 2.0]}
    scene = make_scene(emitters=[light])
    brightest = drawn(scene).max()
    assert brightest == pytest.approx(2.0 / 0.8**2, rel=0.03), "right below the lamp, 0.8 from it"
    shutter = {
        "name": "shutter",
        "type": "rectangle",
        "size": [1.0, 1.0],
        "position": [0.1, 0.0, 0.9],
        "material": "red",
    }
    room, ball = (
        {"name": "room", "type": "room", "size": [3.0, 2.5, 3.0], "material": "white"},
        {"name": "ball", "type": "sphere", "radius": 0.3, "position": [0.1, 0.0, 0.0], "material": "skin"},
    )
    assert drawn(make_scene(emitters=[light], shapes=[room, ball, shutter])).max() == 0.0
    names = [parameter.name for parameter in technique("mine.shade").parameters]
    assert names == ["level", "shadow_side", "facets"]


def test_what_the_shader_does_not_include_is_not_prepared(
    load: Callable[..., Path], make_scene: Callable[..., Scene]
) -> None:
    load()
    scene = make_scene()
    passes = [
        step.name for step in plan_of(technique("mine.shade"), scene, features_of(scene, geometry_of(scene)), {}).passes
    ]
    assert passes == ["shade", "resolve"]


def test_without_lights_there_is_no_shadow_map(load: Callable[..., Path], make_scene: Callable[..., Scene]) -> None:
    load(
        "direct_irradiance(position, normal) + level, 1.0",
        ('interface.glsl"', 'interface.glsl"\n#include "own/lights.glsl"'),
    )
    found = rendered(make_scene(emitters=BRIGHT_SKY))
    assert Skip("shadow atlas", "no emitter but the sky: nothing casts a shadow map") in found.skipped
    assert found.image.pixels.max() == 0.5


def test_the_sky_is_seen_in_a_direction(load: Callable[..., Path], make_scene: Callable[..., Scene]) -> None:
    load("sky_radiance(normal) * (2.0 * level), 1.0", ('interface.glsl"', 'interface.glsl"\n#include "own/sky.glsl"'))
    assert np.allclose(drawn(make_scene(emitters=BRIGHT_SKY)).max(axis=(0, 1)), (0.25, 0.5, 1.0))


def test_a_quantity_of_one_channel_takes_the_first(load: Callable[..., Path], make_scene: Callable[..., Scene]) -> None:
    load("level, 9.0, 9.0, 9.0", ("limits", "channels = 1\nlimits"))
    image = drawn(make_scene())
    assert image.shape == (12, 16, 1)
    assert image.max() == 0.5


@pytest.mark.parametrize(("kind", "default", "given", "seen"), [("int", "3", 4, 4.0), ("bool", "true", False, 0.0)])
def test_whole_numbers_and_truth_values_are_parameters_too(
    load: Callable[..., Path], make_scene: Callable[..., Scene], kind: str, default: str, given: Any, seen: float
) -> None:
    sweep = "true, false" if kind == "bool" else "3, 4"
    bounds = "" if kind == "bool" else "bounds = [0, 9]"
    load(
        "float(level)",
        ("uniform float", f"uniform {kind}"),
        ("default = 0.5", f"default = {default}"),
        ("0.25, 1", sweep),
        ("bounds = [0.0, 2.0]", bounds),
    )
    assert drawn(make_scene()).max() == (1.0 if kind == "bool" else 3.0)
    assert drawn(make_scene(), level=given).max() == seen


@pytest.mark.usefixtures("techniques_forgotten")
def test_a_file_called_glsl_is_a_fragment_shader_too(make_scene: Callable[..., Scene], tmp_path: Path) -> None:
    (tmp_path / "other.glsl").write_text(
        CARD.replace("BODY", "level").replace("mine.shade", "mine.other"), encoding="utf-8"
    )
    load_own(tmp_path / "other.glsl")
    assert Renderer(make_scene()).render(technique("mine.other"), {}, timed=False).image.pixels.max() == 0.5


@pytest.mark.parametrize(
    ("change", "line", "said"),
    [
        (("#version 430", ""), None, "found no #version line"),
        (("/*", "//"), 1, "found no card"),
        (('"for tests"', "for tests"), 4, "the card is no valid TOML: invalid value"),
        (('name = "mine.shade"\n', ""), 1, "name: is missing. A card has name, approximates"),
        (("limits", "limit"), 6, "limit: is an unknown key"),
        (("limits", 'draws = "all"\nlimits'), 6, "draws: found 'all'; it must be 'subject' or 'everything'"),
        (("limits", "grid = 9\nlimits"), 6, "grid: found 9; it must be less than or equal to 8"),
        (("limits", "channels = 4\nlimits"), 6, "channels: found 4"),
        (("default = 0.5", 'default = "dim"'), 9, "parameters.level.default: found 'dim'; a number or a truth value"),
        (("default = 0.5", "default = 5.0"), 8, "parameters.level: default and sweep must lie within bounds"),
        (("[0.25, 1]", "[0.25, true]"), 8, "parameters.level: every value of sweep must be a float, as default is"),
        (("[0.0, 2.0]", "[0.0, 2.0]\ntuned = [0.5, 3.0]"), 8, "parameters.level: tuned is the least and the most"),
        (("[0.0, 2.0]", "[0.0]"), 11, "parameters.level.bounds.1: is missing"),
        (("parameters.level", "parameters.eye"), None, "the parameter 'eye' has a name that lightgauge uses itself"),
        (("own/interface", "own/interfaces"), 15, "the included file 'own/interfaces.glsl' is neither in"),
    ],
)
def test_a_faulty_card_is_named_with_its_line(
    load: Callable[..., Path], change: tuple[str, str], line: int | None, said: str
) -> None:
    message = refusal(load, "level", change)
    assert said in message
    assert f"shade.frag:{line}: " in message if line else "shade.frag: " in message
    assert OWN == {}


@pytest.mark.parametrize(
    ("body", "change", "said"),
    [
        ("undeclared", ("level", "level"), "shade.frag:18: error: `undeclared' undeclared"),
        ("levle", ("uniform float level", "uniform float levle"), "nothing gives the uniform 'levle' a value"),
        ("1.0", ("level", "level"), "the parameter 'level' changes nothing"),
        ("float(level)", ("uniform float", "uniform int"), "the uniform 'level' is of another type than its default"),
        ("level[1]", ("float level", "float level[2]"), "the uniform 'level' is of another type than its default"),
    ],
)
def test_a_shader_that_does_not_go_with_its_card_is_refused(
    load: Callable[..., Path], make_scene: Callable[..., Scene], body: str, change: tuple[str, str], said: str
) -> None:
    load(body, change)
    with pytest.raises(InputError) as refused:
        rendered(make_scene())
    assert said in str(refused.value)
