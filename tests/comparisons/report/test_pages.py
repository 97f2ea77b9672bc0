import copy
import html
import re
from collections.abc import Callable
from html.parser import HTMLParser
from pathlib import Path
from typing import Any
from urllib.parse import unquote

import pytest

from comparisons.report import write_report
from comparisons.report.numbers import format_bound, format_interval, format_metric
from scenes.errors import InputError

Make = Callable[..., dict[str, Any]]
PIXELS = {"pixels": "pixels/room.js", "linear": "images/room-linear.exr"}


class Elements(HTMLParser):
    """The elements of a page: names and attributes."""

    def __init__(self, path: Path) -> None:
        super().__init__()
        self.found: list[tuple[str, dict[str, str]]] = []
        self.feed(path.read_text(encoding="utf-8"))

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.found.append((tag, {name: value or "" for name, value in attrs}))

    def values(self, *names: str) -> list[str]:
        return [attributes[name] for _, attributes in self.found for name in names if name in attributes]


def pages_of(folder: Path) -> list[Path]:
    return [folder / "index.html", *sorted(folder.glob("checks/*.html"))]


def shown(path: Path) -> str:
    """What a reader of a page sees, and its alternative texts."""
    return html.unescape(path.read_text(encoding="utf-8"))


@pytest.fixture
def check_text(tmp_path: Path, make_results: Make) -> Callable[[dict[str, Any]], str]:
    """Writes the report of one check and returns the text of its page."""

    def write(check: dict[str, Any]) -> str:
        write_report(tmp_path, make_results(check))
        (page,) = tmp_path.glob("checks/*.html")
        return shown(page)

    return write


@pytest.fixture
def report(tmp_path: Path, make_results: Make, make_check: Make) -> Path:
    """The folder of a report with checks of all verdicts, one of parity, and all files that they name."""
    pictures = make_check()["images"] | PIXELS
    checks = [
        make_check(scene=f"{verdict.lower()}-room", verdict=verdict, message=f"It is {verdict}.", images=pictures)
        for verdict in ("PASS", "FAIL", "REGRESSED", "INCONCLUSIVE")
    ]
    bare = make_check(scene="broken", verdict="ERROR", criteria=[], images={}, seconds={}, spp=0, worst=None)
    parity = make_check(quantity="depth", technique="raster.depth", images=make_check()["images"])
    for name in pictures.values():
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).touch()
    broken = [{"argument": "a.toml", "message": "a.toml:1: unreadable"}]
    write_report(tmp_path, make_results(*checks, bare, parity, broken=broken, jobs=2, store_note="Repaired."))
    return tmp_path


def test_every_address_is_a_file_of_the_report(report: Path) -> None:
    checked = 0
    for page in pages_of(report):
        elements = Elements(page)
        for address in elements.values("src", "href"):
            path, _, fragment = unquote(address).partition("#")
            if address != "data:,":
                assert not re.match(r"[a-z]+:|/", address), address
                target = (page.parent / path).resolve() if path else page
                assert target.is_relative_to(report.resolve())
                assert target.is_file(), address
                is_view = "=" in fragment  # a state of the overview or of the viewer, not a place
                assert not fragment or is_view or fragment in Elements(target).values("id"), address
                checked += 1
    assert checked > 100


def test_nothing_comes_from_elsewhere(report: Path) -> None:
    for path in [*pages_of(report), *report.glob("assets/*")]:
        text = path.read_text(encoding="utf-8")
        found = re.findall(r"(?:https?:)?//[a-z0-9.-]+\.[a-z]{2,}|@import|url\(|fetch\(|XMLHttpRequest", text)
        assert not [address for address in found if "www.w3.org" not in address], path


def test_ids_are_unique_pictures_have_alternative_texts_and_labels_name_what_is_there(report: Path) -> None:
    for page in pages_of(report):
        elements = Elements(page)
        ids = elements.values("id")
        assert len(ids) == len(set(ids))
        assert all("alt" in attributes for tag, attributes in elements.found if tag == "img")
        assert set(" ".join(elements.values("aria-labelledby")).split()) <= set(ids)
        tags = [tag for tag, _ in elements.found]
        assert [tags.count(tag) for tag in ("main", "h1")] == [1, 1]


