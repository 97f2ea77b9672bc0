"""What a metric is, and which images it takes."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from comparisons.metrics.sample import Estimate, Samples
from scenes.errors import ImageError
from scenes.image import Float64


@dataclass(frozen=True)
class Metric:
    """`unit` is "1" for a ratio, "quantity" for the unit of what is judged.

    `sees` names the faults of `comparisons.mutants` that a check by this metric has to notice. The truth's noise would
    add to the value raised to `noise_power` if nothing corrected for it; None if it would not. One that `is_signed` is
    best at 0 and may lie on either side of it; all others are best at their least.
    """

    name: str
    unit: str
    summary: str
    function: Callable[[Float64, Samples], Estimate]
    sees: frozenset[str]
    noise_power: int | None = None
    is_signed: bool = False

    def of(self, image_test: NDArray[Any], samples: Samples) -> Estimate:
        """Judge an image (H, W, C), linear and scene-referred."""
        return self.function(check_image(image_test, samples), samples)


def check_image(image_test: NDArray[Any], samples: Samples) -> Float64:
    """The image as float64 if it can be judged against the truth; values outside the mask that are not finite become 0.

    Raises
    ------
    ImageError
        The shape or the number of channels differs from the truth's, or a judged value is NaN or infinite.
    """
    expected = samples.accumulators.shape[1:]
    if image_test.ndim != 3 or image_test.shape[:2] != expected[:2]:
        raise ImageError(
            f"the image has shape {image_test.shape}; the truth has {expected} (height, width, channels): render both "
            "at the scene's resolution."
        )
    if image_test.shape[2] != expected[2]:
        raise ImageError(
            f"the image has {image_test.shape[2]} channels; the truth has {expected[2]}: compare images of the same "
            "quantity, without alpha."
        )
    image = np.asarray(image_test, dtype=np.float64)
    finite = np.isfinite(image)
    bad = int(np.count_nonzero(~finite[samples.mask].all(axis=1)))
    if bad:
        raise ImageError(
            f"{bad} of {int(np.count_nonzero(samples.mask))} judged pixels of the image are NaN or infinite; only "
            "finite values are allowed: mend the technique, such an image is not judged."
        )
    return np.where(finite, image, 0.0)
