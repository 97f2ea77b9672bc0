from collections.abc import Callable

from comparisons.bench.pareto import on_front
from comparisons.bench.result import Point


def test_what_is_both_slower_and_worse_is_off_the_front(make_point: Callable[..., Point]) -> None:
    points = [make_point(0.1, 0.02), make_point(0.2, 0.01), make_point(0.2, 0.03), make_point(0.05, 0.05)]
    assert on_front(points) == (True, True, False, True)


def test_as_good_but_slower_is_off_and_twins_are_both_on(make_point: Callable[..., Point]) -> None:
    assert on_front([make_point(0.1, 0.01), make_point(0.1, 0.02)]) == (True, False)
    assert on_front([make_point(0.1, 0.01), make_point(0.1, 0.01)]) == (True, True)


def test_only_points_of_the_same_thing_compete(make_point: Callable[..., Point]) -> None:
    best = make_point(0.01, 0.001)
    for other in ({"scene": "knot"}, {"quantity": "radiance"}, {"metric": "flip"}, {"width": 32}):
        assert on_front([best, make_point(0.1, 0.1, **other)]) == (True, True)
    assert on_front([best, make_point(0.1, 0.1, technique="indirect.grid")]) == (True, False)
