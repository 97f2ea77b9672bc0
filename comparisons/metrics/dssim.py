"""Structural dissimilarity of the displayed images."""

from comparisons.metrics.bracket import bracket
from comparisons.metrics.sample import Estimate, Samples, require_rgb
from comparisons.tonemap import exposure_for, to_display
from scenes.errors import ImageError
from scenes.image import Float64

WINDOW_PIXELS = 11


def dssim_tonemapped(image_test: Float64, samples: Samples) -> Estimate:
    """1 - mean SSIM over the judged pixels and channels, both images tone-mapped with the truth's exposure.

    Wang et al., 2004, "Image quality assessment: from error visibility to structural similarity", with its Gaussian
    window (sigma 1.5, 11x11 pixels), K1 = 0.01, K2 = 0.03 and a data range of 1.

    Parameters
    ----------
    image_test : (H, W, 3), linear Rec. 709; H and W at least 11.
    samples : the truth, 3 channels.

    Returns
    -------
    0 (identical) to 2 (inverted). Pixels outside the mask are black in both images.
    """
    require_rgb(samples, "dssim_tonemapped")
    height, width = samples.mask.shape
    if min(height, width) < WINDOW_PIXELS:
        raise ImageError(
            f"dssim_tonemapped compares windows of {WINDOW_PIXELS}x{WINDOW_PIXELS} pixels; the image has "
            f"{width}x{height}: render it larger, or choose nrmse."
        )
    exposure = exposure_for(samples.mean, samples.mask)
    return bracket(
        lambda true, test: 1 - float(ssim_map(true, test)[samples.mask].mean()),
        lambda linear: to_display(linear, exposure),
        image_test,
        samples,
    )


def ssim_map(display_true: Float64, display_test: Float64) -> Float64:
    """(H, W, 3) structural similarity of two images (H, W, 3) in [0, 1]."""
    from skimage.metrics import structural_similarity

    _, similarity = structural_similarity(
        display_true,
        display_test,
        data_range=1.0,
        channel_axis=-1,
        gaussian_weights=True,
        sigma=1.5,
        use_sample_covariance=False,
        full=True,
    )
    local: Float64 = similarity
    return local
