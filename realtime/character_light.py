"""Light that reaches surfaces from the sky and from other surfaces: radiosity of the triangles, by rays traced once.

Goral, Torrance, Greenberg, Battaile 1984, "Modeling the Interaction of Light between Diffuse Surfaces"; the rays from
a triangle are as dense as the cosine, so that what they meet counts evenly. Every surface is taken as Lambertian with
the reflectance that it has on the whole, translucent bodies too.

What passes hand on:

hierarchy  : `Hierarchy` of all that does not emit (baked)
rays       : `Rays` of the triangles and of the vertices (baked)
radiosity  : buffer with a vec4 for each triangle: the radiance that its front side sends out
received   : for each mesh that receives, by name, a vec4 for each vertex: irradiance over pi of all but the lamps
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from realtime.bvh import TRIANGLES_A_LEAF, build
from realtime.capture import bind_lights, bounces_for, large_buffer
from realtime.character_parts import receives
from realtime.coat_albedo import albedo_of
from realtime.frame import Frame
from realtime.graph import Pass
from realtime.sky import sky_texture
from scenes.geometry import texture_of
from scenes.image import Float32, Float64
from scenes.materials import Diffuse, Fibre, Layered, Material, Principled, Texture, Translucent
from scenes.media import coefficients
from scenes.mesh import Interface, Mesh, Surface
from scenes.model import Scene

if TYPE_CHECKING:
    import moderngl

OFFSET = 2e-4
"""Rays start this part of the scene's size above their surface."""

LARGEST = 1 / 12
"""Edges longer than this part of the scene's size are divided: a triangle has one radiosity."""

TRIANGLE_RAYS = 8
"""From each triangle, in directions of its own: what gathers from many triangles sees the mean of their errors."""


@dataclass(frozen=True)
class Hierarchy:
    """Triangles of the scene, with a bounding volume hierarchy over them.

    places      : rows of two vec4: the middle of each triangle and its normal
    reflectance : a vec4 for each triangle, w the number of its shape
    brightest   : the largest of these reflectances
    shapes      : their names
    """

    nodes: moderngl.Buffer
    triangles: moderngl.Buffer
    places: moderngl.Buffer
    reflectance: moderngl.Buffer
    node_count: int
    count: int
    offset: float
    brightest: float
    shapes: tuple[str, ...]

    def bind(self) -> dict[str, Any]:
        """Bind what indirect/bvh.glsl reads, and the reflectances; returns their uniforms."""
        for binding, buffer in ((4, self.nodes), (5, self.triangles), (6, self.reflectance)):
            buffer.bind_to_storage_buffer(binding)
        return {"node_count": self.node_count, "triangle_count": self.count, "offset": self.offset}


@dataclass(frozen=True)
class Rays:
    """Rays from `count` places, rows of a place and its normal, two vec4 each.

    hits   : (`directions`, count) int32: the triangle that is met; -1: none, -2: the back of one
    stride : a place has directions number `stride` times its own number, and those after that
    """

    hits: moderngl.Buffer
    places: moderngl.Buffer
    count: int
    directions: int
    stride: int

    def bind(self) -> dict[str, Any]:
        """Bind what character/around.glsl reads but the radiosity; returns its uniforms."""
        self.places.bind_to_storage_buffer(2)
        self.hits.bind_to_storage_buffer(3)
        return {"place_count": self.count, "directions": self.directions, "stride": self.stride}


def received_passes(directions: int, skip: str = "") -> list[Pass]:
    """Write `hierarchy`, `radiosity` and `received`."""
    return [
        Pass("hierarchy", _build, writes=("hierarchy",), is_baked=True),
        Pass(
            "trace rays",
            lambda frame: _trace(frame, directions),
            reads=("hierarchy",),
            writes=("rays",),
            skip=skip,
            is_baked=True,
        ),
        Pass(
            "radiosity",
            _bounce,
            reads=("hierarchy", "rays", "lights"),
            uses=("shadow_atlas",),
            writes=("radiosity",),
            skip=skip,
        ),
        Pass("receive", _receive, reads=("hierarchy", "rays", "radiosity"), writes=("received",), skip=skip),
    ]


