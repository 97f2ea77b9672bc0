import copy
import html
import math
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from PIL import Image as Picture

from comparisons.gate import Verdict
from comparisons.report import view, write_pictures, write_report
from comparisons.report.numbers import (
    format_bound,
    format_count,
    format_interval,
    format_metric,
    format_number,
    format_percent,
    format_seconds,
)
from comparisons.report.pictures import (
    DIVERGING,
    NOT_A_NUMBER,
    NOT_JUDGED,
    WITHIN_NOISE,
    error_map,
    significance_map,
)
from comparisons.report.view import BAR_BUDGET, BAR_LENGTH, GLYPHS, SEVERITY, budget_use, page_of
from comparisons.significance import Significance
from reference.quantity import Display
from scenes.errors import ImageError, InputError

SCALE = 0.25


def criterion(metric: str = "nrmse", value: float | None = 0.0731, **changes: Any) -> dict[str, Any]:
    return {
        "metric": metric,
        "value": value,
        "low": None if value is None else value - 0.004,
        "high": None if value is None else value + 0.004,
        "min": None,
        "max": 0.08,
        "bound": 0.08,
        "verdict": "PASS",
        "reason": f"The reason for the budget of {metric}.",
        "note": "",
    } | changes


def check(**changes: Any) -> dict[str, Any]:
    return {
        "id": "room/indirect.irradiance/indirect_radiance",
        "scene": "room",
        "scene_title": "Small coloured room",
        "quantity": "indirect_radiance",
        "technique": "indirect.irradiance",
        "settings": {"bounces": 3, "shadows": True},
        "fit_exposure": True,
        "exposure": 1.374,
        "verdict": "PASS",
        "message": "",
        "criteria": [
            criterion(),
            criterion("energy_bias", -0.012, min=-0.04, max=0.04),
            criterion("flip", 0.0312, max=0.06, note="raw; extrapolated to 0.028"),
        ],
        "spp": 16384,
        "seconds": {"realtime": 0.00184, "reference": 12.41},
        "skipped": [{"what": "visibility pass", "why": "the character is convex"}],
        "integrator": {"name": "indirect_only", "why": "direct light would add noise"},
        "images": {name: f"images/room-{name}.png" for name in ("realtime", "truth", "error", "significance")},
        "error_scale": 0.024,
        "significance": {"share": 0.62, "false_discovery_rate": 0.05, "tiles": 120},
        "unit": "W/(m² sr)",
        "exposure_display": 1.52,
        "card": {
            "name": "Irradiance",
            "source": "Ramamoorthi 2001",
            "summary": "Nine coefficients.",
            "limits": "One position.",
        },
        "cached": True,
        "rerun": "lightgauge run room -k irradiance",
        "accepted": {
            "date": "2026-01-02",
            "reason": "Measured with the first release.",
            "criteria": {"nrmse": [0.0725, 0.07, 0.075], "energy_bias": [0.01, 0.005, 0.015], "flip": [0.0, 0.0, 0.0]},
        },
        "slack": "budget slack: flip fell far.",
        "variants": [
            {
                "quantity": "one_bounce",
                "summary": "without the others",
                "nrmse": 0.211,
                "low": 0.2,
                "high": 0.222,
                "energy_bias": -0.153,
            }
        ],
    } | changes


def results(*checks: dict[str, Any], **changes: Any) -> dict[str, Any]:
    return {
        "schema": 1,
        "environment": {"lightgauge": "0.1.0", "gl_renderer": "llvmpipe", "cpu_count": 2, "commit": "3f9c1ab27d0e"},
        "started": "2026-01-14 09:12:44",
        "seconds": 192.3,
        "counts": {},
        "store_note": None,
        "checks": list(checks),
    } | changes


def page_text(folder: Path, content: dict[str, Any]) -> str:
    """What a reader of the page sees, and its alternative texts."""
    return html.unescape(write_report(folder, content).read_text(encoding="utf-8"))


