"""The pixel to look at first."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from comparisons.metrics.metric import check_image
from comparisons.metrics.sample import Samples

DISTINCT = 3.0
"""Standard errors of the truth that are taken off an error before errors are compared: of a hundred thousand pixels,
noise alone exceeds that in a few hundred, by a fraction of it."""


def worst_pixel(image_test: NDArray[Any], samples: Samples) -> dict[str, Any]:
    """The judged pixel whose error, less `DISTINCT` standard errors of the truth, is largest in any channel.

    Parameters
    ----------
    image_test : (H, W, C), linear.

    Returns
    -------
    `x` and `y`, counted from the top left pixel, and lists of C values: `realtime`, `truth` and its standard error
    `sigma`.
    """
    test = check_image(image_test, samples)
    truth, sigma = samples.mean, samples.standard_error
    excess = (np.abs(test - truth) - DISTINCT * sigma).max(axis=2)
    y, x = np.unravel_index(int(np.argmax(np.where(samples.mask, excess, -np.inf))), excess.shape)
    values = {"realtime": test, "truth": truth, "sigma": sigma}
    return {"x": int(x), "y": int(y)} | {name: [float(v) for v in image[y, x]] for name, image in values.items()}
