"""How much too bright or too dark an image is as a whole."""

from comparisons.metrics.sample import Estimate, Samples, positive_mean
from comparisons.statistics import firefly_note, student_quantile
from scenes.image import Float64


def energy_bias(image_test: Float64, samples: Samples) -> Estimate:
    """mean(x) / mean(y) - 1 over the judged pixels and all channels.

    Parameters
    ----------
    image_test : (H, W, C), linear.
    samples : the truth; any number of channels, with a positive mean.

    Returns
    -------
    A signed ratio: 0.05 means 5 % too bright. The interval comes from the spread of the K accumulators' means (delta
    method, Student's t with K - 1 degrees of freedom), so noise that is correlated between pixels does not narrow it.
    """
    truth = positive_mean(samples, "energy_bias")
    ratio = float(image_test[samples.mask].mean()) / truth
    if samples.is_exact:
        return Estimate.exact(ratio - 1)
    means = samples.masked.mean(axis=(1, 2))
    k = len(means)
    relative_error = float(means.std(ddof=1)) / k**0.5 / truth
    half_width = abs(ratio) * student_quantile(samples.alpha, k - 1) * relative_error
    note = firefly_note((samples.masked - samples.masked.mean(axis=0)).mean(axis=2, keepdims=True))
    return Estimate(ratio - 1, ratio - 1 - half_width, ratio - 1 + half_width, valid=not note, note=note)
