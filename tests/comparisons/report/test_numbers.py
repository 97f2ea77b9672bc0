import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from comparisons.report.numbers import (
    format_bound,
    format_change,
    format_count,
    format_interval,
    format_metric,
    format_number,
    format_percent,
    format_range,
    format_seconds,
)


def test_three_significant_digits() -> None:
    assert format_number(0.07304) == "0.0730"
    assert format_number(12345.0) == "12300"
    assert format_number(9.999) == "10.0"
    assert format_number(-1.2e-6) == "−1.20e−6"
    assert format_number(0.0) == "0"
    assert format_number(8.0, trim=True) == "8"
    assert format_number(100.0, trim=True) == "100"
    assert format_number(math.nan) == "NaN"
    assert format_number(-math.inf) == "−∞"
    assert format_number(None) == "–"


def test_units_of_metrics() -> None:
    assert format_metric("nrmse", 0.0731) == "7.31\u202f%"
    assert format_metric("rel_mse_eps1e-2", 0.0731) == "0.0731"
    assert format_metric("shift_px", 0.002) == "0.00200\u202fpx"
    assert format_metric("rms", 0.002, "m") == "0.00200\u202fm"
    assert format_percent(0.6234) == "62.3\u202f%"
    assert format_percent(0.62, trim=True) == "62\u202f%"
    assert format_percent(None) == "–"
    assert format_count(16384) == "16\u202f384"


def test_intervals_and_bounds() -> None:
    assert format_interval("nrmse", 0.0691, 0.0778) == "[6.91, 7.78]"
    assert format_interval("rms", 0.1, 0.1) == "exact"
    assert format_bound("nrmse", None, 0.08) == "≤ 8\u202f%"
    assert format_bound("nrmse", -0.04, 0.04) == "−4\u202f% to 4\u202f%"
    assert format_bound("dssim", 0.95, None) == "≥ 0.95"


def test_a_range_names_its_unit_once_and_equal_ends_once() -> None:
    assert format_range("nrmse", 0.281, 0.555) == "28.1 to 55.5\u202f%"
    assert format_range("rms", 0.002, 1.5, "mm") == "0.00200 to 1.50\u202fmm"
    assert format_range("flip", 0.0172, 0.0582) == "0.0172 to 0.0582"
    assert format_range("nrmse", 0.5, 0.5) == "50.0\u202f%"


def test_seconds_in_the_unit_that_reads_best() -> None:
    assert format_seconds(0.00184) == "1.84\u202fms"
    assert format_seconds(0.31) == "310\u202fms"
    assert format_seconds(0.00000034) == "0.340\u202fµs"
    assert format_seconds(0.00084) == "840\u202fµs"
    assert format_seconds(12.41) == "12.4\u202fs"
    assert format_seconds(192.3) == "3\u202fmin 12\u202fs"
    assert format_seconds(0.1, trim=True) == "100\u202fms"
    assert format_seconds(1.0, trim=True) == "1\u202fs"


def test_changes_are_factors() -> None:
    assert format_change(1.0153) == "×\u00a01.02"
    assert format_change(0.9997) == "×\u00a01.00"
    assert format_change(0.87331) == "×\u00a00.873"
    assert format_change(12.51) == "×\u00a012.5"
    assert format_change(0.0) == "×\u00a00"


@given(st.floats(-1e300, 1e300))
def test_a_number_reads_back_to_three_digits(value: float) -> None:
    read = float(format_number(value).replace("−", "-"))
    assert read == pytest.approx(value, rel=0.0051, abs=1e-320)
