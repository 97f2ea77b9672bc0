"""The summary in Markdown, read line by line."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from comparisons.history import noted
from comparisons.outputs.markdown import summary_of
from comparisons.report.view import overview_of

Make = Callable[..., dict[str, Any]]


def summary(results: dict[str, Any], **others: Any) -> str:
    return summary_of(overview_of(results), **others)


def cells(line: str) -> list[str]:
    return [cell.strip() for cell in line.replace(r"\|", "\0").strip("|").split("|")]


def tables(text: str) -> list[list[list[str]]]:
    """The cells of each table, its header first."""
    blocks = ("\n" + text).split("\n\n")
    return [[cells(line) for line in block.splitlines()] for block in blocks if block.lstrip("\n").startswith("|")]


def test_it_begins_with_what_is_wrong(bad_run: dict[str, Any]) -> None:
    first, _, counts, *_ = summary(bad_run).splitlines()
    assert first.startswith("## lightgauge: 1 of 6 checks exceeds its budget: worst is hall with indirect.probe")
    assert counts.startswith("! 1 ERROR · ✕ 1 FAIL · ↗ 1 REGRESSED · ? 1 INCONCLUSIVE · ✓ 2 PASS")


def test_every_check_that_does_not_pass_has_a_row_the_worst_first(bad_run: dict[str, Any]) -> None:
    _, wrong, *_ = tables(summary(bad_run))
    assert [row[1] for row in wrong[2:]] == ["shed", "hall", "attic", "cellar"]
    assert wrong[3] == [
        "✕ FAIL",
        "hall",
        "`indirect.probe`",
        "`nrmse`",
        "**30.0\u202f%** [28.0,\u00a032.0]",
        "≤ 20\u202f%",
        "×\u00a03.00 ↗",
        "`scenes/hall.toml:40`",
    ]


def test_tables_are_tables_whatever_stands_in_them(bad_run: dict[str, Any], make_judged: Make, make_run: Make) -> None:
    odd = make_run(make_judged(verdict="ERROR", scene="a|b`c", message="x | y\n| z <script> @someone"))
    for results in (bad_run, odd):
        text = summary(results)
        for table in tables(text):
            assert {len(row) for row in table} == {len(table[0])}
        assert "<script>" not in text
        assert "@someone" not in text
        assert text.count("<details>") == text.count("</details>")
    (row,) = tables(summary(odd))[0][2:]
    assert row[1] == "a\0b`c"


def test_reasons_and_commands_are_at_hand(bad_run: dict[str, Any]) -> None:
    text = summary(bad_run)
    for part in (
        "The budget's reason: 100 % &lt;b> | no.",
        "worst pixel (3, 5) from the top left",
        "about 692 spp would decide it",
        "`lightgauge run room.toml -k indirect.probe`",
        "1 budget could be tightened",
        "`scenes/ruin.toml` | line 3: no such key",
        "| platform | `Linux` |",
    ):
        assert part in text


def test_a_reason_ends_with_one_full_stop(make_judged: Make, make_run: Make) -> None:
    results = make_run(make_judged(0.3, verdict="FAIL", reason="Below this it is not seen."))
    assert "The budget's reason: Below this it is not seen.\n" in summary(results)


def test_each_fault_of_a_scene_stands_on_its_own_line(make_judged: Make, make_run: Make) -> None:
    broken = [{"argument": "ruin.toml", "message": "ruin.toml:3: no such key\nruin.toml:9: no such lamp"}]
    text = summary(make_run(make_judged(), broken=broken))
    assert "| `ruin.toml` | ruin.toml:3: no such key<br>ruin.toml:9: no such lamp |" in text


def test_techniques_stand_by_effect_the_best_first(make_judged: Make, make_run: Make) -> None:
    results = make_run(
        make_judged(0.15, technique="indirect.talk"), make_judged(0.01), make_judged(0.05, scene="hall"), commit=None
    )
    (effect, _) = tables(summary(results))
    assert [(row[0], row[1]) for row in effect[2:]] == [("`indirect.probe`", "2"), ("`indirect.talk`", "1")]
    for number in ("1.00", "5.00"):
        assert number in effect[2][3]


def test_what_changed_since_the_run_before_is_told(tmp_path: Path, make_judged: Make, make_run: Make) -> None:
    before = make_run(make_judged(0.1), started="2026-01-30T12:00:00+00:00")
    now = make_run(make_judged(0.15))
    noted(tmp_path / "history.sqlite", before)
    text = summary_of(overview_of(now, noted(tmp_path / "history.sqlite", now)))
    assert "1 error changed since the run before" in text
    assert "| `room/indirect.probe` | `nrmse` | 10.0\u202f% exact | 15.0\u202f% exact | ↗ 25\u202f% |" in text
    assert "changed since" not in summary(now)


def test_a_gate_that_is_not_held_is_said_first(make_judged: Make, make_run: Make) -> None:
    text = summary(make_run(make_judged()), complaint="Too few checks: 1.")
    assert "> [!CAUTION]\n> Too few checks: 1." in text


@pytest.mark.parametrize("limit", [100_000, 20_000, 5_000, 300, 0])
def test_it_is_never_longer_than_allowed(make_judged: Make, make_run: Make, limit: int) -> None:
    checks = [make_judged(0.3, verdict="FAIL", scene=f"scene{n}", reason="é" * 300) for n in range(500)]
    text = summary(make_run(*checks), limit=limit)
    assert len(text.encode()) <= limit
    if limit >= 5_000:
        assert "more, in the report." in text
        assert text.count("<details>") == text.count("</details>")
        assert text.startswith("## lightgauge: 500 of 500 checks exceed their budget")
