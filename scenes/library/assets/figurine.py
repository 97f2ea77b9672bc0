"""Make figurine.ply, a small character of our own: python -m scenes.library.assets.figurine.

It stands on two feet that point to +z, raises its left arm (+x) and lets the right one hang, so that no mirror image of
it looks like itself. It is 1 high and centred at the origin.
"""

from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from scenes.image import Float64

Faces = NDArray[np.int64]
Point = tuple[float, float, float]


class Capsule(NamedTuple):
    """All points within `radius` of the segment from `start` to `end`."""

    start: Point
    end: Point
    radius: float


PARTS = (
    Capsule((0.0, 0.10, 0.0), (0.0, 0.26, 0.0), 0.105),  # trunk
    Capsule((-0.03, 0.05, 0.0), (0.03, 0.05, 0.0), 0.105),  # hips
    Capsule((0.0, 0.44, 0.01), (0.0, 0.46, 0.01), 0.10),  # head
    Capsule((0.0, 0.43, 0.11), (0.0, 0.43, 0.12), 0.022),  # nose
    Capsule((0.075, 0.0, 0.0), (0.10, -0.36, 0.0), 0.055),  # left leg
    Capsule((0.10, -0.36, 0.0), (0.11, -0.37, 0.085), 0.045),  # left foot
    Capsule((-0.075, 0.0, 0.0), (-0.10, -0.36, 0.0), 0.055),  # right leg
    Capsule((-0.10, -0.36, 0.0), (-0.11, -0.37, 0.085), 0.045),  # right foot
    Capsule((0.11, 0.28, 0.0), (0.24, 0.30, 0.05), 0.043),  # left upper arm
    Capsule((0.24, 0.30, 0.05), (0.29, 0.47, 0.07), 0.038),  # left forearm
    Capsule((-0.11, 0.28, 0.0), (-0.20, 0.15, -0.01), 0.043),  # right upper arm
    Capsule((-0.20, 0.15, -0.01), (-0.245, 0.0, 0.05), 0.038),  # right forearm
)
BLEND = 0.035
CELL = 0.026
RELAXATIONS = 12


def signed_distance(points: Float64) -> Float64:
    """Roughly the distance (N,) of points (N, 3) to the figure, negative inside; parts melt together over `BLEND`."""
    distance = _to_capsule(points, PARTS[0])
    for part in PARTS[1:]:
        distance = _smooth_minimum(distance, _to_capsule(points, part))
    return distance


def _to_capsule(points: Float64, capsule: Capsule) -> Float64:
    start, axis = np.array(capsule.start), np.subtract(capsule.end, capsule.start)
    along = np.clip((points - start) @ axis / (axis @ axis), 0, 1)
    nearest = start + along[:, None] * axis
    distance: Float64 = np.linalg.norm(points - nearest, axis=1) - capsule.radius
    return distance


def _smooth_minimum(a: Float64, b: Float64) -> Float64:
    """The smaller of two distances, rounded where they differ by less than `BLEND`. Quilez 2013, "Smooth minimum"."""
    h = np.maximum(BLEND - np.abs(a - b), 0) / BLEND
    return np.minimum(a, b) - 0.25 * BLEND * h * h


def figurine() -> tuple[Float64, Faces]:
    """Vertices (V, 3) and outward faces (F, 3): marching cubes, whose slivers are then relaxed along the surface."""
    from skimage.measure import marching_cubes

    low, high = np.array([-0.4, -0.55, -0.3]), np.array([0.45, 0.7, 0.35])
    shape = np.ceil((high - low) / CELL).astype(int)
    grid = low + CELL * np.stack(np.meshgrid(*map(np.arange, shape), indexing="ij"), axis=-1)
    field = signed_distance(grid.reshape(-1, 3)).reshape(shape)
    vertices, faces, _, _ = marching_cubes(field, 0.0, spacing=(CELL,) * 3, gradient_direction="descent")
    positions = _relaxed(vertices.astype(np.float64) + low, faces.astype(np.int64))
    bottom, top = positions.min(axis=0), positions.max(axis=0)
    return (positions - 0.5 * (bottom + top)) / (top[1] - bottom[1]), faces.astype(np.int64)


def _relaxed(positions: Float64, faces: Faces) -> Float64:
    """Each vertex moved towards the mean of its neighbours and back onto the surface, again and again."""
    starts, ends = faces[:, [0, 1, 2]].reshape(-1), faces[:, [1, 2, 0]].reshape(-1)
    degree = np.bincount(starts, minlength=len(positions))[:, None]
    for _ in range(RELAXATIONS):
        sums = np.zeros_like(positions)
        np.add.at(sums, starts, positions[ends])
        positions = _on_surface(0.5 * positions + 0.5 * sums / degree)
    return positions


def _on_surface(positions: Float64) -> Float64:
    """Two Newton steps along the gradient of the distance, by central differences."""
    for _ in range(2):
        step = 1e-4 * np.eye(3)
        gradient = (
            np.stack([signed_distance(positions + e) - signed_distance(positions - e) for e in step], axis=1) / 2e-4
        )
        positions = positions - (signed_distance(positions) / np.sum(gradient**2, axis=1))[:, None] * gradient
    return positions


def write(path: Path) -> None:
    """Write the figure as a binary PLY file."""
    import trimesh

    vertices, faces = figurine()
    trimesh.Trimesh(vertices.astype(np.float32), faces, process=False).export(path)


if __name__ == "__main__":
    write(Path(__file__).with_suffix(".ply"))
