"""The pictures of a check: both images made visible, and where they differ."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from comparisons.significance import Significance
from reference.quantity import Display
from reference.store import beside_of
from scenes.errors import ImageError
from scenes.image import Bool, Float32, Float64

Bytes = NDArray[np.uint8]

# Cynthia Brewer, ColorBrewer 2.0, "RdBu", 5 classes, reversed: safe for colour-blind readers.
DIVERGING = ("#0571b0", "#92c5de", "#f7f7f7", "#f4a582", "#ca0020")
# Every 15th colour of Matplotlib's magma and viridis: van der Walt and Smith, 2015, "A better default colormap for
# Matplotlib". Both are perceptually uniform; straight lines between these colours stay within 5/255 of the tables.
MAGMA = (
    *("#000004", "#090720", "#1a1042", "#311165", "#4a1079", "#621980", "#792282", "#912b81", "#aa337d"),
    *("#c23b75", "#d9466b", "#ec5860", "#f7725c", "#fc8e64", "#feaa74", "#fec68a", "#fde2a3", "#fcfdbf"),
)
VIRIDIS = (
    *("#440154", "#481769", "#472a7a", "#433d84", "#3d4e8a", "#355e8d", "#2e6d8e", "#297b8e", "#23898e"),
    *("#1f978b", "#21a585", "#2eb37c", "#46c06f", "#65cb5e", "#89d548", "#b0dd2f", "#d8e219", "#fde725"),
)
NOT_JUDGED = "#3a3a3a"
WITHIN_NOISE = "#bdbdbd"
NOT_A_NUMBER = "#ff00ff"


def write_pictures(
    folder: Path,
    stem: str,
    test: Float32,
    truth: Float32,
    mask: Bool,
    exposure: float,
    error_scale: float,
    display: Display = "radiance",
    smoothing: float = 0.0,
    significance: Significance | None = None,
    flip: Float32 | None = None,
) -> dict[str, str]:
    """Write `images/STEM-realtime.png`, `-truth.png` and `-error.png` under `folder`, one picture pixel an image pixel.

    If it is known where the image is wrong beyond noise, write `-significance.png` as well; `-flip.png` if the FLIP
    error is.

    Parameters
    ----------
    folder : Path
        The report's folder.
    stem : str
        A file name without folders, different for each check.
    test, truth : (H, W, C) float32
        Linear values of the quantity, row 0 at the top, C = 1 to 3.
    mask : (H, W) bool
        The pixels that are judged.
    exposure : float
        Factor before tone mapping (radiance), or 1 / the value that is shown white (depth, uv). Not used otherwise.
    error_scale : float
        The error, in the unit of the quantity, that gets the colour map's outermost colours.
    display : Display
        How values become visible: see `visible`.
    smoothing : float
        Standard deviation in pixels of the Gaussian that averages the error map, for a truth whose pixels are noisy.
    significance : Significance or None
        Where `test` is wrong beyond the truth's noise, (H, W).
    flip : (H, W) float32 or None
        The FLIP error of each pixel, 0 to 1.

    Returns
    -------
    dict of str
        `realtime`, `truth`, `error`, and `significance` and `flip` if those are given: paths relative to `folder`.

    Raises
    ------
    ImageError
        Shapes that do not fit together, or a scale that is not positive.
    """
    _validate(test, truth, mask, error_scale)
    pictures = {
        "realtime": _bytes(visible(test, exposure, display), mask),
        "truth": _bytes(visible(truth, exposure, display), mask),
        "error": error_map(test, truth, mask, error_scale, smoothing),
    }
    if significance is not None:
        pictures["significance"] = significance_map(significance, mask, error_scale)
    if flip is not None:
        pictures["flip"] = flip_picture(flip, mask)
    (folder / "images").mkdir(parents=True, exist_ok=True)
    paths = {name: f"images/{stem}-{name}.png" for name in pictures}
    for name, pixels in pictures.items():
        _save(folder / paths[name], pixels)
    return paths


def write_flagged(folder: Path, stem: str, flagged: Bool) -> dict[str, str]:
    """Write `images/STEM-realtime.png` of a technique that found no value at some pixels (H, W): they are magenta."""
    path = f"images/{stem}-realtime.png"
    (folder / "images").mkdir(parents=True, exist_ok=True)
    _save(folder / path, np.where(flagged[..., None], _rgb(NOT_A_NUMBER), _rgb(NOT_JUDGED)).astype(np.uint8))
    return {"realtime": path}


def visible(pixels: Float32, exposure: float, display: Display) -> Float64:
    """Map values of a quantity to display values in [0, 1], (H, W, C); what is not a number stays so.

    radiance: exposed, tone-mapped and sRGB-encoded; normal: (n + 1) / 2; unit: as it is; depth and uv:
    times `exposure`.
    """
    if display == "radiance":
        from comparisons.tonemap import to_display

        finite = np.isfinite(pixels)
        return np.where(finite, to_display(np.where(finite, pixels, 0), exposure), np.nan)
    scale, offset = {
        "normal": (0.5, 0.5),
        "unit": (1.0, 0.0),
        "uv": (exposure, 0.0),
        "depth": (exposure, 0.0),
    }[display]
    return np.clip(pixels.astype(np.float64) * scale + offset, 0, 1)


def error_map(test: Float32, truth: Float32, mask: Bool, error_scale: float, smoothing: float = 0.0) -> Bytes:
    """Colour the channel mean of `test - truth`: blue is too dark, white is right, red is too bright, (H, W, 3) bytes.

    The colours span +-`error_scale` and clip outside. Unjudged pixels are dark grey, those without a value magenta.
    """
    with np.errstate(invalid="ignore"):
        error = (test.astype(np.float64) - truth.astype(np.float64)).mean(axis=2)
    if smoothing > 0:
        error = _smoothed(error, mask, smoothing)
    coloured = _diverging(error, error_scale)
    coloured[~np.isfinite(error)] = _rgb(NOT_A_NUMBER)
    coloured[~mask] = _rgb(NOT_JUDGED)
    return _quantised(coloured)


def significance_map(significance: Significance, mask: Bool, error_scale: float) -> Bytes:
    """Colour the tiles that are wrong beyond noise by their mean error, as `error_map` does, (H, W, 3) bytes.

    What shows no error beyond noise is light grey, unjudged pixels are dark grey.
    """
    coloured = _diverging(significance.signed, error_scale)
    coloured[~significance.wrong] = _rgb(WITHIN_NOISE)
    coloured[~mask] = _rgb(NOT_JUDGED)
    return _quantised(coloured)


def flip_picture(flip: Float32, mask: Bool) -> Bytes:
    """Colour FLIP errors (H, W) by magma from 0, black, to 1, light yellow; (H, W, 3) bytes.

    This is the scale of FLIP itself, the same for all checks. Unjudged pixels are dark grey.
    """
    coloured = _coloured(flip.astype(np.float64), 0.0, 1.0, MAGMA)
    coloured[~mask] = _rgb(NOT_JUDGED)
    return _quantised(coloured)


def _diverging(error: Float64, scale: float) -> Float64:
    """(H, W, 3) colours in [0, 255] of errors (H, W), the outermost from +-`scale` on."""
    return _coloured(error, -scale, scale, DIVERGING)


def _coloured(values: Float64, low: float, high: float, colours: Sequence[str]) -> Float64:
    """(H, W, 3) in [0, 255]: values (H, W) by colours at equal distances from `low` to `high`, clipped outside."""
    stops = np.array([_rgb(colour) for colour in colours], dtype=np.float64)
    positions = np.linspace(low, high, len(stops))
    return np.stack([np.interp(values, positions, stops[:, channel]) for channel in range(3)], axis=2)


def _smoothed(error: Float64, mask: Bool, sigma: float) -> Float64:
    """Gaussian mean over the judged pixels around each one; those that have no value keep none."""
    from scipy.ndimage import gaussian_filter

    weight = (mask & np.isfinite(error)).astype(np.float64)
    total = gaussian_filter(np.where(weight > 0, error, 0.0), sigma)
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.where(np.isfinite(error), total / gaussian_filter(weight, sigma), error)


def _bytes(shown: Float64, mask: Bool) -> Bytes:
    """Quantise display values; a pixel without a value is magenta where it is judged and grey elsewhere."""
    count = shown.shape[2]
    rgb = 255 * (np.pad(shown, ((0, 0), (0, 0), (0, 1))) if count == 2 else np.repeat(shown, 3 // count, axis=2))
    undefined = np.logical_or.reduce(np.isnan(rgb), axis=2)
    rgb[undefined & mask] = _rgb(NOT_A_NUMBER)
    rgb[undefined & ~mask] = _rgb(NOT_JUDGED)
    return _quantised(rgb)


def _quantised(values: Float64) -> Bytes:
    quantised: Bytes = np.rint(values).astype(np.uint8)
    return quantised


def _rgb(colour: str) -> tuple[int, int, int]:
    return int(colour[1:3], 16), int(colour[3:5], 16), int(colour[5:7], 16)


def _validate(test: Float32, truth: Float32, mask: Bool, error_scale: float) -> None:
    if test.ndim != 3 or test.shape[2] not in (1, 2, 3) or test.shape != truth.shape or mask.shape != test.shape[:2]:
        raise ImageError(
            "The pictures of a check need two images (H, W, 1 to 3) of one size and a mask (H, W), but got "
            f"{test.shape}, {truth.shape} and {mask.shape}. Render both sides with the same sensor."
        )
    if not error_scale > 0:
        raise ImageError(
            f"The scale of an error map must be positive, but is {error_scale:g}. It follows from the budget and the "
            "truth's mean: check that the truth is not black and that the criterion allows some error."
        )


def _save(path: Path, pixels: Bytes) -> None:
    """Write a PNG. An optimised one takes four times as long, and is 4 % smaller."""
    from PIL import Image as Picture

    with beside_of(path) as beside:
        Picture.fromarray(pixels).save(beside, format="PNG")
