"""Volumes of distances to a height field, as the talk marches through them.

Texture space is the unit cube over a block: u, v, and w from 0 at its bottom to 1 at the greatest height.
"""

from dataclasses import dataclass
from typing import cast

import numpy as np

from scenes.image import Bool, Float64

TEXTURE_SPACE = (1.0, 1.0, 1.0)
"""The metric of distances in texture space itself, whatever a block measures."""


def cubic(heights: Float64, slices: int) -> tuple[float, float, float]:
    """The metric in which the voxels over a height field are cubes of size 1."""
    rows, columns = heights.shape
    return columns - 1.0, rows - 1.0, float(slices)


@dataclass(frozen=True)
class DistanceVolume:
    """Distances (D, N, M) to a height field; they are lengths after texture space is stretched by `metric`.

    first, last : texture coordinates of the volume at which texture space begins and ends
    """

    values: Float64
    metric: tuple[float, float, float]
    first: tuple[float, float, float]
    last: tuple[float, float, float]


def voxel_distances(
    heights: Float64, slices: int, metric: tuple[float, float, float] = TEXTURE_SPACE
) -> DistanceVolume:
    """From each voxel's middle to that of the nearest one on or in the surface; as published, in texture space itself.

    A voxel is in the surface if its middle is; those at the bottom all are, so that no ray passes through. Columns
    stand where the samples of the field are.
    """
    from scipy.ndimage import distance_transform_edt

    rows, columns = heights.shape
    is_empty = np.arange(slices)[:, None, None] + 0.5 > heights * slices
    is_empty[0] = False
    spacing = (metric[2] / slices, metric[1] / (rows - 1), metric[0] / (columns - 1))
    distances = cast("Float64", distance_transform_edt(is_empty, sampling=spacing))
    half = 0.5 / columns, 0.5 / rows
    return DistanceVolume(distances, metric, (*half, 0.0), (1 - half[0], 1 - half[1], 1.0))


def signed_distances(heights: Float64, slices: int, extent: tuple[float, float, float]) -> DistanceVolume:
    """Lengths from nodes, which stand at both ends of texture space, to the solid columns under the samples.

    Inside the block they are negative: to the air over the columns. The nearest voxel tells the nearest column, whose
    own height then counts, not that of the voxel.

    extent : of texture space, in lengths of the block
    """
    rows, columns = heights.shape
    spacing = np.array([extent[2] / (slices - 1), extent[1] / (rows - 1), extent[0] / (columns - 1)])
    height = heights * (slices - 1)
    # One more slice, above the block: there is air.
    is_air = np.arange(slices + 1)[:, None, None] > height
    outside = _to_columns(is_air, height, spacing, 1.0)
    inside = _to_columns(~is_air, height, spacing, -1.0)
    half = 0.5 / columns, 0.5 / rows, 0.5 / slices
    values = np.where(is_air, outside, -inside)[:slices]
    return DistanceVolume(values, extent, half, (1 - half[0], 1 - half[1], 1 - half[2]))


def _to_columns(is_far: Bool, height: Float64, spacing: Float64, side: float) -> Float64:
    """Lengths from nodes to the column of the nearest node that is not far: to its part below the surface, or above it.

    is_far : (D, N, M)
    height : (N, M) in slices
    spacing : lengths between nodes along the three axes
    side : 1 if columns are solid below the surface, -1 if they are of air above it
    """
    from scipy.ndimage import distance_transform_edt

    nearest = distance_transform_edt(is_far, sampling=spacing, return_distances=False, return_indices=True)
    row, column = np.asarray(nearest)[1:]
    slices, rows, columns = np.ogrid[tuple(slice(n) for n in is_far.shape)]
    up = np.maximum(side * (slices - height[row, column]), 0.0)
    lengths: Float64 = np.sqrt(
        (spacing[0] * up) ** 2 + (spacing[1] * (rows - row)) ** 2 + (spacing[2] * (columns - column)) ** 2
    )
    return lengths