def mean_reflectance(scene: Scene, material: Diffuse | Translucent | Fibre | Interface) -> Float64:
    """What a surface reflects on the whole (3,).

    A translucent body of half of all space: Jensen, Marschner, Levoy, Hanrahan 2001, "A Practical Model for Subsurface
    Light Transport", section 2.4, without a change of the refractive index.
    """
    if isinstance(material, Diffuse):
        return _mean(scene, material.reflectance)
    if isinstance(material, Translucent):
        sigma_a, sigma_s = coefficients(material, scene.length_unit)
        albedo = np.divide(sigma_s, sigma_a + sigma_s, out=np.zeros(3), where=sigma_a + sigma_s > 0)
        root = np.sqrt(3 * (1 - albedo))
        reflected: Float64 = albedo / 2 * (1 + np.exp(-4 / 3 * root)) * np.exp(-root)
        return reflected
    return np.zeros(3)


def whole_of(frame: Frame, mesh: Mesh) -> tuple[float, float, float]:
    """What a mesh reflects on the whole, found once."""
    red, green, blue = frame.once(("whole", mesh.material), lambda: _whole(frame, mesh.material).tolist())
    return red, green, blue


def _whole(frame: Frame, material: Material | Interface) -> Float64:
    if isinstance(material, Layered | Principled):
        return albedo_of(frame, material).on_the_whole
    return mean_reflectance(frame.scene, material)


def _mean(scene: Scene, value: Any) -> Float64:
    if isinstance(value, Texture):
        mean: Float64 = texture_of(scene, value).mean(axis=(0, 1), dtype=np.float64)
        return mean
    return np.array(value, dtype=np.float64)


def divided(surface: Surface, longest: float) -> Float32:
    """Corners (T, 3, 3) of a surface's triangles, halved along their longest edges until none is above `longest`."""
    corners = surface.positions[surface.faces.astype(np.int64)].astype(np.float64)
    done = []
    while len(corners):
        edges = np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2)
        fits = edges.max(axis=1) <= longest
        done.append(corners[fits])
        rest, k = corners[~fits], edges[~fits].argmax(axis=1)
        turned = np.take_along_axis(rest, ((k[:, None] + np.arange(3)) % 3)[..., None], axis=1)
        middle = turned[:, :2].mean(axis=1)
        corners = np.concatenate(
            [
                np.stack([turned[:, 0], middle, turned[:, 2]], axis=1),
                np.stack([middle, turned[:, 1], turned[:, 2]], axis=1),
            ]
        )
    return np.concatenate(done).astype(np.float32)


def _build(frame: Frame) -> None:
    frame.resources["hierarchy"] = frame.once("hierarchy", lambda: _hierarchy(frame))


def _hierarchy(frame: Frame) -> Hierarchy:
    size = 2 * frame.bounds[1]
    solid = [mesh for mesh in frame.meshes if mesh.radiance is None]
    corners = [divided(mesh.surface, LARGEST * size) for mesh in solid]
    reflectance = np.repeat([whole_of(frame, mesh) for mesh in solid], [len(part) for part in corners], axis=0)
    shapes = tuple(dict.fromkeys(mesh.shape for mesh in solid))
    number = np.repeat([shapes.index(mesh.shape) for mesh in solid], [len(part) for part in corners])
    hierarchy = build([_soup(np.concatenate(corners))])
    triangles = hierarchy.triangles.reshape(-1, 3, 4)[:, :, :3].astype(np.float64)
    cross = np.cross(triangles[:, 1], triangles[:, 2])
    normals = cross / np.maximum(np.linalg.norm(cross, axis=1, keepdims=True), np.finfo(np.float32).tiny)
    middles = triangles[:, 0] + (triangles[:, 1] + triangles[:, 2]) / 3
    reflected = np.zeros((len(triangles), 4), dtype=np.float32)
    reflected[:, :3], reflected[:, 3] = reflectance[hierarchy.order], number[hierarchy.order]
    buffer = frame.context.buffer
    return Hierarchy(
        buffer(hierarchy.nodes.tobytes()),
        buffer(hierarchy.triangles.tobytes()),
        buffer(place_rows(middles, normals).tobytes()),
        buffer(reflected.tobytes()),
        len(hierarchy.nodes),
        len(middles),
        OFFSET * size,
        float(reflected[:, :3].max(initial=0.0)),
        shapes,
    )


