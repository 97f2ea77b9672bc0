"""The accepted error: what counts as a change of it, and the file that keeps it."""

import datetime
import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from comparisons.baseline import (
    FILE_NAME,
    LEAST_CHANGE,
    Accepted,
    Outcome,
    accepted_of,
    against,
    apply,
    error_of,
    notes_on,
    read_accepted,
    text_of,
)
from comparisons.gate import CriterionResult, Verdict
from comparisons.metrics import Estimate, Samples, evaluate
from comparisons.result import CheckResult
from scenes.errors import InputError

Triple = tuple[float, float, float]

TODAY = datetime.date(2026, 11, 22)
WHY = "the first measurement"
TRUTH = np.random.default_rng(0).uniform(0.5, 1.5, size=(10, 10, 3))
MASK = np.ones((10, 10), dtype=bool)

errors = st.floats(0, 10).map(lambda x: round(x, 6))
triples = st.tuples(errors, errors, errors).map(lambda t: (sorted(t)[1], min(t), max(t)))
budgets = st.floats(0.01, 100)


def criterion(measured: Triple, most: float | None = 1.0, least: float | None = None) -> CriterionResult:
    value, low, high = measured
    return CriterionResult("nrmse", value, low, high, least, most, Verdict.PASS, "a bound for a test", "")


def check(*criteria: CriterionResult, technique: str = "t") -> CheckResult:
    return CheckResult(
        "s", "S", "q", technique, {}, False, Verdict.PASS, "", criteria, "1", "radiance", {}, "lightgauge run s", spp=64
    )


def accepted(measured: Triple) -> Accepted:
    return accepted_of(check(criterion(measured)), WHY, TODAY)


def outcome(before: Triple, now: Triple, most: float | None = 1.0, least: float | None = None) -> Outcome | None:
    (found,) = against(accepted(before), [criterion(now, most, least)])
    return found


def point(value: float) -> Triple:
    return value, value, value


@pytest.mark.parametrize(
    ("before", "now", "expected"),
    [
        ((0.3, 0.2, 0.4), (0.6, 0.5, 0.7), Outcome.REGRESSED),
        ((0.3, 0.2, 0.4), (0.6, 0.4, 0.8), Outcome.HELD),
        ((0.3, 0.2, 0.4), (0.6, 0.3, 0.9), Outcome.HELD),
        ((0.3, 0.29, 0.31), (0.34, 0.33, 0.35), Outcome.HELD),
        ((0.3, 0.29, 0.31), (0.36, 0.35, 0.37), Outcome.REGRESSED),
        ((0.8, 0.7, 0.9), (0.2, 0.1, 0.3), Outcome.SLACK),
        ((0.8, 0.7, 0.9), (0.4, 0.3, 0.5), Outcome.HELD),
        ((0.8, 0.1, 0.9), (0.2, 0.1, 0.3), Outcome.HELD),
        ((0.06, 0.05, 0.07), (0.02, 0.01, 0.025), Outcome.HELD),
        ((0.3, 0.2, 0.4), (0.3, 0.2, 0.4), Outcome.HELD),
        (point(0.3), point(0.34), Outcome.HELD),
        (point(0.3), point(0.36), Outcome.REGRESSED),
        (point(0.0), point(0.06), Outcome.REGRESSED),
        (point(0.3), point(0.1), Outcome.SLACK),
        (point(1e-6), point(1e-3), Outcome.HELD),
        (point(1e-3), point(1e-6), Outcome.HELD),
        ((-0.3, -0.4, -0.2), (-0.6, -0.7, -0.5), Outcome.REGRESSED),
        ((-0.3, -0.4, -0.2), (0.3, 0.2, 0.4), Outcome.HELD),
        ((0.0, -0.1, 0.1), (-0.3, -0.4, -0.2), Outcome.REGRESSED),
        ((-0.8, -0.9, -0.7), (0.0, -0.1, 0.1), Outcome.SLACK),
    ],
)
def test_truth_table(before: Triple, now: Triple, expected: Outcome) -> None:
    """All against a budget of 1, of which 0.05 counts."""
    assert outcome(before, now, least=-1.0) is expected


