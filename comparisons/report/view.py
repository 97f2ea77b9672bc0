"""What the page says, worked out from the results of a run: the template only places these texts and lengths."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from comparisons.metrics import METRICS
from comparisons.report.glance import Glance, glances_of
from comparisons.report.numbers import (
    MISSING,
    UNBROKEN,
    format_bound,
    format_interval,
    format_metric,
    format_number,
    format_percent,
    format_seconds,
)
from scenes.errors import InputError

SCHEMA = 1
PARITY = frozenset({"depth", "normal", "coverage", "albedo"})
SEVERITY = {"ERROR": 0, "FAIL": 1, "REGRESSED": 2, "INCONCLUSIVE": 3, "PASS": 4}
GLYPHS = {"ERROR": "!", "FAIL": "✕", "REGRESSED": "↗", "INCONCLUSIVE": "?", "PASS": "✓"}

BAR_LENGTH = 96
BAR_BUDGET = 64

Results = Mapping[str, Any]


@dataclass(frozen=True)
class Bar:
    """An error against its budget, in the units of the drawing; the budget stands at `BAR_BUDGET`."""

    value: float
    low: float
    high: float
    label: str
    overflow: str


@dataclass(frozen=True)
class CriterionView:
    """One criterion in words; `use` is the share of the budget that the error takes, above 1 when it exceeds it.

    `accepted` is what was last accepted and how that has changed; empty where nothing was. `floor` is what the noise of
    the truth reads by itself; empty where it is removed or cannot add.
    """

    metric: str
    value: str
    interval: str
    accepted: str
    floor: str
    bound: str
    verdict: str
    reason: str
    note: str
    use: float | None
    bar: Bar | None


@dataclass(frozen=True)
class CheckView:
    """One check in words. `raw` are its results as they stand; if `tested`, there is a picture of significance."""

    anchor: str
    raw: Results
    verdict: str
    parity: bool
    criteria: tuple[CriterionView, ...]
    headline: CriterionView | None
    settings: str
    adjustment: str
    shown: str
    scale: str
    below: str
    above: str
    tested: bool
    significance: str
    limits: tuple[str, ...]
    variants: tuple[str, ...]


@dataclass(frozen=True)
class Page:
    sentence: str
    rest: str
    verdict: str
    counts: tuple[tuple[str, int], ...]
    checks: tuple[CheckView, ...]
    parity: tuple[CheckView, ...]
    glances: tuple[Glance, ...]
    store_note: str
    summary: tuple[str, ...]
    environment: Mapping[str, str]


def page_of(results: Results) -> Page:
    """Everything the report shows, worst verdict first.

    Raises
    ------
    InputError
        `results` has another schema, or lacks what a check cannot do without.
    """
    if results.get("schema") != SCHEMA:
        raise InputError(
            f"These results have schema {results.get('schema')!r}, but this version reads schema {SCHEMA}. "
            "Run the checks again to get results that it can show."
        )
    views = [_check_of(number, raw) for number, raw in enumerate(results.get("checks") or [], start=1)]
    views.sort(key=lambda view: SEVERITY[view.verdict])
    counts = {verdict: sum(view.verdict == verdict for view in views) for verdict in SEVERITY}
    return Page(
        sentence=sentence_of(views),
        rest=_rest_of(counts),
        verdict=next((verdict for verdict in ("FAIL", *SEVERITY) if counts[verdict]), "INCONCLUSIVE"),
        counts=tuple((verdict, count) for verdict, count in counts.items() if count),
        checks=tuple(view for view in views if not view.parity),
        parity=tuple(view for view in views if view.parity),
        glances=glances_of([(view.anchor, view.raw) for view in views if not view.parity]),
        store_note=results.get("store_note") or "",
        summary=_summary(results),
        environment={key: str(value) for key, value in (results.get("environment") or {}).items() if value is not None},
    )


def sentence_of(views: Sequence[CheckView]) -> str:
    """The verdict of a run in one breath: how many checks hold, and the one to look at first."""
    if not views:
        return "No check was run, so nothing is known."
    failing = [view for view in views if view.verdict == "FAIL"]
    regressed = [view for view in views if view.verdict == "REGRESSED"]
    passing = [view for view in views if view.verdict == "PASS"]
    total = f"{len(views)} check{'' if len(views) == 1 else 's'}"
    if failing:
        verb = "exceeds its" if len(failing) == 1 else "exceed their"
        return f"{len(failing)} of {total} {verb} budget: worst is {_extreme(failing)}."
    if regressed:
        verb = "has" if len(regressed) == 1 else "have"
        return f"{len(regressed)} of {total} {verb} regressed within the budget: worst is {_extreme(regressed)}."
    if len(passing) < len(views):
        return f"{len(passing)} of {total} {'holds its' if len(passing) == 1 else 'hold their'} budget."
    if len(views) == 1:
        return f"The only check holds its budget: {_extreme(views)}."
    return f"All {total} hold their budgets; closest to its budget: {_extreme(views)}."


def _rest_of(counts: Mapping[str, int]) -> str:
    texts = []
    if counts["FAIL"] and (regressed := counts["REGRESSED"]):
        texts.append(f"{regressed} {'has' if regressed == 1 else 'have'} regressed within the budget.")
    if undecided := counts["INCONCLUSIVE"]:
        verb = "is" if undecided == 1 else "are"
        texts.append(f"{undecided} {verb} undecided: the truth is not certain enough for the budget.")
    if broken := counts["ERROR"]:
        texts.append(f"{broken} could not be judged.")
    return " ".join(texts)


def budget_use(value: float | None, low: float | None, high: float | None) -> float | None:
    """The share of its budget that an error takes: 0 is perfect, 1 is the bound, more exceeds it.

    Two bounds: the distance from their middle over half their distance. An upper bound: value / bound. A lower bound
    below 1 is that of a similarity, whose ideal is 1: (1 - value) / (1 - bound); other lower bounds: bound / value.
    None where this has no meaning, such as a bound of zero.
    """
    if value is None or not math.isfinite(value) or (low is None and high is None):
        return None
    if low is not None and high is not None:
        return abs(value - (low + high) / 2) / ((high - low) / 2) if high > low else None
    if high is not None:
        return max(0.0, value / high) if high > 0 else None
    assert low is not None
    if low < 1:
        return max(0.0, (1 - value) / (1 - low))
    return low / value if value > 0 else None


def _extreme(views: Sequence[CheckView]) -> str:
    """Name the check that takes most of its budget, among the radiance checks where there are any."""
    judged = [view for view in views if not view.parity] or views
    worst = max(judged, key=lambda view: _use_of(view.headline))
    how = ", ".join(part for part in (worst.settings, "exposure fitted" if worst.adjustment else "") if part)
    name = f"{worst.raw['scene']} with {worst.raw['technique']}{f' ({how})' if how else ''}"
    if worst.headline is None:
        return name
    return f"{name}, {worst.headline.metric} {worst.headline.value} against {worst.headline.bound}"


def _use_of(criterion: CriterionView | None) -> float:
    return -1.0 if criterion is None or criterion.use is None else criterion.use


def _check_of(number: int, raw: Results) -> CheckView:
    missing = [key for key in ("id", "scene", "technique", "quantity", "verdict") if raw.get(key) is None]
    if missing or raw.get("verdict") not in SEVERITY:
        raise InputError(
            f"Check {number} of these results lacks {', '.join(missing) or 'a known verdict'}; a check needs an id, a "
            f"scene, a technique, a quantity, and a verdict out of {', '.join(SEVERITY)}. Run the checks again."
        )
    criteria = tuple(
        _criterion_of(criterion, raw.get("unit") or "", raw.get("accepted") or {})
        for criterion in raw.get("criteria") or []
    )
    limits = (raw.get("card") or {}).get("limits") or ()
    radiance = raw.get("display", "radiance") == "radiance"
    return CheckView(
        anchor=f"check-{number}",
        raw=raw,
        verdict=raw["verdict"],
        parity=raw["quantity"] in PARITY,
        criteria=criteria,
        headline=_headline(raw["verdict"], criteria),
        settings=", ".join(
            f"{key}{UNBROKEN}={UNBROKEN}{_setting(value)}" for key, value in (raw.get("settings") or {}).items()
        ),
        adjustment=f"fitted exposure × {format_number(raw.get('exposure'))}" if raw.get("fit_exposure") else "",
        shown=_shown(raw),
        scale=format_number(raw.get("error_scale"), trim=True),
        below="too dark" if radiance else "too small",
        above="too bright" if radiance else "too large",
        tested="significance" in (raw.get("images") or {}),
        significance=_significance(raw.get("significance")),
        limits=(limits,) if isinstance(limits, str) else tuple(limits),
        variants=tuple(_variant(variant) for variant in raw.get("variants") or ()),
    )


def _headline(verdict: str, criteria: Sequence[CriterionView]) -> CriterionView | None:
    """The criterion that decides: of those with the check's verdict, the one that takes most of its budget."""
    deciding = [criterion for criterion in criteria if criterion.verdict == verdict] or list(criteria)
    return max(deciding, key=_use_of, default=None)


