"""A relief as polygons that show a displacement map, as the talk and its rival draw it: the block's box."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from realtime.frame import TEXTURE_UNIT, Frame, columns
from realtime.lights import light_rows
from realtime.relief import field_of, grid_to_world, reflectance_of, the_relief
from realtime.shader import set_uniforms
from scenes.errors import InputError
from scenes.geometry import heights_of
from scenes.image import Float32, Float64
from scenes.procedural import normalised, rotation_xyz
from scenes.shapes import Relief

if TYPE_CHECKING:
    import moderngl

LIMITS = (
    "As published: flat polygons with displaced lookups, lit where the polygon is and never in shadow. Silhouettes are "
    "those of the block's box."
)


def draw_polygons(frame: Frame, fragment_shader: str, *, shows_uv: bool, **given: Any) -> None:
    """Draw the relief's box into `shaded`. Of `given`, names in capitals are defines, the others uniforms.

    Raises
    ------
    InputError
        The camera is inside the box, whose polygons are seen from outside alone.
    """
    context, shape = frame.context, the_relief(frame.scene)
    field = field_of(frame, shape)
    box_to_world = grid_to_world(shape, field.cells) @ np.diag([*field.cells, 1.0, 1.0])
    _require_outside(frame, shape, (np.linalg.inv(box_to_world) @ (*frame.camera.eye, 1.0))[:3])
    defines = {name: value for name, value in given.items() if name.isupper()} | ({"UV": 1} if shows_uv else {})
    shader = frame.program("displacement/talk.vert", fragment_shader, **defines)
    field.heights.use(1)
    lights = {} if shows_uv else _bind_lit(frame)
    shaded = frame.texture(frame.size, 4)
    framebuffer = context.framebuffer([shaded], context.depth_renderbuffer(frame.size))
    framebuffer.use()
    frame.submit(framebuffer.clear)
    set_uniforms(
        shader,
        **{name: value for name, value in given.items() if not name.isupper()},
        **lights,
        box_to_world=columns(box_to_world),
        world_to_clip=columns(frame.camera.matrix),
        eye=tuple(frame.camera.eye),
        world_to_tangent=columns(rotation_xyz(shape.rotation_deg).T),
        extent=(*shape.size, shape.depth),
    )
    context.enable_only(context.DEPTH_TEST | context.CULL_FACE)
    array = frame.once(("box", shader), lambda: context.vertex_array(shader, []))
    frame.submit(array.render, vertices=36)
    frame.resources["shaded"] = shaded


def _require_outside(frame: Frame, shape: Relief, place: Float64) -> None:
    """Refuse a camera that is inside the box; `place` is in the unit cube that stands for it."""
    if ((place > 0) & (place < 1)).all():
        raise InputError(
            f"Found the camera inside the box of the relief '{shape.name}' in '{frame.scene.name}'; allowed is any "
            "place outside of it, as its polygons show nothing from within. Move the sensor's origin above the "
            "relief's greatest height."
        )


def _bind_lit(frame: Frame) -> dict[str, Any]:
    """Bind what displacement/polygon.glsl reads to light a fragment; returns its uniforms."""
    lights, shape = frame.resources["lights"], the_relief(frame.scene)
    rows = frame.context.buffer(light_rows(lights).tobytes())
    rows.bind_to_storage_buffer(3)
    frame.resources["light rows"] = rows  # keeps it alive until it is drawn with
    reflectance_of(frame, shape).use(TEXTURE_UNIT)
    frame.once("normal map", lambda: _normal_map(frame)).use(3)
    return {"light_count": len(lights), "reflectance_map": TEXTURE_UNIT}


def _normal_map(frame: Frame) -> moderngl.Texture:
    shape = the_relief(frame.scene)
    made = frame.filtered_texture(sample_normals(heights_of(frame.scene, shape), (*shape.size, shape.depth)))
    made.repeat_x = made.repeat_y = False
    return made


def sample_normals(heights: Float64, extent: tuple[float, float, float]) -> Float32:
    """Unit normals (N, M, 3) in tangent space at the samples of a field (N, M), by central differences."""
    rows, columns_ = heights.shape
    along_v, along_u = np.gradient(heights * extent[2], extent[1] / (rows - 1), extent[0] / (columns_ - 1))
    normals = normalised(np.stack([-along_u, -along_v, np.ones_like(heights)], axis=-1))
    return normals.astype(np.float32)
