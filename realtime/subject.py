"""The subject as surfels of its own, and what it hides from itself."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from realtime.bvh import TRIANGLES_A_LEAF, build
from realtime.capture import FLOATS_A_SURFEL, Surfels, large_buffer
from realtime.frame import Frame
from realtime.graph import Pass
from realtime.lights import facets_of
from scenes.features import Features
from scenes.geometry import diffuse_reflectance, texture_of
from scenes.image import Float32, Float64
from scenes.materials import Texture
from scenes.mesh import Mesh

if TYPE_CHECKING:
    import moderngl

OFFSET = 2e-3
"""Rays start this part of the subject's size above its surface, where the facets of a smooth mesh no longer hide
them.
"""


@dataclass(frozen=True)
class Receivers:
    """`count` places with their normals, in rows of two vec4: the subject's surfels, then its `vertices`."""

    buffer: moderngl.Buffer
    count: int
    vertices: int


@dataclass(frozen=True)
class Visibility:
    """`bits` tells which of the surfels each receiver sees, in rows of `words` 32-bit words."""

    bits: moderngl.Buffer
    words: int
    receivers: Receivers


@dataclass(frozen=True)
class Transfer:
    """What the subject hides from its receivers, in nine harmonics, and what of itself they see instead.

    vectors : (9, R) float32, what each receiver gets per unit of each harmonic of the radiance around it, over pi
    hits    : (`directions`, R) int32, which of the subject's own surfels each ray meets; -1 for none
    """

    vectors: moderngl.Buffer
    hits: moderngl.Buffer
    directions: int
    receivers: Receivers

    def uniforms(self) -> dict[str, Any]:
        """What the shaders that read it need to know."""
        return {"receiver_count": self.receivers.count, "directions": self.directions}


def subject_passes(features: Features, count: int) -> list[Pass]:
    """Add `count` surfels of the subject, and unless it is convex find what it hides from itself."""
    return [
        subject_surfels_pass(count),
        Pass(
            "self-visibility",
            _find_visibility,
            reads=("surfels", "own_surfels"),
            writes=("visibility",),
            skip=_convex(features),
            is_baked=True,
        ),
    ]


def subject_surfels_pass(count: int) -> Pass:
    """Add `count` surfels on each mesh of the subject to those of the surroundings."""
    return Pass(
        "subject surfels",
        lambda frame: _add_surfels(frame, count),
        reads=("surfels",),
        writes=("surfels", "own_surfels"),
        is_baked=True,
    )


def transfer_pass(features: Features, directions: int) -> Pass:
    """Unless the subject is convex, find what it hides from itself by `directions` rays from each receiver."""
    return Pass(
        "transfer",
        lambda frame: _find_transfer(frame, directions),
        reads=("surfels", "own_surfels"),
        writes=("transfer",),
        skip=_convex(features),
        is_baked=True,
    )


def draw_received_pass(skip: str) -> Pass:
    """Draw what the vertices of the subject receive: `shaded` at every sample, from `received` for each mesh."""
    return Pass("draw received", _draw_received, reads=("received",), writes=("shaded",), skip=skip)


def _convex(features: Features) -> str:
    return "the subject is convex: no point of it sees another" if features.subject_is_convex else ""


def _subjects(frame: Frame) -> list[Mesh]:
    return [mesh for mesh in frame.meshes if mesh.is_subject]


def _add_surfels(frame: Frame, count: int) -> None:
    surroundings: Surfels = frame.resources["surfels"]
    rows = [_surfel_rows(mesh, _mean_reflectance(frame, mesh), count) for mesh in _subjects(frame)]
    own = np.concatenate(rows)
    surfels = replace(
        surroundings,
        buffer=frame.context.buffer(surroundings.buffer.read() + own.tobytes()),
        count=surroundings.count + len(own),
        own_reflectance=float(own[:, 8:11].max()),
    )
    frame.resources |= {"surfels": surfels, "own_surfels": len(own)}


def _surfel_rows(mesh: Mesh, reflectance: Float64, count: int) -> Float32:
    facets = facets_of(mesh.surface, count)
    rows = np.zeros((count, FLOATS_A_SURFEL), dtype=np.float32)
    rows[:, 0:3], rows[:, 3], rows[:, 4:7], rows[:, 8:11] = facets.places, facets.area, facets.normals, reflectance
    return rows


def _mean_reflectance(frame: Frame, mesh: Mesh) -> Float64:
    reflectance = diffuse_reflectance(mesh.material)
    if isinstance(reflectance, Texture):
        mean: Float64 = texture_of(frame.scene, reflectance).mean(axis=(0, 1), dtype=float)
        return mean
    return np.array(reflectance)


