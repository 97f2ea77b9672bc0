"""The overview in a real browser: every control is used, and its effect is seen."""

import json
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from comparisons.report import write_report

Make = Callable[..., dict[str, Any]]

SHOWN = "[...document.querySelectorAll('table.checks')[0].tBodies[0].rows].filter(row => !row.hidden)"
NAMES = f"{SHOWN}.map(row => row.querySelector('.scene a').textContent)"
ALL = ["broken", "cellar", "attic", "hall", "den", "bath"]
"""In the order at first: worst verdict first, and of those that do not pass the one furthest beyond its budget."""


def scene(make_check: Make, make_criterion: Make, name: str, value: float | None, **changes: Any) -> dict[str, Any]:
    verdict = changes.pop("verdict", "PASS")
    bound = changes.pop("bound", 0.08)
    criteria = [] if value is None else [make_criterion(value=value, max=bound, verdict=verdict)]
    return make_check(scene=name, scene_title=f"The {name}", verdict=verdict, criteria=criteria, **changes)


@pytest.fixture(scope="module")
def folder(
    tmp_path_factory: pytest.TempPathFactory, make_results: Make, make_check: Make, make_criterion: Make
) -> Path:
    """A report of six checks of light and two of parity, each column in an order of its own."""

    def one(name: str, value: float | None, **changes: Any) -> dict[str, Any]:
        return scene(make_check, make_criterion, name, value, images={}, **changes)

    accepted = make_check()["accepted"]
    defocus = {"quantity": "defocus_radiance", "technique": "defocus.talk", "settings": {"layers": 3}}
    checks = [
        one("hall", 0.02, seconds={"realtime": 0.3, "reference": 5.0}, spp=64, spp_fixed=640, accepted=accepted),
        one("den", 0.04, seconds={"realtime": 0.1, "reference": 9.0}, spp=4096, spp_fixed=4096, bound=0.05),
        one("attic", 0.09, verdict="FAIL", seconds={"realtime": 0.2, "reference": 1.0}, spp=512, accepted=None),
        one("bath", 0.01, seconds={"realtime": 2.0, "reference": 0.5}, spp=16, spp_fixed=320, bound=0.5, **defocus),
        one("cellar", 0.5, verdict="FAIL", bound=0.1, accepted=None, **defocus),
        one("broken", None, verdict="ERROR", seconds={}, spp=0, spp_fixed=0, message="It has no lamp."),
        one("hall", 0.001, quantity="depth", technique="raster.depth"),
        one("den", 0.002, quantity="depth", technique="raster.depth"),
    ]
    folder = tmp_path_factory.mktemp("overview")
    write_report(folder, make_results(*checks))
    return folder


@pytest.fixture(scope="module")
def tab(folder: Path, chromium: Any) -> Iterator[Any]:
    opened = chromium.page((folder / "index.html").as_uri())
    yield opened
    opened.close()


@pytest.fixture
def page(folder: Path, tab: Any) -> Any:
    """The overview, loaded afresh in the same tab."""
    tab.evaluate("isBefore = true")
    tab.go((folder / "index.html").as_uri())
    tab.wait_for("typeof isBefore === 'undefined' && document.readyState === 'complete'")
    return tab


def names(page: Any) -> list[str]:
    found: list[str] = page.evaluate(NAMES)
    return found


def choose(page: Any, name: str, value: str) -> None:
    """Choose an option as the browser does when its user has."""
    page.evaluate(
        f"(() => {{ const field = document.querySelector('select[name={name}]'); field.value = {json.dumps(value)};"
        "field.dispatchEvent(new Event('input', { bubbles: true })); })()"
    )


def write(page: Any, text: str) -> None:
    page.click("input[name=text]")
    for letter in text:
        page.key(letter)


def address(page: Any) -> str:
    found: str = page.evaluate("decodeURIComponent(location.hash)")
    return found


def count(page: Any) -> str:
    found: str = page.text("output")
    return found


def test_at_first_all_checks_are_shown_worst_verdict_first(page: Any) -> None:
    assert names(page) == ALL
    assert count(page) == "6 of 6 checks, 2 of 2 of parity"
    assert address(page) == ""
    assert page.problems() == []


