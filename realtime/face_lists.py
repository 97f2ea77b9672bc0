"""All faces of the subject along the rays of a view, kept in no order: from the camera, and from each light.

Carpenter 1984, "The A-buffer, an Antialiased Hidden Surface Method", with lists of a fixed length.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from realtime.camera import Camera, basis_along, parallel_camera, perspective_matrix, unit, view_matrix
from realtime.frame import Frame, columns
from realtime.lights import PARALLEL, Light
from realtime.shader import set_uniforms
from realtime.thickness import DEPTH_CLAMP, centred_uniforms, is_subject, translation
from scenes.errors import InputError, RenderError
from scenes.image import Float64

if TYPE_CHECKING:
    import moderngl


@dataclass(frozen=True)
class Faces:
    """All faces of the subject along the rays of a view: how many (a texture), and which (a buffer of vec4)."""

    counts: moderngl.Texture
    faces: moderngl.Buffer


@dataclass(frozen=True)
class View:
    """A view of the subject by parallel rays along `axis`, or from a point.

    `centred_to_clip` takes points seen from the subject's centre to clip space; seen from the view, it is at `offset`.
    The view holds a ball of `radius` about the centre.
    """

    camera: Camera
    offset: Float64
    centred_to_clip: Float64
    axis: Float64
    is_parallel: bool
    radius: float

    def uniforms(self) -> dict[str, Any]:
        """What glsl/translucency/view.glsl reads."""
        return {
            "view_to_clip": columns(self.centred_to_clip),
            "view_offset": tuple(self.offset),
            "view_axis": tuple(self.axis),
            "view_is_parallel": self.is_parallel,
        }


STEEPEST = 4.0
"""A listed face's distance changes by this many texels a texel at most: steeper ones are seen from the side, and half a
texel beyond their edge the plane that they lie in is nowhere near the subject.
"""


def list_view_faces(frame: Frame, view: View, side: int, layers: int) -> Faces:
    """Faces of the subject along side x side rays of a view."""
    return list_faces(
        frame,
        view.camera,
        (side, side),
        layers,
        centre=centred_uniforms(frame)["centre"],
        centred_to_clip=columns(view.centred_to_clip),
        offset=tuple(view.offset),
        axis=tuple(view.axis),
        is_parallel=view.is_parallel,
        steepest=STEEPEST * 2 * view.radius / side,
    )


def list_camera_faces(frame: Frame, layers: int) -> Faces:
    """Faces of the subject along the ray of each sample."""
    return list_faces(frame, frame.camera, frame.size, layers, is_parallel=False, **centred_uniforms(frame))


def list_faces(frame: Frame, camera: Camera, size: tuple[int, int], layers: int, **uniforms: Any) -> Faces:
    """Faces of the subject along the rays of a camera; `uniforms` are those of glsl/translucency/faces.frag.

    Raises
    ------
    InputError
        The lists are longer than this GPU's buffers.
    RenderError
        A ray meets more faces than `layers` has room for.
    """
    context, slots = frame.context, 2 * layers
    width, height = size
    needed, allowed = 16 * slots * width * height, int(context.info["GL_MAX_SHADER_STORAGE_BLOCK_SIZE"])
    if needed > allowed:
        raise InputError(
            f"Lists of {slots} faces for {width} x {height} rays take {needed >> 20} MiB; this GPU allows "
            f"{allowed >> 20} MiB. Lower layers, light_side, or the sensor's width and height."
        )
    counts = context.texture(size, 1, bytes(4 * width * height), dtype="u4")
    faces = context.buffer(reserve=needed)
    framebuffer = context.framebuffer([context.texture(size, 1)])
    framebuffer.use()
    # Nothing is blended, but Mesa's llvmpipe drops what an opaque triangle covers, and with it what lists the faces.
    context.enable_only(context.BLEND)
    context.enable_direct(DEPTH_CLAMP)
    counts.bind_to_image(0)
    faces.bind_to_storage_buffer(1)
    shader = frame.program("translucency/centred.vert", "translucency/faces.frag", SLOTS=slots)
    set_uniforms(shader, **uniforms)
    frame.draw(shader, camera, is_subject)
    context.disable_direct(DEPTH_CLAMP)
    frame.submit(context.memory_barrier)
    deepest = context.buffer(bytes(4))
    deepest.bind_to_storage_buffer(0)
    frame.dispatch(frame.program("translucency/deepest.comp"), width, height)
    most = int(np.frombuffer(deepest.read(), dtype=np.uint32)[0])
    if most > slots:
        raise RenderError(
            f"A ray meets {most} faces of the subject of scene '{frame.scene.name}'; layers = {layers} has room "
            f"for {slots}. Set layers to {-(-most // 2)}."
        )
    return Faces(counts, faces)


def parallel_view(axis: Float64, centre: Float64, radius: float) -> View:
    """A view along a unit vector (3,) that holds a ball."""
    camera = parallel_camera(axis, centre, radius)
    return View(camera, centre - camera.eye, camera.matrix @ translation(centre), axis, True, radius)


def light_view(light: Light, centre: Float64, radius: float) -> View:
    """A view from a light that holds a ball.

    Raises
    ------
    InputError
        The light is inside the ball.
    """
    if light.kind == PARALLEL:
        return parallel_view(light.axis, centre, radius)
    offset = centre - light.place
    distance = float(np.linalg.norm(offset))
    if distance <= 1.01 * radius:
        raise InputError(
            f"A light at {np.round(light.place, 3)} is {distance:g} from the subject's centre, inside the ball of "
            f"radius {radius:g} around it; translucency.ordinates sees the subject from each light. Move the light out."
        )
    forward = unit(offset)
    right, up = basis_along(forward)
    tangent = radius / np.sqrt(distance**2 - radius**2)
    projection = perspective_matrix(tangent, tangent, distance - radius, distance + radius)
    camera = Camera(light.place, projection @ view_matrix(light.place, forward, right, up), forward)
    return View(camera, offset, camera.matrix @ translation(centre), forward, False, radius)
