"""Meshes as scans and exports leave them: the same surface, cut into triangles that hardly have an area."""

from pathlib import Path

import numpy as np

from scenes.geometry import geometry_of
from scenes.image import Float64
from scenes.mesh import Surface
from scenes.model import Scene
from scenes.shapes import MeshFile
from scenes.topology import Integers

EVERY = 5
"""One face in so many is cut."""


def with_meshes(scene: Scene, folder: Path, height: float | None) -> Scene:
    """The subject's shapes as mesh files with flat faces, one face in EVERY cut at `height` of its own above an edge.

    The cut leaves a sliver along the edge; at 0 it has no area. With it come, in each file, vertices that no face
    uses, one of them far away, and faces that repeat a corner, by its number or by its place. Without a height
    the meshes are as they were. Files are written into `folder`.
    """
    shapes = []
    for shape in scene.shapes:
        if shape.name not in scene.subject:
            shapes.append(shape)
            continue
        unplaced = shape.model_copy(update={"position": (0.0,) * 3, "rotation_deg": (0.0,) * 3, "scale": 1.0})
        alone = scene.model_copy(update={"shapes": (unplaced,), "subject": (shape.name,), "emitters": ()})
        (mesh,) = geometry_of(alone)
        path = folder / f"{shape.name}-{'whole' if height is None else f'{height:g}'}.obj"
        path.write_text(obj_text(*(_triangles(mesh.surface) if height is None else cut(mesh.surface, height))))
        placing = {name: getattr(shape, name) for name in ("name", "material", "position", "rotation_deg", "scale")}
        shapes.append(MeshFile(type="mesh", path=str(path), shading="flat", **placing))
    return scene.model_copy(update={"shapes": tuple(shapes)})


def cut(surface: Surface, height: float) -> tuple[Float64, Integers]:
    """Positions (V, 3) and faces (F, 3) of a surface with slivers, and with all else that is degenerate."""
    positions, faces = _triangles(surface)
    a, b, c = positions[faces[::EVERY]].transpose(1, 0, 2)
    points = 0.5 * (a + b) + height * (c - 0.5 * (a + b))
    middle = len(positions) + np.arange(len(points))
    first, second, third = faces[::EVERY].T
    around = ((first, second, middle), (second, third, middle), (third, first, middle))
    slivers = [np.stack(corners, axis=1) for corners in around]
    kept = np.delete(faces, np.s_[::EVERY], axis=0)
    size = np.ptp(positions, axis=0).max()
    loose = np.stack([positions.mean(axis=0), positions[0], positions[0] + 100 * size])
    copy_of_0 = len(positions) + len(points) + 1
    without_area = np.array([[0, 0, 0], [0, 0, 1], [0, 1, 0], [0, 1, copy_of_0]])
    return np.concatenate([positions, points, loose]), np.concatenate([kept, *slivers, without_area])


def obj_text(positions: Float64, faces: Integers) -> str:
    """A Wavefront OBJ file; positions with all their digits."""
    lines = [f"v {x!r} {y!r} {z!r}" for x, y, z in positions.tolist()]
    lines += [f"f {a} {b} {c}" for a, b, c in (faces + 1).tolist()]
    return "\n".join(lines)


def _triangles(surface: Surface) -> tuple[Float64, Integers]:
    return surface.positions.astype(np.float64), surface.faces.astype(np.int64)
