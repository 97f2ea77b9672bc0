"""Budgets that are given on a command line."""

import math
from collections.abc import Iterable

from comparisons.metrics import metric_named
from scenes.checks import Criterion
from scenes.errors import InputError

GIVEN = "given on the command line"
"""The reason of such a budget."""


def parse_budgets(texts: Iterable[str]) -> tuple[Criterion, ...]:
    """Criteria from texts such as `nrmse=0.05` (at most) or `energy_bias=-0.02..0.04` (at least and at most).

    One bound for a metric that has a sign holds in either direction: `energy_bias=0.04` is `energy_bias=-0.04..0.04`.

    Raises
    ------
    InputError
        A text is written otherwise, its metric is unknown or has a budget already, or a bound is no finite number or
        one that nothing can meet.
    """
    budgets: dict[str, Criterion] = {}
    for text in texts:
        criterion = _criterion(text)
        if criterion.metric in budgets:
            raise InputError(f"The budget '{text}' is the second for {criterion.metric}; give one: METRIC=MIN..MAX.")
        budgets[criterion.metric] = criterion
    return tuple(budgets.values())


def budget_options(criteria: Iterable[Criterion]) -> tuple[str, ...]:
    """The options of a command line that give those of the criteria that came from one."""
    given = (criterion for criterion in criteria if criterion.reason == GIVEN)
    return tuple(option for criterion in given for option in ("--budget", _as_text(criterion)))


def _as_text(criterion: Criterion) -> str:
    least = f"{criterion.min!r}.." if criterion.min is not None else ""
    return f"{criterion.metric}={least}{criterion.max!r}"


def _criterion(text: str) -> Criterion:
    name, equals, bounds = (part.strip() for part in text.partition("="))
    if not equals:
        raise InputError(f"The budget '{text}' has no bound. Write METRIC=MAX or METRIC=MIN..MAX, such as nrmse=0.05.")
    try:
        metric_named(name)
    except InputError as error:
        raise InputError(f"The budget '{text}': {error}") from error
    least, dots, most = bounds.partition("..")
    low, high = (_bound(text, least), _bound(text, most)) if dots else (None, _bound(text, bounds))
    if low is not None and low > high:
        raise InputError(f"The budget '{text}' has its bounds in the wrong order; write {name}={high:g}..{low:g}.")
    if high <= 0 and (low is None or not metric_named(name).is_signed):
        raise InputError(
            f"The budget '{text}' allows at most {high:g}, which leaves no room for any error. Write a number above 0, "
            f"such as {name}=0.05."
        )
    if low is None and metric_named(name).is_signed:
        low = -high
    return Criterion(metric=name, min=low, max=high, reason=GIVEN)


def _bound(text: str, number: str) -> float:
    try:
        bound = float(number)
    except ValueError:
        bound = math.nan
    if not math.isfinite(bound):
        raise InputError(
            f"The budget '{text}' has the bound '{number}', which is no finite number. Write METRIC=MAX or "
            "METRIC=MIN..MAX, such as nrmse=0.05 or energy_bias=-0.04..0.04."
        )
    return bound