def test_the_page_shows_every_number_reason_and_explanation(tmp_path: Path) -> None:
    shown = page_text(tmp_path, results(check()))
    for one in check()["criteria"]:
        assert format_metric(one["metric"], one["value"]) in shown
        assert format_interval(one["metric"], one["low"], one["high"]) in shown
        assert format_bound(one["metric"], one["min"], one["max"]) in shown
        assert one["reason"] in shown
        assert one["note"] in shown
    for text in (
        *(
            "Small coloured room",
            "indirect.irradiance",
            "bounces\u00a0=\u00a03, shadows\u00a0=\u00a0on",
            "fitted exposure × 1.37",
        ),
        *("visibility pass", "the character is convex", "indirect_only", "direct light would add noise"),
        *("Ramamoorthi 2001", "Nine coefficients.", "One position.", "lightgauge run room -k irradiance"),
        *(format_count(16384), format_seconds(0.00184), format_seconds(12.41), "stored", "exposure × 1.52"),
        *("−0.024", "+0.024", "W/(m² sr)", "llvmpipe", "3f9c1ab27d", "2026-01-14 09:12:44", "3\u202fmin 12\u202fs"),
        *("Wrong beyond noise", "62\u202f% of the judged pixels, at a false discovery rate of 5\u202f%"),
    ):
        assert text in shown


@pytest.mark.parametrize("hostile", ["<script>alert(1)</script>", "\"' onload='x", "</style><b>", "{{ 7 * 7 }}"])
def test_no_text_of_the_results_becomes_markup(tmp_path: Path, hostile: str) -> None:
    def poison(value: Any) -> Any:
        if isinstance(value, dict):
            return {key: value[key] if key in ("verdict", "metric") else poison(value[key]) for key in value}
        if isinstance(value, list):
            return [poison(item) for item in value]
        return hostile if isinstance(value, str) else value

    clean = write_report(tmp_path / "clean", results(check(), store_note="x")).read_text(encoding="utf-8")
    page = write_report(tmp_path, poison(results(check(message="x"), store_note="x"))).read_text(encoding="utf-8")
    assert page.count("<script") == clean.count("<script")
    assert "<" not in hostile or hostile not in page
    assert html.escape(hostile, quote=False).replace('"', "&#34;").replace("'", "&#39;") in page


def test_an_address_of_a_picture_cannot_leave_the_folder_by_its_characters(tmp_path: Path) -> None:
    images = dict.fromkeys(("realtime", "truth", "error"), "images/a[b=2.5]#1 ?.png")
    page = write_report(tmp_path, results(check(images=images))).read_text(encoding="utf-8")
    assert 'src="images/a%5Bb%3D2.5%5D%231%20%3F.png"' in page


def test_the_page_loads_nothing_but_its_pictures(tmp_path: Path) -> None:
    page = write_report(tmp_path, results(check())).read_text(encoding="utf-8")
    addresses = set(re.findall(r'(?:src|href)="([^"#][^"]*)"', page))
    assert addresses == {"data:,", *check()["images"].values()}
    assert "@import" not in page
    assert "url(" not in page


def test_missing_values_are_dashes(tmp_path: Path) -> None:
    broken = check(
        verdict="ERROR",
        message="12 pixels are not a number.",
        criteria=[criterion(value=None, verdict="ERROR")],
        spp=None,
        seconds={"realtime": None, "reference": None},
        images={},
        error_scale=None,
        exposure_display=None,
        integrator=None,
        card=None,
    )
    shown = page_text(tmp_path, results(broken))
    assert "12 pixels are not a number." in shown
    assert re.search(r'<td class="number wide" data-sort="0">–</td>', shown)
    assert '<span class="value">–</span>' in shown
    assert "None" not in shown
    assert "<img" not in shown


def test_a_check_that_was_not_tested_beyond_noise_has_three_pictures(tmp_path: Path) -> None:
    images = {name: path for name, path in check()["images"].items() if name != "significance"}
    exact = page_text(tmp_path, results(check(images=images, significance=None)))
    assert "<figcaption>Wrong beyond noise" not in exact
    assert "shows no error beyond noise" not in exact
    assert exact.count("<figure") == 3


def test_a_picture_of_significance_without_its_share_has_a_dash(tmp_path: Path) -> None:
    older = check()
    del older["significance"]
    shown = page_text(tmp_path, results(older))
    assert shown.count("<figure") == 4
    assert '<p class="under">–</p>' in shown