@pytest.mark.parametrize(("most", "least"), [(1.0, None), (None, -1.0), (0.5, -1.0), (-0.1, -1.0)])
def test_the_size_of_a_budget_is_its_larger_bound(most: float | None, least: float | None) -> None:
    assert outcome(point(-0.3), point(-0.349), most, least) is Outcome.HELD
    assert outcome(point(-0.3), point(-0.351), most, least) is Outcome.REGRESSED


@given(st.floats(-10, 10), st.lists(st.floats(-10, 10), min_size=3, max_size=3))
def test_the_interval_of_an_error_is_that_of_the_distance_from_zero(share: float, numbers: list[float]) -> None:
    low, value, high = sorted(numbers)
    error, least, most = error_of((value, low, high))
    assert least <= error <= most
    inside = min(max(low, share), high)
    assert least <= abs(inside) <= most
    assert {least, most} <= {0.0, abs(low), abs(high)}


@given(triples, budgets)
def test_the_same_result_never_regresses(measured: Triple, most: float) -> None:
    """Not even by the digits that an accepted error is rounded by."""
    value, low, high = (100 * x / 3 for x in measured)
    assert outcome((value, low, high), (value, low, high), most) is Outcome.HELD


@given(triples, triples, budgets, st.floats(1, 100))
def test_a_larger_error_is_never_judged_more_kindly(before: Triple, now: Triple, most: float, factor: float) -> None:
    order = [Outcome.SLACK, Outcome.HELD, Outcome.REGRESSED]
    value, low, high = (x * factor for x in now)
    smaller, larger = outcome(before, now, most), outcome(before, (value, low, high), most)
    assert smaller is not None
    assert larger is not None
    assert order.index(smaller) <= order.index(larger)


@given(triples, triples, budgets)
def test_what_regressed_one_way_is_no_regression_the_other_way(before: Triple, now: Triple, most: float) -> None:
    if outcome(before, now, most) is Outcome.REGRESSED:
        assert outcome(now, before, most) is not Outcome.REGRESSED
    if outcome(before, now, most) is Outcome.SLACK:
        assert outcome(now, before, most) is Outcome.REGRESSED


@given(triples, triples, budgets)
def test_a_small_part_of_the_budget_never_counts(before: Triple, now: Triple, most: float) -> None:
    """What rounding adds to a difference is at most a thousandth of the larger value."""
    if abs(now[0] - before[0]) + 1e-3 * max(now[0], before[0]) < LEAST_CHANGE * most:
        assert outcome(before, now, most) is Outcome.HELD


def test_nothing_is_said_where_nothing_was_accepted_or_measured() -> None:
    risen = criterion(point(0.9))
    assert against(accepted(point(0.1)), [replace(risen, metric="flip")]) == (None,)
    assert against(accepted(point(0.1)), [replace(risen, valid=False)]) == (None,)


def measured(brightness: float, spp: int, rng: np.random.Generator) -> Estimate:
    """nrmse of an image that is too bright, against a truth whose samples are exponentially distributed."""
    shape = spp / 16
    accumulators = TRUTH * rng.gamma(shape, 1 / shape, size=(16, *TRUTH.shape))
    return evaluate("nrmse", brightness * TRUTH, Samples(accumulators, MASK))


def runs(pairs: int, before: tuple[float, int], now: tuple[float, int]) -> list[tuple[Triple, Triple]]:
    rng = np.random.default_rng(7)
    estimates = [(measured(*before, rng), measured(*now, rng)) for _ in range(pairs)]
    return [((a.value, a.low, a.high), (b.value, b.low, b.high)) for a, b in estimates]


@pytest.mark.parametrize("spp", [(32, 32), (512, 32), (32, 512)])
def test_noise_alone_hardly_ever_regresses(spp: tuple[int, int]) -> None:
    """At most 2 alpha = 2 %, for independent truths less; by their values alone more than a tenth would."""
    budget = 0.3
    pairs = runs(400, (1.2, spp[0]), (1.2, spp[1]))
    alarms = sum(outcome(before, now, budget) is Outcome.REGRESSED for before, now in pairs)
    by_value = sum(now[0] - before[0] > LEAST_CHANGE * budget for before, now in pairs)
    assert alarms <= 0.01 * len(pairs)
    assert by_value > 0.1 * len(pairs)


