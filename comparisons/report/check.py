"""A check in words: what its page and its row of the overview say."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any
from urllib.parse import quote

from comparisons.report.criterion import CriterionView, criterion_of, use_of
from comparisons.report.numbers import (
    MISSING,
    UNBROKEN,
    format_change,
    format_count,
    format_interval,
    format_metric,
    format_number,
    format_percent,
    format_seconds,
)
from comparisons.report.pixel import PixelView, pixel_of
from reference.quantities import effect_of
from scenes.errors import InputError

PARITY = "parity"
SEVERITY = {"ERROR": 0, "FAIL": 1, "REGRESSED": 2, "INCONCLUSIVE": 3, "PASS": 4}
GLYPHS = {"ERROR": "!", "FAIL": "✕", "REGRESSED": "↗", "INCONCLUSIVE": "?", "PASS": "✓"}
DECIDED = ("PASS", "FAIL", "REGRESSED")
STEADY = 0.02
"""A change of the error by less than this share is shown without an arrow."""

Results = Mapping[str, Any]


@dataclass(frozen=True)
class Change:
    """What has become of the headline's error since it was accepted: a factor, an arrow, and a word where it counts.

    `factor` is None where the word alone tells: the error was accepted on another renderer, or was 0.
    """

    factor: float | None
    text: str
    arrow: str
    word: str


@dataclass(frozen=True)
class PassView:
    """One pass of the real-time side; `share` is its time over that of the longest."""

    name: str
    seconds: str
    share: float


@dataclass(frozen=True)
class CheckView:
    """One check in words. `raw` are its results as they stand; `name` is that of its page.

    `how` tells checks of one technique apart: its settings, and whether its exposure is fitted. If `tested`, there is a
    picture of significance. `saved` is how many times as many samples a truth of fixed size takes, None for exact ones
    and where nothing was decided.
    """

    name: str
    raw: Results
    effect: str
    verdict: str
    criteria: tuple[CriterionView, ...]
    headline: CriterionView | None
    change: Change | None
    settings: str
    adjustment: str
    how: str
    shown: str
    scale: str
    below: str
    above: str
    tested: bool
    significance: str
    limits: tuple[str, ...]
    variants: tuple[str, ...]
    passes: tuple[PassView, ...]
    samples: str
    saved: float | None
    worst: PixelView | None

    @property
    def is_parity(self) -> bool:
        return self.effect == PARITY

    @property
    def address(self) -> str:
        """Where its page lies, seen from the overview."""
        return f"checks/{quote(self.name)}.html"

    @property
    def title(self) -> str:
        return str(self.raw.get("scene_title") or self.raw["scene"])


def check_of(number: int, raw: Results, name: str) -> CheckView:
    """The check that stands at `number`, counted from 1, in results.json; its page is to be called `name`.

    Raises
    ------
    InputError
        It lacks what a check cannot do without.
    """
    missing = [key for key in ("id", "scene", "technique", "quantity", "verdict") if raw.get(key) is None]
    if missing or raw.get("verdict") not in SEVERITY:
        raise InputError(
            f"Check {number} of these results lacks {', '.join(missing) or 'a known verdict'}; a check needs an id, a "
            f"scene, a technique, a quantity, and a verdict out of {', '.join(SEVERITY)}. Run the checks again."
        )
    criteria = tuple(
        criterion_of(criterion, raw.get("unit") or "", raw.get("accepted") or {})
        for criterion in raw.get("criteria") or []
    )
    headline = _headline(raw["verdict"], criteria)
    limits = (raw.get("card") or {}).get("limits") or ()
    radiance = raw.get("display", "radiance") == "radiance"
    settings = _settings(raw)
    return CheckView(
        name=name,
        raw=raw,
        effect=raw.get("effect") or effect_of(raw["quantity"]),
        verdict=raw["verdict"],
        criteria=criteria,
        headline=headline,
        change=_change(raw, headline),
        settings=settings,
        adjustment=f"fitted exposure × {format_number(raw.get('exposure'))}" if raw.get("fit_exposure") else "",
        how=", ".join(part for part in (settings, "exposure fitted" if raw.get("fit_exposure") else "") if part),
        shown=_shown(raw),
        scale=format_number(raw.get("error_scale"), trim=True),
        below="too dark" if radiance else "too small",
        above="too bright" if radiance else "too large",
        tested="significance" in (raw.get("images") or {}),
        significance=_significance(raw.get("significance")),
        limits=(limits,) if isinstance(limits, str) else tuple(limits),
        variants=tuple(_variant(variant) for variant in raw.get("variants") or ()),
        passes=_passes(raw.get("pass_seconds") or {}),
        samples=_samples(raw),
        saved=_saved(raw),
        worst=pixel_of(raw),
    )


def _headline(verdict: str, criteria: Sequence[CriterionView]) -> CriterionView | None:
    """The criterion that decides: of those with the check's verdict, the one that takes most of its budget."""
    deciding = [criterion for criterion in criteria if criterion.verdict == verdict] or list(criteria)
    return max(deciding, key=use_of, default=None)


