"""The options that commands share: what they write, when, and with which exit status."""

import json
import xml.etree.ElementTree as ET
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from comparisons.outputs.words import shortfall
from comparisons.report.view import overview_of

Make = Callable[..., dict[str, Any]]
Run = Callable[..., Any]
FILES = ("--junit", "out/junit.xml", "--markdown", "out/summary.md", "--history", "out/history.sqlite")


@pytest.fixture(autouse=True)
def _no_github(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("GITHUB_STEP_SUMMARY", "GITHUB_WORKSPACE"):
        monkeypatch.delenv(name, raising=False)


@pytest.fixture
def write_run(here: Path) -> Callable[[dict[str, Any]], None]:
    """Writes results.json into ./report."""

    def write(results: dict[str, Any]) -> None:
        (here / "report").mkdir(exist_ok=True)
        (here / "report" / "results.json").write_text(json.dumps(results), encoding="utf-8")

    return write


@pytest.mark.parametrize(
    ("least", "says"),
    [
        (None, ""),
        (4, ""),
        (5, "4 checks were judged, --min-checks asks for 5 (parity and ERROR are not counted); 1 ended in ERROR: "),
    ],
)
def test_only_judged_checks_count_and_no_parity(bad_run: dict[str, Any], least: int | None, says: str) -> None:
    found = shortfall(overview_of(bad_run), least)
    assert says in found
    assert bool(found) == bool(says)
    if found:
        assert "shed/indirect.probe; 1 could not be read: scenes/ruin.toml" in found


def test_a_finished_run_makes_every_output(
    here: Path, write_run: Callable[..., None], bad_run: dict[str, Any], lightgauge: Run
) -> None:
    write_run(bad_run)
    outcome = lightgauge("report", "report", *FILES)
    assert (outcome.status, outcome.out) == (0, "report/index.html\n")
    assert ET.parse(here / "out" / "junit.xml").getroot().attrib["tests"] == "7"
    assert (here / "out" / "summary.md").read_text(encoding="utf-8").startswith("## lightgauge: 1 of 6 checks")
    assert "1 ERROR" in lightgauge("history", "out/history.sqlite").out


@pytest.mark.parametrize(("least", "status"), [("4", 0), ("5", 1)])
def test_too_few_checks_fail_the_gate(
    write_run: Callable[..., None], bad_run: dict[str, Any], lightgauge: Run, least: str, status: int
) -> None:
    write_run(bad_run)
    outcome = lightgauge("report", "report", "--min-checks", least)
    assert outcome.status == status
    assert ("Too few checks" in outcome.out) == bool(status)


@pytest.fixture
def summary(here: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The file that GitHub names for the summary of a step."""
    monkeypatch.setenv("GITHUB_STEP_SUMMARY", str(here / "summary.md"))
    return here / "summary.md"


def test_github_gets_annotations_and_a_summary_behind_what_is_there(
    summary: Path, write_run: Callable[..., None], bad_run: dict[str, Any], lightgauge: Run
) -> None:
    write_run(bad_run)
    summary.write_text("# Before\n")
    outcome = lightgauge("report", "report", "--format", "github")
    assert "::error file=scenes/hall.toml,line=40,title=FAIL hall/indirect.probe::" in outcome.out
    assert summary.read_text(encoding="utf-8").startswith("# Before\n## lightgauge: 1 of 6 checks")


def test_the_summary_of_a_step_stays_below_what_github_takes(
    summary: Path, write_run: Callable[..., None], bad_run: dict[str, Any], lightgauge: Run
) -> None:
    write_run(bad_run)
    summary.write_text("x" * ((1 << 20) - 3000))
    assert lightgauge("report", "report", "--format", "github").status == 0
    assert (1 << 20) - 3000 < summary.stat().st_size <= 1 << 20


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (("--junit", "."), "is a folder. Name a file with --junit"),
        (("--markdown", "tiny.toml/summary.md"), "--markdown"),
        (("--history", "tiny.toml"), "'tiny.toml' cannot be used as a history"),
        (("--min-checks", "0"), "--min-checks is 0"),
        (("--format", "xml"), "invalid choice: 'xml'"),
    ],
)
def test_what_cannot_be_written_is_refused_before_anything_is_rendered(
    here: Path, write_scene: Callable[..., Path], lightgauge: Run, arguments: tuple[str, str], says: str
) -> None:
    write_scene()
    outcome = lightgauge("run", "tiny.toml", *arguments)
    assert outcome.status == 3
    assert says in outcome.err
    assert not (here / ".lightgauge").exists()


def test_a_run_writes_them_even_if_a_check_fails_and_its_report_shows_the_history(
    with_truth: Path, lightgauge: Run, write_scene: Callable[..., Path]
) -> None:
    assert lightgauge("run", "tiny.toml", *FILES, "--min-checks", "1").status == 0
    write_scene(('"indirect.irradiance"\nsettings = { side = 24 }', '"indirect.talk"'), ("max = 0.5", "max = 0.05"))
    outcome = lightgauge("run", "tiny.toml", *FILES, "--format", "github")
    assert outcome.status == 1
    assert "title=FAIL tiny/indirect.talk::nrmse" in outcome.out
    root = ET.parse("out/junit.xml").getroot()
    assert (root.attrib["failures"], root.attrib["errors"]) == ("1", "0")
    runs = lightgauge("history", "out/history.sqlite").out.splitlines()[1:3]
    assert [("1 FAIL" in run) for run in runs] == [False, True]
    pages = "".join(page.read_text(encoding="utf-8") for page in (with_truth / "report" / "checks").glob("*.html"))
    assert 'class="trend"' in pages


def test_too_few_checks_turn_success_into_failure(with_truth: Path, lightgauge: Run) -> None:
    outcome = lightgauge("run", "tiny.toml", "--min-checks", "2")
    assert outcome.status == 1
    assert "1 check was judged, --min-checks asks for 2" in outcome.out
    assert (with_truth / "report" / "index.html").exists()
