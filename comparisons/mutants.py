"""Known faults to plant in an image: a check that passes a mutant like the image itself does not see that fault.

DeMillo, Lipton and Sayward, 1978, "Hints on test data selection: help for the practicing programmer".

A mutant is a pure function of an image (H, W, C) and of the mask (H, W) of the pixels that are judged. It returns a new
image of the same shape and is the same on every call.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from scenes.image import Bool, Float32, Float64

GAIN = 1.1
DARKEST_SHARE = 0.1
DISPLAY_GAMMA = 2.2
TILE_PIXELS = 16
TILE_SHARE = 4
"""A tile is at most one part in that many of the height and of the width of what is judged."""

EQUIVALENT_RMS = 1e-4
"""Relative to the image's own root mean square. Two graphics drivers may differ by that; no check is asked for it."""

Mutate = Callable[[Float32, Bool], Float32]


@dataclass(frozen=True)
class Mutant:
    name: str
    summary: str
    function: Mutate


def gain(image: Float32, mask: Bool) -> Float32:
    """The image, 10 % too bright."""
    return image * np.float32(GAIN)


def shift(image: Float32, mask: Bool) -> Float32:
    """The image one pixel to the right; its first column stays."""
    return np.concatenate([image[:, :1], image[:, :-1]], axis=1)


def flip_y(image: Float32, mask: Bool) -> Float32:
    """The image upside down."""
    return image[::-1].copy()


def missing_shadow(image: Float32, mask: Bool) -> Float32:
    """The darkest tenth of the judged pixels lit up to the median.

    How bright a pixel is, is the mean magnitude of its channels, so that normals have a brightness too. Channels keep
    their ratios; black, which has none, becomes grey.
    """
    pixels = image[mask].astype(np.float64)
    level = np.abs(pixels).mean(axis=1)
    median = float(np.median(level))
    darkest = np.argsort(level, kind="stable")[: int(np.ceil(DARKEST_SHARE * len(level)))]
    hue = np.divide(pixels, level[:, None], out=np.ones_like(pixels), where=level[:, None] > 0)
    pixels[darkest] = median * hue[darkest]
    return _with_judged(image, mask, pixels)


def gamma_twice(image: Float32, mask: Bool) -> Float32:
    """Linear values encoded for a display whose white is the largest judged magnitude: x becomes x^(1 / 2.2).

    White stays white and black stays black, as with a true encoding; a level tied to the mean would hide that
    everything in between becomes brighter. Signs stay, for normals.
    """
    pixels = image[mask].astype(np.float64)
    white = float(np.abs(pixels).max())
    if white == 0:
        return image.copy()
    return _with_judged(image, mask, white * np.sign(pixels) * (np.abs(pixels) / white) ** (1 / DISPLAY_GAMMA))


def black_tile(image: Float32, mask: Bool) -> Float32:
    """A tile without values: of 16 x 16 pixels, but not longer than a quarter of the judged pixels' bounding box.

    It lies where most judged pixels are in it; among such places, closest to their centroid.
    """
    rows, columns = np.nonzero(mask)
    extent = np.array([np.ptp(rows), np.ptp(columns)]) + 1
    height, width = np.minimum(TILE_PIXELS, -(-extent // TILE_SHARE))
    count = np.lib.stride_tricks.sliding_window_view(mask, (height, width)).sum(axis=(2, 3))
    tops, lefts = np.nonzero(count == count.max())
    distance = (tops + (height - 1) / 2 - rows.mean()) ** 2 + (lefts + (width - 1) / 2 - columns.mean()) ** 2
    nearest = int(np.argmin(distance))
    top, left = tops[nearest], lefts[nearest]
    mutated = image.copy()
    mutated[top : top + height, left : left + width] = 0
    return mutated


def nan_pixel(image: Float32, mask: Bool) -> Float32:
    """One judged pixel that is not a number: the middle one in reading order."""
    places = np.argwhere(mask)
    row, column = places[len(places) // 2]
    mutated = image.copy()
    mutated[row, column] = np.nan
    return mutated


def is_equivalent(image: Float32, mutated: Float32, mask: Bool) -> bool:
    """Whether the judged pixels are as good as unchanged, as those of a symmetric image that is flipped."""
    original = image[mask].astype(np.float64)
    change = mutated[mask] - original
    return bool(np.mean(change**2) <= EQUIVALENT_RMS**2 * np.mean(original**2))


def _with_judged(image: Float32, mask: Bool, pixels: Float64) -> Float32:
    """The image with other values (P, C) at the judged pixels."""
    mutated = image.copy()
    mutated[mask] = pixels
    return mutated


MUTANTS = {
    mutant.name: mutant
    for mutant in (
        Mutant("gain", "10 % too bright", gain),
        Mutant("shift", "one pixel to the right", shift),
        Mutant("flip_y", "upside down", flip_y),
        Mutant("missing_shadow", "the darkest tenth lit up to the median", missing_shadow),
        Mutant("gamma_twice", "encoded for display where linear values belong", gamma_twice),
        Mutant("black_tile", "a tile of at most 16 x 16 pixels left black", black_tile),
        Mutant("nan_pixel", "one pixel that is not a number", nan_pixel),
    )
}