def test_a_rise_by_30_percent_is_found() -> None:
    pairs = runs(50, (1.2, 128), (1.26, 128))
    widths = [(high - low) / value for (value, low, high), _ in pairs]
    assert np.mean(widths) > 0.1
    assert sum(outcome(before, now, 0.35) is Outcome.REGRESSED for before, now in pairs) >= 45


def test_a_risen_error_regresses_its_check_and_says_by_how_much() -> None:
    kept = replace(criterion((0.01, 0.0, 0.02)), metric="flip")
    before = accepted_of(check(criterion((0.2, 0.19, 0.21)), kept), WHY, TODAY)
    result = apply(check(criterion((0.3, 0.29, 0.31)), kept), before)
    assert result.verdict is Verdict.REGRESSED
    assert [c.verdict for c in result.criteria] == [Verdict.REGRESSED, Verdict.PASS]
    assert result.message == (
        "The error has risen since it was accepted on 2026-11-22, though the budget holds: nrmse from 20.0\u202f% "
        "[19.0, 21.0] to 30.0\u202f% [29.0, 31.0], budget ≤ 100\u202f%. Find what changed; if it is meant, run "
        "`lightgauge accept RUN --reason \"...\" -k 's/t$'` with the folder of this run."
    )
    assert result.accepted == {
        "date": "2026-11-22",
        "reason": WHY,
        "criteria": {"nrmse": [0.2, 0.19, 0.21], "flip": [0.01, 0.0, 0.02]},
        "renderer": "",
    }
    assert apply(result, before) == result
    assert CheckResult.from_json(json.loads(json.dumps(result.to_json()))) == result


def test_a_fallen_error_passes_and_its_budget_is_called_slack() -> None:
    result = apply(check(criterion((0.0352, 0.02, 0.045), 0.35)), accepted((0.294, 0.29, 0.298)))
    assert result.verdict is Verdict.PASS
    assert result.slack == (
        "budget slack: nrmse fell from 29.4\u202f% to 3.52\u202f% while its budget is ≤ 35\u202f%; tighten the budget "
        "and run `lightgauge accept`"
    )


@pytest.mark.parametrize("verdict", [Verdict.INCONCLUSIVE, Verdict.FAIL, Verdict.ERROR])
def test_a_check_that_does_not_pass_keeps_its_verdict(verdict: Verdict) -> None:
    broken = replace(check(criterion(point(0.9))), verdict=verdict, message="why")
    result = apply(broken, accepted(point(0.1)))
    assert result == replace(broken, accepted=result.accepted)
    assert result.accepted is not None


def test_a_check_without_an_accepted_error_stays_as_it_is() -> None:
    assert apply(check(criterion(point(0.9))), None) == check(criterion(point(0.9)))


def test_slack_and_missing_entries_are_noted() -> None:
    known = apply(check(criterion(point(0.1))), accepted(point(0.9)))
    unknown, failed = check(technique="new"), replace(check(technique="bad"), verdict=Verdict.FAIL)
    slack, missing = notes_on([known, unknown, failed])
    assert slack == f"s/t: {known.slack}"
    assert missing.startswith("1 check has no accepted error")
    assert list(notes_on([known, failed])) == [slack]
    assert list(notes_on([unknown, failed])) == []


names = st.text(min_size=1, max_size=12)
numbers = st.floats(-1e6, 1e6).map(lambda x: float(f"{x:.4g}"))
entries = st.builds(
    Accepted,
    criteria=st.dictionaries(names, st.tuples(numbers, numbers, numbers).map(lambda t: (sorted(t)[1], min(t), max(t)))),
    date=st.dates(),
    reason=st.text(min_size=8, max_size=40),
    spp=st.integers(0, 1 << 22),
)


@given(st.dictionaries(names, entries, max_size=4))
def test_entries_come_back_from_the_file_as_they_were(
    tmp_path_factory: pytest.TempPathFactory, written: dict[str, Accepted]
) -> None:
    folder = tmp_path_factory.getbasetemp()
    (folder / FILE_NAME).write_text(text_of(written), encoding="utf-8")
    assert read_accepted(folder) == written
    assert text_of(read_accepted(folder)) == text_of(written)


