"""The error that was last accepted for each check, and what has become of it since.

A budget says how large an error may be; the accepted error says how large it was when somebody last agreed to it. It
lies beside the scenes in `accepted.json`, one line a check, and is meant to be committed with them.
"""

import datetime
import json
import re
import shlex
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace
from enum import StrEnum
from functools import lru_cache
from pathlib import Path
from typing import Annotated

from pydantic import AfterValidator, Field, TypeAdapter, ValidationError

from comparisons.expression import quoted
from comparisons.gate import CriterionResult, Verdict
from comparisons.report.numbers import format_bound, format_interval, format_metric
from comparisons.result import CheckResult
from scenes.checks import Sentence
from scenes.errors import InputError
from scenes.strict import Strict

FILE_NAME = "accepted.json"

DIGITS = 4
"""Significant digits of an accepted number: what they round off is a hundredth of the smallest change that counts."""

LEAST_CHANGE = 0.05
"""A change by less than this share of the budget never counts, however sure it is.

Another driver puts single samples on the other side of an edge. Each adds 1.2e-4 to the rms of a coverage of 128 x 128
pixels; the parity of the shipped scenes takes at most 5.4 % of its budgets, most of it less than 1 %.
"""

SLACK = 0.5
"""A budget is slack when the error is surely below this share of the accepted one."""


def _in_order(measured: tuple[float, float, float]) -> tuple[float, float, float]:
    value, low, high = measured
    if not low <= value <= high:
        raise ValueError("these should be [value, low, high] with low <= value <= high")
    return measured


Measured = Annotated[tuple[float, float, float], AfterValidator(_in_order)]
"""Value, low and high of a metric."""


class Accepted(Strict):
    """Each metric as it was when it was accepted, when and why that was, and by how many samples a pixel (0: exact).

    `renderer` is the family of the OpenGL renderer that drew it, as `family_of` tells; empty stands for any.
    """

    criteria: dict[str, Measured]
    date: datetime.date
    reason: Sentence
    spp: Annotated[int, Field(ge=0)]
    renderer: str = ""


class Outcome(StrEnum):
    """What has become of an error since it was accepted."""

    HELD = "held"
    REGRESSED = "regressed"
    SLACK = "slack"


def accepted_of(result: CheckResult, reason: str, date: datetime.date) -> Accepted:
    """What is accepted with a result."""
    return Accepted(
        criteria={c.metric: _measured(c) for c in result.criteria},
        date=date,
        reason=reason,
        spp=result.spp,
        renderer=family_of(result.gl_renderer),
    )


def family_of(gl_renderer: str) -> str:
    """Who draws, without versions: images of one family agree closely enough for one baseline.

    >>> family_of("llvmpipe (LLVM 15.0.6, 256 bits), OpenGL 4.5"), family_of("NVIDIA H200/PCIe/SSE2, OpenGL 4.3")
    ('llvmpipe', 'NVIDIA H200')
    """
    return re.split(r" \(|/|,", gl_renderer, maxsplit=1)[0]


def against(accepted: Accepted, criteria: Iterable[CriterionResult]) -> tuple[Outcome | None, ...]:
    """Hold what was measured against what was accepted: one outcome a criterion, in their order.

    None where nothing was accepted, or where nothing valid was measured.

    Every metric is 0 for a perfect image, so the error is the distance from 0: |value|, with the interval of |x| for x
    in [low, high]. It has REGRESSED if its whole interval lies above the accepted one; a budget is SLACK if it lies
    below, and below half of the accepted error. Either counts only from `LEAST_CHANGE` of the budget, the larger of
    |min| and |max|, on.

    Notes
    -----
    Both intervals contain the true error, unless they miss it on one side, each with probability alpha. If it has not
    changed and they don't overlap, one of them misses it: a false alarm has a probability of at most 2 alpha a
    criterion, however the two depend on each other (Bonferroni), that is 2 %. For a signed metric close to 0, whose
    interval can miss on both sides, it is 3 alpha. Independent normal estimates of the same width reach
    1 - Phi(sqrt(2) z) = 0.05 %, with z = 2.33 for alpha = 1 %; the same truth, found in the store, gives the same
    interval and no alarm.
    """
    return tuple(_outcome(accepted, c) for c in criteria)


def _outcome(accepted: Accepted, criterion: CriterionResult) -> Outcome | None:
    if criterion.metric not in accepted.criteria or not criterion.valid:
        return None
    before, before_low, before_high = error_of(accepted.criteria[criterion.metric])
    now, low, high = error_of(_measured(criterion))
    least = LEAST_CHANGE * max(abs(bound) for bound in (criterion.min, criterion.max) if bound is not None)
    if low > before_high and now - before > least:
        return Outcome.REGRESSED
    if high < before_low and high < SLACK * before and before - now > least:
        return Outcome.SLACK
    return Outcome.HELD


def error_of(measured: tuple[float, float, float]) -> tuple[float, float, float]:
    """Distance from 0 of a value in its interval, and the interval of that distance.

    >>> error_of((-0.02, -0.03, 0.01))
    (0.02, 0.0, 0.03)
    """
    value, low, high = measured
    nearest = 0.0 if low <= 0 <= high else min(abs(low), abs(high))
    return abs(value), nearest, max(abs(low), abs(high))


