"""The registry of metrics: each takes an image and the truth, and returns an estimate with its interval.

To add one: write its module, add its line to `METRICS`, test it on published or closed-form values.
"""

import difflib
from typing import Any

from numpy.typing import NDArray

from comparisons.metrics.abs_difference import max_abs, p99_abs
from comparisons.metrics.angle import p99_angle_deg
from comparisons.metrics.delta_e_itp import delta_e_itp
from comparisons.metrics.dssim import dssim_tonemapped
from comparisons.metrics.energy_bias import energy_bias
from comparisons.metrics.flip import flip
from comparisons.metrics.limb_nrmse import limb_nrmse
from comparisons.metrics.metric import Metric, check_image
from comparisons.metrics.misclassified import misclassified
from comparisons.metrics.nrmse import nrmse
from comparisons.metrics.off_by import off_by_1
from comparisons.metrics.penumbra_rmse import penumbra_rmse
from comparisons.metrics.rel_mse import rel_mse
from comparisons.metrics.rel_mse_clipped import rel_mse_clipped
from comparisons.metrics.rms import rel_rms, rms
from comparisons.metrics.rmse import rmse
from comparisons.metrics.sample import Estimate, Samples
from comparisons.metrics.shift_px import shift_px
from comparisons.metrics.signed_bias import signed_bias
from scenes.errors import InputError

__all__ = ["METRICS", "Estimate", "Metric", "Samples", "check_image", "evaluate", "metric_named"]


_ALL = frozenset({"gain", "shift", "flip_y", "missing_shadow", "gamma_twice", "black_tile", "nan_pixel"})

_DIFFERENCES = _ALL - {"shift"}
"""Differences pixel by pixel: a smooth image that is moved by a pixel hardly differs from itself."""

_MEANS = _DIFFERENCES - {"flip_y"}
"""A mean does not know where a value stands."""

_STRUCTURE = _DIFFERENCES - {"gain"}
"""SSIM takes the mean of a window almost out: it moves by 0.001 for an image that is 10 % too bright."""

_PERCENTILE = _DIFFERENCES - {"missing_shadow", "black_tile"}
"""What is wrong in fewer than one pixel in a hundred lies beyond the percentile."""

_DIRECTIONS = frozenset({"flip_y", "gamma_twice", "nan_pixel"})
"""A percentile of angles, which do not know how long a vector is."""

_AROUND_EDGES = _DIFFERENCES - {"black_tile"}
"""What is wrong far from shadow edges is not judged."""

_LIMB = _DIFFERENCES - {"missing_shadow", "black_tile"}
"""What is wrong far from the outline is not judged."""

_ALIGNMENT = frozenset({"shift", "flip_y", "nan_pixel"})
"""Where things are, not what value they have."""

METRICS = {
    metric.name: metric
    for metric in (
        Metric("nrmse", "1", "root mean square error over the truth's mean, noise removed", nrmse, _DIFFERENCES, 2),
        Metric(
            "limb_nrmse", "1", "root mean square error over the truth's mean, near the outline", limb_nrmse, _LIMB, 2
        ),
        Metric(
            "rel_mse_eps1e-2",
            "1",
            "mean squared error relative to each pixel's truth, noise removed",
            rel_mse,
            _DIFFERENCES,
            1,
        ),
        Metric(
            "rel_mse_clipped",
            "1",
            "the same of image and truth clipped at display white: highlights count up to there",
            rel_mse_clipped,
            _DIFFERENCES,
            1,
        ),
        Metric(
            "energy_bias",
            "1",
            "mean over the truth's mean, minus one: above 0 is too bright",
            energy_bias,
            _MEANS,
            is_signed=True,
        ),
        Metric("signed_bias", "quantity", "mean difference: above 0 is too large", signed_bias, _MEANS, is_signed=True),
        Metric("flip", "1", "mean FLIP error of the tone-mapped images", flip, _DIFFERENCES),
        Metric("dssim_tonemapped", "1", "one minus SSIM of the tone-mapped images", dssim_tonemapped, _STRUCTURE),
        Metric(
            "delta_e_itp", "JND", "mean HDR colour difference, display white at 203 cd/m²", delta_e_itp, _DIFFERENCES
        ),
        Metric("shift_px", "px", "length of the translation that aligns the images", shift_px, _ALIGNMENT),
        Metric("rms", "quantity", "root mean square difference from an exact truth", rms, _DIFFERENCES),
        Metric("rmse", "quantity", "root mean square error, noise removed", rmse, _DIFFERENCES, 2),
        Metric(
            "penumbra_rmse",
            "quantity",
            "root mean square error within 4 px of shadow edges, noise removed",
            penumbra_rmse,
            _AROUND_EDGES,
            2,
        ),
        Metric("misclassified", "1", "share of the area wrongly lit or in shadow", misclassified, _DIFFERENCES),
        Metric(
            "rel_rms",
            "1",
            "root mean square difference over the root mean square of an exact truth",
            rel_rms,
            _DIFFERENCES,
        ),
        Metric(
            "p99_abs",
            "quantity",
            "99th percentile of the absolute difference from an exact truth",
            p99_abs,
            _PERCENTILE,
        ),
        Metric(
            "off_by_1", "1", "share of the pixels that are off an exact truth by more than 1", off_by_1, _DIFFERENCES
        ),
        Metric("p99_angle_deg", "deg", "99th percentile of the angle to an exact truth", p99_angle_deg, _DIRECTIONS),
        Metric("max_abs", "quantity", "largest absolute difference from an exact truth", max_abs, _DIFFERENCES),
    )
}


def metric_named(name: str) -> Metric:
    """The metric of that exact name; an unknown one raises an InputError that lists all, the closest first."""
    if name in METRICS:
        return METRICS[name]
    close = difflib.get_close_matches(name, METRICS, n=len(METRICS), cutoff=0.5)
    ordered = [*close, *(other for other in METRICS if other not in close)]
    raise InputError(f"unknown metric '{name}'; allowed are {', '.join(ordered)}: use one of these names.")


def evaluate(name: str, image_test: NDArray[Any], samples: Samples) -> Estimate:
    """Judge an image (H, W, C), linear and scene-referred, by the metric of that name."""
    return metric_named(name).of(image_test, samples)
