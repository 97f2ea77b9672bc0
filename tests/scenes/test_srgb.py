import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from scenes import srgb

UNIT = st.floats(0.0, 1.0)


@pytest.mark.parametrize(("code", "linear"), [(0, 0.0), (10, 0.003035), (127, 0.212231), (188, 0.502886), (255, 1.0)])
def test_published_code_values(code: int, linear: float) -> None:
    assert srgb.decode(np.array(code / 255)) == pytest.approx(linear, abs=1e-6)
    assert srgb.encode(np.array(linear)) * 255 == pytest.approx(code, abs=2e-3)


@given(UNIT)
def test_decode_undoes_encode(linear: float) -> None:
    assert srgb.decode(srgb.encode(np.array(linear))) == pytest.approx(linear, abs=1e-7)


@given(UNIT, UNIT)
def test_brighter_stays_brighter(a: float, b: float) -> None:
    low, high = sorted((a, b))
    assert srgb.encode(np.array(low)) <= srgb.encode(np.array(high)) + 3e-8


def test_values_outside_the_range_are_clipped() -> None:
    assert srgb.encode(np.array([-1.0, 7.0])).tolist() == [0.0, pytest.approx(1.0)]
    assert srgb.decode(np.array([-1.0, 7.0])).tolist() == [0.0, pytest.approx(1.0)]
