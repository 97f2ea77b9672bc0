"""The angle between vectors."""

import numpy as np

from comparisons.metrics.sample import Estimate, Samples, require_exact
from scenes.errors import ImageError
from scenes.image import Float64


def p99_angle_deg(image_test: Float64, samples: Samples) -> Estimate:
    """99th percentile of the angle between the vectors of judged pixels. Lengths do not count.

    Kahan 2006, "How futile are mindless assessments of roundoff in floating-point computation?", section 12: twice the
    arctangent of |a - b| / |a + b| for unit vectors is precise for small angles, where the arccosine of a dot product
    is not. A vector without length has no direction: it is half a turn off.

    Parameters
    ----------
    image_test : (H, W, 3)
    samples : the truth, exact, of three channels

    Raises
    ------
    ImageError
        The truth has another number of channels, or a vector without length.
    """
    require_exact(samples, "p99_angle_deg")
    truth, test = samples.masked[0], image_test[samples.mask]
    lengths = np.linalg.norm(truth, axis=1)
    if truth.shape[1] != 3 or not lengths.all():
        raise ImageError(
            f"p99_angle_deg compares directions; the truth has {truth.shape[1]} channels and {np.sum(lengths == 0)} "
            "pixels without a direction, allowed are three channels and none. Judge such a quantity by p99_abs."
        )
    a = truth / lengths[:, None]
    test_lengths = np.linalg.norm(test, axis=1, keepdims=True)
    b = np.divide(test, test_lengths, out=-a, where=test_lengths > 0)
    angle = 2 * np.arctan2(np.linalg.norm(a - b, axis=1), np.linalg.norm(a + b, axis=1))
    return Estimate.exact(float(np.degrees(np.percentile(angle, 99))))
