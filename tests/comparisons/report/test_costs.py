import xml.etree.ElementTree as ET
from collections.abc import Callable
from typing import Any

import pytest

from comparisons.report.costs import CostPlot
from comparisons.report.view import overview_of

SVG = "{http://www.w3.org/2000/svg}"
Make = Callable[..., dict[str, Any]]
Plots = Callable[..., tuple[CostPlot, ...]]


@pytest.fixture
def plots(make_results: Make) -> Plots:
    return lambda *checks: overview_of(make_results(*checks)).costs


def titles(plot: CostPlot) -> list[str]:
    return [link.find(f"{SVG}path/{SVG}title").text or "" for link in ET.fromstring(plot.svg).iter(f"{SVG}a")]  # type: ignore[union-attr]


def test_each_check_is_a_point_that_says_what_it_is_and_leads_to_its_page(plots: Plots, make_check: Make) -> None:
    (plot,) = plots(make_check(), make_check(scene="hall", technique="indirect.talk"))
    assert (plot.effect, plot.metric, plot.points, plot.others) == ("indirect light", "nrmse", 2, 0)
    settings = "(bounces\u00a0=\u00a03, shadows\u00a0=\u00a0on, exposure fitted)"
    assert f"room, indirect.irradiance {settings}: nrmse 7.31\u202f% [6.91, 7.71] in 1.84\u202fms" in titles(plot)
    links = [link.attrib["href"] for link in ET.fromstring(plot.svg).iter(f"{SVG}a")]
    assert any(link.startswith("checks/hall-indirect.talk") for link in links)


def test_the_metric_is_the_one_that_most_checks_have(plots: Plots, make_check: Make, make_criterion: Make) -> None:
    by_flip = make_check(criteria=[make_criterion("flip", 0.03)])
    only_nrmse = make_check(criteria=[make_criterion()])
    (plot,) = plots(by_flip, by_flip, only_nrmse)
    assert (plot.metric, plot.points, plot.others) == ("flip", 2, 1)


def test_of_metrics_that_are_as_common_the_first_named_is_drawn(
    plots: Plots, make_check: Make, make_criterion: Make
) -> None:
    both = make_check(criteria=[make_criterion("flip", 0.03), make_criterion("energy_bias", -0.01)])
    (plot,) = plots(both, both)
    assert plot.metric == "flip"


def test_path_tracing_stands_at_its_noise_and_its_time(plots: Plots, make_check: Make, make_criterion: Make) -> None:
    noisy = make_check(criteria=[make_criterion(floor=0.05)])
    (plot,) = plots(noisy, noisy)
    assert plot.has_truth
    assert "room, path tracing at 4096 spp: nrmse 5.00\u202f% in 12.4\u202fs" in titles(plot)
    exact = noisy | {"spp": 0}
    assert not plots(exact, exact)[0].has_truth
    raw = make_check(criteria=[make_criterion("flip", 0.03, floor=0.01)])
    assert not plots(raw, raw)[0].has_truth  # its floor is what two noisy truths differ by, not the noise of one


def test_an_error_of_zero_is_a_hollow_mark(plots: Plots, make_check: Make, make_criterion: Make) -> None:
    none_left = make_check(criteria=[make_criterion(value=0.0, low=0.0, high=0.02)])
    (plot,) = plots(none_left, make_check())
    paints = [link[0].attrib["fill"] for link in ET.fromstring(plot.svg).iter(f"{SVG}a")]
    assert paints.count("none") == 1


def test_nothing_is_drawn_of_one_check_of_untimed_ones_and_of_none_with_an_error(
    plots: Plots, make_check: Make, make_criterion: Make
) -> None:
    untimed = make_check(seconds={})
    perfect = make_check(criteria=[make_criterion(value=0.0, low=0.0, high=0.0)])
    assert plots(make_check()) == plots(untimed, untimed) == plots(perfect, perfect) == ()


def test_parity_is_not_drawn(plots: Plots, make_check: Make) -> None:
    assert plots(make_check(quantity="depth"), make_check(quantity="depth")) == ()