def _measured(criterion: CriterionResult) -> tuple[float, float, float]:
    """Rounded, as it is accepted and as it is held against what was."""
    value, low, high = (float(f"{x:.{DIGITS}g}") + 0.0 for x in (criterion.value, criterion.low, criterion.high))
    return value, low, high


def apply(result: CheckResult, accepted: Accepted | None) -> CheckResult:
    """A result beside what was accepted for its check: a PASS may become REGRESSED, or its budget turn out slack.

    Other verdicts stay, and so do those on another renderer than that of the accepted error. A result is to be cached
    without this, so that accepting it changes the next run.
    """
    if accepted is None:
        return result
    shown = accepted.model_dump(mode="json", include={"date", "reason", "criteria", "renderer"})
    is_foreign = accepted.renderer not in ("", family_of(result.gl_renderer))
    if result.verdict is not Verdict.PASS or is_foreign:
        return replace(result, accepted=shown)
    pairs = list(zip(result.criteria, against(accepted, result.criteria), strict=True))
    risen = [c for c, outcome in pairs if outcome is Outcome.REGRESSED]
    fallen = [c for c, outcome in pairs if outcome is Outcome.SLACK]
    return replace(
        result,
        accepted=shown,
        verdict=Verdict.REGRESSED if risen else Verdict.PASS,
        criteria=tuple(
            replace(c, verdict=Verdict.REGRESSED) if outcome is Outcome.REGRESSED else c for c, outcome in pairs
        ),
        message=_message(result, accepted, risen) if risen else result.message,
        slack=_slack(result.unit, accepted, fallen) if fallen else "",
    )


def _message(result: CheckResult, accepted: Accepted, risen: Iterable[CriterionResult]) -> str:
    def change(c: CriterionResult) -> str:
        before, now = (measured_text(c.metric, m, result.unit) for m in (accepted.criteria[c.metric], _measured(c)))
        return f"{c.metric} from {before} to {now}, budget {format_bound(c.metric, c.min, c.max, result.unit)}"

    return (
        f"The error has risen since it was accepted on {accepted.date}, though the budget holds: "
        f"{'; '.join(map(change, risen))}. Find what changed; if it is meant, run "
        f'`lightgauge accept RUN --reason "..." -k {shlex.quote(quoted(f"{result.id}$"))}` with the folder of this run.'
    )


def _slack(unit: str, accepted: Accepted, fallen: Iterable[CriterionResult]) -> str:
    changes = "; ".join(
        f"{c.metric} fell from {format_metric(c.metric, accepted.criteria[c.metric][0], unit)} to "
        f"{format_metric(c.metric, c.value, unit)} while its budget is {format_bound(c.metric, c.min, c.max, unit)}"
        for c in fallen
    )
    return f"budget slack: {changes}; tighten the budget and run `lightgauge accept`"


def measured_text(metric: str, measured: tuple[float, float, float], unit: str) -> str:
    """A value with its interval, or alone if it is exact; `unit` is that of the quantity."""
    value, low, high = measured
    return format_metric(metric, value, unit) + ("" if low == high else f" {format_interval(metric, low, high)}")


def notes_on(results: Iterable[CheckResult]) -> Iterator[str]:
    """What a reader should know although nothing is wrong: slack budgets, and checks that nothing is accepted for yet.

    Where nothing is accepted at all, nothing is said about it.
    """
    found = list(results)
    yield from (f"{r.id}: {r.slack}" for r in found if r.slack)
    missing = sum(r.verdict is Verdict.PASS and r.accepted is None for r in found)
    if missing and any(r.accepted is not None for r in found):
        have = "check has" if missing == 1 else "checks have"
        yield f"{missing} {have} no accepted error; `lightgauge accept` notes the present one."


def read_accepted(folder: Path) -> dict[str, Accepted]:
    """What is accepted for the scenes of a folder, by the name of the check; {} if there is no such file.

    Raises
    ------
    InputError
        The file cannot be read, or holds something else.
    """
    path = folder / FILE_NAME
    try:
        return dict(_accepted_in(path.read_bytes()))
    except FileNotFoundError:
        return {}
    except OSError as error:
        raise InputError(
            f"{path}: the accepted errors cannot be read ({error.strerror}). Allow reading it, or remove it."
        ) from error
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        where = "".join(f"{part}: " for part in first["loc"])
        what = first["msg"].removeprefix("Value error, ")
        raise InputError(
            f"{path}: {where}{what}. Allowed is one object that holds, for each check, criteria (for each metric "
            "[value, low, high]), date, reason and spp. Restore the file, or remove it and run `lightgauge accept`."
        ) from error


@lru_cache(maxsize=4)
def _accepted_in(content: bytes) -> dict[str, Accepted]:
    return TypeAdapter(dict[str, Accepted]).validate_json(content)


def text_of(accepted: Mapping[str, Accepted]) -> str:
    """The content of `accepted.json`: sorted, one line a check, and the same for the same entries."""
    lines = (
        f"{json.dumps(name)}: {json.dumps(accepted[name].model_dump(mode='json'), sort_keys=True, ensure_ascii=False)}"
        for name in sorted(accepted)
    )
    return "{\n" + ",\n".join(lines) + "\n}\n"