def test_the_glance_tells_the_share_of_the_worst_scene() -> None:
    def scene(name: str, value: float, **changes: Any) -> dict[str, Any]:
        return check(scene=name, criteria=[criterion(value=value)], **changes)

    share = {"share": 0.625, "false_discovery_rate": 0.05, "tiles": 9}
    rows = page_of(results(scene("mild", 0.01), scene("bad", 0.07, significance=share))).glances
    assert [(row.where, row.wrong) for row in rows] == [("bad", "62.5\u202f%")]
    rows = page_of(results(scene("mild", 0.01), scene("bad", 0.07, significance=None))).glances
    assert [(row.where, row.wrong) for row in rows] == [("bad", "–")]


def test_a_check_with_only_its_identity_is_shown(tmp_path: Path) -> None:
    keys = ("id", "scene", "technique", "quantity")
    least = {key: check()[key] for key in keys} | {"verdict": "ERROR"}
    assert check()["id"] in page_text(tmp_path, results(least))


def test_a_run_without_checks_says_so(tmp_path: Path) -> None:
    shown = page_text(tmp_path, results())
    assert "No check was run" in shown
    assert "<table" not in shown


def test_all_passing_names_the_check_closest_to_its_budget() -> None:
    close = check(scene="close", criteria=[criterion(value=0.079)])
    far = check(scene="far", criteria=[criterion(value=0.01)])
    page = page_of(results(far, close))
    assert page.sentence.startswith("All 2 checks hold their budgets; closest to its budget: close with")
    assert page.verdict == "PASS"


def test_the_worst_failure_is_the_one_furthest_beyond_its_budget() -> None:
    bad = criterion(value=0.1, verdict="FAIL")
    worse = criterion("flip", 0.5, max=0.1, verdict="FAIL")
    page = page_of(
        results(
            check(),
            check(scene="bad", verdict="FAIL", criteria=[bad]),
            check(scene="worse", settings={"c": 2.5}, verdict="FAIL", criteria=[criterion(), worse]),
            check(verdict="ERROR", criteria=[]),
            check(verdict="INCONCLUSIVE"),
        )
    )
    assert page.sentence == (
        "2 of 5 checks exceed their budget: worst is worse with indirect.irradiance "
        "(c\u00a0=\u00a02.5, exposure fitted), flip 0.500 against ≤ 0.1."
    )
    assert page.rest.startswith("1 is undecided")
    assert page.rest.endswith("1 could not be judged.")
    assert page.counts == (("ERROR", 1), ("FAIL", 2), ("INCONCLUSIVE", 1), ("PASS", 1))


def test_a_regression_is_told_after_failures_and_before_what_is_undecided() -> None:
    risen = criterion(value=0.05, verdict="REGRESSED")
    regressed = check(scene="risen", verdict="REGRESSED", criteria=[criterion("flip", 0.0799), risen])
    page = page_of(results(check(), check(verdict="INCONCLUSIVE"), regressed))
    assert page.verdict == "REGRESSED"
    assert page.sentence.startswith("1 of 3 checks has regressed within the budget: worst is risen with")
    assert page.sentence.endswith("nrmse 5.00\u202f% against ≤ 8\u202f%.")
    assert page.rest.startswith("1 is undecided")
    assert page.counts == (("REGRESSED", 1), ("INCONCLUSIVE", 1), ("PASS", 1))
    failed = check(verdict="FAIL", criteria=[criterion(value=0.1, verdict="FAIL")])
    page = page_of(results(failed, regressed, regressed))
    assert page.verdict == "FAIL"
    assert page.sentence.startswith("1 of 3 checks exceeds its budget")
    assert page.rest == "2 have regressed within the budget."


def test_what_was_accepted_stands_beside_what_is_measured(tmp_path: Path) -> None:
    shown = page_text(tmp_path, results(check()))
    assert "accepted 7.25\u202f% on 2026-01-02, now × 1.01" in shown
    assert "accepted 1.00\u202f% on 2026-01-02, now × 1.20" in shown
    assert "<small>accepted 0 on 2026-01-02</small>" in shown
    assert "on 2026-01-02: Measured with the first release." in shown
    assert '<p class="slack">budget slack: flip fell far.</p>' in shown
    assert "accepted" not in page_text(tmp_path, results(check(accepted=None, slack="")))


