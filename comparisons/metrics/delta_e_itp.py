"""Colour difference for high dynamic range, in just noticeable differences."""

import warnings

import numpy as np

from comparisons.metrics.bracket import bracket
from comparisons.metrics.sample import Estimate, Samples, require_rgb
from comparisons.tonemap import exposure_for
from scenes.image import Float64

# ITU-R BT.2408, "Guidance for operational practices in HDR television production": diffuse white on a reference
# display.
WHITE_CD_M2 = 203.0


def delta_e_itp(image_test: Float64, samples: Samples) -> Estimate:
    """Mean Delta E ITP over the judged pixels. ITU-R BT.2124, equation 1.

    Parameters
    ----------
    image_test : (H, W, 3), linear Rec. 709.
    samples : the truth, 3 channels.

    Returns
    -------
    Just noticeable differences under the most critical adaptation.

    Notes
    -----
    The scale matters: images are exposed as for display, display white is 203 cd/m², and brighter pixels are not
    clipped.
    """
    require_rgb(samples, "delta_e_itp")
    scale = exposure_for(samples.mean, samples.mask) * WHITE_CD_M2
    return bracket(
        lambda true, test: float(difference_itp(true[samples.mask], test[samples.mask]).mean()),
        lambda linear: scale * linear,
        image_test,
        samples,
    )


def difference_itp(rgb_true: Float64, rgb_test: Float64) -> Float64:
    """(P,) Delta E ITP of two lists (P, 3) of linear Rec. 709 colours in cd/m²; negative values count as 0."""
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", message='"Matplotlib" related API')
        import colour

    def to_ictcp(rgb: Float64) -> Float64:
        wide = colour.RGB_to_RGB(np.maximum(rgb, 0.0), "ITU-R BT.709", "ITU-R BT.2020")
        return np.asarray(colour.RGB_to_ICtCp(np.maximum(wide, 0.0), method="ITU-R BT.2100-2 PQ"), dtype=np.float64)

    return np.asarray(colour.delta_E(to_ictcp(rgb_true), to_ictcp(rgb_test), method="ITP"), dtype=np.float64)
