import re
from itertools import product
from pathlib import Path

import pytest

from comparisons.gate import Verdict
from comparisons.report import view

STYLE = (Path(view.__file__).parent / "templates" / "style.css").read_text(encoding="utf-8")
READABLE = 4.5
"""W3C 2018, "Web Content Accessibility Guidelines 2.1", 1.4.3: the least contrast of text."""

VERDICTS = ("pass", "fail", "regressed", "inconclusive", "error")
PAIRS = (
    *product(("text", "soft", "link", "regressed", "pass"), ("page", "surface")),
    ("pass", "pass-tint"),
    ("inconclusive", "inconclusive-tint"),
    *(("on-verdict", name) for name in ("fail", "regressed", "error")),
    ("text", "track"),
    ("soft", "track"),
)


def variables(theme: str) -> dict[str, str]:
    light, dark = re.findall(r":root \{(.*?)\}", STYLE, flags=re.DOTALL)[:2]
    return dict(re.findall(r"--([\w-]+): (#\w+);", light + (dark if theme == "dark" else "")))


def luminance(colour: str) -> float:
    digits = colour[1:] if len(colour) == 7 else "".join(2 * digit for digit in colour[1:])
    channels = [int(digits[start : start + 2], 16) / 255 for start in (0, 2, 4)]
    linear = [c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in channels]
    return sum(weight * c for weight, c in zip((0.2126, 0.7152, 0.0722), linear, strict=True))


def contrast(one: str, other: str) -> float:
    low, high = sorted((luminance(one), luminance(other)))
    return (high + 0.05) / (low + 0.05)


def test_contrast_is_that_of_the_definition() -> None:
    assert contrast("#fff", "#000000") == pytest.approx(21)
    assert contrast("#777777", "#ffffff") == pytest.approx(4.478, abs=1e-3)


@pytest.mark.parametrize("theme", ["light", "dark"])
def test_all_text_is_readable(theme: str) -> None:
    colours = variables(theme)
    assert {(*pair, round(c, 2)) for pair in PAIRS if (c := contrast(*(colours[n] for n in pair))) < READABLE} == set()


@pytest.mark.parametrize("theme", ["light", "dark"])
def test_bars_and_marks_stand_out_from_their_ground(theme: str) -> None:
    colours = variables(theme)
    assert all(contrast(colours[name], colours["surface"]) >= 3 for name in (*VERDICTS, "mark"))


def test_every_verdict_has_its_looks() -> None:
    verdicts = {str(verdict) for verdict in Verdict}
    assert all(f"{kind}{verdict}" in STYLE for verdict in verdicts for kind in (".badge.", "svg.", "h1."))


def test_motion_is_only_for_those_who_want_it() -> None:
    assert re.findall(r"(?:animation|transition|scroll-behavior)\b", STYLE) == ["scroll-behavior"]
    assert "(prefers-reduced-motion: no-preference) { html { scroll-behavior: smooth; } }" in STYLE
