"""How much too large or too small a quantity is on average."""

from comparisons.metrics.sample import Estimate, Samples
from comparisons.statistics import firefly_note, student_quantile
from scenes.image import Float64


def signed_bias(image_test: Float64, samples: Samples) -> Estimate:
    """mean(x - y) over the judged pixels and all channels, in the quantity's unit.

    Parameters
    ----------
    image_test : (H, W, C), linear.
    samples : the truth; any number of channels, with a mean of any sign.

    Returns
    -------
    A signed difference. The interval comes from the spread of the K accumulators' means (Student's t with K - 1 degrees
    of freedom), so noise that is correlated between pixels does not narrow it.
    """
    means = samples.masked.mean(axis=(1, 2))
    value = float(image_test[samples.mask].mean() - means.mean())
    if samples.is_exact:
        return Estimate.exact(value)
    k = len(means)
    half_width = student_quantile(samples.alpha, k - 1) * float(means.std(ddof=1)) / k**0.5
    deviations = samples.masked - samples.masked.mean(axis=0)
    note = firefly_note(deviations.mean(axis=2, keepdims=True))
    return Estimate(value, value - half_width, value + half_width, valid=not note, note=note)
