"""Depth maps of lights that look at the eye: what stands in the way, the eye itself left out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from realtime.camera import Camera, basis_along, orthographic_matrix, perspective_matrix, unit, view_matrix
from realtime.eye import EyeModel
from realtime.frame import Frame
from scenes.image import Float64
from scenes.mesh import Mesh

if TYPE_CHECKING:
    import moderngl


@dataclass(frozen=True)
class EyeShadows:
    """`maps` holds a square tile for each camera, side by side: the depth along its axis from its eye."""

    maps: moderngl.Texture
    cameras: tuple[Camera, ...]


def casts_shadow(mesh: Mesh) -> bool:
    """Whether a mesh may stand between a light and the eye: it is neither of the subject nor a lamp."""
    return not mesh.is_subject and mesh.radiance is None


def draw_eye_shadows(
    frame: Frame, model: EyeModel, centre: Float64, places: Sequence[tuple[float, ...]], side: int
) -> EyeShadows:
    """`places` are those of the lights in world space, or the directions to them where the fourth number is 0."""
    context = frame.context
    maps = frame.texture((side * len(places), side), 1)
    framebuffer = context.framebuffer([maps], context.depth_renderbuffer(maps.size))
    framebuffer.use()
    frame.submit(framebuffer.clear, red=3e38)
    context.enable_only(context.DEPTH_TEST)
    shader = frame.program("raster/mesh.vert", "raster/distance.frag")
    shader["parallel"] = True
    cameras = tuple(_camera(frame, model, centre, np.array(place)) for place in places)
    for tile, camera in enumerate(cameras):
        framebuffer.viewport = (tile * side, 0, side, side)
        frame.draw(shader, camera, casts_shadow)
    return EyeShadows(maps, cameras)


def _camera(frame: Frame, model: EyeModel, centre: Float64, place: Float64) -> Camera:
    """A camera at a light whose image just holds the eye; for parallel light one outside of the scene."""
    radius = max(model.apex, model.sclera_radius)
    middle, extent = frame.bounds
    outside = centre + (float(np.linalg.norm(centre - middle)) + 1.01 * extent) * unit(place[:3])
    origin = place[:3] if place[3] else outside
    distance = float(np.linalg.norm(centre - origin))
    forward = unit(centre - origin)
    if place[3]:
        tangent = radius / np.sqrt(max(distance**2 - radius**2, 1e-6 * radius**2))
        projection = perspective_matrix(tangent, tangent, 1e-3 * distance, distance + radius)
    else:
        projection = orthographic_matrix(radius, 0.0, distance + radius)
    return Camera(origin, projection @ view_matrix(origin, forward, *basis_along(forward)), forward)