def _receivers(frame: Frame) -> Receivers:
    surfels: Surfels = frame.resources["surfels"]
    data = np.frombuffer(surfels.buffer.read(), dtype=np.float32).reshape(surfels.count, 3, 4)
    own = data[surfels.surroundings :, :2].copy()
    own[:, :, 3] = 0
    vertices = np.concatenate([_vertex_rows(mesh) for mesh in _subjects(frame)])
    rows = np.concatenate([own, vertices])
    return Receivers(frame.context.buffer(rows.tobytes()), len(rows), len(vertices))


def _vertex_rows(mesh: Mesh) -> Float32:
    rows = np.zeros((len(mesh.surface.positions), 2, 4), dtype=np.float32)
    rows[:, 0, :3], rows[:, 1, :3] = mesh.surface.positions, mesh.surface.normals
    return rows


def _bind_hierarchy(frame: Frame) -> dict[str, Any]:
    """Bind what indirect/bvh.glsl reads; returns its uniform, and how far rays start above the surface."""
    hierarchy = build([mesh.surface for mesh in _subjects(frame)])
    buffers = [frame.context.buffer(part.tobytes()) for part in (hierarchy.nodes, hierarchy.triangles)]
    for binding, buffer in enumerate(buffers, 4):
        buffer.bind_to_storage_buffer(binding)
    frame.resources["hierarchy"] = buffers
    low, high = frame.subject_box
    return {"node_count": len(hierarchy.nodes), "offset": OFFSET * float(np.linalg.norm(high - low))}


def _find_visibility(frame: Frame) -> None:
    surfels: Surfels = frame.resources["surfels"]
    receivers = _receivers(frame)
    words = -(-surfels.count // 32)
    bits = frame.context.buffer(reserve=receivers.count * words * 4)
    for binding, buffer in enumerate((surfels.buffer, receivers.buffer, bits)):
        buffer.bind_to_storage_buffer(binding)
    frame.dispatch(
        frame.program("indirect/visibility.comp", TRIANGLES_A_LEAF=TRIANGLES_A_LEAF),
        receivers.count,
        words,
        group=(64, 1),
        surfel_count=surfels.count,
        receiver_count=receivers.count,
        words=words,
        **_bind_hierarchy(frame),
    )
    frame.resources["visibility"] = Visibility(bits, words, receivers)


def _find_transfer(frame: Frame, directions: int) -> None:
    surfels: Surfels = frame.resources["surfels"]
    receivers = _receivers(frame)
    hits = large_buffer(
        frame,
        directions * receivers.count * 4,
        f"What {directions} rays from each of {receivers.count} points of the subject hit needs a list",
        "Set directions lower.",
    )
    vectors = frame.context.buffer(reserve=9 * receivers.count * 4)
    for binding, buffer in enumerate((surfels.buffer, receivers.buffer, hits, vectors)):
        buffer.bind_to_storage_buffer(binding)
    transfer = Transfer(vectors, hits, directions, receivers)
    uniforms = _bind_hierarchy(frame) | surfels.uniforms() | transfer.uniforms()
    trace = frame.program("indirect_grid/trace.comp", TRIANGLES_A_LEAF=TRIANGLES_A_LEAF)
    frame.dispatch(trace, receivers.count, directions, group=(64, 1), **uniforms)
    frame.dispatch(frame.program("indirect_grid/transfer.comp"), receivers.count, group=(64, 1), **uniforms)
    frame.resources["transfer"] = transfer


def by_mesh(frame: Frame, values: moderngl.Buffer) -> dict[str, moderngl.Buffer]:
    """Cut a vec4 for each vertex of the subject into a buffer for each of its meshes, the same ones in each frame."""
    sizes = {mesh.name: 16 * len(mesh.surface.positions) for mesh in _subjects(frame)}
    make = frame.context.buffer
    buffers = frame.once("received", lambda: {name: make(reserve=size) for name, size in sizes.items()})
    first = 0
    for name, size in sizes.items():
        frame.submit(frame.context.copy_buffer, buffers[name], values, size, read_offset=first)
        first += size
    return buffers


def _draw_received(frame: Frame) -> None:
    context = frame.context
    shaded = frame.texture(frame.size, 4)
    framebuffer = context.framebuffer([shaded], context.depth_renderbuffer(frame.size))
    framebuffer.use()
    frame.submit(framebuffer.clear)
    context.enable_only(context.DEPTH_TEST)
    frame.draw(
        frame.program("indirect/received.vert", "indirect/received.frag"),
        frame.camera,
        received=frame.resources["received"],
    )
    frame.resources["shaded"] = shaded
