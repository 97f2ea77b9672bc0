"""A page is written anew if, and only if, anything that it shows has changed."""

import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from comparisons.report import write_report
from comparisons.report.page import PACKAGES, WRITTEN
from scenes.digest import PACKAGES_FOLDER, used_by

Make = Callable[..., dict[str, Any]]
LONG_AGO = 10**18


@pytest.fixture
def written(tmp_path: Path, make_results: Make) -> Callable[..., set[str]]:
    """Writes the report of some checks, and tells which of its files that wrote."""

    def write(*checks: dict[str, Any], **changes: Any) -> set[str]:
        for path in tmp_path.rglob("*.*"):
            os.utime(path, ns=(LONG_AGO, LONG_AGO))
        write_report(tmp_path, make_results(*checks, **changes))
        files = (path for path in tmp_path.rglob("*.*") if path.stat().st_mtime_ns != LONG_AGO)
        return {path.relative_to(tmp_path).as_posix() for path in files}

    return write


@pytest.fixture
def checks(make_check: Make) -> list[dict[str, Any]]:
    return [make_check(scene=name, images={}) for name in ("a", "b", "c")]


ALWAYS = {"index.html", "assets/checks.js", WRITTEN}


def test_the_first_report_is_written_as_a_whole(
    written: Callable[..., set[str]], checks: list[dict[str, Any]], tmp_path: Path
) -> None:
    every = written(*checks)
    assert every >= ALWAYS | {"assets/style.css", "assets/controls.js"}
    assert len([name for name in every if name.startswith("checks/")]) == 3
    assert {path.relative_to(tmp_path).as_posix() for path in tmp_path.rglob("*.*")} == every


def test_another_run_of_the_same_results_writes_what_tells_of_the_run(
    written: Callable[..., set[str]], checks: list[dict[str, Any]], tmp_path: Path
) -> None:
    written(*checks)
    assert written(*checks, started="2026-03-04 10:11:12", seconds=1.5) == ALWAYS
    assert "2026-03-04 10:11:12" in (tmp_path / "index.html").read_text(encoding="utf-8")
    assert "2026-03-04 10:11:12" in (tmp_path / "assets" / "checks.js").read_text(encoding="utf-8")


def pages_in(names: set[str]) -> set[str]:
    return {name.removeprefix("checks/")[0] for name in names if name.startswith("checks/")}


@pytest.mark.parametrize(
    "change",
    [
        {"cached": False},
        {"message": "Another one."},
        {"seconds": {"realtime": 0.5, "reference": 12.4}},
        {"card": {"name": "indirect.irradiance", "summary": "Ten coefficients.", "limits": "", "source": ""}},
        {"images": {"realtime": "images/b-realtime.png"}},
    ],
    ids=lambda change: next(iter(change)),
)
def test_a_changed_check_has_a_new_page(
    written: Callable[..., set[str]], checks: list[dict[str, Any]], change: dict[str, Any]
) -> None:
    written(*checks)
    a, b, c = checks
    assert pages_in(written(a, b | change, c)) == {"b"}


def test_pages_know_their_neighbours_and_their_number(
    written: Callable[..., set[str]], checks: list[dict[str, Any]]
) -> None:
    written(*checks)
    assert pages_in(written(*checks[:2])) == {"a", "b"}, "'1 of 3' has become '1 of 2'"


def test_the_versions_that_a_page_tells_are_those_of_the_run(
    written: Callable[..., set[str]], checks: list[dict[str, Any]]
) -> None:
    written(*checks)
    assert pages_in(written(*checks, environment={"mitsuba": "4.0"})) == {"a", "b", "c"}


def edited(page: Path) -> None:
    page.write_text(page.read_text(encoding="utf-8").replace("Criteria", "Critera"), encoding="utf-8")


def cut_off(page: Path) -> None:
    page.write_bytes(page.read_bytes()[:-100])


@pytest.mark.parametrize("damage", [edited, cut_off, Path.unlink])
def test_a_page_that_is_not_as_it_was_written_is_written_anew(
    written: Callable[..., set[str]], checks: list[dict[str, Any]], tmp_path: Path, damage: Callable[[Path], None]
) -> None:
    written(*checks)
    (page,) = tmp_path.glob("checks/b-*.html")
    whole = page.read_bytes()
    damage(page)
    assert pages_in(written(*checks)) == {"b"}
    assert page.read_bytes() == whole


@pytest.mark.parametrize("content", ["", "[]", "null", "{", '{"index.html": 1}', "\xff"])
def test_without_knowing_what_was_written_all_is_written(
    written: Callable[..., set[str]], checks: list[dict[str, Any]], tmp_path: Path, content: str
) -> None:
    every = written(*checks)
    (tmp_path / WRITTEN).write_text(content, encoding="latin-1")
    assert written(*checks) == every


def test_other_code_writes_all_pages(
    written: Callable[..., set[str]], checks: list[dict[str, Any]], monkeypatch: pytest.MonkeyPatch
) -> None:
    written(*checks)
    monkeypatch.setattr("comparisons.report.page.page_code", lambda: "other")
    anew = written(*checks)
    assert pages_in(anew) == {"a", "b", "c"}
    assert "assets/controls.js" in anew


def test_the_code_of_pages_is_all_that_makes_them(tmp_path: Path, make_results: Make, make_check: Make) -> None:
    """Whatever is imported here to write a report counts, but for packages that only name their modules."""
    results = make_results(make_check())
    program = (
        "import sys; from pathlib import Path; from comparisons.report.page import write_report;"
        f"write_report(Path({str(tmp_path)!r}), {results!r});"
        "print(*(m.__file__ for n, m in sys.modules.items() if n.split('.')[0] in ('comparisons', 'reference')))"
    )
    said = subprocess.run(
        [sys.executable, "-c", program], cwd=PACKAGES_FOLDER, capture_output=True, text=True, check=True
    ).stdout
    modules = {Path(path) for path in said.split() if not path.endswith("__init__.py")}
    assert len(modules) > 20
    assert modules <= used_by(("comparisons.report.page",), PACKAGES)


def test_a_page_says_of_its_run_what_the_overview_says(
    tmp_path: Path, make_results: Make, make_check: Make, open_page: Callable[..., Any]
) -> None:
    write_report(tmp_path, make_results(make_check(images={})))
    (path,) = tmp_path.glob("checks/*.html")
    told = open_page(path).evaluate("document.getElementById('run').textContent")
    assert "2026-01-14 09:12:44" in told
    assert "commit 3f9c1ab27d0e" in told
    assert told == open_page(tmp_path / "index.html").evaluate("document.getElementById('run').textContent")
