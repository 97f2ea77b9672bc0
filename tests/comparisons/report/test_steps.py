"""The page of a check in a real browser: the way to its neighbours and back, and the command to copy."""

import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from comparisons.report import write_report

Make = Callable[..., dict[str, Any]]
PATIENCE_S = 30.0
TITLE = "document.querySelector('h1').lastChild.textContent.trim()"


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory, make_results: Make, make_check: Make) -> Path:
    """A report of five checks named A to E, of which B and D are of defocus."""
    folder = tmp_path_factory.mktemp("steps")
    checks = [
        make_check(
            scene=name.lower(),
            scene_title=name,
            images={},
            settings={"wanted": "100 %"},
            quantity="defocus_radiance" if name in "BD" else "indirect_radiance",
        )
        for name in "ABCDE"
    ]
    for check in checks:
        check["id"] += f"/{check['scene']} ü"
    write_report(folder, make_results(*checks))
    return folder


@pytest.fixture
def at(folder: Path, open_page: Callable[..., Any]) -> Callable[..., Any]:
    """Opens the page of the check with that title."""
    return lambda title, query="": open_page(next(folder.glob(f"checks/{title.lower()}-*.html")), fragment=query)


def eventually(page: Any, condition: str) -> None:
    """Wait for a condition on a page that may just be left: what it is asked then goes unanswered."""
    end = time.monotonic() + PATIENCE_S
    while time.monotonic() < end:
        try:
            if page.evaluate(condition):
                return
        except AssertionError as error:
            if "navigated" not in str(error):
                raise
        time.sleep(0.02)
    raise AssertionError(f"waited {PATIENCE_S:g} s for {condition}")


def arrive(page: Any, title: str) -> None:
    eventually(page, f"document.readyState === 'complete' && !!document.querySelector('h1') && {TITLE} === '{title}'")


def test_links_lead_to_the_neighbours_and_end_at_the_ends(at: Callable[..., Any]) -> None:
    page = at("A")
    assert page.evaluate("document.querySelector('[rel=prev]').hasAttribute('href')") is False
    for title in "BCDE":
        page.click("[rel=next]")
        arrive(page, title)
    assert page.evaluate("document.querySelector('[rel=next]').hasAttribute('href')") is False
    assert page.text("#place") == "5 of 5"
    page.click("[rel=prev]")
    arrive(page, "D")


def test_keys_lead_there_too(at: Callable[..., Any]) -> None:
    page = at("A")
    page.key("k")
    page.key("j")
    arrive(page, "B")
    page.key("j")
    arrive(page, "C")
    page.key("k")
    arrive(page, "B")
    assert page.text("#place") == "2 of 5"
    page.key("o")
    eventually(page, "document.readyState === 'complete' && location.pathname.endsWith('/index.html')")
    assert page.text("output") == "5 of 5 checks"


def test_the_way_keeps_to_what_was_chosen(at: Callable[..., Any]) -> None:
    page = at("B", "?effect=defocus&sort=-scene")
    assert page.text("#place") == "2 of 2 chosen"
    assert page.evaluate("document.querySelector('[rel=next]').hasAttribute('href')") is False
    page.key("k")
    arrive(page, "D")
    assert page.text("#place") == "1 of 2 chosen"
    page.click(".back")
    eventually(page, "document.readyState === 'complete' && !!document.querySelector('output')")
    assert page.text("output") == "2 of 5 checks"
    assert page.evaluate("location.hash") == "#effect=defocus&sort=-scene"


def test_a_row_of_the_overview_hands_its_choice_on(folder: Path, open_page: Callable[..., Any]) -> None:
    page = open_page(folder / "index.html", fragment="#effect=defocus")
    page.click("tr:not([hidden]) .scene a")
    arrive(page, "B")
    assert page.text("#place") == "1 of 2 chosen"
    assert page.problems() == []


def test_a_check_outside_of_what_was_chosen_keeps_its_own_neighbours(at: Callable[..., Any]) -> None:
    page = at("A", "?effect=defocus")
    assert page.text("#place") == "1 of 5"
    page.key("j")
    arrive(page, "B")


def test_the_command_is_copied(at: Callable[..., Any]) -> None:
    page = at("A")
    page.browser.send("Browser.grantPermissions", permissions=["clipboardReadWrite", "clipboardSanitizedWrite"])
    page.click(".copy")
    eventually(page, "document.querySelector('.copy').textContent === 'Copied'")
    assert page.evaluate("navigator.clipboard.readText()") == "lightgauge run room -k irradiance"
    assert page.evaluate("document.querySelector('.command [role=status]').textContent") == "Copied"


def test_where_the_clipboard_is_closed_the_command_is_selected(at: Callable[..., Any]) -> None:
    page = at("A")
    page.evaluate("navigator.clipboard.writeText = () => Promise.reject(new Error('closed'))")
    page.evaluate("document.execCommand = () => false")
    page.click(".copy")
    eventually(page, "document.querySelector('.copy').textContent === 'Press Ctrl+C'")
    assert page.evaluate("getSelection().toString()") == "lightgauge run room -k irradiance"
