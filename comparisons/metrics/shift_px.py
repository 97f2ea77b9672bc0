"""By how many pixels one image is moved against another."""

import numpy as np

from comparisons.metrics.sample import Estimate, Samples, require_exact
from scenes.errors import ImageError
from scenes.image import Bool, Float64

# The neighbours that the four taps of the interpolation reach: across an edge lies something else.
MARGIN_PIXELS = 2
# Second difference over the typical slope. A hard edge has 2 or more, a wave of six pixels or longer at most 1.
MAX_BEND = 1.0
MIN_PIXELS = 16
# Weakest against strongest direction of squared gradients. Float32 images of a plane reach about 1e-10 through
# rounding.
MIN_STRUCTURE = 1e-6
# Between the gradients of the aligned images. Copies have 1, a mirrored or flipped image about 0.
MIN_CORRELATION = 0.7
MAX_STEPS = 30
CONVERGED_PIXELS = 1e-6


def shift_px(image_test: Float64, samples: Samples) -> Estimate:
    """Length of the one translation that best aligns the images, in pixels.

    Lucas and Kanade, 1981, "An iterative image registration technique with an application to stereo vision", with the
    truth's gradients at every step. Pixels away from hard edges count: there a hundredth of a pixel can be told. Where
    they cannot tell a shift, as in a picture of flat cards and walls, the edges count too, which are less exact.

    Parameters
    ----------
    image_test : (H, W, C)
    samples : the truth, exact, any number of channels. It must vary in two directions, else no shift can be told.

    Returns
    -------
    Pixels. If no shift aligns the images (mirrored, flipped, unrelated, moved by very much), the image's diagonal,
    which is larger than any shift between images that overlap, with a note.
    """
    require_exact(samples, "shift_px")
    if min(samples.mask.shape) < 2:
        raise ImageError(
            f"shift_px needs images of 2 x 2 pixels or more; the truth's height and width are {samples.mask.shape}: "
            "raise the sensor's resolution."
        )
    truth = samples.mean
    gradients = _gradients(truth)
    interior = _away_from_edges(truth, gradients, samples.mask)
    if not _tells_a_shift(truth, gradients, interior):
        interior = _eroded(samples.mask)
        _require_pixels(interior)
        if not _tells_a_shift(truth, gradients, interior):
            raise ImageError(
                "shift_px cannot tell a shift: the truth is constant, or varies in one direction only. It must vary in "
                "two: judge a subject that is not one flat wall."
            )
    diagonal = float(np.hypot(*samples.mask.shape))
    shift = _align(image_test, truth, gradients, interior)
    correlation = -1.0
    if np.hypot(*shift) < diagonal / 4:
        used = interior & _in_frame(samples.mask.shape, shift)
        correlation = _correlation(gradients[:, used], _gradients(moved(image_test, shift))[:, used])
    if correlation < MIN_CORRELATION:
        return Estimate.exact(
            diagonal, note="no shift aligns the images: one is mirrored, flipped, blank or of something else"
        )
    return Estimate.exact(float(np.hypot(*shift)))


def _align(image_test: Float64, truth: Float64, gradients: Float64, interior: Bool) -> Float64:
    """The shift t (rows, columns) for which test(p + t) is closest to truth(p), or where the search left the image."""
    shift = np.zeros(2)
    for _ in range(MAX_STEPS):
        used = interior & _in_frame(interior.shape, shift)
        if np.count_nonzero(used) < MIN_PIXELS:
            break
        slopes = gradients[:, used].reshape(2, -1)
        residual = (moved(image_test, shift) - truth)[used].ravel()
        step = np.linalg.lstsq(slopes @ slopes.T, slopes @ residual, rcond=None)[0]
        shift = shift - step
        if np.hypot(*step) < CONVERGED_PIXELS or np.hypot(*shift) > np.hypot(*interior.shape):
            break
    return shift


def moved(image: Float64, shift: Float64) -> Float64:
    """image(p + shift), by cubic Lagrange interpolation through four pixels along rows, then columns."""
    for axis in (0, 1):
        whole = int(np.floor(shift[axis]))
        u = shift[axis] - whole
        taps = (
            -u * (u - 1) * (u - 2) / 6,
            (u + 1) * (u - 1) * (u - 2) / 2,
            -(u + 1) * u * (u - 2) / 2,
            (u + 1) * u * (u - 1) / 6,
        )
        last = image.shape[axis] - 1
        pixels = np.arange(last + 1) + whole
        neighbours = [np.take(image, np.clip(pixels + offset, 0, last), axis) for offset in (-1, 0, 1, 2)]
        image = np.tensordot(taps, np.stack(neighbours), axes=1)
    return image


def _gradients(image: Float64) -> Float64:
    """(2, H, W, C), central differences along rows and columns."""
    return np.stack([np.gradient(image, axis=0), np.gradient(image, axis=1)])


def _eroded(mask: Bool, pixels: int = 1) -> Bool:
    """The pixels of the mask so far away from its border."""
    from scipy.ndimage import binary_erosion

    inner: Bool = binary_erosion(mask, np.ones((3, 3)), iterations=pixels)
    return inner


def _away_from_edges(truth: Float64, gradients: Float64, mask: Bool) -> Bool:
    """The pixels of the mask away from its border and from hard edges of the truth."""
    inner = _eroded(mask)
    slope = np.sqrt(np.mean(gradients[:, inner] ** 2)) if inner.any() else 0.0
    bends = [np.abs(_second_difference(truth, axis)) > MAX_BEND * slope for axis in (0, 1)]
    is_edge = inner & np.any(bends, axis=(0, 3))
    return _eroded(mask & ~is_edge, MARGIN_PIXELS)


def _require_pixels(used: Bool) -> None:
    count = int(np.count_nonzero(used))
    if count < MIN_PIXELS:
        raise ImageError(
            f"shift_px needs {MIN_PIXELS} pixels inside the mask; there are {count}: render the subject larger."
        )


def _second_difference(image: Float64, axis: int) -> Float64:
    """f(p - 1) - 2 f(p) + f(p + 1) along an axis of an image (H, W, C); 0 at its border."""
    bend = np.zeros_like(image)
    inner = [slice(None)] * 3
    inner[axis] = slice(1, -1)
    bend[tuple(inner)] = np.diff(image, 2, axis=axis)
    return bend


def _in_frame(shape: tuple[int, ...], shift: Float64) -> Bool:
    """(H, W), the pixels p for which p + shift lies in the image."""
    rows, columns = (np.arange(size) + offset for size, offset in zip(shape, shift, strict=True))
    inside: Bool = ((rows >= 1) & (rows <= shape[0] - 2))[:, None] & (columns >= 1) & (columns <= shape[1] - 2)
    return inside


def _tells_a_shift(truth: Float64, gradients: Float64, used: Bool) -> bool:
    """Whether the truth varies in two directions at enough of the pixels in use."""
    if np.count_nonzero(used) < MIN_PIXELS:
        return False
    slopes = gradients[:, used].reshape(2, -1)
    weakest, strongest = np.linalg.eigvalsh(slopes @ slopes.T / slopes.shape[1])
    magnitude = float(np.abs(truth[used]).max())
    return bool(strongest > (MIN_STRUCTURE * magnitude) ** 2 and weakest > MIN_STRUCTURE * strongest)


def _correlation(first: Float64, second: Float64) -> float:
    """Cosine of the angle between two sets of slopes; 0 if one of them is all zero."""
    scale = float(np.sqrt(np.sum(first**2) * np.sum(second**2)))
    return float(np.sum(first * second)) / scale if scale > 0 else 0.0
