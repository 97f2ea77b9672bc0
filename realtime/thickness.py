"""How far each sample's ray runs inside the subject: the talk's first pass, and sums, exact if it is closed."""

from __future__ import annotations

from typing import Any

import numpy as np

from realtime.frame import Frame, columns
from realtime.graph import Pass
from realtime.shader import set_uniforms
from scenes.errors import FlaggedPixels
from scenes.image import Float64
from scenes.mesh import Mesh

DEPTH_CLAMP = 0x864F
"""GL_DEPTH_CLAMP: without it, faces before the near and behind the far plane are cut away, and sums lose a part."""


def is_subject(mesh: Mesh) -> bool:
    """Whether a mesh belongs to what is judged."""
    return mesh.is_subject


def translation(vector: Float64) -> Float64:
    """The matrix (4, 4) that adds a vector (3,)."""
    matrix = np.eye(4)
    matrix[:3, 3] = vector
    return matrix


def centred_uniforms(frame: Frame) -> dict[str, Any]:
    """The camera as seen from the subject's centre, multiplied in float64: what glsl/translucency/centred.vert reads.

    The centre is rounded to float32 first, so that the shader subtracts exactly the one that the matrix adds.
    """
    centre = frame.subject_centre.astype(np.float32).astype(float)
    return {
        "centre": tuple(centre),
        "offset": tuple(centre - frame.camera.eye),
        "centred_to_clip": columns(frame.camera.matrix @ translation(centre)),
    }


def subject_diagonal(frame: Frame) -> float:
    """Of the subject's box: no ray is longer inside it."""
    low, high = frame.subject_box
    return float(np.linalg.norm(high - low))


def additive_passes(allow_open: bool) -> list[Pass]:
    """Write `thickness` of every sample: all layers, summed without an order.

    Where the subject's faces do not pair up along the ray there is no thickness; unless `allow_open` that is an error.
    """
    return [
        Pass("signed sums", _draw_sums, writes=("signed_sum",)),
        Pass("close sums", lambda frame: _close(frame, allow_open), reads=("signed_sum",), writes=("thickness",)),
    ]


def _draw_sums(frame: Frame) -> None:
    context = frame.context
    sums = frame.texture(frame.size, 2)
    framebuffer = context.framebuffer([sums])
    framebuffer.use()
    frame.submit(framebuffer.clear)
    context.enable_only(context.BLEND)
    context.blend_func = context.ONE, context.ONE
    context.enable_direct(DEPTH_CLAMP)
    shader = frame.program("translucency/centred.vert", "translucency/signed_sum.frag")
    set_uniforms(shader, **centred_uniforms(frame))
    frame.draw(shader, frame.camera, is_subject)
    context.disable_direct(DEPTH_CLAMP)
    frame.resources["signed_sum"] = sums


def _close(frame: Frame, allow_open: bool) -> None:
    sensor = frame.scene.sensor
    thickness = frame.texture(frame.size, 1)
    counts = frame.context.buffer(bytes(8))
    frame.resources["signed_sum"].use(0)
    thickness.bind_to_image(0, read=False, write=True)
    counts.bind_to_storage_buffer(0)
    frame.dispatch(
        frame.program("translucency/thickness.comp"),
        sensor.width,
        sensor.height,
        grid=frame.grid,
        centre_distance=float(np.linalg.norm(centred_uniforms(frame)["offset"])),
    )
    seen, unpaired = np.frombuffer(counts.read(), dtype=np.uint32)
    if unpaired and not allow_open:
        counted = frame.read("signed_sum", 2)[..., 1].reshape(sensor.height, frame.grid, sensor.width, frame.grid)
        raise FlaggedPixels(
            f"In {unpaired} of the {seen} pixels that see the subject of scene '{frame.scene.name}', front and back "
            "faces do not pair up, so there is no thickness: its mesh is open, or the camera is inside it. Close the "
            "mesh, move the camera, or accept those pixels with allow_open = true.",
            (counted != 0).any(axis=(1, 3)),
        )
    frame.resources["thickness"] = thickness


def talk_passes(half_float: bool) -> list[Pass]:
    """Write `back_position`, as published: the nearest back face, in half floats if so asked."""
    return [Pass("back faces", lambda frame: _draw_back_faces(frame, half_float), writes=("back_position",))]


def _draw_back_faces(frame: Frame, half_float: bool) -> None:
    frame.resources["back_position"] = draw_faces(
        frame,
        frame.program("raster/mesh.vert", "translucency/back_position.frag"),
        frame.texture(frame.size, 4, "f2" if half_float else "f4"),
        culled="front",
    )


def draw_faces(frame: Frame, shader: Any, target: Any, culled: str) -> Any:
    """Draw the subject's faces into a cleared texture; those nearest to the camera stay, of the side not `culled`."""
    context = frame.context
    framebuffer = context.framebuffer([target], context.depth_renderbuffer(frame.size))
    framebuffer.use()
    frame.submit(framebuffer.clear)
    context.enable_only(context.DEPTH_TEST | context.CULL_FACE)
    context.cull_face = culled
    frame.draw(shader, frame.camera, is_subject)
    context.cull_face = "back"
    return target
