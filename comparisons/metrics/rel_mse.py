"""Mean of the squared error relative to the truth at each pixel."""

import numpy as np

from comparisons.metrics.sample import Estimate, Samples, positive_mean
from comparisons.statistics import PixelEstimates, firefly_note, squared_errors
from scenes.image import Bool, Float64

# A truth of 1 % of the mean or less counts as dark: below it the error is absolute, so black pixels do not divide by
# zero.
EPSILON = 0.01
# A weight 1 / y² from a y with relative noise s is too large by 3 s² + (15 - 4 g) s⁴ + ... of itself, where g s⁴ is the
# third moment of the relative noise: g is 2 for gamma noise, 6 for the indirect light of the shipped scenes. The first
# term is removed, the rest bounded by SHARP_FACTOR s⁴ and added to the interval, while s² is below NOISY_WEIGHT.
SHARP_FACTOR = 25
NOISY_WEIGHT = 0.05
BLUR_PIXELS = 5
# What blurred weights may do to a result, relative to it. Measured on pools of real samples of shipped scenes: -21 % to
# +5 %, most for an image without the truth's detail.
BLURRED_ALLOWANCE = 0.3


def rel_mse(image_test: Float64, samples: Samples) -> Estimate:
    """mean of (x - y)² / (y² + (0.01 mean(y))²) over the judged pixels and all channels, without the truth's noise.

    Parameters
    ----------
    image_test : (H, W, C), linear.
    samples : the truth; any number of channels, with a positive mean.

    Returns
    -------
    A ratio of squares, clipped to 0 from below.

    Notes
    -----
    The denominator must not share samples with the numerator: that alone adds 151 % at 16 samples a pixel. Each half of
    the accumulators is judged with weights from the other half, and the two results are averaged. While a half is very
    noisy its weights come from its 5x5 mean over judged pixels, which costs a fifth of the value where the truth has
    detail and the image has none. What the weights may cost is added to the interval. The test image is not in the
    denominator: a technique could lower its error by being too bright.
    """
    positive_mean(samples, "rel_mse_eps1e-2")
    test = image_test[samples.mask]
    floor = denominator_floor(samples)
    if samples.is_exact:
        truth = samples.masked[0]
        return Estimate.exact(float(np.mean((test - truth) ** 2 / (truth**2 + floor))))
    terms = weighted_errors(test, samples, floor)
    value = float(terms.values.mean())
    half_width = terms.half_width(samples.alpha)
    allowance = 1 + weight_allowance(samples, terms.values)
    low, high = max(0.0, value - half_width) / allowance, max(0.0, value + half_width) * allowance
    weights = _weights(samples.masked, samples.mask, floor).values
    note = firefly_note(samples.masked - samples.masked.mean(axis=0))  # weights would hide them: they are bright
    noise = max(0.0, float(np.mean(weights * samples.variance_of_mean)))
    return Estimate(max(0.0, value), low, high, valid=not note, note=note, floor=noise)


def denominator_floor(samples: Samples) -> float:
    """What is added to the squared truth, so that black pixels do not divide by zero."""
    return (EPSILON * float(samples.masked.mean())) ** 2


def weights_are_blurred(samples: Samples) -> bool:
    """Whether the weights of a half of the accumulators come from the 5x5 mean around each pixel."""
    return any(float(noise.mean()) > NOISY_WEIGHT for noise in _noise_of_halves(samples))


def weight_allowance(samples: Samples, errors: Float64) -> float:
    """What the weights may add to or take from a result, relative to it; errors (P,) are the pixels' estimates.

    Each pixel counts by its share of the error: noisy weights do harm where the error is.
    """
    if weights_are_blurred(samples):
        return BLURRED_ALLOWANCE
    shares = np.maximum(errors, 0.0)
    total = float(shares.sum())
    if total == 0:
        return 0.0
    remainders = (np.mean(noise**2, axis=1) for noise in _noise_of_halves(samples))
    return SHARP_FACTOR * max(float(remainder @ shares) for remainder in remainders) / total


def _noise_of_halves(samples: Samples) -> tuple[Float64, Float64]:
    half = len(samples.masked) // 2
    floor = denominator_floor(samples)
    return _relative_noise(samples.masked[:half], floor), _relative_noise(samples.masked[half:], floor)


def _relative_noise(accumulators: Float64, floor: float) -> Float64:
    """(P, C), the squared relative noise s² of the mean of some accumulators."""
    variance = accumulators.var(axis=0, ddof=1) / len(accumulators)
    noise: Float64 = variance / (accumulators.mean(axis=0) ** 2 + floor)
    return noise


def weighted_errors(test: Float64, samples: Samples, floor: float) -> PixelEstimates:
    """Per-pixel terms whose mean estimates the relative squared error; test (P, C), floor is added to y².

    Notes
    -----
    Z = mean over channels of (w_B U_A + w_A U_B) / 2, from halves A and B. Leaving an accumulator out of A changes U_A
    and, to first order, w_A. The halves have h accumulators each: the factor turns the jackknife's (2h - 1) / 2h for
    all into the (h - 1) / h that holds for each half alone.
    """
    half = len(samples.masked) // 2
    halves = samples.masked[:half], samples.masked[half:]
    errors = [_channel_errors(test - accumulators) for accumulators in halves]
    weights = [_weights(accumulators, samples.mask, floor) for accumulators in halves]
    deviations = [
        (weights[1 - i].values * errors[i].deviations + weights[i].deviations * errors[1 - i].values).mean(axis=-1) / 2
        for i in (0, 1)
    ]
    values = (weights[1].values * errors[0].values + weights[0].values * errors[1].values).mean(axis=-1) / 2
    factor = np.sqrt((half - 1) / half / ((2 * half - 1) / (2 * half)))
    return PixelEstimates(values, factor * np.concatenate(deviations))


def _channel_errors(differences: Float64) -> PixelEstimates:
    """Unbiased squared error of every pixel and channel on its own: values (P, C), deviations (K, P, C)."""
    errors = squared_errors(differences.reshape(len(differences), -1, 1))
    return PixelEstimates(errors.values.reshape(differences.shape[1:]), errors.deviations.reshape(differences.shape))


def _weights(accumulators: Float64, mask: Bool, floor: float) -> PixelEstimates:
    """Weights 1 / (y² + floor) from a half (K, P, C): values (P, C), deviations (K, P, C).

    The blurred weights are steady: their deviations count as 0.
    """
    k = len(accumulators)
    mean = accumulators.mean(axis=0)
    variance = accumulators.var(axis=0, ddof=1) / k
    weights = 1 / (mean**2 + floor)
    if float(_relative_noise(accumulators, floor).mean()) > NOISY_WEIGHT:
        return PixelEstimates(1 / (_blur(mean, mask) ** 2 + floor), np.zeros_like(accumulators))
    slope = -2 * mean * weights**2
    curvature = 8 * mean**2 * weights**3 - 2 * weights**2
    return PixelEstimates(weights - curvature * variance / 2, slope * (mean - accumulators) / (k - 1))


def _blur(values: Float64, mask: Bool) -> Float64:
    """Mean of the judged pixels in the 5x5 neighbourhood of each of them; values (P, C)."""
    from scipy.ndimage import uniform_filter

    image = np.zeros((*mask.shape, values.shape[1]))
    image[mask] = values
    size = (BLUR_PIXELS, BLUR_PIXELS, 1)
    total = uniform_filter(image, size, mode="constant")
    share = uniform_filter(mask[..., None].astype(np.float64), size, mode="constant")
    blurred: Float64 = total[mask] / share[mask]
    return blurred
