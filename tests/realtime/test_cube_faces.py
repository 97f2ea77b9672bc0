"""Every technique that captures a cube must know which way its six faces look, and where it stands."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from scenes.image import Float32, Float64
from scenes.model import Scene

FAST = {name: {"side": 24, "block": 3, "shadow_side": 64} for name in ("indirect.probe", "indirect.irradiance")}
TECHNIQUES = pytest.mark.parametrize("name", ["indirect.talk", "indirect.probe", "indirect.irradiance"])
WALLS = (("left", "right"), ("floor", "ceiling"), ("back", "front"))


@TECHNIQUES
@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize("sign", [-1, 1])
def test_a_point_is_lit_by_the_wall_that_it_faces(
    make_scene: Callable[..., Scene], draw: Callable[..., Float32], name: str, axis: int, sign: int
) -> None:
    """One wall reflects and all others are black: a face that is turned, mirrored or exchanged lights other points."""
    room = {"name": "room", "type": "room", "size": [3.0] * 3, "material": "black"}
    origin, light = np.full(3, -0.05), np.zeros(3)
    origin[(axis + 1) % 3], light[(axis + 1) % 3], light[(axis + 2) % 3] = 1.4, 0.8, 0.8
    view = {"origin": origin.tolist(), "target": [0.0] * 3, "up": [0.6, 0.5, 0.4], "fov_deg": 28.0}
    reflectances = {"white": 0.8, "black": 0.0, "skin": 0.6}
    scene = make_scene(
        sensor=make_scene().sensor.model_dump() | view,
        materials={n: {"type": "diffuse", "reflectance": [r] * 3} for n, r in reflectances.items()},
        shapes=[
            room | {"walls": {WALLS[axis][sign > 0]: "white"}},
            {"name": "ball", "type": "sphere", "radius": 0.3, "detail": 3, "material": "skin"},
        ],
        emitters=[{"type": "point", "position": light.tolist(), "intensity": [5.0] * 3}],
    )
    seen = draw(scene, "raster.coverage")[..., 0] == 1
    radiance, facing = (
        draw(scene, name, **FAST.get(name, {}))[seen][:, 0],
        sign * draw(scene, "raster.normal")[seen][:, axis],
    )
    assert np.corrcoef(radiance, np.maximum(facing, 0))[0, 1] > 0.85
    assert radiance[facing < -0.6].max() < 0.15 * radiance.max()


def moved(thing: dict[str, Any], by: Float64) -> dict[str, Any]:
    """Everything in a table of a scene that is a place."""
    return {
        key: (np.array(value) + by).tolist() if key in ("position", "origin", "target") else value
        for key, value in thing.items()
    }


@TECHNIQUES
@pytest.mark.parametrize(
    "light",
    [
        {"type": "point", "position": [0.7, 0.9, 0.8], "intensity": [5.0, 4.0, 3.0]},
        {"type": "directional", "direction": [0.4, -1.0, -0.3], "irradiance": [2.0, 1.8, 1.5]},
        {
            "type": "disk",
            "position": [-0.6, 1.1, 0.3],
            "normal": [0.2, -1.0, 0.1],
            "radius": 0.2,
            "radiance": [3.0] * 3,
        },
    ],
    ids=["point", "sun", "disk"],
)
def test_moving_the_whole_scene_changes_nothing(
    make_scene: Callable[..., Scene], draw: Callable[..., Float32], name: str, light: dict[str, Any]
) -> None:
    shapes: list[dict[str, Any]] = [
        {"name": "ball", "type": "sphere", "radius": 0.3, "detail": 3, "position": [0.1, 0.0, 0.0], "material": "skin"},
        {"name": "floor", "type": "rectangle", "size": [5.0, 4.0], "position": [0.0, -0.5, 0.0], "material": "red"},
        {"name": "wall", "type": "rectangle", "size": [5.0, 4.0], "position": [0.0, 0.0, -1.0], "material": "white"},
    ]
    shapes[1]["rotation_deg"] = [-90.0, 0.0, 0.0]
    here = make_scene(shapes=shapes, emitters=[light])
    by = np.array([1.7, -0.9, 2.6])
    sensor = moved(here.sensor.model_dump(), by)
    there = make_scene(sensor=sensor, shapes=[moved(s, by) for s in shapes], emitters=[moved(light, by)])
    first, second = draw(here, name, side=48), draw(there, name, side=48)
    assert first.max() > 0
    np.testing.assert_allclose(second, first, atol=0.01 * first.max())
