"""Scenes that are quick to draw: where many settings are looked for, most drawings are of these."""

from dataclasses import replace

from realtime.technique import Technique
from scenes.model import Scene
from scenes.shapes import DisplacedIcosphere, Ellipsoid, Shape, Sphere

SIDE = 32
"""Pixels along the longer side of an image."""

DETAIL = 4
"""Of balls, whose triangles are divided so often: 5120 of them."""

GRID = 2
"""Samples along each side of a pixel."""


def rough_scene(scene: Scene) -> Scene:
    """A scene with few pixels and triangles."""
    sensor = scene.sensor
    factor = min(1.0, SIDE / max(sensor.width, sensor.height))
    size = {name: max(1, round(factor * getattr(sensor, name))) for name in ("width", "height")}
    shapes = tuple(map(_rough_shape, scene.shapes))
    return scene.model_copy(update={"sensor": sensor.model_copy(update=size), "shapes": shapes})


def _rough_shape(shape: Shape) -> Shape:
    if isinstance(shape, Sphere | Ellipsoid | DisplacedIcosphere):
        return shape.model_copy(update={"detail": min(DETAIL, shape.detail)})
    return shape


def rough_technique(technique: Technique) -> Technique:
    """A technique with few samples."""
    return replace(technique, grid=min(GRID, technique.grid))
