import math
import re
from collections.abc import Callable
from dataclasses import replace

import pytest

from comparisons.bench.claims import claim, claims, needed_for, time_needed
from comparisons.bench.result import Interval, Point, Slope, Traced
from comparisons.bench.traced import slope_of


def test_between_its_images_the_path_tracer_is_interpolated_and_beyond_them_its_slope_is_followed(
    ladder: list[Traced],
) -> None:
    inside = needed_for(1 / math.sqrt(6), ladder, None)
    assert inside.is_measured
    assert [inside.spp, inside.seconds] == pytest.approx([6, 0.06])
    slope = slope_of(ladder)
    assert slope is not None
    assert slope.exponent.value == pytest.approx(-0.5)
    beyond = needed_for(0.01, ladder, slope)
    assert not beyond.is_measured
    assert [beyond.spp, beyond.seconds] == pytest.approx([10_000, 100.0])


def test_a_steeper_slope_needs_less_beyond_the_last_image(make_traced: Callable[..., Traced]) -> None:
    steep = [make_traced(spp, 1 / spp, 0.01 * spp) for spp in (1, 2, 4)]
    assert needed_for(0.01, steep, slope_of(steep)).spp == pytest.approx(100)


def test_times_and_errors_of_both_sides_widen_the_interval_of_the_time_that_is_needed(
    ladder: list[Traced], make_traced: Callable[..., Traced]
) -> None:
    error = Interval(0.5, 0.4, 0.6)
    found = time_needed(error, ladder, None)
    assert (found.value, found.low, found.high) == pytest.approx((0.04, 0.01 / 0.36, 0.01 / 0.16))
    noisy = [make_traced(t.spp, t.error.value, t.seconds.value, 0.1) for t in ladder]
    wider = time_needed(error, noisy, None)
    assert (wider.low, wider.high) == pytest.approx((0.9 * 0.9**2 * found.low, 1.1 * 1.1**2 * found.high))
    assert time_needed(Interval(0.5, 0.0, 0.6), ladder, None).high == math.inf


def test_what_is_unsure_of_the_path_tracer_widens_the_interval_too(ladder: list[Traced]) -> None:
    """10 % of its error are 21 % of its samples; beyond its images the slope is unsure as well."""
    error = Interval(0.5, 0.5, 0.5)
    unsure = [replace(t, error=Interval(e := t.error.value, 0.9 * e, 1.1 * e)) for t in ladder]
    found = time_needed(error, unsure, None)
    assert (found.low, found.value, found.high) == pytest.approx((0.04 * 0.81, 0.04, 0.04 * 1.21))
    slope = slope_of(ladder)
    assert slope is not None
    far = Interval(0.025, 0.025, 0.025)
    beyond = time_needed(far, ladder, replace(slope, exponent=Interval(-0.5, -1.0, -0.25)))
    assert (beyond.low, beyond.value, beyond.high) == pytest.approx((1.6, 16.0, 1600.0))
    assert time_needed(far, ladder, replace(slope, exponent=Interval(-0.5, -1.0, 0.1))).high == math.inf


@pytest.mark.parametrize(
    ("error", "seconds", "said"),
    [
        (0.5, 0.001, r"nrmse 50.0.% .* in 1.00.ms; the path tracer needs 40.0.ms \(4 spp\): 40.0 \[.*\] times as long"),
        (0.5, 0.4, r"the path tracer needs 40.0.ms \(4 spp\): 10.0 \[.*\] times less"),
        (0.5, 0.039, r"\(4 spp\): as long, as far as can be told \(1.03 \[0.771, 1.41\] times\)"),
        (0.125, 0.001, r"needs 640.ms \(64 spp, by its slope\): 640 \["),
        (1.2, 0.4, r"path tracing with 1 spp is better \(100.%\) and quicker \(10.0.ms\)"),
        (1.2, 0.001, r"path tracing with 1 spp is better \(100.%\), and takes 10.0.ms: 10.0 \[.*\] times as long"),
        (0.0, 0.001, "no number of samples makes path tracing as good"),
    ],
)
def test_a_claim_says_what_the_path_tracer_needs_for_the_same_error(
    make_point: Callable[..., Point], ladder: list[Traced], error: float, seconds: float, said: str
) -> None:
    found = claim(make_point(error, seconds, 0.1), ladder, slope_of(ladder))
    assert re.search(said, found), found
    assert found.startswith("room: indirect.probe reaches nrmse")


def test_an_exact_truth_is_held_against_its_time_alone(
    make_point: Callable[..., Point], make_traced: Callable[..., Traced]
) -> None:
    exact = make_traced(0, 0.0, 0.02, integrator="ray casts")
    found = claim(make_point(0.001, 0.01), [exact], None)
    assert "the exact image, by ray casts, takes 20.0" in found
    assert "2.00 [2.00, 2.00] times as long" in found


def test_defaults_and_both_ends_of_the_front_are_spoken_of(
    make_point: Callable[..., Point], ladder: list[Traced]
) -> None:
    points = [
        make_point(0.3, 0.03),
        make_point(0.4, 0.01, settings={"side": 24}, swept="side"),
        make_point(0.35, 0.02, settings={"side": 48}, swept="side"),
        make_point(0.2, 0.05, settings={"side": 96}, swept="side"),
    ]
    said = claims(points, ladder, [])
    assert [("side=24" in one, "side=48" in one, "side=96" in one) for one in said] == [
        (False, False, False),
        (True, False, False),
        (False, False, True),
    ]
    assert claims([make_point(0.3, 0.03, width=32)], ladder, []) == ()


def test_too_few_images_have_no_slope(ladder: list[Traced], make_traced: Callable[..., Traced]) -> None:
    assert slope_of(ladder[:2]) is None
    assert slope_of([make_traced(0, 0.0, 0.02)]) is None
    found = slope_of(ladder)
    assert isinstance(found, Slope)
    assert found.coefficient == pytest.approx(1.0)
