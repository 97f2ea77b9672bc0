"""FLIP: the difference a viewer sees when flipping between two images."""

import hashlib
from typing import Any

import numpy as np
from numpy.typing import NDArray

from comparisons.metrics.bracket import bracket
from comparisons.metrics.sample import Estimate, Samples, require_rgb
from comparisons.tonemap import exposure_for, to_display
from scenes.image import Float64

MAPS_KEPT = 32
"""Those of the last checks: what the noise of a truth alone reads is the same for every technique that is held against
it, and the picture of a check often shows a map that was just judged.
"""

_maps: dict[tuple[tuple[int, ...], bytes], NDArray[np.float32]] = {}
"""By the content of both images, the oldest first."""


def flip(image_test: Float64, samples: Samples) -> Estimate:
    """Mean of the LDR FLIP map over the judged pixels, both images tone-mapped with the truth's exposure.

    Andersson et al., 2020, "FLIP: A difference evaluator for alternating images", at its default 67 pixels per degree.

    Parameters
    ----------
    image_test : (H, W, 3), linear Rec. 709.
    samples : the truth, 3 channels.

    Returns
    -------
    0 (no visible difference) to 1. Pixels outside the mask are black in both images.
    """
    require_rgb(samples, "flip")
    exposure = exposure_for(samples.mean, samples.mask)
    return bracket(
        lambda true, test: float(flip_map(true, test)[samples.mask].mean()),
        lambda linear: to_display(linear, exposure),
        image_test,
        samples,
    )


def flip_image(image_test: NDArray[Any], samples: Samples) -> NDArray[np.float32]:
    """(H, W) FLIP error of each pixel; its mean over the judged pixels is the `high` of `flip`, noise included.

    Parameters and conditions are those of `flip`.
    """
    require_rgb(samples, "flip")
    exposure = exposure_for(samples.mean, samples.mask)
    test = np.where(samples.mask[..., None], image_test, 0.0)
    return flip_map(to_display(samples.mean, exposure), to_display(test, exposure))


def flip_map(display_true: Float64, display_test: Float64) -> NDArray[np.float32]:
    """(H, W) FLIP error of two images (H, W, 3) of sRGB code values in [0, 1]."""
    true, test = (np.ascontiguousarray(image, dtype=np.float32) for image in (display_true, display_test))
    key = true.shape, hashlib.sha256(true.tobytes() + test.tobytes()).digest()
    if key not in _maps:
        _maps[key] = _evaluated(true, test)
        if len(_maps) > MAPS_KEPT:
            del _maps[next(iter(_maps))]
    return _maps[key]


def _evaluated(true: NDArray[np.float32], test: NDArray[np.float32]) -> NDArray[np.float32]:
    from flip_evaluator import evaluate

    error_map, _, _ = evaluate(true, test, "LDR", inputsRGB=True, applyMagma=False)
    errors: NDArray[np.float32] = error_map[..., 0].copy()
    errors.flags.writeable = False
    return errors
