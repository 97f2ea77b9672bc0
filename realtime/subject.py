"""The subject as surfels of its own, and what it hides from itself."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from realtime.bvh import TRIANGLES_A_LEAF, build
from realtime.capture import FLOATS_A_SURFEL, Surfels, bind_lights
from realtime.frame import Frame
from realtime.graph import Pass
from realtime.lights import facets_of
from scenes.features import Features
from scenes.geometry import diffuse_reflectance, texture_of
from scenes.image import Float32, Float64
from scenes.mesh import Mesh
from scenes.model import Texture

if TYPE_CHECKING:
    import moderngl

OFFSET = 2e-3
"""Rays start this part of the subject's size above its surface, where the facets of a smooth mesh no longer hide
them.
"""


@dataclass(frozen=True)
class Visibility:
    """`bits` tells which of the surfels each receiver sees, in rows of `words` 32-bit words.

    The receivers are the subject's surfels, then its vertices.
    """

    bits: moderngl.Buffer
    words: int
    receivers: moderngl.Buffer
    count: int
    vertices: int


def subject_passes(features: Features, count: int) -> list[Pass]:
    """Add `count` surfels of the subject, and unless it is convex find what it hides from itself."""
    convex = "the subject is convex: no point of it sees another" if features.subject_is_convex else ""
    return [
        Pass(
            "subject surfels",
            lambda frame: _add_surfels(frame, count),
            reads=("lights", "surfels"),
            uses=("shadow_atlas",),
            writes=("surfels",),
        ),
        Pass("self-visibility", _find_visibility, reads=("surfels",), writes=("visibility",), skip=convex),
    ]


def _subjects(frame: Frame) -> list[Mesh]:
    return [mesh for mesh in frame.meshes if mesh.is_subject]


def _add_surfels(frame: Frame, count: int) -> None:
    surroundings: Surfels = frame.resources["surfels"]
    rows = [_surfel_rows(mesh, _mean_reflectance(frame, mesh), count) for mesh in _subjects(frame)]
    own = np.concatenate(rows)
    total = surroundings.count + len(own)
    buffer = frame.context.buffer(surroundings.buffer.read() + own.tobytes())
    buffer.bind_to_storage_buffer(0)
    uniforms = bind_lights(frame) | {"first": surroundings.count, "surfel_count": total}
    frame.dispatch(frame.program("indirect/relight_surfels.comp"), len(own), group=(64, 1), **uniforms)
    frame.resources["surfels"] = Surfels(buffer, total, surroundings.count, surroundings.closed)


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


def _find_visibility(frame: Frame) -> None:
    context = frame.context
    surfels: Surfels = frame.resources["surfels"]
    data = np.frombuffer(surfels.buffer.read(), dtype=np.float32).reshape(surfels.count, 4, 4)
    own = data[surfels.surroundings :, :2].copy()
    own[:, :, 3] = 0
    vertices = np.concatenate([_vertex_rows(mesh) for mesh in _subjects(frame)])
    receivers = context.buffer(np.concatenate([own, vertices]).tobytes())
    count, words = len(own) + len(vertices), -(-surfels.count // 32)
    bits = context.buffer(reserve=count * words * 4)
    hierarchy = build([mesh.surface for mesh in _subjects(frame)])
    nodes, triangles = context.buffer(hierarchy.nodes.tobytes()), context.buffer(hierarchy.triangles.tobytes())
    for binding, buffer in ((0, surfels.buffer), (1, receivers), (2, bits), (4, nodes), (5, triangles)):
        buffer.bind_to_storage_buffer(binding)
    low, high = frame.subject_box
    frame.dispatch(
        frame.program("indirect/visibility.comp", TRIANGLES_A_LEAF=TRIANGLES_A_LEAF),
        count,
        words,
        group=(64, 1),
        surfel_count=surfels.count,
        receiver_count=count,
        words=words,
        node_count=len(hierarchy.nodes),
        offset=OFFSET * float(np.linalg.norm(high - low)),
    )
    frame.resources["visibility"] = Visibility(bits, words, receivers, count, len(vertices))


def _vertex_rows(mesh: Mesh) -> Float32:
    rows = np.zeros((len(mesh.surface.positions), 2, 4), dtype=np.float32)
    rows[:, 0, :3], rows[:, 1, :3] = mesh.surface.positions, mesh.surface.normals
    return rows
