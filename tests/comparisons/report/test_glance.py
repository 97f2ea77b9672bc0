from collections.abc import Callable
from typing import Any

import pytest

from comparisons.report.glance import Glance, Group, in_columns
from comparisons.report.view import overview_of

Make = Callable[..., dict[str, Any]]
Glances = Callable[..., list[Glance]]


@pytest.fixture
def glances(make_results: Make) -> Glances:
    def of(*checks: dict[str, Any]) -> list[Glance]:
        columns = overview_of(make_results(*checks)).glance
        return [row for column in columns for group in column for row in group.rows]

    return of


def test_a_row_goes_from_the_best_scene_to_the_worst(glances: Glances, make_check: Make, make_criterion: Make) -> None:
    mild = make_check(scene="mild", criteria=[make_criterion(value=0.01, low=0.009, high=0.011)])
    bad = make_check(scene="bad", criteria=[make_criterion(value=1.0, low=0.9, high=1.1, verdict="FAIL")])
    (row,) = glances(mild, bad | {"verdict": "FAIL"})
    assert (row.error, row.interval, row.worst.raw["scene"]) == ("1.00 to 100\u202f%", "[90.0, 110]", "bad")
    assert row.reach is not None
    assert list(row.reach) == pytest.approx([0.4, 0.8])
    assert (row.checks, row.verdict) == (2, "FAIL")


def test_the_share_that_is_wrong_is_that_of_the_worst_scene(
    glances: Glances, make_check: Make, make_criterion: Make
) -> None:
    def scene(name: str, value: float, **changes: Any) -> dict[str, Any]:
        return make_check(scene=name, criteria=[make_criterion(value=value)], **changes)

    share = {"share": 0.625, "false_discovery_rate": 0.05, "tiles": 9}
    (row,) = glances(scene("mild", 0.01), scene("bad", 0.07, significance=share))
    assert row.wrong == "62.5\u202f%"
    (row,) = glances(scene("mild", 0.01), scene("bad", 0.07, significance=None))
    assert row.wrong == "–"


def test_ratios_stand_before_errors_that_have_a_unit(glances: Glances, make_check: Make, make_criterion: Make) -> None:
    length = make_check(quantity="iris_uv", technique="long", criteria=[make_criterion("rms", 3.0)], unit="mm")
    ratio = make_check(quantity="iris_uv", technique="short", criteria=[make_criterion("rms", 0.1)], unit="1")
    rows = glances(length, ratio)
    assert [row.technique for row in rows] == ["short", "long"]
    assert [row.reach is None for row in rows] == [False, True]


def test_settings_that_are_names_are_told_apart_and_numbers_are_not(glances: Glances, make_check: Make) -> None:
    settings = ({"side": 24}, {"side": 96}, {"lookup": "slab", "side": 9})
    rows = glances(*(make_check(settings=chosen, fit_exposure=False) for chosen in settings))
    assert [(row.how, row.way, row.checks) for row in rows] == [("", "", 2), ("lookup = slab", "slab", 1)]


def test_what_was_not_measured_has_no_row(glances: Glances, make_check: Make, make_criterion: Make) -> None:
    assert not glances(make_check(criteria=[]), make_check(criteria=[make_criterion(value=None)]))


def test_columns_are_about_equally_tall_and_keep_the_order(glances: Glances, make_check: Make) -> None:
    (row,) = glances(make_check())
    groups = [Group(name, 1, (row,) * count) for name, count in (("a", 5), ("b", 6), ("c", 11), ("d", 3), ("e", 7))]
    columns = in_columns(groups)
    assert [[group.effect for group in column] for column in columns] == [["a", "c"], ["b", "d", "e"]]
    assert in_columns(groups[:1]) == ((groups[0],),)
