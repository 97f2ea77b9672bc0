"""The page of a benchmark, from a small one that was made up."""

import dataclasses
import html
import re
import xml.etree.ElementTree as ET
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from comparisons.bench.powerlaw import fit_power_law
from comparisons.bench.result import Ablation, Bench, FrameCost, Interval, Point, Scaling, Slope, Traced, bench_of
from comparisons.report.bench_page import write_bench_page
from comparisons.report.bench_view import view_of
from scenes.errors import InputError

SVG = "{http://www.w3.org/2000/svg}"
MADE_UP: tuple[tuple[str, dict[str, Any], str, float, float, int], ...] = (
    ("indirect.talk", {}, "", 0.004, 0.46, 1),
    ("indirect.talk", {"c_height": 2.5}, "c_height", 0.0041, 0.38, 1),
    ("indirect.probe", {}, "", 0.006, 0.29, 1),
    ("indirect.probe", {"block": 12}, "block", 0.003, 0.33, 1),
    ("indirect.grid", {}, "", 0.021, 0.062, 1),
    ("indirect.grid", {"count": 4}, "count", 0.012, 0.09, 1),
    ("indirect.grid", {"count": 8}, "count", 0.07, 0.066, 1),
    ("indirect.grid", {}, "sensor", 0.06, 0.061, 2),
    ("indirect.irradiance", {}, "", 0.11, 0.045, 1),
)


def around(value: float, share: float = 0.05) -> Interval:
    return Interval(value, value * (1 - share), value * (1 + share))


def cost_of(seconds: float) -> FrameCost:
    start = {"compile": 0.2, "upload": 0.01, "bake": 0.3, "first frame": seconds}
    return FrameCost(
        around(seconds, 0.02), 1.2 * seconds, 31, "GPU timer queries", start, {"shade": seconds}, 25_000_000
    )


def point(
    technique: str, settings: dict[str, Any], swept: str, seconds: float, error: float, factor: int, **others: Any
) -> Point:
    known: dict[str, Any] = {
        "scene": "small-room-knot",
        "effect": "indirect light",
        "quantity": "indirect_radiance",
        "technique": technique,
        "settings": settings,
        "swept": swept,
        "width": 128 * factor,
        "height": 128 * factor,
        "metric": "nrmse",
        "error": around(error),
        "cost": cost_of(seconds),
    }
    return Point(**(known | others))


def traced(spp: int, **others: Any) -> Traced:
    known: dict[str, Any] = {
        "scene": "small-room-knot",
        "effect": "indirect light",
        "quantity": "indirect_radiance",
        "integrator": "path",
        "variant": "llvm_ad_rgb",
        "width": 128,
        "height": 128,
        "spp": spp,
        "metric": "nrmse",
        "error": around(0.8 / max(1, spp) ** 0.5),
        "seconds": around(0.02 * spp),
        "peak_bytes": 10**8,
    }
    return Traced(**(known | others))


def scaling(technique: str, axis: str, exponent: float) -> Scaling:
    sizes = (65536.0, 262144.0, 786432.0, 1310720.0, 2073600.0)
    seconds = tuple(2e-3 * (size / 65536) ** exponent * (1 + 0.05 * (-1) ** i) for i, size in enumerate(sizes))
    law = fit_power_law(sizes, seconds)
    return Scaling("small-room-knot", technique, axis, sizes, seconds, law.exponent, law.coefficient, law.r2)


@pytest.fixture
def bench() -> Bench:
    return Bench(
        environment={"gl_renderer": "a GPU", "cpu": "a CPU of 16 cores", "commit": None, "doubts": ["It was busy."]},
        started="2026-01-31T12:00:00+00:00",
        points=tuple(point(*one) for one in MADE_UP),
        traced=tuple(traced(spp) for spp in (1, 4, 16, 64)),
        slopes=(Slope("small-room-knot", "indirect_radiance", "nrmse", 128, 128, around(-0.5), 0.8, 1.0),),
        scaling=(scaling("indirect.grid", "pixels", 0.9), scaling("indirect.talk", "pixels", 0.4)),
        ablations=(
            Ablation(
                scene="small-room-knot",
                effect="indirect light",
                technique="indirect.grid",
                settings={},
                part="own transport",
                how="own_bounces = 0",
                metric="nrmse",
                error_with=around(0.062),
                error_without=around(0.13),
                added=Interval(0.068, 0.064, 0.072),
                seconds_with=0.021,
                seconds_without=0.017,
            ),
        ),
        claims=("small-room-knot: indirect.grid reaches 6.2 % in 21 ms.", "All is well <measured>."),
        skipped=({"what": "indirect.talk: lights", "why": "One light is all it takes."},),
    )


