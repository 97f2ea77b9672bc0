"""The plot of a check's course, read as XML."""

import re
import xml.etree.ElementTree as ET
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest

from comparisons.history import Entry, noted
from comparisons.report.trend import MOST_RUNS, SOUND, UNSOUND, trend_plot

SVG = "{http://www.w3.org/2000/svg}"
Make = Callable[..., dict[str, Any]]
Plot = Callable[..., ET.Element]


@pytest.fixture
def entries(tmp_path: Path, make_judged: Make, make_run: Make) -> Callable[..., tuple[Entry, ...]]:
    """The entries of one run a day, with what make_judged is given for each."""

    def made(*days: dict[str, Any]) -> tuple[Entry, ...]:
        for number, given in enumerate(days, start=1):
            run = make_run(
                make_judged(**given), started=f"{2000 + number}-02-01T08:30:00+00:00", commit=f"{number:012x}+"
            )
            history = noted(tmp_path / "history.sqlite", run)
        return history.entries("room/indirect.probe")

    return made


@pytest.fixture
def plot(entries: Callable[..., tuple[Entry, ...]]) -> Plot:
    return lambda *days: ET.fromstring(trend_plot(entries(*days)))


def marks(root: ET.Element, name: str) -> list[ET.Element]:
    return [path for path in root.iter(f"{SVG}path") if path.attrib.get("class") == name]


def heights(root: ET.Element, name: str) -> list[float]:
    return [float(re.findall(r"-?[\d.]+", mark.attrib["d"])[1]) for mark in marks(root, name)]


def test_errors_stand_above_each_other_by_their_size_and_the_budget_above_them(plot: Plot) -> None:
    root = plot({"value": 0.05}, {"value": 0.15}, {"value": 0.10})
    low, high, middle = heights(root, "point")
    assert low - middle == pytest.approx(middle - high, abs=0.2)  # downward on the page: less error
    assert len(marks(root, "budget")) == 3
    assert max(heights(root, "budget")) < high
    (times,) = (line for line in root.findall(f"{SVG}polyline")[1:])
    assert len(times.attrib["points"].split()) == len(marks(root, "time")) == 3


def test_an_interval_reaches_around_its_value_and_an_exact_one_is_a_point(plot: Plot) -> None:
    root = plot({"value": 0.1, "low": 0.08, "high": 0.14}, {"value": 0.1})
    (interval,) = marks(root, "interval")
    low, high = map(float, re.findall(r"M[\d.]+,([\d.]+)V([\d.]+)", interval.attrib["d"])[0])
    value = heights(root, "point")[0]
    assert low - value == pytest.approx((value - high) / 2, abs=0.2)


def test_what_did_not_pass_differs_by_colour_and_by_shape(plot: Plot) -> None:
    passed, failed = marks(plot({"value": 0.1}, {"value": 0.3, "verdict": "FAIL"}), "point")
    assert (passed.attrib["fill"], failed.attrib["fill"]) == (SOUND, UNSOUND)
    shapes = [re.sub(r"^M[\d.,]+", "", mark.attrib["d"]) for mark in (passed, failed)]
    assert shapes[0] != shapes[1]


def test_a_run_that_could_not_judge_the_check_leaves_a_cross(plot: Plot) -> None:
    root = plot({"value": 0.1}, {"verdict": "ERROR", "gl_renderer": "", "seconds": {}}, {"value": 0.1})
    titles = [title.text or "" for title in root.iter(f"{SVG}title")]
    assert sum("ERROR" in title for title in titles) == 1
    assert len(marks(root, "point")) == len(marks(root, "time")) == 2


def test_a_bound_that_is_far_off_is_named_but_flattens_nothing(plot: Plot) -> None:
    root = plot({"value": 0.001, "max": 0.2})
    assert marks(root, "budget") == []
    assert "budget ≤ 20\u202f%" in {text.text for text in root.iter(f"{SVG}text")}


def test_other_renderers_are_left_out(plot: Plot) -> None:
    other = "NVIDIA H200/PCIe/SSE2, OpenGL 4.3"
    root = plot({"value": 0.1, "gl_renderer": other}, {"value": 0.1}, {"value": 0.11})
    assert len(marks(root, "point")) == 2
    assert "llvmpipe" in {text.text for text in root.iter(f"{SVG}text")}


def test_a_newest_run_that_drew_nothing_hides_none_of_those_before(plot: Plot) -> None:
    other = "NVIDIA H200/PCIe/SSE2, OpenGL 4.3"
    root = plot({"value": 0.1, "gl_renderer": other}, {"value": 0.1}, {"verdict": "ERROR", "gl_renderer": None})
    assert len(marks(root, "point")) == 1
    assert any("ERROR" in (path.findtext(f"{SVG}title") or "") for path in root.iter(f"{SVG}path"))


def test_each_metric_has_a_panel(entries: Callable[..., tuple[Entry, ...]]) -> None:
    found = entries({"value": 0.1}, {"value": 0.2, "metric": "energy_bias", "min": -0.3, "max": 0.3})
    texts = {text.text for text in ET.fromstring(trend_plot(found)).iter(f"{SVG}text")}
    assert {"nrmse", "energy_bias", "time of the technique"} <= texts


def test_the_newest_runs_are_shown(plot: Plot) -> None:
    root = plot(*({"value": 0.001 * number} for number in range(MOST_RUNS + 5)))
    titles = [mark.findtext(f"{SVG}title") or "" for mark in marks(root, "point")]
    assert len(titles) == MOST_RUNS
    assert "nrmse 0.500\u202f% exact" in titles[0]


def test_labels_name_commits_and_never_overlap(plot: Plot) -> None:
    root = plot(*({"value": 0.1} for _ in range(28)))
    labels = [text for text in root.iter(f"{SVG}text") if re.fullmatch("0{7}[+]", text.text or "")]
    places = [float(label.attrib["x"]) for label in labels]
    assert len(places) > 5
    assert all(right - left > 45 for left, right in pairwise(places))


def test_who_cannot_see_it_hears_the_values(plot: Plot) -> None:
    root = plot({"value": 0.1, "low": 0.08, "high": 0.12}, {"value": 0.2})
    assert root.attrib["role"] == "img"
    assert root.findtext(f"{SVG}title") == "Error and time of room/indirect.probe over 2 runs"
    assert "from 10.0\u202f% [8.00, 12.0]" in (root.findtext(f"{SVG}desc") or "")
    assert "currentColor" in root.attrib["fill"]


def test_where_nothing_was_measured_there_is_nothing_to_draw(entries: Callable[..., tuple[Entry, ...]]) -> None:
    assert trend_plot(()) == ""
    assert trend_plot(entries({"verdict": "ERROR"})) == ""
