"""Where hair stands on a deformed skin: exact in float64, as images over the chart of the scene's first hair.

A pixel is a place of the chart, not of what the camera sees: see `scenes.grooming.film_uv`. `hair_geometry` is the tip
of the hair that is rooted there, in the world's axes about the position of the shape that it grows on, so that it is
the same for a shape far away. `hair_tangent` is the direction of growing u on the skin there.
"""

from collections.abc import Callable

import numpy as np

from reference.quantity import Integrator, Quantity
from reference.stage import Stage
from reference.strands import film_frames
from scenes.features import Features
from scenes.image import Float32
from scenes.model import Scene


def tips(scene: Scene, width: int, height: int) -> Float32:
    """(H, W, 3), in the scene's unit of length."""
    frames, shape = film_frames(scene, width, height)
    position = next(shape.position for shape in scene.shapes if shape.name == scene.hair[0].on)
    tip = frames.to_world(shape[:, 3:])[:, 0] - position
    return tip.reshape(height, width, 3).astype(np.float32)


def tangents(scene: Scene, width: int, height: int) -> Float32:
    """(H, W, 3), of unit length."""
    frames, _ = film_frames(scene, width, height)
    return frames.axes[:, 0].reshape(height, width, 3).astype(np.float32)


def refuses_without_hair(features: Features) -> str:
    """Why there is nothing to judge, or nothing."""
    return "" if features.has_hair else "the scene has no hair"


def _quantity(name: str, unit: str, summary: str, image: Callable[[Scene, int, int], Float32]) -> Quantity:
    def exact(stage: Stage) -> Float32:
        return image(stage.description, stage.width, stage.height)

    def integrator(features: Features) -> Integrator:
        return Integrator(
            "deformed frames in double precision",
            "where hair stands is a deterministic function of the skin: no light is transported",
            exact=exact,
        )

    return Quantity(name, unit, summary, "normal", 3, False, integrator, refuses=refuses_without_hair)


QUANTITIES = {
    q.name: q
    for q in (
        _quantity("hair_geometry", "length", "where the hair rooted at a place of the chart ends", tips),
        _quantity("hair_tangent", "1", "direction of growing u on the skin at a place of the chart", tangents),
    )
}
