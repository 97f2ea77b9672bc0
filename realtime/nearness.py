"""How close to a place the first surface may be: near planes that hide nothing."""

from collections.abc import Iterable

import numpy as np

from scenes.image import Float64

Box = tuple[Float64, Float64]
"""Lowest and highest corner."""

OF_SIZE = 1e-3
"""Closer to a place than this part of its radius nothing is drawn of what surrounds that place: thinner than what
stands so close to a camera or a light.
"""

OFF_AXIS = 1 / 8
"""Over its distance, the planar depth of what is seen farthest off an axis: at 83 degrees."""


def near_plane(boxes: Iterable[Box], place: Float64, radius: float) -> float:
    """Planar depth before which nothing is drawn around a place, in a scene of this radius whose meshes fill `boxes`.

    It is OF_SIZE of the radius, so that depth is fine where most is seen; but nothing is cut away that is farther from
    the place than OF_SIZE of its own box's radius, so that one thing far off, which makes the scene's radius large,
    does not make all else vanish.
    """
    return min([OF_SIZE * radius, *(_closest(box, place) for box in boxes)])


def _closest(box: Box, place: Float64) -> float:
    low, high = box
    distance = float(np.linalg.norm(np.maximum(np.maximum(low - place, place - high), 0)))
    return max(OFF_AXIS * distance, OF_SIZE * float(np.linalg.norm(high - low)) / 2)
