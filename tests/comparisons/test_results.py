"""results.json: what it holds, and that it comes back as it was."""

import json
import math
import os
import subprocess
from collections.abc import Callable
from dataclasses import asdict, fields, replace
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from comparisons.gate import CriterionResult, Verdict
from comparisons.result import CheckResult, check_id, rerun_command
from comparisons.results import _copy, commit, read_run, results_json, results_text, shown_by, with_pictures
from comparisons.summary import closing_lines, line_of
from reference.quantities import MODULES as QUANTITIES
from reference.store import Store

Run = Callable[..., Any]

CRITERION_KEYS = {"bound", *(field.name for field in fields(CriterionResult))}
CHECK_KEYS = {"id", "effect", *(field.name for field in fields(CheckResult))}

numbers = st.floats(allow_nan=False, allow_infinity=False)
texts = st.text(max_size=12)
criteria = st.builds(
    CriterionResult,
    metric=texts,
    value=numbers,
    low=numbers,
    high=numbers,
    min=st.none() | numbers,
    max=st.none() | numbers,
    verdict=st.sampled_from(Verdict),
    reason=texts,
    note=texts,
    valid=st.booleans(),
    floor=st.none() | numbers,
    renderer=texts,
    place=texts,
)
checks = st.builds(
    CheckResult,
    worst=st.none() | st.fixed_dictionaries({"x": st.integers(0, 9), "truth": st.lists(numbers, max_size=3)}),
    scene=texts,
    scene_title=texts,
    quantity=st.sampled_from(sorted(QUANTITIES)),
    technique=texts,
    settings=st.dictionaries(texts, st.booleans() | st.integers() | numbers | texts, max_size=3),
    fit_exposure=st.booleans(),
    verdict=st.sampled_from(Verdict),
    message=texts,
    criteria=st.lists(criteria, max_size=3).map(tuple),
    unit=texts,
    card=st.dictionaries(texts, texts, max_size=2),
    rerun=texts,
    spp=st.integers(min_value=0),
    seconds=st.dictionaries(texts, numbers, max_size=2),
    skipped=st.lists(st.fixed_dictionaries({"what": texts, "why": texts}), max_size=2).map(tuple),
    images=st.dictionaries(texts, texts, max_size=2),
    error_scale=st.none() | numbers,
    exit_status=st.sampled_from((0, 3, 4)),
)


def no_constants(name: str) -> None:
    raise AssertionError(f"{name} is not JSON")


@given(checks)
def test_a_result_comes_back_from_json_as_it_was(result: CheckResult) -> None:
    text = json.dumps(result.to_json(), allow_nan=False)
    assert CheckResult.from_json(json.loads(text)) == result


@given(criteria, st.sampled_from((math.nan, math.inf, -math.inf)))
def test_a_measurement_that_is_no_number_is_null(criterion: CriterionResult, value: float) -> None:
    result = replace(BARE, criteria=(replace(criterion, value=value, low=value, high=value),))
    plain = json.loads(json.dumps(result.to_json(), allow_nan=False))
    assert [plain["criteria"][0][key] for key in ("value", "low", "high")] == [None, None, None]
    (back,) = CheckResult.from_json(plain).criteria
    assert math.isnan(back.value)
    assert replace(back, value=0, low=0, high=0) == replace(criterion, value=0, low=0, high=0)


BARE = CheckResult("s", "S", "depth", "t", {}, False, Verdict.ERROR, "", (), "m", "depth", {}, "lightgauge run s")


@given(criteria)
def test_the_bound_of_a_criterion_is_its_upper_one_if_there_is_one(criterion: CriterionResult) -> None:
    (plain,) = replace(BARE, criteria=(criterion,)).to_json()["criteria"]
    assert plain["bound"] == (criterion.min if criterion.max is None else criterion.max)


def test_the_results_of_a_run_have_the_keys_that_readers_rely_on(after_a_run: Path) -> None:
    text = (after_a_run / "report" / "results.json").read_text(encoding="utf-8")
    results = json.loads(text, parse_constant=no_constants)
    assert results["schema"] == 1
    assert {"environment", "started", "seconds", "counts", "store_note", "checks"} <= set(results)
    assert results["counts"] == {"PASS": 5, "INCONCLUSIVE": 0, "REGRESSED": 0, "FAIL": 0, "ERROR": 0}
    assert results["seconds"] > 0
    assert results["environment"]["mitsuba"].count(".") == 2
    assert "OpenGL" in results["environment"]["gl_renderer"]
    for check in results["checks"]:
        assert set(check) == CHECK_KEYS
        assert check["criteria"]
        assert all(set(criterion) == CRITERION_KEYS for criterion in check["criteria"])
        assert set(check["seconds"]) == {"realtime", "reference"}
        assert all((after_a_run / "report" / path).is_file() for path in check["images"].values())
        more = {"linear", "flip"} if check["quantity"] == "indirect_radiance" else set()
        assert set(check["images"]) == {"realtime", "truth", "error", "pixels"} | more
        assert json.loads(json.dumps(CheckResult.from_json(check).to_json())) == check


