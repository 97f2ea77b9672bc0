"""A scene somewhere else: the same things, seen in the same way."""

from collections.abc import Callable
from typing import Any

import numpy as np

from scenes.image import Float64
from scenes.model import Scene
from scenes.units import Vec3

POINTS = ("origin", "target", "position", "start", "end")
"""The fields of sensors, shapes and emitters that are points in space."""


def moved(scene: Scene, offset: Vec3) -> Scene:
    """Everything moved by `offset`."""
    return with_points_mapped(scene, lambda point: point + offset)


def with_points_mapped(scene: Scene, change: Callable[[Float64], Float64]) -> Scene:
    """Every point in space mapped by `change`; directions and sizes stay."""
    return scene.model_copy(
        update={
            "sensor": mapped(scene.sensor, POINTS, change),
            "shapes": tuple(mapped(shape, POINTS, change) for shape in scene.shapes),
            "emitters": tuple(mapped(light, POINTS, change) for light in scene.emitters),
        }
    )


def mapped(part: Any, names: tuple[str, ...], change: Callable[[Float64], Float64]) -> Any:
    """A sensor, shape or emitter with `change` applied to those of the fields that it has."""
    held = [name for name in names if name in type(part).model_fields]
    return part.model_copy(update={name: vec3(change(np.array(getattr(part, name)))) for name in held})


def vec3(values: Any) -> Vec3:
    """Three numbers as a scene holds them."""
    x, y, z = (float(value) for value in values)
    return x, y, z
