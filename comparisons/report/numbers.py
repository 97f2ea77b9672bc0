"""How the report writes numbers: three significant digits, a unit where there is one, a dash for what is missing."""

import math

from comparisons.metrics import METRICS

MISSING = "–"
MINUS = "−"
NARROW_SPACE = "\u202f"
UNBROKEN = "\u00a0"


def is_share(metric: str) -> bool:
    """Whether values are read as percent.

    Those of `nrmse`, `limb_nrmse`, `misclassified`, `off_by_1`, `energy_bias` are, and of names with the word `rel`. A
    squared error (`rel_mse...`) is not: a percentage would suggest a size that it does not have.
    """
    words = metric.split("_")
    named = words[0] in ("nrmse", "limb", "misclassified", "off") or metric.startswith("energy_bias")
    return named or ("rel" in words and "mse" not in words)


def format_number(value: float | None, *, trim: bool = False) -> str:
    """Three significant digits; `trim` drops trailing zeros, for numbers that people chose, such as bounds.

    Examples
    --------
    >>> format_number(0.07304), format_number(8.0, trim=True), format_number(1.2e-6), format_number(None)
    ('0.0730', '8', '1.20e−6', '–')
    """
    if value is None:
        return MISSING
    if not math.isfinite(value):
        return "NaN" if math.isnan(value) else f"{MINUS if value < 0 else ''}∞"
    text = _significant(value)
    mantissa, _, exponent = text.partition("e")
    if trim and "." in mantissa:
        mantissa = mantissa.rstrip("0").rstrip(".")
    return (mantissa + (f"e{int(exponent)}" if exponent else "")).replace("-", MINUS)


def _significant(value: float) -> str:
    if value == 0:
        return "0"
    scientific = f"{value:.2e}"
    magnitude = int(scientific.partition("e")[2])
    if -4 <= magnitude < 6:
        return f"{float(scientific):.{max(0, 2 - magnitude)}f}"
    return scientific


def format_metric(metric: str, value: float | None, quantity_unit: str = "", *, trim: bool = False) -> str:
    """A value of a metric with its unit: `7.30 %`, `0.0120 px`, `0.950`. `quantity_unit` is that of what is judged."""
    if value is None:
        return MISSING
    unit = _unit(metric, quantity_unit)
    return f"{format_number(value * _scale(metric), trim=trim)}{NARROW_SPACE if unit else ''}{unit}"


def format_range(metric: str, least: float, most: float, quantity_unit: str = "") -> str:
    """Two values of a metric with their unit, or one if they read the same: `28.1 to 55.5 %`."""
    first, last = (format_metric(metric, value, quantity_unit) for value in (least, most))
    if first == last:
        return last
    unit = _unit(metric, quantity_unit)
    return f"{first.removesuffix(NARROW_SPACE + unit) if unit else first} to {last}"


def format_percent(share: float | None, *, trim: bool = False) -> str:
    """A share as percent: `62.3 %`."""
    return MISSING if share is None else f"{format_number(100 * share, trim=trim)}{NARROW_SPACE}%"


def format_interval(metric: str, low: float | None, high: float | None) -> str:
    """A confidence interval in the unit of `format_metric`, without repeating it: `[6.91, 7.78]`, or `exact`."""
    if low is None or high is None:
        return ""
    if low == high:
        return "exact"
    return f"[{format_number(low * _scale(metric))}, {format_number(high * _scale(metric))}]"


def format_bound(metric: str, low: float | None, high: float | None, quantity_unit: str = "") -> str:
    """What a criterion allows: `≤ 8 %`, `≥ 0.95`, or `−4 % to 4 %`."""
    least, most = (format_metric(metric, bound, quantity_unit, trim=True) for bound in (low, high))
    if low is not None and high is not None:
        return f"{least} to {most}"
    if high is not None:
        return f"≤ {most}"
    return MISSING if low is None else f"≥ {least}"


def format_seconds(seconds: float | None, *, trim: bool = False) -> str:
    """A duration in the unit that reads best: `840 µs`, `1.84 ms`, `12.4 s`, `3 min 12 s`."""
    if seconds is None:
        return MISSING
    if seconds >= 120:
        minutes, rest = divmod(round(seconds), 60)
        return f"{minutes}{NARROW_SPACE}min {rest}{NARROW_SPACE}s"
    for factor, unit in ((1.0, "s"), (1e3, "ms"), (1e6, "µs")):
        if seconds * factor >= 1 or unit == "µs":
            break
    return f"{format_number(seconds * factor, trim=trim)}{NARROW_SPACE}{unit}"


def format_change(factor: float) -> str:
    """A factor: `× 1.02`, `× 0.873`, `× 12.5`."""
    return f"×{UNBROKEN}{format_number(factor)}"


def format_count(count: int | None) -> str:
    """A whole number with its thousands set apart."""
    return MISSING if count is None else f"{count:,}".replace(",", NARROW_SPACE)


def _scale(metric: str) -> float:
    return 100.0 if is_share(metric) else 1.0


def _unit(metric: str, quantity_unit: str) -> str:
    """The unit that the registry states; a metric that is no longer there has none."""
    if is_share(metric):
        return "%"
    unit = METRICS[metric].unit if metric in METRICS else "1"
    stated = quantity_unit if unit == "quantity" else unit
    return "" if stated == "1" else stated