def test_the_pictures_of_a_check_are_described_where_they_tell_something(report: Path) -> None:
    for page in report.glob("checks/*room*.html"):
        alts = [attributes["alt"] for tag, attributes in Elements(page).found if tag == "img"]
        assert len(alts) == 4
        assert all(re.match(r"(Real-time|Truth|Error.*|Wrong beyond noise): \w+ of .+ with .+", alt) for alt in alts)


def test_a_page_shows_every_number_reason_and_explanation(
    check_text: Callable[[dict[str, Any]], str], make_check: Make
) -> None:
    text = check_text(make_check())
    for one in make_check()["criteria"]:
        assert format_metric(one["metric"], one["value"]) in text
        assert format_interval(one["metric"], one["low"], one["high"]) in text
        assert format_bound(one["metric"], one["min"], one["max"]) in text
        assert {part for part in (one["reason"], one["note"], one["place"]) if part not in text} == set()
    for said in (
        *("Small coloured room", "indirect.irradiance", "bounces\u00a0=\u00a03, shadows\u00a0=\u00a0on"),
        *("fitted exposure × 1.37", "on llvmpipe", "indirect_only", "direct light would add noise"),
        *("Ramamoorthi 2001", "Nine coefficients.", "One position.", "lightgauge run room -k irradiance"),
        *("skipped: visibility pass", "the character is convex", "gather", "600\u202fµs"),
        *("4\u202f096 spp", "4 times as many", "12.4\u202fs", "1.84\u202fms", "exposure × 1.52"),
        *("KEY/BLOCK/PART", "ab12cd34", "x = 12, y = 7", "0.250 ± 0.0500", "+0.250"),
        *("−0.024", "+0.024", "W/(m² sr)", "llvmpipe (LLVM"),
        "62\u202f% of the judged pixels, at a false discovery rate of 5\u202f%",
        "one_bounce (without the others): nrmse 21.1\u202f% [20.0, 22.2], energy_bias −15.3\u202f%",
        "accepted 7.25\u202f% on 2026-01-02, now ×\u00a01.01",
        "on 2026-01-02: Measured with the first release.",
        "budget slack: flip fell far.",
    ):
        assert said in text


def test_a_check_with_only_its_identity_has_a_page(
    check_text: Callable[[dict[str, Any]], str], make_check: Make
) -> None:
    least = {key: make_check()[key] for key in ("id", "scene", "technique", "quantity")} | {"verdict": "ERROR"}
    text = check_text(least)
    assert "<img" not in text
    assert "None" not in text


def test_a_check_of_an_older_run_has_a_page(check_text: Callable[[dict[str, Any]], str], make_check: Make) -> None:
    older = {key: value for key, value in make_check().items() if key not in ("worst", "effect", "pass_seconds")}
    older["criteria"] = [{k: v for k, v in one.items() if k not in ("place", "renderer")} for one in older["criteria"]]
    text = check_text(older)
    assert "Worst pixel" not in text
    assert "viewer" not in text
    assert "indirect light" in text


def test_a_check_with_pixels_has_the_viewer_and_leads_it_to_the_worst(
    check_text: Callable[[dict[str, Any]], str], make_check: Make
) -> None:
    text = check_text(make_check(images=make_check()["images"] | PIXELS))
    assert '<script src="../pixels/room.js">' in text
    assert '<link rel="stylesheet" href="../assets/viewer.css">' in text
    assert '<a href="#pixel=12,7">' in text
    assert 'href="../images/room-linear.exr"' in text


