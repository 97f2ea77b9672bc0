"""The report of a run as a folder of pages that need no network: the overview, and a page for each check."""

import json
from collections.abc import Iterator, Mapping
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from comparisons.report import criterion, glance, numbers
from comparisons.report.check import GLYPHS, CheckView
from comparisons.report.pictures import DIVERGING, NOT_A_NUMBER, NOT_JUDGED, WITHIN_NOISE
from comparisons.report.view import Overview, keys_of, overview_of
from scenes.errors import InputError

if TYPE_CHECKING:
    from jinja2 import Environment

    from comparisons.history import History

TEMPLATES = Path(__file__).parent / "templates"
ASSETS = (".css", ".js")
STILLS = {
    "realtime": "Real-time",
    "truth": "Truth",
    "error": "Error: real-time − truth",
    "flip": "FLIP",
    "significance": "Wrong beyond noise",
}
"""The pictures of a check that its page shows, in their order."""


def write_report(folder: Path, results: Mapping[str, Any], history: "History | None" = None) -> Path:
    """Write `index.html`, `checks/` and `assets/` from the content of `results.json`.

    Parameters
    ----------
    folder : Path
        Created when missing. The pictures that the checks name are relative to it.
    results : dict
        Schema 1. A missing or null number is shown as a dash.
    history : History or None
        The runs before, and this one: each check shows the course of its error, the overview what has changed.

    Returns
    -------
    Path
        The overview.

    Raises
    ------
    InputError
        The results cannot be read as schema 1, or the pages cannot be written.
    """
    overview = overview_of(results, history)
    path = folder / "index.html"
    try:
        for name, text in _files(overview, history):
            path = folder / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text, encoding="utf-8")
    except OSError as error:
        raise InputError(
            f"The report cannot be written to {path}: {error.strerror}. Choose a folder that you may write to."
        ) from error
    return path


def _files(overview: Overview, history: "History | None") -> Iterator[tuple[str, str]]:
    """Names and contents, the overview last: what it leads to is there by then."""
    for asset in sorted(TEMPLATES.iterdir()):
        if asset.suffix in ASSETS:
            yield f"assets/{asset.name}", asset.read_text(encoding="utf-8")
    yield "assets/controls.js", controls_script()
    keys = ",\n".join(json.dumps(keys_of(view), separators=(",", ":")) for view in overview.all)
    yield "assets/checks.js", f'"use strict";\nconst CHECKS = [\n{keys}\n];\n'
    environment = _environment()
    template = environment.get_template("check.html")
    neighbours = (None, *overview.all, None)
    for number, view in enumerate(overview.all):
        yield (
            f"checks/{view.name}.html",
            template.render(
                page=overview,
                check=view,
                previous=neighbours[number],
                following=neighbours[number + 2],
                place=number + 1,
                trend=_trend(view, history),
            ),
        )
    yield "index.html", environment.get_template("index.html").render(page=overview)


def controls_script() -> str:
    """The script that brings the controls of the viewer: one for all checks."""
    return f"lightgauge.controls = {json.dumps(_environment().get_template('controls.html').render())};\n"


def _trend(view: CheckView, history: "History | None") -> str:
    """The course of a check as SVG; empty where no history has it."""
    from comparisons.report.trend import trend_plot  # which reads the history, and that what is accepted

    return "" if history is None else trend_plot(history.entries(view.raw["id"]))


@cache
def _environment() -> "Environment":
    from jinja2 import Environment, FileSystemLoader, StrictUndefined

    environment = Environment(
        loader=FileSystemLoader(TEMPLATES),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters.update(
        change=numbers.format_change,
        count=numbers.format_count,
        number=numbers.format_number,
        seconds=numbers.format_seconds,
    )
    environment.globals.update(
        missing=numbers.MISSING,
        glyphs=GLYPHS,
        stills=STILLS,
        bar_length=criterion.BAR_LENGTH,
        bar_budget=criterion.BAR_BUDGET,
        glance_scale=glance.SCALE,
        colours={
            "gradient": ", ".join(DIVERGING),
            "unjudged": NOT_JUDGED,
            "undefined": NOT_A_NUMBER,
            "within_noise": WITHIN_NOISE,
        },
    )
    return environment
