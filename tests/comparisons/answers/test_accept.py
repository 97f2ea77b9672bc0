"""From a finished run to the file of accepted errors."""

import json
from collections.abc import Callable
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import pytest

from comparisons.answers.accept import accept_lines, updated
from comparisons.baseline import FILE_NAME, apply, read_accepted, text_of
from comparisons.gate import CriterionResult, Verdict
from comparisons.result import CheckResult
from scenes.errors import InputError
from scenes.load import load_scene

Write = Callable[..., Path]

WHY = "the first measurement"
LIGHT = "tiny/indirect.irradiance[side=24]"


def criterion(metric: str, value: float, half_width: float = 0.0) -> CriterionResult:
    return CriterionResult(
        metric, value, value - half_width, value + half_width, None, 0.5, Verdict.PASS, "a bound for a test", ""
    )


def check(technique: str = "raster.depth", scene: str = "tiny", **changes: Any) -> CheckResult:
    result = CheckResult(
        *(
            scene,
            "A ball",
            "depth",
            technique,
            {},
            False,
            Verdict.PASS,
            "",
            (criterion("rms", 1e-4),),
            "m",
            "depth",
            {},
        ),
        rerun=f"lightgauge run {scene}.toml -k {technique}",
    )
    return replace(result, **changes)


def light(value: float = 0.2, verdict: Verdict = Verdict.PASS) -> CheckResult:
    criteria = (criterion("nrmse", value, 0.01),)
    return check("indirect.irradiance", settings={"side": 24}, criteria=criteria, spp=256, verdict=verdict)


def finished_run(here: Path, *results: CheckResult) -> Path:
    folder = here / "report"
    folder.mkdir(exist_ok=True)
    content = {"schema": 1, "checks": [result.to_json() for result in results]}
    (folder / "results.json").write_text(json.dumps(content), encoding="utf-8")
    return folder


def accept(here: Path, *results: CheckResult, reason: str = WHY, keep: str = "") -> list[str]:
    return list(accept_lines(finished_run(here, *results), reason, keep))


def test_what_passes_is_accepted_beside_its_scene(here: Path, write_scene: Write) -> None:
    write_scene()
    lines = accept(here, check(), light())
    assert lines == [
        "accepted tiny/raster.depth: rms none -> 0.000100\u202fm",
        f"accepted {LIGHT}: nrmse none -> 20.0\u202f% [19.0, 21.0]",
        f"{here / FILE_NAME} holds 2 accepted errors now.",
    ]
    entries = read_accepted(here)
    assert entries["tiny/raster.depth"].criteria == {"rms": (1e-4, 1e-4, 1e-4)}
    assert entries[LIGHT].criteria == {"nrmse": (0.2, 0.19, 0.21)}
    assert (entries[LIGHT].spp, entries[LIGHT].reason) == (256, WHY)
    assert abs((datetime.now(UTC).date() - entries[LIGHT].date).days) <= 1


def test_an_accepted_regression_is_none_any_more(here: Path, write_scene: Write) -> None:
    write_scene()
    accept(here, light(0.2))
    regressed = apply(light(0.3), read_accepted(here)[LIGHT])
    assert regressed.verdict is Verdict.REGRESSED
    first, _ = accept(here, regressed, reason="a darker room is meant")
    assert first == f"accepted {LIGHT}: nrmse 20.0\u202f% [19.0, 21.0] -> 30.0\u202f% [29.0, 31.0]"
    assert apply(light(0.3), read_accepted(here)[LIGHT]).verdict is Verdict.PASS


def test_the_same_numbers_change_nothing_in_the_file(here: Path, write_scene: Write) -> None:
    write_scene()
    accept(here, check(), light())
    before = (here / FILE_NAME).read_bytes()
    lines = accept(here, check(), light(), reason="another reason")
    assert [line.split()[0] for line in lines[:2]] == ["unchanged", "unchanged"]
    assert (here / FILE_NAME).read_bytes() == before
    accept(here, check(), light(0.21), reason="another reason")
    changed = (here / FILE_NAME).read_text(encoding="utf-8").splitlines()
    assert [old for old in before.decode().splitlines() if old not in changed] == [before.decode().splitlines()[1]]


@pytest.mark.parametrize("verdict", [Verdict.INCONCLUSIVE, Verdict.FAIL, Verdict.ERROR])
def test_what_does_not_hold_its_budget_is_left_out(here: Path, write_scene: Write, verdict: Verdict) -> None:
    write_scene()
    lines = accept(here, check(), light(verdict=verdict))
    assert lines[0] == f"left out {LIGHT}: it is {verdict}, and only an error within its budget can be accepted"
    assert set(read_accepted(here)) == {"tiny/raster.depth"}
    (here / FILE_NAME).unlink()
    with pytest.raises(InputError, match=f"can be accepted: .* is {verdict}"):
        accept(here, light(verdict=verdict))
    assert not (here / FILE_NAME).exists()


