"""What a part of a technique changes, as one small picture."""

import base64
import io

import numpy as np

from comparisons.report.pictures import error_map, visible
from comparisons.tonemap import exposure_for
from reference.estimator import Truth
from reference.quantities import quantity
from scenes.errors import ImageError
from scenes.image import Float32

GAP = 2
"""Black pixels between pictures."""


def strip(whole: Float32, less: Float32, truth: Truth) -> str:
    """A PNG in base64 of an image (H, W, C), that without a part, and where the latter is too dark or too bright.

    Too dark is blue and too bright is red, the outermost colours from a wrong mean level of the truth on. Nothing (an
    empty text) for quantities that are no radiance, and where the truth is black.
    """
    from PIL import Image

    mean = truth.accumulators.mean(axis=0, dtype=np.float64)
    if quantity(truth.quantity).display != "radiance":
        return ""
    try:
        exposure = exposure_for(mean, truth.mask)
    except ImageError:
        return ""
    shown = [np.rint(255 * visible(image, exposure, "radiance")).astype(np.uint8) for image in (whole, less)]
    change = error_map(less, whole, truth.mask, float(mean[truth.mask].mean()))
    gap = np.zeros((whole.shape[0], GAP, 3), dtype=np.uint8)
    held = io.BytesIO()
    Image.fromarray(np.concatenate([shown[0], gap, shown[1], gap, change], axis=1)).save(held, format="PNG")
    return base64.b64encode(held.getvalue()).decode("ascii")