def test_the_page_tells_what_a_truth_would_lose_without_a_part(tmp_path: Path) -> None:
    said = "one_bounce (without the others): nrmse 21.1\u202f% [20.0, 22.2], energy_bias −15.3\u202f%"
    assert said in page_text(tmp_path, results(check()))
    assert "What the truth would lose" not in page_text(tmp_path, results(check(variants=[])))


def test_the_glance_puts_ratios_before_errors_that_have_a_unit() -> None:
    uv = check(technique="cornea", criteria=[criterion("rms", 3.0, max=4.0)], unit="mm")
    rows = page_of(results(uv, check())).glances
    assert [row.technique for row in rows] == ["indirect.irradiance", "cornea"]
    assert rows[0].quantity == "indirect_radiance"


def test_the_glance_tells_settings_that_are_names_apart_and_numbers_not() -> None:
    checks = [
        check(settings=s, fit_exposure=False) for s in ({"side": 24}, {"side": 96}, {"lookup": "slab", "side": 9})
    ]
    rows = page_of(results(*checks)).glances
    assert [(row.how, row.checks) for row in rows] == [("", 2), ("lookup = slab", 1)]


def test_every_verdict_has_a_rank_a_glyph_and_colours() -> None:
    verdicts = {str(verdict) for verdict in Verdict}
    style = (Path(view.__file__).parent / "templates" / "style.css").read_text(encoding="utf-8")
    assert set(SEVERITY) == set(GLYPHS) == verdicts
    assert list(SEVERITY) == [str(verdict) for verdict in reversed(Verdict)]
    assert all(f"{kind}{verdict}" in style for verdict in verdicts for kind in (".badge.", "svg.", "h1."))


def test_parity_checks_are_apart_and_open_only_when_they_need_attention(tmp_path: Path) -> None:
    parity = check(quantity="depth", criteria=[criterion("rms", 0.001, max=0.01)], unit="m")
    page = page_of(results(parity, check()))
    assert [view.raw["quantity"] for view in page.parity] == ["depth"]
    assert [view.raw["quantity"] for view in page.checks] == ["indirect_radiance"]
    opened = '<details class="parity" open>'
    assert opened not in page_text(tmp_path, results(parity, check()))
    assert opened in page_text(tmp_path, results(parity | {"verdict": "FAIL"}, check()))


@pytest.mark.parametrize(
    ("value", "low", "high", "use"),
    [
        (0.04, None, 0.08, 0.5),
        (0.16, None, 0.08, 2.0),
        (-0.01, None, 0.08, 0.0),
        (-0.02, -0.04, 0.04, 0.5),
        (1.06, 0.9, 1.1, 0.6),
        (0.975, 0.95, None, 0.5),
        (60.0, 30.0, None, 0.5),
        (0.1, None, 0.0, None),
        (None, None, 0.08, None),
        (math.nan, None, 0.08, None),
    ],
)
def test_budget_use(value: float | None, low: float | None, high: float | None, use: float | None) -> None:
    assert budget_use(value, low, high) == (None if use is None else pytest.approx(use, abs=1e-12))


@given(value=st.floats(0, 10), half_width=st.floats(0, 1), bound=st.floats(0.01, 10))
def test_a_bar_crosses_the_line_exactly_where_the_error_exceeds_its_budget(
    value: float, half_width: float, bound: float
) -> None:
    low, high = value - half_width, value + half_width
    judged = check(criteria=[criterion(value=value, low=low, high=high, max=bound)])
    bar = page_of(results(judged)).checks[0].criteria[0].bar
    assert bar is not None
    assert 0 <= bar.low <= bar.value <= bar.high <= BAR_LENGTH
    rounding = 0.01
    if abs(value / bound - 1) > rounding:
        assert (bar.value > BAR_BUDGET) == (value > bound)
    assert bool(bar.overflow) == (value / bound * BAR_BUDGET > BAR_LENGTH)


def test_an_interval_around_no_bias_starts_at_zero() -> None:
    judged = check(criteria=[criterion("energy_bias", 0.002, low=-0.01, high=0.014, min=-0.04, max=0.04)])
    bar = page_of(results(judged)).checks[0].criteria[0].bar
    assert bar is not None
    assert bar.low == 0
    assert bar.high == pytest.approx(0.35 * BAR_BUDGET, abs=0.01)


