import math
from collections.abc import Callable
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from comparisons.report.criterion import BAR_BUDGET, BAR_LENGTH, budget_use, criterion_of

Make = Callable[..., dict[str, Any]]


@pytest.mark.parametrize(
    ("value", "low", "high", "use"),
    [
        (0.04, None, 0.08, 0.5),
        (0.16, None, 0.08, 2.0),
        (-0.01, None, 0.08, 0.0),
        (-0.02, -0.04, 0.04, 0.5),
        (1.06, 0.9, 1.1, 0.6),
        (0.975, 0.95, None, 0.5),
        (60.0, 30.0, None, 0.5),
        (0.1, None, 0.0, None),
        (None, None, 0.08, None),
        (math.nan, None, 0.08, None),
    ],
)
def test_budget_use(value: float | None, low: float | None, high: float | None, use: float | None) -> None:
    assert budget_use(value, low, high) == (None if use is None else pytest.approx(use, abs=1e-12))


@given(value=st.floats(0, 10), half_width=st.floats(0, 1), bound=st.floats(0.01, 10))
def test_a_bar_crosses_the_line_exactly_where_the_error_exceeds_its_budget(
    make_criterion: Make, value: float, half_width: float, bound: float
) -> None:
    low, high = value - half_width, value + half_width
    bar = criterion_of(make_criterion(value=value, low=low, high=high, max=bound), "", {}).bar
    assert bar is not None
    assert 0 <= bar.low <= bar.value <= bar.high <= BAR_LENGTH
    rounding = 0.01
    if abs(value / bound - 1) > rounding:
        assert (bar.value > BAR_BUDGET) == (value > bound)
    assert bool(bar.overflow) == (value / bound * BAR_BUDGET > BAR_LENGTH)


def test_an_interval_around_no_bias_starts_at_zero(make_criterion: Make) -> None:
    bar = criterion_of(make_criterion("energy_bias", 0.002, low=-0.01, high=0.014, min=-0.04, max=0.04), "", {}).bar
    assert bar is not None
    assert bar.low == 0
    assert bar.high == pytest.approx(0.35 * BAR_BUDGET, abs=0.01)


def test_what_was_accepted_stands_beside_what_is_measured(make_criterion: Make) -> None:
    accepted = {"date": "2026-01-02", "criteria": {"nrmse": [0.0725, 0.07, 0.075], "flip": [0.0, 0.0, 0.0]}}
    risen = criterion_of(make_criterion(value=0.0731), "", accepted)
    assert risen.accepted == "accepted 7.25\u202f% on 2026-01-02"
    assert risen.change == pytest.approx(0.0731 / 0.0725)
    was_zero = criterion_of(make_criterion("flip", 0.03), "", accepted)
    assert (was_zero.accepted, was_zero.change) == ("accepted 0 on 2026-01-02", None)
    unknown = criterion_of(make_criterion("rms", 0.03), "", accepted)
    assert (unknown.accepted, unknown.change) == ("", None)


def test_a_bias_that_has_changed_its_sign_is_compared_by_its_size(make_criterion: Make) -> None:
    accepted = {"date": "2026-01-02", "criteria": {"energy_bias": [0.01, 0.005, 0.015]}}
    bias = criterion_of(make_criterion("energy_bias", -0.012, min=-0.04, max=0.04), "", accepted)
    assert bias.change == pytest.approx(1.2)


def test_the_noise_of_the_truth_is_told_where_it_adds_to_a_value(make_criterion: Make) -> None:
    assert criterion_of(make_criterion("flip", 0.03, floor=0.012), "", {}).floor == "noise reads 0.0120"
    assert criterion_of(make_criterion("nrmse", 0.03, floor=0.012), "", {}).floor == ""


def test_results_of_older_runs_lack_places_and_renderers(make_criterion: Make) -> None:
    older = {key: value for key, value in make_criterion().items() if key not in ("place", "renderer", "note")}
    view = criterion_of(older, "", {})
    assert (view.place, view.renderer, view.note) == ("", "", "")