@pytest.fixture
def write(tmp_path: Path) -> Callable[[Bench], str]:
    """Writes the page of a benchmark and returns what a reader of it sees."""
    return lambda bench: html.unescape(write_bench_page(tmp_path, bench.to_json()).read_text(encoding="utf-8"))


def test_what_to_use_is_the_front_from_the_quickest_to_the_most_exact(bench: Bench) -> None:
    (group,) = view_of(bench).groups
    found = [(answer.row.point.technique, answer.row.frame, answer.row.error) for answer in group.answers]
    assert [(name, frame.replace("\u202f", " ")) for name, frame, _ in found] == [
        ("indirect.probe", "3.00 ms"),
        ("indirect.probe", "6.00 ms"),
        ("indirect.grid", "12.0 ms"),
        ("indirect.grid", "21.0 ms"),
        ("indirect.irradiance", "110 ms"),
    ]


def test_the_path_tracer_is_asked_for_the_same_error(bench: Bench) -> None:
    """By hand: 10 % takes 64 spp of 20 ms, 4.5 % then (0.1 / 0.045)² times as long: 6.32 s, 57.5 frames of 110 ms."""
    answer = view_of(bench).groups[0].answers[-1]
    assert (answer.traced.replace("\u202f", " "), answer.times) == ("6.32 s", "57.5×")


def test_an_error_that_path_tracing_undercuts_at_once_is_told_as_a_bound(bench: Bench) -> None:
    poor = dataclasses.replace(bench, points=(point("indirect.talk", {}, "", 0.004, 0.9, 1),))
    (answer,) = view_of(poor).groups[0].answers
    assert (answer.traced.replace("\u202f", " "), answer.times.replace("\u202f", " ")) == ("< 20.0 ms", "< 5.00×")


def test_no_path_tracing_is_no_number(bench: Bench) -> None:
    alone = dataclasses.replace(bench, traced=(), slopes=())
    assert {(answer.traced, answer.times) for answer in view_of(alone).groups[0].answers} == {("", "")}


def test_an_exact_truth_takes_what_it_takes(bench: Bench) -> None:
    exact = dataclasses.replace(bench, traced=(traced(0, error=Interval(0, 0, 0), seconds=around(0.3)),), slopes=())
    assert view_of(exact).groups[0].answers[0].traced.replace("\u202f", " ") == "300 ms"


def test_claims_stand_with_what_they_are_about(bench: Bench) -> None:
    view = view_of(bench)
    assert view.groups[0].claims == bench.claims[:1]
    assert view.claims == bench.claims[1:]


def test_the_page_says_everything(write: Callable[[Bench], str], bench: Bench) -> None:
    page = write(bench).replace("\u202f", " ")
    assert "What a millisecond buys: 4 techniques for 1 effect, 9 points from 3.00 ms to 110 ms a frame" in page
    assert "a GPU · a CPU of 16 cores" in page
    assert page.count("It was busy.") == 1
    for claim in bench.claims:
        assert claim in page
    assert all(text in page for text in ("c_height = 2.5", "256 × 256", "25.0 MB", "bake 300 ms", "[8.55, 9.45]"))
    assert "median by GPU timer queries" in page
    assert all(text in page for text in ("own_bounces = 0", "4.00 ms", "19.0 %", "[6.40, 7.20]"))
    assert "One light is all it takes." in page
    assert "<dt>commit</dt>" not in page


def test_words_of_others_are_text_and_no_markup(tmp_path: Path, bench: Bench) -> None:
    page = write_bench_page(tmp_path, bench.to_json()).read_text(encoding="utf-8")
    assert "All is well &lt;measured&gt;." in page


def test_every_address_is_a_file_beside_the_page(write: Callable[[Bench], str], tmp_path: Path, bench: Bench) -> None:
    page = write(bench)
    addresses = [a for a in re.findall(r'(?:href|src)="([^"#][^"]*)"', page) if a != "data:,"]
    assert sorted({*addresses}) == [
        "assets/style.css",
        "plots/indirect-light-small-room-knot-indirect_radiance-nrmse.svg",
        "plots/scaling-pixels-small-room-knot.svg",
    ]
    assert all((tmp_path / address).is_file() for address in addresses)