def test_every_skip_has_a_reason(after_a_run: Path) -> None:
    _, results = read_run(after_a_run / "report")
    skipped = [skip for check in results["checks"] for skip in check["skipped"]]
    assert any(skip["what"] == "self-visibility" for skip in skipped)
    assert all(set(skip) == {"what", "why"} and len(skip["why"]) > 8 for skip in skipped)


def test_verdicts_are_counted() -> None:
    of = [replace(BARE, verdict=verdict) for verdict in (Verdict.PASS, Verdict.PASS, Verdict.FAIL)]
    results = results_json(of, "2024-01-01T00:00:00+00:00", 1.5, ["one.", "two."])
    assert results["counts"] == {"PASS": 2, "INCONCLUSIVE": 0, "REGRESSED": 0, "FAIL": 1, "ERROR": 0}
    assert results["store_note"] == "one. two."
    assert results_json([], "", 0.0, [])["store_note"] is None


def test_a_checkout_names_its_commit(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    def git(*arguments: str) -> str:
        identity = ["-c", "user.name=a", "-c", "user.email=a@b"]
        return subprocess.run(["git", *identity, *arguments], check=True, capture_output=True, text=True).stdout.strip()

    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("GIT_CEILING_DIRECTORIES", str(tmp_path.parent))
    assert commit() is None
    git("init", "--quiet")
    (tmp_path / "shader.frag").write_text("one", encoding="utf-8")
    git("add", ".")
    git("commit", "--quiet", "--message", "one")
    assert commit() == git("rev-parse", "--short=12", "HEAD")
    (tmp_path / "report").mkdir()
    assert commit() == git("rev-parse", "--short=12", "HEAD")
    (tmp_path / "shader.frag").write_text("two", encoding="utf-8")
    assert commit() == git("rev-parse", "--short=12", "HEAD") + "+"
    monkeypatch.setenv("PATH", str(tmp_path))
    assert commit() is None


@pytest.mark.parametrize(
    ("settings", "fitted", "name"),
    [
        ({}, False, "t"),
        ({"b": 2, "a": 1.5}, False, "t[a=1.5,b=2]"),
        ({}, True, "t[fitted]"),
        ({"a": True}, True, "t[a=True,fitted]"),
    ],
)
def test_the_name_of_a_check_tells_what_sets_it_apart(settings: dict[str, Any], fitted: bool, name: str) -> None:
    assert check_id("t", settings, fitted) == name


def test_the_command_to_repeat_a_check_can_be_pasted_into_a_shell() -> None:
    assert rerun_command("knot", "raster.depth") == "lightgauge run knot -k '/raster.depth$'"
    assert rerun_command("my scene.toml", "t") == "lightgauge run 'my scene.toml' -k '/t$'"


JUDGED = CriterionResult("nrmse", 0.1, 0.09, 0.11, None, 0.08, Verdict.FAIL, "a reason", "a note")


def test_a_line_shows_the_criterion_that_decides() -> None:
    passing = replace(JUDGED, metric="flip", verdict=Verdict.PASS)
    line = line_of(replace(BARE, verdict=Verdict.FAIL, criteria=(passing, JUDGED), cached=True))
    assert line.startswith("FAIL         s/t  nrmse 10.0")
    assert line.endswith("(stored)")
    assert "flip" not in line


def test_a_message_of_several_lines_is_one_line_of_progress() -> None:
    assert line_of(replace(BARE, message="one\ntwo")).endswith("s/t  one two")


def test_the_last_lines_say_what_is_not_fine_and_why() -> None:
    results = [
        replace(BARE, technique="good", verdict=Verdict.PASS),
        replace(BARE, technique="bad", verdict=Verdict.FAIL, criteria=(JUDGED,)),
        replace(BARE, technique="broken", message="first\nsecond"),
        replace(BARE, technique="also broken", message="first\nsecond"),
    ]
    lines = list(closing_lines(results, ["A block was damaged."], Path("report/index.html"), 2.0))
    assert lines[0] == "A block was damaged."
    assert lines[1] == "FAIL s/bad"
    assert lines[2].endswith("(a reason); a note")
    assert lines[4:9] == [
        "ERROR s/broken",
        "  first\n  second",
        "  again: lightgauge run s",
        "ERROR s/also broken",
        "  (for the same reason)",
    ]
    assert lines[-1] == "1 PASS, 1 FAIL, 2 ERROR in 2.0 s. Report: report/index.html"
    assert not any("good" in line for line in lines)


def test_results_hold_every_field(after_a_run: Path) -> None:
    _, results = read_run(after_a_run / "report" / "results.json")
    assert set(asdict(CheckResult.from_json(results["checks"][0]))) == CHECK_KEYS - {"id", "effect"}


def files_of(folder: Path) -> dict[str, set[str]]:
    return {part: {path.name for path in (folder / part).iterdir()} for part in ("checks", "images", "pixels")}


def test_a_report_holds_its_own_checks_and_no_earlier_ones(after_a_run: Path, lightgauge: Run) -> None:
    lightgauge("run", "tiny.toml", "-k", "depth", "-o", "apart")
    mine = Path("report", "images", "mine-error.png")
    mine.write_bytes(b"drawn by somebody else")
    lightgauge("run", "tiny.toml", "-k", "depth")
    assert mine.exists()
    mine.unlink()
    assert files_of(Path("report")) == files_of(Path("apart"))


@pytest.mark.parametrize("path", ["../keep.txt", "keep.txt", "images/../keep.txt", "/keep.txt"])
def test_only_what_lies_where_reports_have_pictures_is_ever_removed(tmp_path: Path, path: str) -> None:
    results = {"checks": [{"id": "room/a", "images": {"truth": path, "error": "images/room-a-error.png"}}]}
    (tmp_path / "results.json").write_text(json.dumps(results), encoding="utf-8")
    assert shown_by(tmp_path) == {"checks/room-a.html", "images/room-a-error.png"}


@pytest.mark.parametrize(
    "text", ["", "[]", '{"checks": [{}]}', '{"checks": 3}', '{"checks": [{"id": 1, "images": 2}]}']
)
def test_a_damaged_earlier_run_shows_nothing(tmp_path: Path, text: str) -> None:
    (tmp_path / "results.json").write_text(text, encoding="utf-8")
    assert shown_by(tmp_path) == set()


def test_checks_whose_names_make_the_same_file_name_have_pictures_of_their_own(
    make_judged: Callable[..., dict[str, Any]], tmp_path: Path
) -> None:
    for name in ("one.png", "two.png"):
        (tmp_path / name).write_text(name, encoding="utf-8")
    (tmp_path / "images").mkdir()
    named = [
        CheckResult.from_json(make_judged(scene=scene, technique=technique, images={"truth": image}))
        for scene, technique, image in (("a", "b-c", "one.png"), ("a-b", "c", "two.png"))
    ]
    shown = with_pictures(tmp_path, Store(tmp_path), named)
    assert [(tmp_path / one.images["truth"]).read_text(encoding="utf-8") for one in shown] == ["one.png", "two.png"]


def test_a_picture_is_copied_if_it_is_not_the_one_that_is_there(tmp_path: Path) -> None:
    source, target = tmp_path / "store.png", tmp_path / "report.png"
    source.write_bytes(b"first")
    _copy(source, target)
    assert target.read_bytes() == b"first"
    inode = target.stat().st_ino
    os.utime(target, ns=(0, source.stat().st_mtime_ns))
    _copy(source, target)
    assert (target.stat().st_ino, target.stat().st_atime_ns) == (inode, 0), "it was neither read nor written"
    source.write_bytes(b"other")
    os.utime(source, ns=(0, target.stat().st_mtime_ns + 1))
    _copy(source, target)
    assert target.read_bytes() == b"other"
    target.write_bytes(b"edits")
    os.utime(target, ns=(0, source.stat().st_mtime_ns - 1))
    _copy(source, target)
    assert target.read_bytes() == b"other"


def test_results_are_written_one_check_a_line(make_run: Callable[..., Any], make_judged: Callable[..., Any]) -> None:
    results = make_run(make_judged(), make_judged(scene="other"))
    text = results_text(results)
    assert json.loads(text) == json.loads(json.dumps(results))
    assert sum(line.startswith("{") and '"criteria"' in line for line in text.splitlines()) == 2
    assert json.loads(results_text(make_run()))["checks"] == []
    with pytest.raises(ValueError, match="not JSON compliant"):
        results_text(make_run(make_judged() | {"spp": float("nan")}))
