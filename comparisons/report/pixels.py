"""The numbers behind a check's pictures, as a script that the report's viewer reads.

A page that was opened as a file may neither fetch files nor read the pixels of its images; it may run scripts. So the
values travel as one call of `lightgauge.show`, with each image as the base64 of a zlib stream. What is deflated are
float32 values, rounded to fewer significant bits and split into planes of bytes: the first bytes of all values, then
the second ones, and so on. Rounding leaves the last planes almost empty, so that a value costs what its significant
bits cost, without a limit to its range as half floats have.
"""

import base64
import json
import zlib
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from comparisons.metrics.sample import Samples
from comparisons.report.pictures import DIVERGING, MAGMA, NOT_A_NUMBER, NOT_JUDGED, VIRIDIS, WITHIN_NOISE
from comparisons.significance import Significance
from reference.quantity import Display
from reference.store import write_text
from scenes.image import Bool, Float32

VALUE_BITS = 11
"""Significant bits of a value, those of a half float: its relative error is 2^-11 at most."""

SIGMA_BITS = 7
"""Significant bits of a standard error, which is itself known to a fifth."""

COLOURS = {
    "diverging": DIVERGING,
    "magma": MAGMA,
    "viridis": VIRIDIS,
    "notJudged": NOT_JUDGED,
    "withinNoise": WITHIN_NOISE,
    "notANumber": NOT_A_NUMBER,
}
"""What the viewer shares with the pictures."""


def write_pixels(
    folder: Path,
    stem: str,
    test: Float32,
    samples: Samples,
    *,
    quantity: str,
    unit: str,
    display: Display,
    exposure: float,
    error_scale: float,
    smoothing: float = 0.0,
    significance: Significance | None = None,
    flip: Float32 | None = None,
    worst: tuple[int, int] | None = None,
) -> str:
    """Write `pixels/STEM.js` under `folder`, which hands the values of a check to the viewer.

    Parameters
    ----------
    folder, stem, exposure, error_scale, display, smoothing, significance : as for `pictures.write_pictures`.
    test : (H, W, C), the judged image, linear, C = 1 to 3.
    samples : the truth, (K, H, W, C), and the pixels that are judged.
    quantity, unit : what the values are.
    flip : (H, W), the FLIP error, for radiance.
    worst : x and y of the pixel to look at first.

    Returns
    -------
    str
        The path relative to `folder`.
    """
    height, width, channels = test.shape
    mask = samples.mask
    with np.errstate(invalid="ignore"):
        error = test.astype(np.float64) - samples.mean
    images = {
        "realtime": _everywhere(test),
        "truth": _judged(samples.mean, mask),
        "error": _judged(error, mask),
    }
    if not samples.is_exact:
        images["sigma"] = _judged(samples.standard_error, mask, SIGMA_BITS)
    if flip is not None:
        images["flip"] = _judged(flip[..., None], mask)
    if significance is not None:
        images["significance"] = _judged(np.where(significance.wrong, significance.signed, np.nan)[..., None], mask)
    content = {
        "quantity": quantity,
        "unit": unit,
        "display": display,
        "width": width,
        "height": height,
        "channels": channels,
        "exposure": exposure,
        "errorScale": error_scale,
        "smoothing": smoothing,
        "worst": worst,
        "colours": COLOURS,
        "judged": _packed(np.packbits(mask, bitorder="little")),
        "images": images,
    }
    path = f"pixels/{stem}.js"
    (folder / "pixels").mkdir(parents=True, exist_ok=True)
    write_text(folder / path, f"lightgauge.show({json.dumps(content, allow_nan=False, separators=(',', ':'))});\n")
    return path


def rounded(values: NDArray[Any], bits: int) -> Float32:
    """Float32 values of `bits` significant bits, the nearest ones; NaN and infinities stay what they are.

    Within the normal range of float32, 1e-38 to 3e38, the relative error is 2^-bits at most.
    """
    exact = np.ascontiguousarray(values, dtype=np.float32)
    dropped = np.uint32(24 - bits)
    pattern = exact.view(np.uint32)
    is_odd = (pattern >> dropped) & np.uint32(1)
    nearest = pattern + ((np.uint32(1) << (dropped - np.uint32(1))) - np.uint32(1)) + is_odd  # ties to even
    kept = ((nearest >> dropped) << dropped).view(np.float32)
    return np.where(np.isfinite(exact), kept, exact)


def _everywhere(image: NDArray[Any]) -> dict[str, Any]:
    return {"channels": image.shape[2], "where": "everywhere", "data": _packed(_planes(rounded(image, VALUE_BITS)))}


def _judged(image: NDArray[Any], mask: Bool, bits: int = VALUE_BITS) -> dict[str, Any]:
    """The values (H, W, C) at the judged pixels, row by row."""
    return {"channels": image.shape[2], "where": "judged", "data": _packed(_planes(rounded(image[mask], bits)))}


def _planes(values: Float32) -> NDArray[np.uint8]:
    """Bytes 0 of all values, then bytes 1, 2 and 3, the last of which hold sign and exponent."""
    return np.ascontiguousarray(values.astype("<f4").reshape(-1, 1).view(np.uint8).T)


def _packed(data: NDArray[np.uint8]) -> str:
    """A zlib stream in base64. More effort than the least takes 16 times as long, for files that are 5 % smaller."""
    return base64.b64encode(zlib.compress(data.tobytes(), zlib.Z_BEST_SPEED)).decode("ascii")