def _criterion_of(raw: Results, unit: str, accepted: Results) -> CriterionView:
    metric, low, high = raw["metric"], raw.get("min"), raw.get("max")
    return CriterionView(
        metric=metric,
        value=format_metric(metric, raw.get("value"), unit),
        interval=format_interval(metric, raw.get("low"), raw.get("high")),
        accepted=_accepted(raw, unit, accepted),
        floor=_floor(raw, unit),
        bound=format_bound(metric, low, high, unit),
        verdict=raw["verdict"],
        reason=raw.get("reason") or "",
        note=raw.get("note") or "",
        use=budget_use(raw.get("value"), low, high),
        bar=_bar(raw),
    )


def _floor(raw: Results, unit: str) -> str:
    """What two truths differ by, for the metrics that cannot tell their noise from an error."""
    metric = raw["metric"]
    removed = metric in METRICS and METRICS[metric].noise_power is not None
    return "" if raw.get("floor") is None or removed else f"noise reads {format_metric(metric, raw['floor'], unit)}"


def _accepted(raw: Results, unit: str, accepted: Results) -> str:
    """What was accepted for a criterion, and the factor from there to the error now."""
    measured = (accepted.get("criteria") or {}).get(raw["metric"])
    if not measured:
        return ""
    text = f"accepted {format_metric(raw['metric'], measured[0], unit)} on {accepted.get('date')}"
    if raw.get("value") is None or measured[0] == 0:
        return text
    return f"{text}, now × {format_number(abs(raw['value'] / measured[0]))}"