def test_numbers() -> None:
    assert format_number(0.07304) == "0.0730"
    assert format_number(12345.0) == "12300"
    assert format_number(9.999) == "10.0"
    assert format_number(-1.2e-6) == "−1.20e−6"
    assert format_number(0.0) == "0"
    assert format_number(8.0, trim=True) == "8"
    assert format_number(100.0, trim=True) == "100"
    assert format_number(math.nan) == "NaN"
    assert format_number(-math.inf) == "−∞"
    assert format_number(None) == "–"
    assert format_metric("nrmse", 0.0731) == "7.31\u202f%"
    assert format_metric("rel_mse_eps1e-2", 0.0731) == "0.0731"
    assert format_metric("shift_px", 0.002) == "0.00200\u202fpx"
    assert format_metric("rms", 0.002, "m") == "0.00200\u202fm"
    assert format_interval("nrmse", 0.0691, 0.0778) == "[6.91, 7.78]"
    assert format_interval("rms", 0.1, 0.1) == "exact"
    assert format_percent(0.6234) == "62.3\u202f%"
    assert format_percent(0.62, trim=True) == "62\u202f%"
    assert format_percent(None) == "–"
    assert format_bound("nrmse", None, 0.08) == "≤ 8\u202f%"
    assert format_bound("energy_bias", -0.04, 0.04) == "−4\u202f% to 4\u202f%"
    assert format_seconds(0.00000034) == "0.340\u202fµs"
    assert format_seconds(0.31) == "310\u202fms"
    assert format_seconds(12.41) == "12.4\u202fs"


@given(st.floats(-1e300, 1e300))
def test_a_number_reads_back_to_three_digits(value: float) -> None:
    read = float(format_number(value).replace("−", "-"))
    assert read == pytest.approx(value, rel=0.0051, abs=1e-320)


def test_results_of_another_schema_are_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="schema 2"):
        write_report(tmp_path, results(schema=2))


def test_a_check_without_its_scene_is_refused() -> None:
    with pytest.raises(InputError, match="Check 2 of these results lacks scene"):
        page_of(results(check(), check(scene=None)))


def test_a_folder_that_cannot_be_made_is_refused(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="cannot be written"):
        write_report(tmp_path / "file", results())


def test_writing_does_not_change_the_results(tmp_path: Path) -> None:
    content = results(check())
    before = copy.deepcopy(content)
    write_report(tmp_path, content)
    assert content == before


def grey(*values: float) -> NDArray[np.float32]:
    """A row of grey pixels (1, W, 3)."""
    return np.repeat(np.array(values, dtype=np.float32)[None, :, None], 3, axis=2)


def colour(text: str) -> list[int]:
    return [int(text[start : start + 2], 16) for start in (1, 3, 5)]


def test_error_colours_at_the_scale_at_zero_beyond_and_outside_the_mask() -> None:
    test = grey(-SCALE, -SCALE / 2, 0, SCALE / 2, SCALE, 5 * SCALE, -5 * SCALE, SCALE, math.nan)
    mask = np.array([[True] * 7 + [False, True]])
    coloured = error_map(test, np.zeros_like(test), mask, SCALE)[0].tolist()
    ends = [DIVERGING[-1], DIVERGING[0]]
    assert coloured == [colour(text) for text in (*DIVERGING, *ends, NOT_JUDGED, NOT_A_NUMBER)]


def test_too_dark_is_bluer_and_too_bright_is_redder() -> None:
    dark, bright = error_map(grey(0.5, 1.5), grey(1, 1), np.ones((1, 2), bool), 1.0)[0].astype(int)
    assert dark[2] > dark[0]
    assert bright[0] > bright[2]


def significance_of(signed: list[float], wrong: list[bool]) -> Significance:
    return Significance(np.array([wrong]), np.array([signed]), share=0.5, tiles=2)