@pytest.mark.parametrize(
    ("key", "rising", "unknown"),
    [
        ("effect", ["cellar", "bath", "broken", "attic", "hall", "den"], []),
        ("scene", ["attic", "bath", "broken", "cellar", "den", "hall"], []),
        ("technique", ["cellar", "bath", "broken", "attic", "hall", "den"], []),
        ("severity", ALL, []),
        ("error", ["bath", "hall", "den", "attic", "cellar"], ["broken"]),
        ("budget", ["den", "attic", "hall", "cellar", "bath"], ["broken"]),
        ("use", ["bath", "hall", "den", "attic", "cellar"], ["broken"]),
        ("realtime", ["cellar", "den", "attic", "hall", "bath"], ["broken"]),
        ("truth", ["bath", "attic", "hall", "den", "cellar"], ["broken"]),
        ("spp", ["broken", "bath", "hall", "attic", "cellar", "den"], []),
        ("saved", ["den", "cellar", "hall", "bath", "attic"], ["broken"]),
        ("change", ["bath", "hall", "den"], ["broken", "cellar", "attic"]),
    ],
)
def test_a_heading_sorts_both_ways(page: Any, key: str, rising: list[str], unknown: list[str]) -> None:
    """You should see what has no value last, whichever way."""
    heading = f"table.checks th [data-sort={key}]"
    seen = {}
    for _ in range(2):
        page.click(heading)
        order = page.evaluate(f"document.querySelector({json.dumps(heading)}).closest('th').ariaSort")
        seen[order] = names(page)
        assert address(page) == f"#sort={'-' if order == 'descending' else ''}{key}"
    assert seen["ascending"] == rising + unknown
    value = dict(page.evaluate(f"CHECKS.filter(check => !check.parity).map(check => [check.scene, check.{key}])"))
    assert seen["descending"] == sorted(rising, key=rank(ALL, value), reverse=True) + unknown


def rank(order: list[str], value: dict[str, Any]) -> Callable[[str], Any]:
    """What sorts by value, equal ones backwards, so that reversed they keep their order."""
    return lambda name: (value[name], -order.index(name))


def test_the_keyboard_sorts_too(page: Any) -> None:
    page.evaluate("document.querySelector('[data-sort=scene]').focus()")
    page.key("Enter")
    assert names(page) == sorted(ALL)


@pytest.mark.parametrize(
    ("field", "value", "left", "of_parity"),
    [
        ("effect", "defocus", ["cellar", "bath"], 0),
        ("scene", "hall", ["hall"], 1),
        ("technique", "defocus.talk", ["cellar", "bath"], 0),
        ("verdict", "FAIL", ["cellar", "attic"], 0),
    ],
)
def test_a_choice_filters(page: Any, field: str, value: str, left: list[str], of_parity: int) -> None:
    choose(page, field, value)
    assert names(page) == left
    assert count(page) == f"{len(left)} of 6 checks, {of_parity} of 2 of parity"
    assert address(page) == f"#{field}={value}"
    choose(page, field, "")
    assert names(page) == ALL


@pytest.mark.parametrize(
    ("text", "left"),
    [("no lamp", ["broken"]), ("LAYERS", ["cellar", "bath"]), ("the hall", ["hall"]), ("den pass", ["den"])],
)
def test_text_finds_all_its_words_wherever_they_stand(page: Any, text: str, left: list[str]) -> None:
    write(page, text)
    assert names(page) == left
    assert address(page) == f"#text={text.replace(' ', '+')}"


def test_filters_add_up(page: Any) -> None:
    choose(page, "verdict", "FAIL")
    choose(page, "effect", "indirect light")
    assert names(page) == ["attic"]


def test_a_chip_shows_one_verdict_and_all_again(page: Any) -> None:
    chip = ".chip[data-verdict=FAIL]"
    page.click(chip)
    assert names(page) == ["cellar", "attic"]
    assert page.evaluate("document.querySelector('select[name=verdict]').value") == "FAIL"
    assert page.evaluate(f"document.querySelector('{chip}').ariaPressed") == "true"
    assert page.evaluate("document.querySelector('.filters').getBoundingClientRect().top < innerHeight")
    page.click(chip)
    assert names(page) == ALL
    assert page.evaluate(f"document.querySelector('{chip}').ariaPressed") == "false"