def _bar(raw: Results) -> Bar | None:
    low, high = raw.get("min"), raw.get("max")
    use = budget_use(raw.get("value"), low, high)
    if use is None:
        return None
    measured = [budget_use(end, low, high) for end in (raw.get("low"), raw.get("high"))]
    ends = sorted(use if end is None else end for end in measured)
    if low is not None and high is not None and _straddles(raw, (low + high) / 2):
        ends[0] = 0.0
    spread = f", interval {format_percent(ends[0])} to {format_percent(ends[1])}" if ends[0] < ends[1] else ""
    return Bar(
        value=_length(use),
        low=_length(ends[0]),
        high=_length(ends[1]),
        label=f"The error takes {format_percent(use)} of its budget{spread}.",
        overflow=f"{format_number(use)}×" if use * BAR_BUDGET > BAR_LENGTH else "",
    )


def _straddles(raw: Results, middle: float) -> bool:
    low, high = raw.get("low"), raw.get("high")
    return low is not None and high is not None and low < middle < high


def _length(use: float) -> float:
    return round(min(use * BAR_BUDGET, BAR_LENGTH), 2)


def _shown(raw: Results) -> str:
    """How the pictures of a check were made visible, in words."""
    exposure = raw.get("exposure_display")
    display = raw.get("display", "radiance")
    if display == "normal":
        return "Normals shown as (n + 1) / 2."
    if display == "uv":
        return "Red is u, green is v, both from 0 to 1."
    if display == "unit":
        return "Black is 0, white is 1."
    if display == "depth":
        white = format_number(1 / exposure if exposure else None, trim=True)
        return f"Black is 0, white is {white} {raw.get('unit') or 'scene units'}."
    return f"Tone-mapped for display at exposure × {format_number(exposure)}; the metrics see linear values."


def _significance(raw: Results | None) -> str:
    """How much of an image is wrong beyond noise, in words."""
    if raw is None:
        return MISSING
    share, rate = (format_percent(raw.get(key), trim=True) for key in ("share", "false_discovery_rate"))
    return f"{share} of the judged pixels, at a false discovery rate of {rate}"


def _variant(raw: Results) -> str:
    """What a truth that leaves something out is wrong by, in words."""
    error = f"{format_metric('nrmse', raw['nrmse'])} {format_interval('nrmse', raw['low'], raw['high'])}"
    energy = format_metric("energy_bias", raw["energy_bias"])
    return f"{raw['quantity']} ({raw['summary']}): nrmse {error}, energy_bias {energy}"


def _setting(value: bool | int | float | str) -> str:
    if isinstance(value, bool):
        return "on" if value else "off"
    return value if isinstance(value, str) else f"{value:g}"


def _summary(results: Results) -> tuple[str, ...]:
    environment = results.get("environment") or {}
    parts = (
        f"lightgauge {environment['lightgauge']}" if environment.get("lightgauge") else "",
        f"commit {environment['commit'][:10]}" if environment.get("commit") else "",
        str(environment.get("gl_renderer") or ""),
        f"{environment['cpu_count']} CPU cores" if environment.get("cpu_count") else "",
        str(results.get("started") or ""),
        f"took {format_seconds(results.get('seconds'))}" if results.get("seconds") is not None else "",
    )
    return tuple(part for part in parts if part)
