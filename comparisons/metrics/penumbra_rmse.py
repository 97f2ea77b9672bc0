"""Root of the mean squared error around the edges of shadows."""

from dataclasses import replace

import numpy as np

from comparisons.metrics.rms import rms
from comparisons.metrics.rmse import mean_squared_errors, rooted
from comparisons.metrics.sample import Estimate, Samples, require_fractions
from scenes.errors import ImageError
from scenes.image import Bool, Float64

# A pixel that sees less than 2 % or more than 98 % of the light counts as dark or lit: no eye tells it from one.
DARK, LIT = 0.02, 0.98
REACH_PIXELS = 4
# Standard errors. An edge beyond a limit by as much is taken for certain; of those that noise puts there, one in 700.
CERTAIN = 3.0


def penumbra_rmse(image_test: Float64, samples: Samples) -> Estimate:
    """sqrt(mean (x - y)²) over the judged pixels around shadow edges, without the truth's noise.

    Those are the pixels within 4 px of a pixel whose truth is a fraction between 0.02 and 0.98. All others, whose error
    is mostly 0, would make any error small: the wider the image, the smaller.

    Parameters
    ----------
    image_test : (H, W, C), linear.
    samples : the truth, a fraction at each pixel, noisy or exact.

    Returns
    -------
    In the quantity's unit.

    Raises
    ------
    ImageError
        The truth is no fraction, or has no such pixel.

    Notes
    -----
    Noise changes which pixels are chosen. The true choice lies between that around the edges which are certain and that
    around all which are possible; the interval spans the results of both, and the noise of the result on top. That is
    no bound for every choice between them, but held in tests with errors at just the pixels that count.
    """
    require_fractions(samples, "penumbra_rmse")
    chosen = near_edges(samples.mean, samples.mask)
    if not chosen.any():
        raise ImageError(
            "penumbra_rmse needs shadow edges, pixels whose truth is between "
            f"{DARK} and {LIT}; there is none, all are lit or dark: judge rmse or misclassified, or let the sensor see "
            "the edge of a shadow."
        )
    around = replace(samples, mask=chosen)
    if samples.is_exact:
        return rms(image_test, around)
    errors = mean_squared_errors(image_test, around)
    square, half_width = float(errors.values.mean()), errors.half_width(samples.alpha)
    squares = [square, *_with_other_choices(image_test, samples)]
    return rooted(square, min(squares) - half_width, max(squares) + half_width, around)


def near_edges(truth: Float64, mask: Bool, margin: Float64 | float = 0.0) -> Bool:
    """(H, W), the judged pixels whose centre is at most 4 px from that of one with a truth between 0.02 and 0.98.

    margin : (H, W, C) by which the truth must lie within these limits
    """
    from scipy.ndimage import distance_transform_edt

    is_edge = mask & ((truth > DARK + margin) & (truth < LIT - margin)).any(axis=-1)
    if not is_edge.any():
        return is_edge
    near: Bool = mask & (distance_transform_edt(~is_edge) <= REACH_PIXELS)
    return near


def _with_other_choices(image_test: Float64, samples: Samples) -> list[float]:
    """The mean squares around the edges that are certain, if there are any, and around all that are possible."""
    margin = np.zeros(samples.mean.shape)
    margin[samples.mask] = CERTAIN * np.sqrt(samples.variance_of_mean)
    choices = [near_edges(samples.mean, samples.mask, sign * margin) for sign in (1, -1)]
    around = [replace(samples, mask=choice) for choice in choices if choice.any()]
    return [float(mean_squared_errors(image_test, one).values.mean()) for one in around]