def test_a_technique_at_a_glance_leads_to_its_checks(page: Any) -> None:
    page.click(".group a[href*='technique=defocus.talk']")
    page.wait_for(f"{NAMES}.length === 2")
    assert names(page) == ["cellar", "bath"]
    assert page.evaluate("document.querySelector('select[name=effect]').value") == "defocus"


def test_a_link_restores_what_was_chosen(folder: Path, open_page: Callable[..., Any]) -> None:
    page = open_page(folder / "index.html", fragment="#effect=indirect+light&text=pass&sort=-error")
    assert names(page) == ["den", "hall"]
    assert page.evaluate("document.querySelector('input[name=text]').value") == "pass"
    assert page.evaluate("document.querySelector('[data-sort=error]').closest('th').ariaSort") == "descending"
    page.evaluate("location.hash = '#scene=bath'")
    page.wait_for("document.querySelector('select[name=scene]').value === 'bath'")
    assert names(page) == ["bath"]


def test_where_nothing_matches_it_says_so_and_leads_back(page: Any) -> None:
    assert page.evaluate("document.querySelector('.nothing-matches').hidden")
    write(page, "zebra")
    assert names(page) == []
    assert page.text(".nothing-matches").startswith("No check matches.")
    page.click(".nothing-matches .reset")
    assert names(page) == ALL
    assert page.evaluate("document.querySelector('.nothing-matches').hidden")
    assert page.evaluate("document.activeElement.name") == "text"


def test_reset_shows_everything_again(page: Any) -> None:
    page.click("[data-sort=scene]")
    choose(page, "effect", "defocus")
    page.click(".filters [type=reset]")
    assert names(page) == ALL
    assert (address(page), page.evaluate("document.querySelector('select[name=effect]').value")) == ("", "")
    assert page.evaluate("document.querySelectorAll('[aria-sort]').length") == 0


def test_the_slash_goes_to_the_text(page: Any) -> None:
    page.key("/")
    assert page.evaluate("document.activeElement.name") == "text"
    page.key("/")
    assert page.evaluate("document.activeElement.value") == "/"


def test_parity_opens_when_only_it_matches_or_when_it_is_asked_for(page: Any) -> None:
    assert not page.evaluate("document.getElementById('parity').open")
    choose(page, "effect", "parity")
    assert page.evaluate("document.getElementById('parity').open")
    assert count(page) == "0 of 6 checks, 2 of 2 of parity"
    page.evaluate("document.getElementById('parity').open = false")
    page.click(".jump a[href='#parity']")
    page.wait_for("document.getElementById('parity').open")


def test_a_link_to_parity_does_no_harm_where_there_is_none(
    tmp_path: Path, make_results: Make, make_check: Make, open_page: Callable[..., Any]
) -> None:
    write_report(tmp_path, make_results(make_check(images={})))
    page = open_page(tmp_path / "index.html", fragment="#parity")
    assert count(page) == "1 of 1 checks"
    assert page.problems() == []


def test_each_fault_of_a_scene_stands_on_its_own_line(
    tmp_path: Path, make_results: Make, make_check: Make, open_page: Callable[..., Any]
) -> None:
    broken = [{"argument": "ruin.toml", "message": "ruin.toml:3: no such key\nruin.toml:9: no such lamp"}]
    write_report(tmp_path, make_results(make_check(images={}), broken=broken))
    page = open_page(tmp_path / "index.html")
    assert page.text(".callout.ERROR").splitlines() == ["ruin.toml:3: no such key", "ruin.toml:9: no such lamp"]


@pytest.mark.parametrize("width", [1400, 1000, 620])
def test_nothing_is_wider_than_the_window(folder: Path, open_page: Callable[..., Any], width: int) -> None:
    page = open_page(folder / "index.html", width)
    assert page.evaluate("document.documentElement.scrollWidth") <= width
    ends = "[...document.querySelectorAll('.group tbody > tr > *')].map(cell => cell.getBoundingClientRect().right)"
    assert page.evaluate(f"Math.max(...{ends})") <= width
