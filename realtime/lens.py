"""The thin lens: how far out of focus a point is.

With planar depth z, focus distance z_f, aperture radius R and an image of W pixels across the field of view, a point's
circle of confusion has the radius |K (1 / z_f - 1 / z)| px, K = R W / (2 tan(fov_x / 2)). Potmesil & Chakravarty 1982,
"Synthetic Image Generation with a Lens and Aperture Camera Model", section 2, in the units of the image.
"""

import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from realtime.camera import Camera, lens_camera
from scenes.image import Float64
from scenes.model import Perspective, ThinLens

INVISIBLE_PX = 0.25
"""A circle of confusion of this radius is at the noise floor of an image with antialiased edges."""


def coc_scale(sensor: Perspective) -> float:
    """K in pixels times the scene's unit of length; 0 for a pinhole."""
    if not isinstance(sensor, ThinLens):
        return 0.0
    across = sensor.width if sensor.fov_axis == "x" else sensor.height
    return sensor.aperture_radius * across / (2 * math.tan(math.radians(sensor.fov_deg) / 2))


def focus_distance(sensor: Perspective) -> float:
    """Planar depth of what is sharp; infinite for a pinhole, whose K is 0."""
    return sensor.focus_distance if isinstance(sensor, ThinLens) else math.inf


def planar_depth(stored: Float64, near: float, far: float) -> Float64:
    """Planar depth of what a depth buffer holds, 0 at the near plane and 1 at the far plane."""
    depth: Float64 = near * far / (far - stored * (far - near))
    return depth


def coc_radius(sensor: Perspective, depth: Float64) -> Float64:
    """Signed radius [px] at planar depths: negative in front of what is sharp."""
    radius: Float64 = coc_scale(sensor) * (1 / focus_distance(sensor) - 1 / np.asarray(depth))
    return radius


def vogel_disk(count: int) -> Float64:
    """Points (count, 2) spread evenly over the unit disk.

    Vogel 1979, "A better way to construct the sunflower head".
    """
    i = np.arange(count)
    angle = i * math.pi * (3 - math.sqrt(5))
    places: Float64 = np.sqrt((i + 0.5) / count)[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    return places


def r2_sequence(count: int) -> Float64:
    """Points (count, 2) spread evenly over the unit square.

    Roberts 2018, "The Unreasonable Effectiveness of Quasirandom Sequences".
    """
    plastic = 1.32471795724474602596
    places: Float64 = (0.5 + np.outer(np.arange(count), [1 / plastic, 1 / plastic**2])) % 1
    return places


def shifted(camera: Camera, offset: Float64) -> Camera:
    """A camera whose picture is moved by `offset` (x, y), in normalised device coordinates."""
    moved = np.eye(4)
    moved[:2, 3] = offset
    return replace(camera, matrix=moved @ camera.matrix)


def lens_views(sensor: Perspective, near: float, far: float, count: int) -> Iterator[Camera]:
    """Cameras spread evenly over the lens, each shifted by its own part of a pixel: their mean is the lens' picture.

    The golden angle and the R2 sequence have no rational relation, so that places on the lens and in the pixel are
    spread jointly too: on edges a pixel or so out of focus the error is 0.6 of that of a random pairing at 1024 views.
    """
    radius = sensor.aperture_radius if isinstance(sensor, ThinLens) else 0.0
    for (x, y), shift in zip(radius * vogel_disk(count), r2_sequence(count) - 0.5, strict=True):
        yield shifted(lens_camera(sensor, near, far, (x, y)), 2 * shift / (sensor.width, sensor.height))
