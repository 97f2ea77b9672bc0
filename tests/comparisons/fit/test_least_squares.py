"""Many numbers at once: a mixture of exponentials whose parts are known, as highlights are one of lobes."""

import numpy as np
import pytest

from comparisons.fit.least_squares import LAST_STEPS, least_squares_from
from comparisons.fit.search import MANY, Errors, Settings, best_settings, takes_many
from comparisons.fit.space import Axis
from scenes.image import Float64

PLACES = np.linspace(0.0, 1.0, 60)
PARTS = 8
BEST = {f"strength_{k}": 0.5 + 0.2 * k for k in range(PARTS)} | {f"centre_{k}": (k + 0.5) / PARTS for k in range(PARTS)}
AXES = [Axis(f"strength_{k}", 1.0, 0.01, 10.0) for k in range(PARTS)] + [
    Axis(f"centre_{k}", (k + 0.2) / PARTS, 0.0, 1.0) for k in range(PARTS)
]
START = {axis.name: axis.published for axis in AXES}


def image(settings: Settings, shift: float = 0.0) -> Float64:
    parts = [(float(settings[f"strength_{k}"]), float(settings[f"centre_{k}"])) for k in range(PARTS)]
    return np.asarray(sum(s * np.exp(-(((PLACES - c - shift) / 0.05) ** 2)) for s, c in parts))


def errors(shift: float = 0.0) -> tuple[Errors, list[Settings]]:
    """Those of a truth that is moved a little, and the settings that were tried."""
    truth, tried = image(BEST), list[Settings]()

    def off(settings: Settings) -> Float64:
        tried.append(settings)
        return image(settings, shift) - truth

    return Errors(lambda settings: float(np.sum(off(settings) ** 2)), off), tried


def test_many_numbers_are_found_one_by_one() -> None:
    assert takes_many(AXES)
    assert not takes_many(AXES[:MANY])
    fine, _ = errors()
    found = best_settings(fine, fine, AXES, START, 40 * len(AXES))
    assert found.error < 1e-3 * fine.error(START)
    for name, value in BEST.items():
        assert found.settings[name] == pytest.approx(value, abs=0.01 if "centre" in name else 0.05), name


def test_most_drawings_are_rough_and_the_last_steps_follow_the_true_error() -> None:
    """The rough truth lies a little aside: only the last steps take that back."""
    (fine, in_full), (rough, roughly) = errors(), errors(shift=0.01)
    found = best_settings(fine, rough, AXES, START, 40 * len(AXES))
    assert len(in_full) <= LAST_STEPS * (1 + len(AXES)) + 6
    assert len(roughly) > 3 * len(in_full)
    centres = np.mean([float(found.settings[f"centre_{k}"]) - BEST[f"centre_{k}"] for k in range(PARTS)])
    assert abs(centres) < 1e-3


def test_no_more_is_drawn_than_allowed() -> None:
    fine, tried = errors()
    best_settings(fine, fine, AXES, START, 200)
    looked_around = 1 + 3 * len(AXES) + 64
    assert len(tried) <= 200 + looked_around + LAST_STEPS * (1 + len(AXES)) + 10


def test_what_is_best_at_an_end_is_found_there() -> None:
    axes = [Axis(f"x{k}", 0.5, 0.0, 1.0) for k in range(MANY + 1)]
    goal = np.linspace(-0.5, 1.5, len(axes))

    def off(settings: Settings) -> Float64:
        return np.array([float(settings[axis.name]) for axis in axes]) - goal

    both = Errors(lambda settings: float(np.sum(off(settings) ** 2)), off)
    found = best_settings(both, both, axes, {axis.name: 0.5 for axis in axes}, 600)
    np.testing.assert_allclose([float(value) for value in found.settings.values()], np.clip(goal, 0, 1), atol=2e-3)


def test_without_evaluations_the_best_start_stays() -> None:
    def off(places: Float64) -> Float64:
        return places - 0.3

    found = least_squares_from([[0.9] * 3, [0.5] * 3], off, off, 0)
    assert found.shape == (3,)
    assert float(np.sum(off(found) ** 2)) <= 3 * 0.6**2
