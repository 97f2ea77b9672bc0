"""Signed distances that bodies are blended from, and the surface on which they vanish."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from scenes.image import Float64

Field = Callable[[Float64, Float64, Float64], Float64]
"""A signed distance, negative inside, of coordinates x, y, z of shapes that broadcast."""


def ellipsoid_bound(x: Float64, y: Float64, z: Float64, radii: tuple[float, float, float]) -> Float64:
    """An ellipsoid's distance to first order close to it. Quilez 2008, "Ellipsoid SDF"."""
    a, b, c = radii
    k0 = np.sqrt((x / a) ** 2 + (y / b) ** 2 + (z / c) ** 2)
    k1 = np.sqrt((x / a**2) ** 2 + (y / b**2) ** 2 + (z / c**2) ** 2)
    distance: Float64 = k0 * (k0 - 1) / np.maximum(k1, 1e-12)  # at the centre both vanish; there only the sign counts
    return distance


def vesica(x: Float64, y: Float64, size: tuple[float, float], tip_radius: float) -> Float64:
    """The signed distance in the plane to the lens that two circles share, `size` wide and tall, with rounded tips.

    It is taller than wide. Quilez 2020, "2D distance functions", vesica.
    """
    width, height = size
    half_height, half_width = 0.5 * height - tip_radius, 0.5 * width - tip_radius
    offset = 0.5 * (half_height**2 / half_width - half_width)
    x, y = np.abs(x), np.abs(y)
    to_tip, to_side = np.hypot(x, y - half_height), np.hypot(x + offset, y) - (offset + half_width)
    distance: Float64 = np.where((y - half_height) * offset > x * half_height, to_tip, to_side) - tip_radius
    return distance


def smooth_union(a: Float64, b: Float64, radius: float) -> Float64:
    """The smaller of two distances, rounded where they differ by less than `radius`.

    Quilez 2013, "Smooth minimum", quadratic polynomial.
    """
    overlap = np.maximum(radius - np.abs(a - b), 0) / radius
    return np.minimum(a, b) - 0.25 * radius * overlap**2


def isosurface(field: Field, axes: list[Float64]) -> tuple[Float64, NDArray[np.integer]]:
    """Vertices (V, 3) and outward faces (F, 3) of a field's zero set on an even grid with these coordinates.

    Lewiner et al. 2003, "Efficient implementation of marching cubes' cases with topological guarantees". A sample of
    exactly 0 would collapse triangles into a vertex, so that none is left closer to 0 than a thousandth of a cell.
    """
    from skimage.measure import marching_cubes

    x, y, z = axes
    cell = x[1] - x[0]
    samples = np.empty((len(x), len(y), len(z)), dtype=np.float32)
    for i, at in enumerate(x):
        samples[i] = field(at, y[:, None], z[None, :])
    least = 1e-3 * cell
    is_close = np.abs(samples) < least
    samples[is_close] = np.copysign(least, samples[is_close])
    vertices, faces, _, _ = marching_cubes(samples, 0.0, gradient_direction="descent")
    origin = np.array([x[0], y[0], z[0]])
    return origin + cell * vertices.astype(np.float64), faces


def gradient(field: Field, points: Float64, step: float) -> Float64:
    """The gradient (V, 3) of a field at points (V, 3), by central differences."""
    differences: list[Float64] = [
        field(*(points + offset).T) - field(*(points - offset).T) for offset in step * np.eye(3)
    ]
    return np.stack(differences, axis=1) / (2 * step)