def test_missing_values_are_dashes(
    check_text: Callable[[dict[str, Any]], str], make_check: Make, tmp_path: Path
) -> None:
    values = {"spp": None, "seconds": {"realtime": None, "reference": None}, "error_scale": None, "card": None}
    broken = {"verdict": "ERROR", "message": "12 pixels are not a number.", "exposure_display": None}
    text = check_text(make_check(**values, **broken, integrator=None, images={}))
    assert "12 pixels are not a number." in text
    overview = shown(tmp_path / "index.html")
    assert '<td class="time number">–</td>' in overview
    assert "None" not in text + overview


def test_a_run_without_checks_says_so(tmp_path: Path, make_results: Make) -> None:
    text = shown(write_report(tmp_path, make_results()))
    assert "No check was run" in text
    assert "<table" not in text


def test_parity_is_open_only_when_it_needs_attention(tmp_path: Path, make_results: Make, make_check: Make) -> None:
    parity, opened = make_check(quantity="depth"), '<details class="parity" id="parity" open>'
    assert opened not in shown(write_report(tmp_path, make_results(parity, make_check())))
    assert opened in shown(write_report(tmp_path, make_results(parity | {"verdict": "FAIL"}, make_check())))


def test_times_of_concurrent_jobs_are_marked(tmp_path: Path, make_results: Make, make_check: Make) -> None:
    checks = make_check(), make_check()
    assert "2 jobs side by side" in shown(write_report(tmp_path, make_results(*checks, jobs=2)))
    assert "side by side" not in shown(write_report(tmp_path, make_results(*checks, jobs=1)))


@pytest.mark.parametrize("hostile", ["<script>alert(1)</script>", "\"' onload='x", "</style><b>", "{{ 7 * 7 }}"])
def test_no_text_of_the_results_becomes_markup(
    tmp_path: Path, make_results: Make, make_check: Make, hostile: str
) -> None:
    def poison(value: Any) -> Any:
        if isinstance(value, dict):
            return {key: value[key] if key in ("verdict", "metric") else poison(value[key]) for key in value}
        if isinstance(value, list):
            return [poison(item) for item in value]
        return hostile if isinstance(value, str) else value

    def written(folder: Path, content: dict[str, Any]) -> str:
        write_report(folder, content)
        return "".join(page.read_text(encoding="utf-8") for page in pages_of(folder))

    broken = [{"argument": "x", "message": "y"}]
    content = make_results(make_check(message="x", unit="1"), store_note="x", broken=broken)
    text = written(tmp_path / "poisoned", poison(content))
    assert text.count("<script") == written(tmp_path / "clean", content).count("<script")
    assert "<" not in hostile or hostile not in text
    assert html.escape(hostile, quote=False).replace('"', "&#34;").replace("'", "&#39;") in text


def test_an_address_of_a_picture_cannot_leave_the_folder_by_its_characters(
    tmp_path: Path, make_results: Make, make_check: Make
) -> None:
    images = dict.fromkeys(("realtime", "truth", "error"), "images/a[b=2.5]#1 ?.png")
    page = write_report(tmp_path, make_results(make_check(images=images))).read_text(encoding="utf-8")
    assert 'src="images/a%5Bb%3D2.5%5D%231%20%3F.png"' in page


def test_pages_stay_small(tmp_path: Path, make_results: Make, make_check: Make) -> None:
    """You should see that 378 checks make an overview of less than 1.2 MB, and that a page is 25 kB at most."""
    checks = [make_check(scene=f"scene-{number}") for number in range(60)]
    overview = write_report(tmp_path, make_results(*checks))
    assert overview.stat().st_size / 60 < 1.2e6 / 378
    assert max(page.stat().st_size for page in tmp_path.glob("checks/*.html")) < 25_000
    assets = sum(asset.stat().st_size for asset in tmp_path.glob("assets/*"))
    assert assets < 300_000


def test_a_folder_that_cannot_be_made_is_refused(tmp_path: Path, make_results: Make) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="cannot be written"):
        write_report(tmp_path / "file", make_results())


def test_writing_does_not_change_the_results(tmp_path: Path, make_results: Make, make_check: Make) -> None:
    content = make_results(make_check())
    before = copy.deepcopy(content)
    write_report(tmp_path, content)
    assert content == before