def front(folder: Path) -> ET.Element:
    return ET.parse(folder / "plots/indirect-light-small-room-knot-indirect_radiance-nrmse.svg").getroot()


def test_what_is_beaten_or_of_another_resolution_is_faint(
    write: Callable[[Bench], str], tmp_path: Path, bench: Bench
) -> None:
    write(bench)
    marks = [path for path in front(tmp_path).iter(f"{SVG}path") if path.find(f"{SVG}title") is not None]
    titles = {path.findtext(f"{SVG}title") or "": "opacity" in path.attrib for path in marks}
    faint = sorted(title.partition(":")[0] for title, is_faint in titles.items() if is_faint)
    assert faint == [
        "indirect.grid (count = 8), 128 × 128",
        "indirect.grid, 256 × 256",
        "indirect.talk (c_height = 2.5), 128 × 128",
        "indirect.talk, 128 × 128",
    ]
    assert len(titles) == len(MADE_UP) + 4  # and the path tracer's images


def test_the_front_and_the_law_of_path_tracing_are_lines(
    write: Callable[[Bench], str], tmp_path: Path, bench: Bench
) -> None:
    write(bench)
    law, joined = front(tmp_path).findall(f"{SVG}polyline")
    assert len(joined.attrib["points"].split()) == 5
    assert "stroke-dasharray" in law.attrib
    names = {text.text for text in front(tmp_path).findall(f"{SVG}text")}
    assert {"path tracing", "∝ spp^−0.500", "front", "indirect.grid"} <= names


def test_nothing_above_noise_is_said_in_words(write: Callable[[Bench], str], tmp_path: Path, bench: Bench) -> None:
    exact = dataclasses.replace(bench.points[0], error=Interval(0.0, 0.0, 0.0))
    page = write(dataclasses.replace(bench, points=(exact,), traced=(), slopes=(), scaling=()))
    assert "No error is above the noise of the truth" in page
    assert not (tmp_path / "plots").exists()


def test_a_benchmark_of_scaling_alone_has_a_page(write: Callable[[Bench], str], bench: Bench) -> None:
    page = write(Bench(bench.environment, bench.started, scaling=bench.scaling))
    assert "Nothing was measured against truth" in page
    assert "0.397" in page
    assert "What to use" not in page


def test_it_reads_what_it_wrote(bench: Bench) -> None:
    assert bench_of(bench.to_json()) == bench


@pytest.mark.parametrize(
    ("change", "found"),
    [
        ({"schema": 2}, "has schema 2, but this version reads schema 1"),
        ({"points": [{"scene": "a"}]}, r"not as `lightgauge bench` writes it: points.0.effect: Field required"),
    ],
)
def test_another_file_is_refused(tmp_path: Path, bench: Bench, change: dict[str, Any], found: str) -> None:
    with pytest.raises(InputError, match=found):
        write_bench_page(tmp_path, bench.to_json() | change)


def test_a_folder_that_cannot_be_written_is_named(tmp_path: Path, bench: Bench) -> None:
    (tmp_path / "file").touch()
    with pytest.raises(InputError, match=r"cannot be written to .*file"):
        write_bench_page(tmp_path / "file", bench.to_json())


def test_headings_sort_by_numbers(tmp_path: Path, bench: Bench, open_page: Any) -> None:
    page = open_page(write_bench_page(tmp_path, bench.to_json()))
    error = "[...document.querySelectorAll('#points ~ .list tbody tr')].map(row => Number(row.cells[6].dataset.key))"
    for order in (sorted, lambda values: sorted(values, reverse=True)):
        page.click("#points ~ .list thead th:nth-child(7) button")
        assert page.evaluate(error) == order(one[4] for one in MADE_UP)


@pytest.mark.parametrize("width", [420, 800, 1400])
def test_the_page_is_no_wider_than_its_window(tmp_path: Path, bench: Bench, open_page: Any, width: int) -> None:
    page = open_page(write_bench_page(tmp_path, bench.to_json()), width)
    assert page.evaluate("document.documentElement.scrollWidth") <= width
