"""The interpreter does in single precision what the GPU does."""

from collections.abc import Callable, Mapping

import numpy as np
import pytest

from comparisons.glsl.values import Array, Value
from comparisons.stress.domains import DOMAINS
from comparisons.stress.examination import Subject, subject
from comparisons.stress.inputs import drawn

COUNT = 1024
APPROXIMATED = {
    "lib/ball.glsl:part_above_horizon": "Mesa's asin is a polynomial, off by up to 2e-4",
    "lib/sky.glsl:sky_uv": "Mesa's acos and atan are polynomials, off by up to 2e-4",
}
"""Functions whose built-in ones GLSL allows to be loose, and Mesa makes so."""


@pytest.mark.parametrize("name", [name for name in DOMAINS if name.startswith("lib/")])
def test_functions_give_what_they_give_on_the_gpu(
    name: str,
    on_gpu: Callable[[Subject, Mapping[str, Value]], Array],
    side_by_side: Callable[[Mapping[str, Value], int], Array],
) -> None:
    """Most numbers are the same to the last digit; where they are not, both are as far from double precision."""
    of = subject(name)
    inputs = drawn(of.kinds, np.random.default_rng(5), COUNT)
    gpu = on_gpu(of, inputs).astype(np.float64)
    single = side_by_side(of.evaluate(inputs, np.float32).outputs, COUNT)
    double = side_by_side(of.evaluate(inputs, np.float64).outputs, COUNT)
    if name in APPROXIMATED:
        np.testing.assert_allclose(gpu, single, atol=2e-4)
        return
    size = np.maximum(np.abs(double), 1e-6)
    ours, theirs = np.abs(single - double) / size, np.abs(gpu - double) / size
    assert np.median(np.abs(gpu - single) / size) <= 2e-7
    assert np.quantile(theirs, 0.99) <= 2 * np.quantile(ours, 0.99) + 2e-6