def test_only_what_contains_the_text_is_accepted(here: Path, write_scene: Write) -> None:
    write_scene()
    accept(here, check(), light(), keep="raster")
    assert set(read_accepted(here)) == {"tiny/raster.depth"}
    accept(here, check(), light(0.3), keep="indirect")
    assert set(read_accepted(here)) == {"tiny/raster.depth", LIGHT}
    with pytest.raises(InputError, match=r"No check in '.*report' matches 'glossy'"):
        accept(here, check(), light(), keep="glossy")


def test_scenes_of_one_folder_share_its_file(here: Path, write_scene: Write) -> None:
    write_scene()
    write_scene(name="other")
    (here / "deeper").mkdir()
    (here / "deeper" / "third.toml").write_bytes((here / "tiny.toml").read_bytes())
    third = check(scene="third", rerun="lightgauge run deeper/../deeper/third.toml -k raster")
    accept(here, check(), check(scene="other"), third)
    assert set(read_accepted(here)) == {"tiny/raster.depth", "other/raster.depth"}
    assert set(read_accepted(here / "deeper")) == {"third/raster.depth"}


def test_what_a_scene_no_longer_has_is_dropped(here: Path, write_scene: Write) -> None:
    write_scene()
    write_scene(name="other")
    accept(here, check(), light(), check(scene="other"))
    write_scene(("side = 24", "side = 32"))
    lines = accept(here, check(criteria=(criterion("rms", 2e-4),)), light())
    assert f"left out {LIGHT}: the scene no longer has this check" in lines
    assert f"dropped {LIGHT}: the scene no longer has this check" in lines
    assert set(read_accepted(here)) == {"tiny/raster.depth", "other/raster.depth"}


def test_other_scenes_are_not_touched_even_if_their_names_begin_alike(here: Path, write_scene: Write) -> None:
    write_scene()
    scene = load_scene(here / "tiny.toml")
    accept(here, check())
    (entry,) = read_accepted(here).values()
    assert updated(scene, {"tiny-2/gone": entry, "tiny/gone": entry}, {}) == {"tiny-2/gone": entry}


@pytest.mark.parametrize("reason", ["", "   ", "better", "  better   "])
def test_a_reason_is_needed(here: Path, write_scene: Write, reason: str) -> None:
    write_scene()
    with pytest.raises(InputError, match="too short"):
        accept(here, check(), reason=reason)
    assert not (here / FILE_NAME).exists()


def test_a_reason_of_several_lines_becomes_one(here: Path, write_scene: Write) -> None:
    write_scene()
    accept(here, check(), reason=" meant \n so ")
    assert read_accepted(here)["tiny/raster.depth"].reason == "meant so"


def test_nothing_is_written_if_a_file_cannot_be_read(here: Path, write_scene: Write) -> None:
    write_scene()
    (here / "deeper").mkdir()
    (here / "deeper" / FILE_NAME).write_text("{", encoding="utf-8")
    (here / "deeper" / "third.toml").write_bytes((here / "tiny.toml").read_bytes())
    third = check(scene="third", rerun="lightgauge run deeper/third.toml -k raster")
    with pytest.raises(InputError, match="Invalid JSON"):
        accept(here, check(), third)
    assert not (here / FILE_NAME).exists()


def test_a_scene_that_is_gone_is_named(here: Path) -> None:
    with pytest.raises(InputError, match=r"tiny\.toml: the scene cannot be read"):
        accept(here, check())


@pytest.mark.parametrize(
    "change",
    [
        {"schema": 2},
        {"checks": [{}]},
        {"checks": [{"rerun": "lightgauge"}]},
        {"checks": [check().to_json() | {"verdict": "FINE"}]},
        {"checks": [check().to_json() | {"extra": 1}]},
        {"checks": [check().to_json() | {"rerun": None}]},
    ],
)
def test_results_that_are_none_are_refused_in_one_paragraph(here: Path, change: dict[str, Any]) -> None:
    folder = finished_run(here, check())
    content = {"schema": 1, "checks": [check().to_json()]} | change
    (folder / "results.json").write_text(json.dumps(content), encoding="utf-8")
    with pytest.raises(InputError) as caught:
        list(accept_lines(folder, WHY, ""))
    assert "Run the checks again." in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_run_that_does_not_exist_is_refused(here: Path) -> None:
    with pytest.raises(InputError, match="does not exist"):
        list(accept_lines(here / "nothing", WHY, ""))


def test_a_run_is_accepted_and_the_file_is_the_one_that_text_of_gives(after_a_run: Path) -> None:
    lines = list(accept_lines(Path("report"), WHY, ""))
    assert len(lines) == 6
    entries = read_accepted(after_a_run)
    assert set(entries) == {LIGHT, *(f"tiny/raster.{name}" for name in ("normal", "depth", "coverage", "albedo"))}
    assert (after_a_run / FILE_NAME).read_text(encoding="utf-8") == text_of(entries)