def _soup(corners: Float32) -> Surface:
    flat = np.ascontiguousarray(corners.reshape(-1, 3))
    faces = np.arange(len(flat), dtype=np.uint32).reshape(-1, 3)
    return Surface(flat, np.zeros_like(flat), np.zeros((len(flat), 2), dtype=np.float32), faces)


def _trace(frame: Frame, directions: int) -> None:
    hierarchy: Hierarchy = frame.resources["hierarchy"]
    vertices = [
        place_rows(mesh.surface.positions, mesh.surface.normals)
        for mesh in frame.meshes
        if receives(mesh, frame.settings)
    ]
    rays = [traced(frame, hierarchy.places, hierarchy.count, TRIANGLE_RAYS, TRIANGLE_RAYS)]
    if vertices:
        rays.append(traced(frame, *_uploaded(frame, np.concatenate(vertices)), directions, 0))
    frame.resources["rays"] = tuple(rays)


def place_rows(places: Float32 | Float64, normals: Float32 | Float64) -> Float32:
    """Places (N, 3) and their normals as rows (N, 2, 4) of character/places.glsl."""
    rows = np.zeros((len(places), 2, 4), dtype=np.float32)
    rows[:, 0, :3], rows[:, 1, :3] = places, normals
    return rows


def _uploaded(frame: Frame, rows: Float32) -> tuple[moderngl.Buffer, int]:
    return frame.context.buffer(rows.tobytes()), len(rows)


def traced(frame: Frame, places: moderngl.Buffer, count: int, directions: int, stride: int) -> Rays:
    """What rays from some places meet."""
    hierarchy: Hierarchy = frame.resources["hierarchy"]
    hits = large_buffer(
        frame,
        4 * directions * count,
        f"What {directions} rays from each of {count} places meet needs a list",
        "Set rays lower.",
    )
    rays = Rays(hits, places, count, directions, stride)
    shader = frame.program("character/trace.comp", TRIANGLES_A_LEAF=TRIANGLES_A_LEAF)
    uniforms = hierarchy.bind() | rays.bind()
    frame.dispatch(shader, count, directions, group=(64, 1), **uniforms)
    return rays


def _bounce(frame: Frame) -> None:
    hierarchy: Hierarchy = frame.resources["hierarchy"]
    make, size = frame.context.buffer, 16 * hierarchy.count
    lit, before, after = make(reserve=size), make(reserve=size), make(reserve=size)
    uniforms = hierarchy.bind()
    lit.bind_to_storage_buffer(0)
    hierarchy.places.bind_to_storage_buffer(2)
    light = frame.program("character/light_triangles.comp")
    frame.dispatch(light, hierarchy.count, group=(64, 1), **uniforms, **bind_lights(frame))
    frame.submit(frame.context.copy_buffer, before, lit)
    rays: Rays = frame.resources["rays"][0]
    sky_texture(frame).use(5)
    uniforms |= rays.bind()
    shader = frame.program("character/bounce.comp")
    for _ in range(bounces_for(hierarchy.brightest)):
        for binding, buffer in ((0, lit), (1, before), (7, after)):
            buffer.bind_to_storage_buffer(binding)
        frame.dispatch(shader, hierarchy.count, group=(64, 1), **uniforms)
        before, after = after, before
    frame.resources["radiosity"] = before


def _receive(frame: Frame) -> None:
    if len(frame.resources["rays"]) == 1:
        frame.resources["received"] = {}
        return
    rays: Rays = frame.resources["rays"][1]
    received = frame.context.buffer(reserve=16 * rays.count)
    received.bind_to_storage_buffer(0)
    frame.resources["radiosity"].bind_to_storage_buffer(1)
    sky_texture(frame).use(5)
    frame.dispatch(frame.program("character/receive.comp"), rays.count, group=(64, 1), **rays.bind())
    sizes = {mesh.name: 16 * len(mesh.surface.positions) for mesh in frame.meshes if receives(mesh, frame.settings)}
    kept = frame.once("received", lambda: {name: frame.context.buffer(reserve=size) for name, size in sizes.items()})
    first = 0
    for name, size in sizes.items():
        frame.submit(frame.context.copy_buffer, kept[name], received, size, read_offset=first)
        first += size
    frame.resources["received"] = kept
