import re
import xml.etree.ElementTree as ET

import pytest

from comparisons.report.plot import COLOURS, LEGEND_WIDTH, MOST_SERIES, MUTED_MARK, Point, Series, loglog_plot

SVG = "{http://www.w3.org/2000/svg}"


def drawn(*series: Series) -> ET.Element:
    return ET.fromstring(loglog_plot("Error & time", "time [ms]", "error < budget", series))


def line(root: ET.Element, index: int = 0) -> list[tuple[float, ...]]:
    corners = root.findall(f"{SVG}polyline")[index].attrib["points"].split()
    return [tuple(map(float, corner.split(","))) for corner in corners]


def test_a_power_law_is_a_straight_line() -> None:
    (x0, y0), (x1, y1), (x2, y2) = line(drawn(Series("law", [Point(t, t**-0.5) for t in (1, 10, 100)])))
    assert x0 < x1 < x2
    assert y0 < y1 < y2  # downward on the page: less error
    assert (x1 - x0, y1 - y0) == pytest.approx((x2 - x1, y2 - y1), abs=0.11)


def test_ticks_are_powers_of_ten_or_finer_within_a_decade() -> None:
    def labels(*values: float) -> set[str | None]:
        root = drawn(Series("s", [Point(v, v) for v in values]))
        return {text.text for text in root.findall(f"{SVG}text")}

    assert {"1", "10", "100"} <= labels(1, 100)
    assert {"2", "5"} <= labels(1.5, 6)


def test_intervals_reach_from_low_to_high() -> None:
    root = drawn(Series("s", [Point(1, 2, 1, 4), Point(10, 2)]))
    ((low, high),) = re.findall(
        r'd="M[\d.]+,([\d.]+)V([\d.]+)" stroke="#', ET.tostring(root).decode().replace("ns0:", "")
    )
    assert float(low) > line(root)[0][1] > float(high)


def test_series_differ_by_colour_and_mark_and_are_named() -> None:
    root = drawn(*(Series(f"technique {i}", [Point(1, 1)]) for i in range(len(COLOURS))))
    marks = {(path.attrib["d"], path.attrib["fill"]) for path in root.findall(f"{SVG}path") if "fill" in path.attrib}
    assert len(marks) == len({d for d, _ in marks}) == len({fill for _, fill in marks}) == len(COLOURS)
    assert {f"technique {i}" for i in range(6)} <= {text.text for text in root.findall(f"{SVG}text")}


def test_a_name_that_is_too_long_for_the_legend_is_squeezed_into_it() -> None:
    root = drawn(*(Series(name, [Point(1, 1)]) for name in ("my_hemisphere_with_many_bounces", "indirect.probe")))
    fits = {text.text: text.attrib.get("textLength") for text in root.findall(f"{SVG}text")}
    assert fits["my_hemisphere_with_many_bounces"] == f"{LEGEND_WIDTH:g}"
    assert fits["indirect.probe"] is None


def test_as_many_series_as_may_be_drawn_look_different() -> None:
    assert len({Series("s", []).look(index) for index in range(MOST_SERIES)}) == MOST_SERIES


def test_context_is_muted_and_takes_no_colour_from_the_series() -> None:
    root = drawn(Series("context", [Point(1, 1)], is_joined=False, is_muted=True), Series("s", [Point(1, 1)]))
    marks = [path.attrib for path in root.findall(f"{SVG}path") if "transform" in path.attrib]
    assert [mark["d"] == MUTED_MARK for mark in marks] == [True, True, False, False]
    assert {mark["fill"] for mark in marks} == {"none", COLOURS[0]}
    assert len(root.findall(f"{SVG}polyline")) == 1


def test_zero_stands_hollow_at_the_lower_edge() -> None:
    root = drawn(Series("s", [Point(1, 0, 0, 3), Point(2, 1)]))
    hollow, full = (path for path in root.findall(f"{SVG}path") if path.find(f"{SVG}title") is not None)
    assert (hollow.attrib["fill"], full.attrib["fill"]) == ("none", COLOURS[0])
    lower_edge = max(y for _, y in line(root))
    assert hollow.attrib["transform"].endswith(f" {lower_edge})")
    assert f"V{lower_edge}" not in full.attrib["d"]


def test_a_point_leads_where_it_says() -> None:
    root = drawn(Series("s", [Point(1, 1, title="a < b", address="checks/a.html?x=1&y=2"), Point(2, 2)]))
    (link,) = root.findall(f"{SVG}a")
    assert link.attrib["href"] == "checks/a.html?x=1&y=2"
    assert link.findtext(f"{SVG}path/{SVG}title") == "a < b"


def test_numbers_along_the_x_axis_are_written_as_wanted() -> None:
    svg = loglog_plot("t", "x", "y", [Series("s", [Point(1, 1), Point(100, 1)])], x_text=lambda x: f"{x:g} apples")
    assert "10 apples" in {text.text for text in ET.fromstring(svg).findall(f"{SVG}text")}


def test_who_cannot_see_it_hears_the_values() -> None:
    root = drawn(Series("talk", [Point(3, 0.25)]))
    assert root.attrib["role"] == "img"
    assert root.findtext(f"{SVG}title") == "Error & time"
    assert root.findtext(f"{SVG}desc") == "talk: 3 0.25"


@pytest.mark.parametrize(
    "series",
    [
        [],
        [Series("s", [])],
        [Series("s", [Point(0, 1)])],
        [Series("s", [Point(1, 0)])],
        [Series("s", [Point(1, 1, -1, 2)])],
        [Series("s", [Point(1, 1)])] * (MOST_SERIES + 1),
    ],
)
def test_what_cannot_be_drawn_is_refused(series: list[Series]) -> None:
    with pytest.raises(ValueError, match=r"found|series of"):
        loglog_plot("t", "x", "y", series)


def test_what_stands_back_is_faint() -> None:
    root = drawn(Series("s", [Point(1, 1, 0.5, 2, is_dim=True), Point(2, 1, 0.5, 2)]))
    drawn_in_colour = [p for p in root.findall(f"{SVG}path") if p.attrib.get("stroke") or "transform" in p.attrib]
    coloured = [p for p in drawn_in_colour if COLOURS[0] in (p.attrib.get("stroke"), p.attrib.get("fill"))]
    assert ["opacity" in path.attrib for path in coloured] == [True, True, False, False, False]  # the last: the legend


def test_a_line_has_no_marks_and_takes_no_colour_from_the_series() -> None:
    ends = [Point(1, 1), Point(10, 2)]
    root = drawn(Series("fit", ends, is_line=True, is_dashed=True), Series("s", [Point(1, 1)], is_joined=False))
    (fit,) = root.findall(f"{SVG}polyline")
    assert (fit.attrib["stroke"], fit.attrib["stroke-dasharray"]) == ("currentColor", "5 3")
    assert [p.attrib["fill"] for p in root.findall(f"{SVG}path") if p.find(f"{SVG}title") is not None] == [COLOURS[0]]


def test_over_many_decades_labels_have_room() -> None:
    root = drawn(Series("s", [Point(1e-6, 1), Point(1e6, 10)]))
    along_x = [text for text in root.findall(f"{SVG}text") if text.attrib.get("y") == "366"]
    assert 4 <= len(along_x) <= 7
