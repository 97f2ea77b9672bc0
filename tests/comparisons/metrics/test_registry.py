"""What is refused before any metric is computed, and what the registry promises."""

import subprocess
import sys
from collections.abc import Callable

import numpy as np
import pytest

from comparisons.metrics import METRICS, Samples, evaluate, metric_named
from scenes.errors import ImageError, InputError
from scenes.image import Float64

Exact = Callable[[Float64], Samples]
TRUTH: Float64 = np.random.default_rng(0).uniform(0.5, 1.0, size=(16, 12, 3))
MASK = np.ones((16, 12), dtype=bool)


def test_every_metric_says_what_it_is() -> None:
    for name, metric in METRICS.items():
        assert metric.name == name
        assert metric.unit
        assert metric.summary


def test_an_unknown_metric_lists_the_closest_first() -> None:
    with pytest.raises(InputError, match=r"unknown metric 'nrsme'; allowed are nrmse, .*max_abs"):
        metric_named("nrsme")


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("metric", METRICS)
def test_an_image_that_is_not_finite_is_refused(metric: str, value: float, exact: Exact) -> None:
    image = TRUTH.copy()
    image[3, 4, 1] = value
    with pytest.raises(ImageError, match="1 of 192 judged pixels of the image are NaN or infinite"):
        evaluate(metric, image, exact(TRUTH))


@pytest.mark.parametrize(
    ("image", "message"),
    [
        (TRUTH[:8], r"the image has shape \(8, 12, 3\); the truth has \(16, 12, 3\)"),
        (TRUTH[..., 0], r"the image has shape \(16, 12\)"),
        (TRUTH[..., :1], "the image has 1 channels; the truth has 3"),
        (np.dstack([TRUTH, TRUTH[..., :1]]), "the image has 4 channels; the truth has 3"),
    ],
    ids=["height", "no channels", "one channel", "alpha"],
)
def test_an_image_of_another_shape_is_refused(image: Float64, message: str, exact: Exact) -> None:
    with pytest.raises(ImageError, match=message):
        evaluate("nrmse", image, exact(TRUTH))


@pytest.mark.parametrize(
    ("accumulators", "mask", "message"),
    [
        (TRUTH, MASK, r"shape \(16, 12, 3\); allowed is \(accumulators"),
        (np.stack([TRUTH] * 2), MASK, "2 accumulators"),
        (np.stack([TRUTH] * 7), MASK, "7 accumulators"),
        (TRUTH[None], MASK[:8], "the mask is bool of shape"),
        (TRUTH[None], MASK.astype(float), "the mask is float64"),
        (TRUTH[None], ~MASK, "the mask is empty"),
        (np.full_like(TRUTH, np.nan)[None], MASK, "576 values inside the mask that are NaN"),
    ],
    ids=["axes", "two", "odd", "mask shape", "mask type", "empty mask", "nan"],
)
def test_a_truth_that_cannot_be_used_is_refused(accumulators: Float64, mask: np.ndarray, message: str) -> None:
    with pytest.raises(ImageError, match=message):
        Samples(accumulators, mask)


@pytest.mark.parametrize("metric", ["nrmse", "rel_mse_eps1e-2", "energy_bias"])
def test_a_black_truth_is_refused_by_relative_metrics(metric: str, exact: Exact) -> None:
    with pytest.raises(ImageError, match="divides by the mean of the truth"):
        evaluate(metric, TRUTH, exact(np.zeros_like(TRUTH)))


def test_importing_the_metrics_loads_no_heavy_library() -> None:
    heavy = "{'colour', 'skimage', 'flip_evaluator', 'scipy', 'mitsuba', 'moderngl'}"
    code = f"import sys, comparisons.gate, comparisons.metrics; print(sorted({heavy} & set(sys.modules)))"
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert result.stdout.strip() == "[]"
