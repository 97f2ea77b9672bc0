"""Near planes that hide nothing, and an origin near what is seen."""

from collections.abc import Callable

import numpy as np
import pytest

from realtime.nearness import near_plane
from realtime.origin import FAR_OFF, near_origin
from realtime.render import Renderer
from realtime.techniques import technique
from scenes.image import Float64
from scenes.model import Scene
from scenes.placing import moved

MakeScene = Callable[..., Scene]
HERE = np.zeros(3)


def box(low: float, high: float) -> tuple[Float64, Float64]:
    return np.full(3, low), np.full(3, high)


def test_a_room_around_a_place_has_the_near_plane_of_its_size() -> None:
    assert near_plane([box(-2, 2)], HERE, 5.0) == pytest.approx(1e-3 * np.sqrt(12))
    assert near_plane([], HERE, 5.0) == pytest.approx(5e-3)


@pytest.mark.parametrize("size", [1e2, 1e4, 1e7])
def test_something_far_off_does_not_move_it_past_what_is_close(size: float) -> None:
    """You should see the near plane before the ball, however large the scene is."""
    ball, far_off = box(1, 2), box(size, size + 1)
    near = near_plane([ball, far_off], HERE, size)
    assert 0 < near <= np.sqrt(3) / 8
    assert near == pytest.approx(min(1e-3 * size, np.sqrt(3) / 8))


@pytest.mark.usefixtures("gl")
def test_a_far_thing_hides_nothing(make_scene: MakeScene) -> None:
    card = {"name": "card", "type": "rectangle", "size": [1.0, 1.0], "material": "red"}
    there = [dict(shape) for shape in make_scene().model_dump(include={"shapes"}, mode="json")["shapes"]]
    images = [
        Renderer(make_scene(shapes=shapes)).render(technique("raster.depth"), {}, timed=False).image.pixels
        for shapes in (there, [*there, card | {"position": [0.0, 0.0, -1e6]}])
    ]
    assert images[0].min() > 0.5
    np.testing.assert_allclose(images[1], images[0], rtol=1e-4)


def test_the_origin_moves_only_to_what_is_far_off(make_scene: MakeScene) -> None:
    scene = make_scene()
    assert near_origin(scene) is scene
    distance = float(np.linalg.norm(np.subtract(scene.sensor.target, scene.sensor.origin)))
    far_off = near_origin(moved(scene, (2 * FAR_OFF * distance, 0.0, 0.0)))
    assert np.linalg.norm(far_off.sensor.target) < 1e-12
    before, after = (np.subtract(s.emitters[0].position, s.sensor.origin) for s in (scene, far_off))  # type: ignore[union-attr]
    np.testing.assert_allclose(after, before, atol=1e-9)