def _settings(raw: Results) -> str:
    return ", ".join(
        f"{key}{UNBROKEN}={UNBROKEN}{_setting(value)}" for key, value in (raw.get("settings") or {}).items()
    )


def _setting(value: bool | int | float | str) -> str:
    if isinstance(value, bool):
        return "on" if value else "off"
    return value if isinstance(value, str) else f"{value:g}"


def _change(raw: Results, headline: CriterionView | None) -> Change | None:
    accepted = raw.get("accepted")
    if not accepted or headline is None or not headline.accepted:
        return None
    if not _is_same_renderer(accepted.get("renderer") or "", raw.get("gl_renderer") or ""):
        return Change(None, "", "", "other renderer")
    word = "regressed" if raw["verdict"] == "REGRESSED" else "slack" if raw.get("slack") else ""
    if headline.change is None:
        return Change(None, "", "", word or "was 0")
    arrow = "→" if abs(headline.change - 1) < STEADY else "↗" if headline.change > 1 else "↘"
    return Change(headline.change, format_change(headline.change), arrow, word)


def _is_same_renderer(accepted: str, gl_renderer: str) -> bool:
    from comparisons.baseline import family_of  # which itself writes numbers as the report does

    return accepted in ("", family_of(gl_renderer))


def _shown(raw: Results) -> str:
    """How the pictures of a check were made visible, in words."""
    exposure = raw.get("exposure_display")
    display = raw.get("display", "radiance")
    if display == "normal":
        return "Normals shown as (n + 1) / 2."
    if display == "uv":
        return f"Red is u, green is v, both from 0 to {format_number(1 / exposure if exposure else None, trim=True)}."
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


def _passes(seconds: Mapping[str, float]) -> tuple[PassView, ...]:
    longest = max(seconds.values(), default=0.0) or 1.0
    return tuple(PassView(name, format_seconds(taken), round(taken / longest, 3)) for name, taken in seconds.items())


def _saved(raw: Results) -> float | None:
    fixed, spent = raw.get("spp_fixed"), raw.get("spp")
    return fixed / spent if fixed and spent and raw["verdict"] in DECIDED else None


def _samples(raw: Results) -> str:
    """What the truth cost, what a truth of fixed size would have, and what the pictures rest on."""
    spent, fixed, shown = raw.get("spp"), raw.get("spp_fixed"), raw.get("spp_shown") or 0
    if not spent:
        return ""
    is_decided = raw["verdict"] in DECIDED
    purpose = "for the verdict" if is_decided else "without a verdict"
    parts = [f"{format_count(spent)} spp {purpose}, in {format_seconds((raw.get('seconds') or {}).get('reference'))}"]
    if fixed and is_decided:
        times = f": {format_number(fixed / spent, trim=True)} times as many" if fixed > spent else ""
        parts.append(f"a truth of fixed size, as certain, takes {format_count(fixed)}{times}")
    if shown > spent:
        parts.append(f"pictures and the worst pixel show all {format_count(shown)} spp that the store holds")
    return "; ".join(parts)
