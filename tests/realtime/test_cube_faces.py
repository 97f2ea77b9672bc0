"""Each technique that captures a cube must know which way its six faces look."""

from collections.abc import Callable

import numpy as np
import pytest

from scenes.image import Float32
from scenes.model import Scene

WALLS = (("left", "right"), ("floor", "ceiling"), ("back", "front"))


@pytest.mark.parametrize("name", ["indirect.talk", "indirect.probe", "indirect.irradiance"])
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
    radiance, facing = draw(scene, name)[seen][:, 0], sign * draw(scene, "raster.normal")[seen][:, axis]
    assert np.corrcoef(radiance, np.maximum(facing, 0))[0, 1] > 0.85
    assert radiance[facing < -0.6].max() < 0.15 * radiance.max()
