"""Where an image is wrong beyond the noise of its truth: a test on each tile, false discoveries controlled over all.

A tile's K mean errors, one against each accumulator, are independent and of equal variance, and by the central limit
theorem close to normal: Student's t with K - 1 degrees of freedom tells whether their mean is zero. Single pixels are
not normal at low sample counts: at 16 samples a pixel, a map of them raises false alarms on every image.

Channels are tested one by one: in their mean, errors of opposite sign would cancel. The tile's p-value combines theirs:
Simes, 1986, "An improved Bonferroni procedure for multiple tests of significance". It costs a grey error nothing,
since its p-values are alike. The tiles of both sizes form one family: Benjamini and Hochberg, 1995, "Controlling the
false discovery rate". Channels that share their paths and tiles that share their pixels are positively dependent, which
does no harm to one-sided tests: Benjamini and Yekutieli, 2001, "The control of the false discovery rate in multiple
testing under dependency". That it does none to these two-sided ones is measured: see `significance`.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from comparisons.metrics.metric import check_image
from comparisons.metrics.sample import Samples
from scenes.image import Bool, Float64

FALSE_DISCOVERY_RATE = 0.05
"""The share of the tiles called wrong that may be right; of images without any error, that many have such a tile."""

LEAST_SPP = 64
"""Samples a pixel below which rough truth raises too many false alarms."""

TILE_SIZES = (16, 8)
"""Pixels, the largest first: large tiles find small errors, small ones say where an error is."""

MIN_JUDGED = 16
"""Judged pixels that a tile needs, a quarter of a small one. Means of fewer inherit the skewness of single pixels: on a
thin ring with gamma noise (coefficient of variation 2, 16 spp), 11 % false alarms with 4 pixels, 6 % with 16."""


@dataclass(frozen=True)
class Significance:
    """Where the mean error of a tile differs from zero beyond noise.

    wrong  : (H, W), judged pixels in a significant tile of either size. An error that is smaller than its tile marks
             the whole tile.
    signed : (H, W), the mean error x - y of the smallest significant tile around each wrong pixel, in the channel that
             is most certainly wrong, in the unit of the quantity; 0 elsewhere
    share  : wrong pixels over judged pixels
    tiles  : tiles tested
    """

    wrong: Bool
    signed: Float64
    share: float
    tiles: int

    @property
    def summary(self) -> dict[str, float | int]:
        """What results.json says about it."""
        return {"share": self.share, "false_discovery_rate": FALSE_DISCOVERY_RATE, "tiles": self.tiles}


@dataclass(frozen=True)
class _Grid:
    """Tiles of one size: which of them are `tested` (rows, columns), and a p-value and an error for each of those."""

    size: int
    tested: Bool
    p_values: Float64
    errors: Float64

    def spread(self, values: NDArray[Any], shape: tuple[int, int]) -> NDArray[Any]:
        """An image of `shape` with the value of each tested tile at its pixels, 0 elsewhere."""
        tiles = np.zeros(self.tested.shape, dtype=values.dtype)
        tiles[self.tested] = values
        return tiles.repeat(self.size, axis=0).repeat(self.size, axis=1)[: shape[0], : shape[1]]


def significance(image_test: NDArray[Any], samples: Samples) -> Significance | None:
    """Test the tiles of an image against a noisy truth.

    Parameters
    ----------
    image_test : (H, W, C), linear.
    samples : the truth; its pixels' noise is independent.

    Returns
    -------
    None if there is nothing to test: the truth is exact, or no tile has `MIN_JUDGED` judged pixels.

    Raises
    ------
    ImageError
        The image does not fit the truth, or has judged values that are NaN or infinite.

    Notes
    -----
    False alarms, the share of images without error in which any tile is called wrong, measured with 16 accumulators:
    5 to 6 % on 64x64 pixels from 16 spp on, for Gaussian noise and for gamma noise whose samples have a coefficient of
    variation of up to 2. Indirect light of two shipped scenes: 6 % at 64 and 5 % at 256 spp; at 16 spp, 3 % for the
    figurine and 21 % for the knot (skewness of a sample 6), then in 1 % of the pixels.

    It breaks where the mean over a tile is itself skewed, so that few rare paths decide it: log-normal noise of σ = 1.5
    raises 32 % at 16, 15 % at 64 and 9 % at 256 spp; if one path in a thousand carries all light, 100 %, 68 % and 15 %.
    Most tiles then miss such paths, and the image seems too bright in them.
    """
    image = check_image(image_test, samples)
    if samples.is_exact:
        return None
    differences = np.zeros(samples.accumulators.shape)
    differences[:, samples.mask] = image[samples.mask] - samples.masked
    level = np.where(samples.mask[..., None], np.abs(image) + np.abs(samples.mean), 0.0)
    grids = [_grid(differences, level, samples.mask, size) for size in TILE_SIZES]
    return _marked(grids, samples.mask) if any(grid.tested.any() for grid in grids) else None


def _grid(differences: Float64, level: Float64, mask: Bool, size: int) -> _Grid:
    """The t-tests of the tiles of one size.

    Both images come as float32, so no error is known better than the last digit of the pixels' level: this bounds the
    standard error where the truth has no noise.
    """
    from scipy.special import stdtr
    from scipy.stats import false_discovery_control

    k = len(differences)
    judged = _tile_sums(mask[None].astype(np.float64), size)[0]
    tested = judged >= MIN_JUDGED
    count = judged[tested][:, None]
    means = _tile_sums(differences, size)[:, tested] / count
    last_digit = np.finfo(np.float32).eps * _tile_sums(level[None], size)[0, tested] / count
    error = means.mean(axis=0)
    standard_error = np.maximum(means.std(axis=0, ddof=1) / np.sqrt(k), last_digit)
    t = np.divide(error, standard_error, out=np.zeros_like(error), where=error != 0)
    adjusted = false_discovery_control(2 * stdtr(k - 1, -np.abs(t)), axis=1)
    surest = np.abs(t).argmax(axis=1)[:, None]
    return _Grid(size, tested, adjusted.min(axis=1), np.take_along_axis(error, surest, axis=1)[:, 0])


def _tile_sums(values: Float64, size: int) -> Float64:
    """(N, H, W, ...) summed over tiles, the last ones cut off by the image's edge: (N, rows, columns, ...)."""
    height, width = values.shape[1:3]
    rows = np.add.reduceat(values, range(0, height, size), axis=1)
    sums: Float64 = np.add.reduceat(rows, range(0, width, size), axis=2)
    return sums


def _marked(grids: Sequence[_Grid], mask: Bool) -> Significance:
    """Mark the pixels of significant tiles. The last grid has the smallest tiles and the last word on the error."""
    from scipy.stats import false_discovery_control

    family = np.concatenate([grid.p_values for grid in grids])
    significant = false_discovery_control(family) <= FALSE_DISCOVERY_RATE
    ends = np.cumsum([len(grid.p_values) for grid in grids])
    wrong = np.zeros(mask.shape, dtype=np.bool_)
    signed = np.zeros(mask.shape)
    for grid, found in zip(grids, np.split(significant, ends[:-1]), strict=True):
        pixels = grid.spread(found, mask.shape) & mask
        wrong |= pixels
        signed = np.where(pixels, grid.spread(grid.errors, mask.shape), signed)
    return Significance(wrong, signed, float(wrong[mask].mean()), len(family))