def test_significant_tiles_have_the_colours_of_the_error_map() -> None:
    """One that is wrong by nothing to speak of is white, and still unlike what shows no error."""
    found = significance_of([-SCALE, -SCALE / 2, 0, SCALE / 2, 5 * SCALE, 0, 0], [True] * 5 + [False] * 2)
    mask = np.array([[True] * 6 + [False]])
    coloured = significance_map(found, mask, SCALE)[0].tolist()
    assert coloured == [colour(text) for text in (*DIVERGING, WITHIN_NOISE, NOT_JUDGED)]
    assert len({*DIVERGING, WITHIN_NOISE, NOT_JUDGED}) == 7


def read(path: Path) -> NDArray[np.uint8]:
    with Picture.open(path) as picture:
        return np.asarray(picture.convert("RGB"))


def test_pictures_are_written_where_their_paths_say(tmp_path: Path) -> None:
    test, truth = grey(0, 1), grey(0, 0.25)
    paths = write_pictures(tmp_path, "room", test, truth, np.ones((1, 2), bool), 1.0, SCALE)
    assert paths == {name: f"images/room-{name}.png" for name in ("realtime", "truth", "error")}
    assert read(tmp_path / paths["realtime"])[0].tolist() == [[0, 0, 0], [255, 255, 255]]
    # IEC 61966-2-1: a linear quarter has the sRGB code 137.
    assert read(tmp_path / paths["truth"])[0].tolist() == [[0, 0, 0], [137, 137, 137]]
    assert read(tmp_path / paths["error"])[0].tolist() == [colour(DIVERGING[2]), colour(DIVERGING[-1])]


def test_the_picture_of_significance_is_written_on_demand(tmp_path: Path) -> None:
    found = significance_of([SCALE, 0], [True, False])
    image, mask = grey(1, 1), np.ones((1, 2), bool)
    paths = write_pictures(tmp_path, "room", image, image, mask, 1.0, SCALE, significance=found)
    assert list(paths) == ["realtime", "truth", "error", "significance"]
    assert paths["significance"] == "images/room-significance.png"
    assert read(tmp_path / paths["significance"])[0].tolist() == [colour(DIVERGING[-1]), colour(WITHIN_NOISE)]


@pytest.mark.parametrize(
    ("display", "pixel", "exposure", "shown"),
    [
        ("normal", [-1, 0, 1], 1.0, [0, 128, 255]),
        ("unit", [0.2], 1.0, [51, 51, 51]),
        ("depth", [2.0], 0.1, [51, 51, 51]),
        ("depth", [20.0], 0.1, [255, 255, 255]),
        ("depth", [math.nan], 0.1, colour(NOT_A_NUMBER)),
        ("radiance", [math.inf, 0, 0], 1.0, colour(NOT_A_NUMBER)),
        ("uv", [0.2, 1.0], 1.0, [51, 255, 0]),
    ],
)
def test_quantities_are_made_visible(
    tmp_path: Path, display: Display, pixel: list[float], exposure: float, shown: list[int]
) -> None:
    test = np.array([[pixel]], dtype=np.float32)
    truth = np.zeros_like(test)
    paths = write_pictures(tmp_path, "a", test, truth, np.ones((1, 1), bool), exposure, 1.0, display)
    assert read(tmp_path / paths["realtime"])[0, 0].tolist() == shown


def test_pixels_without_a_value_that_are_not_judged_are_grey(tmp_path: Path) -> None:
    test = grey(math.nan)
    paths = write_pictures(tmp_path, "a", test, test, np.zeros((1, 1), bool), 1.0, 1.0)
    assert [read(tmp_path / path)[0, 0].tolist() for path in paths.values()] == [colour(NOT_JUDGED)] * 3


@pytest.mark.parametrize("scale", [0.0, -1.0, math.nan])
def test_a_scale_that_shows_nothing_is_refused(tmp_path: Path, scale: float) -> None:
    with pytest.raises(ImageError, match="must be positive"):
        write_pictures(tmp_path, "a", grey(1), grey(1), np.ones((1, 1), bool), 1.0, scale)


def test_images_of_different_shapes_are_refused(tmp_path: Path) -> None:
    with pytest.raises(ImageError, match=r"\(1, 2, 3\), \(1, 1, 3\)"):
        write_pictures(tmp_path, "a", grey(1, 1), grey(1), np.ones((1, 2), bool), 1.0, 1.0)
