"""Errors whose least value is known, and how few drawings find it."""

import math
from collections.abc import Callable

import numpy as np
import pytest

from comparisons.fit.search import Errors, Found, Settings, best_settings, without_effect
from comparisons.fit.space import Axis, Choice, Part


def number(settings: Settings, name: str) -> float:
    value = settings[name]
    assert isinstance(value, int | float)
    return value


def searched(
    error: Callable[[Settings], float], parts: list[Part], start: dict[str, float | str], evaluations: int = 80
) -> tuple[Found, int]:
    """What is found, and how many different settings were tried."""
    tried: dict[tuple[object, ...], float] = {}

    def remembered(settings: Settings) -> float:
        key = tuple(sorted(settings.items()))
        if key not in tried:
            tried[key] = error(settings)
        return tried[key]

    errors = Errors(remembered, lambda settings: np.zeros(0))
    return best_settings(errors, errors, parts, start, evaluations), len(tried)


def test_one_number() -> None:
    found, tried = searched(lambda s: 1 + (number(s, "a") - 0.3) ** 2, [Axis("a", 2.0, 0, 10)], {"a": 2.0})
    assert found.settings["a"] == pytest.approx(0.3, abs=0.02)
    assert tried <= 30


def test_a_positive_number_over_decades() -> None:
    found, tried = searched(lambda s: math.log(number(s, "a") / 3e-3) ** 2, [Axis("a", 1.0, 1e-4, 10)], {"a": 1.0})
    assert found.settings["a"] == pytest.approx(3e-3, rel=0.02)
    assert tried <= 30


def test_a_narrow_valley_at_an_angle() -> None:
    def error(s: Settings) -> float:
        a, b = number(s, "a"), number(s, "b")
        return 1 + 100 * (a + b - 1.1) ** 2 + (a - b + 0.3) ** 2

    found, tried = searched(error, [Axis("a", 0.9, 0, 1), Axis("b", 0.9, 0, 1)], {"a": 0.9, "b": 0.9})
    assert found.settings == {"a": pytest.approx(0.4, abs=0.02), "b": pytest.approx(0.7, abs=0.02)}
    assert tried <= 80


def test_the_lower_of_two_dips() -> None:
    """From the published value, downhill leads to the wrong one."""

    def error(s: Settings) -> float:
        a = number(s, "a")
        return 2 - math.exp(-(((a - 0.1) / 0.1) ** 2)) - 2 * math.exp(-(((a - 0.8) / 0.1) ** 2))

    found, _ = searched(error, [Axis("a", 0.15, 0, 1)], {"a": 0.15})
    assert found.settings["a"] == pytest.approx(0.8, abs=0.01)


def test_many_numbers_that_depend_on_each_other() -> None:
    names = "abcdefgh"
    rng = np.random.default_rng(0)
    mixed, best = rng.normal(size=(20, 8)), rng.uniform(0.2, 0.8, 8)

    def error(s: Settings) -> float:
        x = np.array([number(s, name) for name in names])
        return 1 + float(np.sum((mixed @ (x - best) * (1 + 0.3 * x.sum())) ** 2))

    found, _ = searched(error, [Axis(n, 0.1, 0, 1) for n in names], dict.fromkeys(names, 0.1), 320)
    np.testing.assert_allclose([number(found.settings, n) for n in names], best, atol=0.01)


def test_whole_numbers_and_plateaus() -> None:
    """The error has steps, as that of a cube with 8 bits a channel has."""

    def error(s: Settings) -> float:
        return round(200 * ((number(s, "a") - 0.3) ** 2 + 0.01 * (number(s, "n") - 7) ** 2)) / 200

    found, _ = searched(error, [Axis("a", 0.9, 0, 1), Axis("n", 2, 1, 12, True)], {"a": 0.9, "n": 2})
    assert found.settings["n"] == 7
    assert found.settings["a"] == pytest.approx(0.3, abs=0.05)


def test_settings_that_cannot_be_drawn_are_avoided() -> None:
    def error(s: Settings) -> float:
        a, b = number(s, "a"), number(s, "b")
        return math.inf if a + b > 1.2 else 1 + (a - 0.3) ** 2 + (b - 0.8) ** 2

    found, _ = searched(error, [Axis("a", 0.1, 0, 1), Axis("b", 0.1, 0, 1)], {"a": 0.1, "b": 0.1})
    assert found.error == pytest.approx(1, abs=1e-3)


def test_all_choices_are_tried_each_with_its_own_numbers() -> None:
    def error(s: Settings) -> float:
        best, floor = (0.2, 2.0) if s["way"] == "short" else (0.6, 1.0)
        return floor + (number(s, "a") - best) ** 2

    parts: list[Part] = [Choice("way", "short", ("short", "long")), Axis("a", 0.2, 0, 1)]
    found, _ = searched(error, parts, {"way": "short", "a": 0.2})
    assert found.settings == {"way": "long", "a": pytest.approx(0.6, abs=0.01)}


def test_no_more_drawings_than_allowed() -> None:
    """Once everywhere was looked: three points an axis, the start, and eight of the sequence."""
    parts: list[Part] = [Axis("a", 0.9, 0, 1), Axis("b", 0.9, 0, 1)]
    _, tried = searched(lambda s: number(s, "a") ** 2 + number(s, "b"), parts, {"a": 0.9, "b": 0.9}, 24)
    assert tried <= 24


def test_what_is_best_as_published_stays() -> None:
    """Even where it is none of the values that a search can reach."""
    found, _ = searched(lambda s: abs(number(s, "a") - 0.123456), [Axis("a", 0.123456, 0, 1)], {"a": 0.123456})
    assert found.settings == {"a": 0.123456}


def test_what_has_no_effect_is_found() -> None:
    parts: list[Part] = [Axis("a", 1.0, 0, 2), Axis("b", 1.0, 0, 2), Choice("way", "x", ("x", "y"))]
    still = without_effect(lambda s: 1 + number(s, "a") ** 2, parts, {"a": 1.0, "b": 1.0, "way": "x"})
    assert [part.name for part in still] == ["b", "way"]
