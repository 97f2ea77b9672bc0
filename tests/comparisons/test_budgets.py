"""Budgets on a command line: what they mean, and what is refused."""

import pytest

from comparisons.budgets import GIVEN, parse_budgets
from scenes.errors import InputError


def test_a_budget_is_the_most_that_a_metric_may_be() -> None:
    (only,) = parse_budgets(["nrmse=0.05"])
    assert (only.metric, only.min, only.max, only.reason) == ("nrmse", None, 0.05, GIVEN)


def test_two_bounds_are_the_least_and_the_most() -> None:
    first, second = parse_budgets([" energy_bias = -4e-2..0.04 ", "flip=.1"])
    assert (first.metric, first.min, first.max) == ("energy_bias", -0.04, 0.04)
    assert (second.metric, second.max) == ("flip", 0.1)


def test_one_bound_of_a_metric_with_a_sign_holds_in_either_direction() -> None:
    """An image that loses two thirds of its light is no better than one that is two thirds too bright."""
    bias, darker = parse_budgets(["energy_bias=0.04", "signed_bias=-0.2..-0.1"])
    assert (bias.min, bias.max) == (-0.04, 0.04)
    assert (darker.min, darker.max) == (-0.2, -0.1)


def test_no_text_is_no_budget() -> None:
    assert parse_budgets([]) == ()


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("nrmse", "has no bound. Write METRIC=MAX"),
        ("nrsme=0.1", "unknown metric 'nrsme'; allowed are nrmse,"),
        ("=0.1", "unknown metric ''"),
        ("nrmse=", "which is no finite number"),
        ("nrmse=5%", "'5%', which is no finite number"),
        ("nrmse=nan", "'nan', which is no finite number"),
        ("nrmse=inf", "'inf', which is no finite number"),
        ("energy_bias=..0.1", "'', which is no finite number"),
        ("nrmse=-1", "allows at most -1, which leaves no room for any error"),
        ("nrmse=0", "allows at most 0"),
        ("energy_bias=-0.1", "allows at most -0.1"),
        ("nrmse=-2..-1", "allows at most -1"),
        ("energy_bias=0.1..-0.1", "wrong order; write energy_bias=-0.1..0.1"),
    ],
)
def test_what_is_written_otherwise_is_refused(text: str, said: str) -> None:
    with pytest.raises(InputError) as refused:
        parse_budgets([text])
    assert f"The budget '{text}'" in str(refused.value)
    assert said in str(refused.value)


def test_a_metric_has_one_budget() -> None:
    with pytest.raises(InputError, match=r"second for nrmse; give one: METRIC=MIN\.\.MAX"):
        parse_budgets(["nrmse=0.05", "nrmse=0.1"])
