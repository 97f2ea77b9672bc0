"""Workflow commands, read as GitHub's runner does."""

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from comparisons.outputs.github import MOST, annotations
from comparisons.report.view import overview_of

Make = Callable[..., dict[str, Any]]
Command = tuple[str, dict[str, str], str]


def unescaped(text: str) -> str:
    for code, character in (("%3A", ":"), ("%2C", ","), ("%0D", "\r"), ("%0A", "\n"), ("%25", "%")):
        text = text.replace(code, character)
    return text


def command_of(line: str) -> Command:
    """Level, properties and message of a line."""
    found = re.fullmatch(r"::(\w+) (.*?)::(.*)", line)
    assert found, line
    properties = dict(part.split("=", 1) for part in found[2].split(","))
    return found[1], {key: unescaped(value) for key, value in properties.items()}, unescaped(found[3])


def commands(results: dict[str, Any], complaint: str = "", root: Path | None = None) -> list[Command]:
    lines = annotations(overview_of(results), Path("report"), complaint, root or Path.cwd())
    return [command_of(line) for line in lines]


def test_levels_follow_the_verdicts_the_worst_first(bad_run: dict[str, Any]) -> None:
    found = commands(bad_run, complaint="Too few checks: 3.")
    assert [(level, properties["title"]) for level, properties, _ in found] == [
        ("error", "Too few checks"),
        ("error", "scenes/ruin.toml cannot be read"),
        ("error", "ERROR shed/indirect.probe"),
        ("error", "FAIL hall/indirect.probe"),
        ("error", "REGRESSED attic/indirect.probe"),
        ("warning", "INCONCLUSIVE cellar/indirect.probe"),
        ("notice", "Slack budget: room/indirect.probe"),
    ]


def test_an_annotation_stands_at_the_budget_and_says_what_helps(bad_run: dict[str, Any]) -> None:
    (fail,) = (c for c in commands(bad_run) if c[1]["title"].startswith("FAIL"))
    assert (fail[1]["file"], fail[1]["line"]) == ("scenes/hall.toml", "40")
    first, *rest = fail[2].splitlines()
    assert first == "nrmse 30.0\u202f% [28.0, 32.0], budget ≤ 20\u202f%"
    assert rest[0] == "reason for the budget: 100 % <b> | no"
    assert rest[1].startswith("worst pixel (3, 5) from the top left")
    assert rest[2] == "again: lightgauge run room.toml -k indirect.probe"


def test_a_scene_that_cannot_be_read_is_annotated_where_it_is_wrong(make_run: Make) -> None:
    mistake = {"argument": "scenes/a.toml", "message": "scenes/a.toml:39: checks[0].technique: unknown"}
    unnamed = {"argument": "b", "message": "no such scene: see the list"}
    (first, second) = commands(make_run(broken=[mistake, unnamed]))
    assert (first[1]["file"], first[1]["line"], first[2]) == ("scenes/a.toml", "39", mistake["message"])
    assert set(second[1]) == {"title"}


def test_a_budget_outside_the_checkout_is_annotated_without_a_place(
    bad_run: dict[str, Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (fail,) = (c for c in commands(bad_run, root=tmp_path) if c[1]["title"].startswith("FAIL"))
    assert set(fail[1]) == {"title"}
    below = tmp_path / "rendering"
    below.mkdir()
    monkeypatch.chdir(below)
    (fail,) = (c for c in commands(bad_run, root=tmp_path) if c[1]["title"].startswith("FAIL"))
    assert fail[1]["file"] == "rendering/scenes/hall.toml"


def test_a_line_is_a_line_and_a_property_a_property(make_judged: Make, make_run: Make) -> None:
    (found,) = commands(make_run(make_judged(verdict="ERROR", scene="a,b:c%0A", message="50 %\r\nof it", rerun="")))
    assert found == ("error", {"title": "ERROR a,b:c%0A/indirect.probe"}, "50 % of it")


@pytest.mark.parametrize("count", [MOST, MOST + 1, 3 * MOST])
def test_where_there_are_more_than_github_shows_the_last_one_says_so(
    make_judged: Make, make_run: Make, count: int
) -> None:
    checks = [make_judged(0.3 + n / 100, verdict="FAIL", scene=f"scene{n}") for n in range(count)]
    found = commands(make_run(*checks, make_judged(0.2, 0.1, 0.3, "INCONCLUSIVE")))
    errors = [c for c in found if c[0] == "error"]
    assert errors[0][1]["title"] == f"FAIL scene{count - 1}/indirect.probe"
    assert len(errors) == MOST
    assert [c[1]["title"] for c in errors if "more" in c[1]["title"]] == (
        [f"and {count - MOST + 1} more"] if count > MOST else []
    )
    assert [c[0] for c in found].count("warning") == 1


def test_a_run_in_which_all_is_well_annotates_nothing(make_judged: Make, make_run: Make) -> None:
    assert commands(make_run(make_judged())) == []
