import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from comparisons import history
from comparisons.history import History
from comparisons.report import write_report
from comparisons.report.course import MOST_CHANGES, changes_of
from comparisons.report.view import overview_of

Make = Callable[..., dict[str, Any]]


@pytest.fixture
def course(tmp_path: Path, make_results: Make) -> Callable[..., tuple[dict[str, Any], History]]:
    """Notes runs of lists of checks in a history; returns the last run's results and the history."""

    def noted(*runs: list[dict[str, Any]]) -> tuple[dict[str, Any], History]:
        path = tmp_path / "history.sqlite"
        for day, checks in enumerate(runs, start=1):
            results = make_results(*checks, started=f"2026-01-0{day}T10:00:00+00:00")
            results["environment"] = results["environment"] | {"commit": f"c0ffee{day}"}
            history.note(path, results)
        return results, history.read(path)

    return noted


@pytest.fixture
def measured(make_check: Make, make_criterion: Make) -> Callable[..., dict[str, Any]]:
    """A check whose only criterion is an nrmse of that value."""
    return lambda value, scene="room", **changes: make_check(
        scene=scene, criteria=[make_criterion(value=value, **changes)]
    )


def test_an_error_that_changed_is_told_with_both_values(course: Any, measured: Any) -> None:
    results, past = course([measured(0.02), measured(0.05, "hall")], [measured(0.06), measured(0.05, "hall")])
    changes = overview_of(results, past).changes
    assert changes is not None
    (change,) = changes.listed
    assert (change.check.raw["scene"], change.metric, change.rose) == ("room", "nrmse", True)
    assert (change.before, change.now) == ("2.00\u202f% [1.60, 2.40]", "6.00\u202f% [5.60, 6.40]")
    assert (change.share, change.since) == ("50\u202f%", "2026-01-01 10:00 c0ffee1")
    assert (changes.runs, changes.more) == (2, 0)


def test_of_many_changes_the_largest_are_listed(course: Any, measured: Any) -> None:
    count = MOST_CHANGES + 3
    before = [measured(0.005 * number, f"s{number}") for number in range(1, count + 1)]
    results, past = course(before, [measured(0.2, f"s{number}") for number in range(1, count + 1)])
    changes = overview_of(results, past).changes
    assert changes is not None
    assert [change.check.raw["scene"] for change in changes.listed] == [f"s{n}" for n in range(1, MOST_CHANGES + 1)]
    assert changes.more == 3


def test_one_run_and_no_history_tell_nothing(course: Any, measured: Any) -> None:
    results, past = course([measured(0.02)])
    assert overview_of(results, past).changes is None
    assert overview_of(results).changes is None


def test_checks_that_this_run_did_not_have_are_not_told(course: Any, measured: Any) -> None:
    _, past = course([measured(0.02)], [measured(0.06)])
    changes = changes_of([], past)
    assert changes is not None
    assert changes.listed == ()


def test_the_pages_show_the_course(tmp_path: Path, course: Any, measured: Any) -> None:
    results, past = course([measured(0.06)], [measured(0.02)])
    overview = write_report(tmp_path, results, past).read_text(encoding="utf-8")
    assert "Since the run before" in overview
    assert '<span class="better">↘ better</span>' in overview
    (page,) = (path.read_text(encoding="utf-8") for path in tmp_path.glob("checks/*.html"))
    (trend,) = re.findall(r'<svg[^>]*class="trend".*?</svg>', page, flags=re.DOTALL)
    assert "c0ffee1" in trend
    assert "c0ffee2" in trend


def test_a_course_without_changes_says_so(tmp_path: Path, course: Any, measured: Any) -> None:
    results, past = course([measured(0.06)], [measured(0.06)])
    assert "No error has changed." in write_report(tmp_path, results, past).read_text(encoding="utf-8")


def test_without_a_history_there_is_no_course(tmp_path: Path, make_results: Make, measured: Any) -> None:
    assert "Since the run before" not in write_report(tmp_path, make_results(measured(0.06))).read_text(
        encoding="utf-8"
    )
    (page,) = (path.read_text(encoding="utf-8") for path in tmp_path.glob("checks/*.html"))
    assert "History" not in page