def test_the_file_has_one_sorted_line_a_check() -> None:
    rms, flip = criterion((0.123456, -0.0, 0.2)), replace(criterion(point(1e-5)), metric="flip")
    one, other = (accepted_of(check(*order), WHY, TODAY) for order in ((rms, flip), (flip, rms)))
    line = (
        '{"criteria": {"flip": [1e-05, 1e-05, 1e-05], "nrmse": [0.1235, 0.0, 0.2]}, "date": "2026-11-22", '
        f'"reason": "{WHY}", "renderer": "", "spp": 64}}'
    )
    assert text_of({"b": one, "a": other}) == f'{{\n"a": {line},\n"b": {line}\n}}\n'


def test_without_a_file_nothing_is_accepted(tmp_path: Path) -> None:
    assert read_accepted(tmp_path) == {}


GOOD = '{"s/t": {"criteria": {"nrmse": [0.1, 0.05, 0.2]}, "date": "2026-11-22", "reason": "because it is", "spp": 64}}'


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda text: text[:-2], "Invalid JSON"),
        (lambda text: f"<<<<<<< HEAD\n{text}", "Invalid JSON"),
        (lambda text: "", "Invalid JSON"),
        (lambda text: "[]", "should be an object"),
        (lambda text: text.replace('"spp"', '"sp"'), "s/t: spp: Field required"),
        (lambda text: text.replace('"spp"', '"extra": 1, "spp"'), "s/t: extra: Extra inputs are not permitted"),
        (lambda text: text.replace("64", "-64"), "s/t: spp: "),
        (lambda text: text.replace("64", "6.5"), "s/t: spp: "),
        (lambda text: text.replace("2026-11-22", "yesterday"), "s/t: date: "),
        (lambda text: text.replace("because it is", "so"), "s/t: reason: "),
        (lambda text: text.replace("0.05, ", ""), "s/t: criteria: nrmse: "),
        (lambda text: text.replace("0.05", "0.15"), "s/t: criteria: nrmse: these should be [value, low, high]"),
        (lambda text: text.replace("0.05", '"0.05"'), "s/t: criteria: nrmse: 1: "),
        (lambda text: text.replace("0.05", "NaN"), "s/t: criteria: nrmse: 1: "),
        (lambda text: text.replace("0.2]", "Infinity]"), "s/t: criteria: nrmse: 2: "),
    ],
)
def test_a_file_that_is_wrong_is_refused_in_one_paragraph(
    tmp_path: Path, change: Callable[[str], str], said: str
) -> None:
    (tmp_path / FILE_NAME).write_text(change(GOOD), encoding="utf-8")
    with pytest.raises(InputError) as caught:
        read_accepted(tmp_path)
    message = str(caught.value)
    assert message.startswith(f"{tmp_path / FILE_NAME}: ")
    assert said in message
    assert message.endswith("Restore the file, or remove it and run `lightgauge accept`.")
    assert "\n" not in message


def test_the_file_that_the_wrong_ones_are_made_from_is_right(tmp_path: Path) -> None:
    (tmp_path / FILE_NAME).write_text(GOOD, encoding="utf-8")
    assert read_accepted(tmp_path)["s/t"].criteria == {"nrmse": (0.1, 0.05, 0.2)}


def test_a_file_that_cannot_be_read_is_refused(tmp_path: Path) -> None:
    (tmp_path / FILE_NAME).mkdir()
    with pytest.raises(InputError, match="cannot be read"):
        read_accepted(tmp_path)


def test_an_error_is_not_held_against_that_of_another_renderer() -> None:
    before = accepted((0.2, 0.19, 0.21)).model_copy(update={"renderer": "llvmpipe"})
    risen = check(criterion((0.3, 0.29, 0.31)))
    nvidia = replace(risen, gl_renderer="NVIDIA H200/PCIe/SSE2, OpenGL 4.3")
    assert apply(nvidia, before).verdict is Verdict.PASS
    assert (apply(nvidia, before).accepted or {})["renderer"] == "llvmpipe"
    assert apply(replace(risen, gl_renderer="llvmpipe (LLVM 19)"), before).verdict is Verdict.REGRESSED


def test_what_is_accepted_names_its_renderer() -> None:
    result = replace(check(criterion(point(0.1))), gl_renderer="llvmpipe (LLVM 15.0.6, 256 bits), OpenGL 4.5")
    assert accepted_of(result, WHY, TODAY).renderer == "llvmpipe"
