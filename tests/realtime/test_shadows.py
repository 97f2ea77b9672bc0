"""Shadows of the captured surroundings, by scenes in which everything that could shine is shaded."""

from collections.abc import Callable
from typing import Any

import pytest

from scenes.image import Float32
from scenes.model import Scene

Draw = Callable[..., Float32]
MakeScene = Callable[..., Scene]

LEVEL = {"type": "rectangle", "rotation_deg": [-90.0, 0.0, 0.0], "material": "white"}
FLOOR = LEVEL | {"name": "floor", "size": [1.0, 1.0]}
BALL = {"name": "ball", "type": "sphere", "radius": 0.08, "detail": 3, "position": [0.0, 0.15, 0.0], "material": "skin"}
CEILING = LEVEL | {"name": "ceiling", "size": [4.0, 4.0], "position": [0.0, 0.3, 0.0]}
VIEW = {"origin": [0.5, 0.2, 0.3], "target": [0.0, 0.15, 0.0], "fov_deg": 12.0}
COARSE = {"side": 48, "block": 6}
LIGHTS: dict[str, dict[str, Any]] = {
    "point": {"type": "point", "position": [0.1, 1.3, 0.2], "intensity": [1.0, 1.0, 1.0]},
    "point close to what it lights": {"type": "point", "position": [0.1, 0.4, 0.1], "intensity": [1.0, 1.0, 1.0]},
    "sun": {"type": "directional", "direction": [0.3, -1.0, 0.2], "irradiance": [1.0, 1.0, 1.0]},
    "disk": {"type": "disk", "position": [0.1, 1.3, 0.2], "normal": [0, -1, 0], "radius": 0.2, "radiance": [3.0] * 3},
}


@pytest.mark.parametrize(
    "name",
    [
        "indirect.irradiance",
        "indirect.probe",
    ],
)
@pytest.mark.parametrize("light", LIGHTS)
def test_below_a_panel_that_shades_everything_it_is_dark(
    make_scene: MakeScene, draw: Draw, name: str, light: str
) -> None:
    """The panel is lit from above, but its lower side reflects nothing."""
    sensor = make_scene().sensor.model_dump() | VIEW
    below = draw(make_scene(sensor=sensor, shapes=[FLOOR, BALL, CEILING], emitters=[LIGHTS[light]]), name, **COARSE)
    in_the_open = draw(make_scene(sensor=sensor, shapes=[FLOOR, BALL], emitters=[LIGHTS[light]]), name, **COARSE)
    assert in_the_open.mean() > 0
    assert below.max() < 1e-4 * in_the_open.max()


@pytest.mark.parametrize("light", LIGHTS)
@pytest.mark.parametrize("shadow_side", [64, 256])
def test_a_floor_does_not_shade_itself(
    make_scene: MakeScene, draw: Draw, light: str, shadow_side: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Against the same with shadow maps that nothing is drawn into.

    All that may be missing is the shadow of the ball: (radius / height)², 0.4 % of the floor as the ball sees it.
    """
    sensor = make_scene().sensor.model_dump() | VIEW | {"fov_deg": 1.5}
    scene = make_scene(sensor=sensor, shapes=[FLOOR, BALL | {"radius": 0.01, "detail": 2}], emitters=[LIGHTS[light]])
    shaded = draw(scene, "indirect.probe", shadow_side=shadow_side, **COARSE)
    monkeypatch.setattr("realtime.shadows._cameras", lambda frame, light: ())
    assert shaded.mean() == pytest.approx(
        draw(scene, "indirect.probe", shadow_side=shadow_side, **COARSE).mean(), rel=0.01
    )
