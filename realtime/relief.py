"""Carved blocks drawn by rays through their height fields: their grid, their quadtree, their part of a G-buffer.

In the grid of a relief x and y count samples, z is the height: its samples stand at whole numbers.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from realtime.camera import Camera
from realtime.frame import TEXTURE_UNIT, Frame, columns
from realtime.graph import Pass
from realtime.sky import require_no_sky
from scenes.errors import InputError
from scenes.features import Features
from scenes.geometry import heights_of
from scenes.image import Float32, Float64
from scenes.mesh import Mesh
from scenes.model import Scene
from scenes.procedural import rotation_xyz
from scenes.shapes import Relief

if TYPE_CHECKING:
    import moderngl

BELOW = -1.0
"""Height where there is no field: no ray that meets a block goes so low."""


@dataclass(frozen=True)
class Field:
    """A height field on the GPU: its samples, and the quadtree of the highest ones.

    cells : along u and v
    top : the highest sample
    levels : of the quadtree, but for the first
    """

    heights: moderngl.Texture
    highest: moderngl.Texture
    cells: tuple[int, int]
    top: float
    levels: int


def the_relief(scene: Scene) -> Relief:
    """The carved block that is judged.

    Raises
    ------
    InputError
        The subject is not one relief.
    """
    found = [shape for shape in scene.shapes if shape.name in scene.subject]
    if len(found) != 1 or not isinstance(found[0], Relief):
        kinds = ", ".join(sorted(shape.type for shape in found))
        raise InputError(
            f"Found {len(found)} shape(s) in the subject of '{scene.name}' ({kinds}); the techniques of displacement "
            'draw exactly one relief. Name one shape of type "relief" in `subject`.'
        )
    return found[0]


def require_lit_relief(scene: Scene, features: Features) -> None:
    """Refuse what the techniques of displacement cannot light.

    Raises
    ------
    InputError
        The subject is not one relief, or the scene has a sky.
    """
    the_relief(scene)
    require_no_sky(scene, features, "the techniques of displacement light a relief")


def quadtree(heights: Float64) -> list[Float32]:
    """The highest corner of each cell, then of each 2 x 2 of these and so on, until one is left.

    heights : (N, M)

    Cells are padded with BELOW to powers of two, so that every level has the size of a mip level.
    """
    corners = (heights[:-1, :-1], heights[:-1, 1:], heights[1:, :-1], heights[1:, 1:])
    cells = np.maximum.reduce(corners).astype(np.float32)
    padding = [(0, (1 << (n - 1).bit_length()) - n) for n in cells.shape]
    levels = [np.pad(cells, padding, constant_values=BELOW)]
    while levels[-1].size > 1:
        rows, columns_ = levels[-1].shape
        height, width = min(rows, 2), min(columns_, 2)
        levels.append(levels[-1].reshape(rows // height, height, columns_ // width, width).max(axis=(1, 3)))
    return levels


def grid_to_world(shape: Relief, cells: tuple[int, int]) -> Float64:
    """The matrix (4, 4) from the grid of a relief to the world."""
    axes = shape.scale * rotation_xyz(shape.rotation_deg)
    steps = np.array([shape.size[0] / cells[0], shape.size[1] / cells[1], shape.depth])
    matrix = np.eye(4)
    matrix[:3, :3] = axes * steps
    matrix[:3, 3] = np.array(shape.position) - axes @ np.array([shape.size[0] / 2, shape.size[1] / 2, shape.depth])
    return matrix


def world_to_grid(shape: Relief, cells: tuple[int, int]) -> Float64:
    """The inverse (4, 4) of `grid_to_world`."""
    return np.asarray(np.linalg.inv(grid_to_world(shape, cells)), dtype=np.float64)


def view_rays(camera: Camera, to_grid: Float64, box: Float64) -> dict[str, Any]:
    """The uniforms of displacement/view.glsl: rays o + t d of a camera in a grid.

    Rays are made in float64 around a point as far off as the middle of the `box` (3,): there they are exact to the
    rounding of the box's size, however far away the camera is.

    to_grid : (4, 4), from the world
    """
    to_world = np.linalg.inv(to_grid)
    middle, corner = (to_world @ (*point, 1.0) for point in (box / 2, np.zeros(3)))
    radius = float(np.linalg.norm((middle - corner)[:3]))
    depth = max(float((middle[:3] - camera.eye) @ camera.forward), radius)
    clip = camera.matrix @ (*(camera.eye + depth * camera.forward), 1.0)
    from_clip = to_grid @ np.linalg.inv(camera.matrix)
    anchor = (from_clip @ (0.0, 0.0, clip[2], clip[3]))[:3]
    return {
        "ray_anchor": tuple(anchor),
        "ray_forward": tuple(anchor - (to_grid @ (*camera.eye, 1.0))[:3]),
        "ray_right": tuple(clip[3] * from_clip[:3, 0]),
        "ray_up": tuple(clip[3] * from_clip[:3, 1]),
    }


def field_of(frame: Frame, shape: Relief) -> Field:
    """The height field of a relief, uploaded once."""
    return frame.once(("relief", shape.name), lambda: _upload(frame, heights_of(frame.scene, shape)))


def _upload(frame: Frame, heights: Float64) -> Field:
    levels = quadtree(heights)
    rows, samples = heights.shape
    fine = frame.texture((samples, rows), 1)
    fine.filter = (frame.context.LINEAR, frame.context.LINEAR)
    fine.repeat_x = fine.repeat_y = False
    fine.write(np.ascontiguousarray(heights, dtype=np.float32).tobytes())
    highest = frame.texture(levels[0].shape[::-1], 1)
    frame.build_mipmaps(highest)
    highest.filter = (frame.context.NEAREST_MIPMAP_NEAREST, frame.context.NEAREST)
    for level, values in enumerate(levels):
        highest.write(np.ascontiguousarray(values).tobytes(), level=level)
    return Field(fine, highest, (samples - 1, rows - 1), float(levels[-1].max()), len(levels) - 1)


def reflectance_of(frame: Frame, shape: Relief) -> moderngl.Texture:
    """What a relief reflects over (u, v), uploaded once."""
    material = frame.scene.materials[shape.material]
    return frame.once(("reflectance", shape.material), lambda: frame.reflectance_texture(material))


def bind_relief(frame: Frame, shape: Relief) -> dict[str, Any]:
    """Bind what displacement/quadtree.glsl reads; returns its uniforms."""
    field = field_of(frame, shape)
    field.heights.use(1)
    field.highest.use(2)
    return {"cells": field.cells, "top": field.top, "levels": field.levels}


def cast_rays(frame: Frame, shader: Any, shape: Relief, **own: Any) -> None:
    """Run a compute shader with displacement/view.glsl on every sample of the frame: rays of its camera at a relief.

    `own` are uniforms that the shader has besides.

    Raises
    ------
    InputError
        The camera is inside the block.
    """
    camera, field = frame.camera, field_of(frame, shape)
    to_grid = world_to_grid(shape, field.cells)
    _require_outside(frame, shape, (to_grid @ (*camera.eye, 1.0))[:3])
    uniforms = bind_relief(frame, shape) | view_rays(camera, to_grid, np.array([*field.cells, field.top]))
    uniforms |= {
        "grid_to_world": columns(grid_to_world(shape, field.cells)),
        "world_to_grid": columns(to_grid[:3, :3]),
        "eye": tuple(camera.eye),
        "forward": tuple(camera.forward),
        "reflectance_map": TEXTURE_UNIT,
        "is_subject": float(shape.name in frame.scene.subject),
    }
    frame.dispatch(shader, *frame.size, **(uniforms | own))


def _require_outside(frame: Frame, shape: Relief, place: Float64) -> None:
    """Refuse a camera that is inside a block, whose surface has no inner side; `place` is in the grid."""
    cells = np.array(field_of(frame, shape).cells)
    if (place < 0).any() or (place[:2] > cells).any():
        return
    heights = heights_of(frame.scene, shape)
    column, row = np.minimum(place[:2].astype(int), cells - 1)
    s, t = place[:2] - (column, row)
    square = heights[row : row + 2, column : column + 2]
    if place[2] <= np.array([1 - t, t]) @ square @ np.array([1 - s, s]):
        raise InputError(
            f"Found the camera inside the relief '{shape.name}'; allowed is any place outside its body. Move the "
            "sensor's origin above the surface."
        )


Marking = Callable[[Relief], tuple[dict[str, float], dict[str, Any]]]
"""Binds what displacement/hits.comp marks samples of a relief with; returns its defines and uniforms."""


def relief_gbuffer_pass(which: Callable[[Mesh], bool] = lambda mesh: True, mark: Marking | None = None) -> Pass:
    """As `realtime.gbuffer.gbuffer_pass`, of the meshes for which `which` holds; reliefs are drawn by rays."""
    return Pass("gbuffer", lambda frame: _gbuffer(frame, which, mark), writes=("position", "normal", "albedo"))


def _gbuffer(frame: Frame, which: Callable[[Mesh], bool], mark: Marking | None) -> None:
    targets = [frame.texture(frame.size, 4) for _ in range(3)]
    reliefs = {shape.name: shape for shape in frame.scene.shapes if isinstance(shape, Relief)}
    wanted = [reliefs[mesh.shape] for mesh in frame.meshes if which(mesh) and mesh.shape in reliefs]
    has_meshes = any(which(mesh) and mesh.shape not in reliefs for mesh in frame.meshes)
    if has_meshes or not wanted:
        framebuffer = frame.context.framebuffer(targets, frame.context.depth_renderbuffer(frame.size))
        framebuffer.use()
        frame.submit(framebuffer.clear)
    if has_meshes:
        frame.context.enable_only(frame.context.DEPTH_TEST)
        shader = frame.program("raster/mesh.vert", "raster/gbuffer.frag")
        frame.draw(shader, frame.camera, lambda mesh: which(mesh) and mesh.shape not in reliefs)
    for place, shape in enumerate(wanted):
        for unit, target in enumerate(targets):
            target.bind_to_image(unit, read=True, write=True)
        reflectance_of(frame, shape).use(TEXTURE_UNIT)
        defines = {} if has_meshes or place else {"FIRST": 1}
        marked, own = mark(shape) if mark else ({}, {})
        cast_rays(frame, frame.program("displacement/hits.comp", **defines, **marked), shape, **own)
    frame.resources |= dict(zip(("position", "normal", "albedo"), targets, strict=True))
