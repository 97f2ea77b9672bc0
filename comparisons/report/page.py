"""The report of a run as a folder of pages that need no network: the overview, and a page for each check."""

import hashlib
import json
from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import cache, partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from comparisons.report import criterion, glance, numbers
from comparisons.report.check import GLYPHS, CheckView
from comparisons.report.pictures import DIVERGING, NOT_A_NUMBER, NOT_JUDGED, WITHIN_NOISE
from comparisons.report.view import Overview, keys_of, overview_of
from scenes.digest import code_digest, digest_of, file_digest, used_by
from scenes.errors import InputError

if TYPE_CHECKING:
    from jinja2 import Environment

    from comparisons.history import History

TEMPLATES = Path(__file__).parent / "templates"
ASSETS = (".css", ".js")
PACKAGES = ("comparisons", "reference", "scenes")
WRITTEN = "pages.json"
"""Lies beside the overview: what each page of a check was made of, so that one that is unchanged stays."""

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
    written = _written(folder)
    files: dict[str, tuple[str, str]] = {}
    try:
        for name, made_of, text_of in _files(overview, history):
            path = folder / name
            if not made_of or written.get(name) != [made_of, _digest(path)]:
                path.parent.mkdir(parents=True, exist_ok=True)
                content = text_of().encode()
                path.write_bytes(content)
                if made_of:
                    files[name] = made_of, hashlib.sha256(content).hexdigest()
            else:
                files[name] = written[name][0], written[name][1]
        (folder / WRITTEN).write_text(json.dumps(files, indent=0), encoding="utf-8")
    except OSError as error:
        raise InputError(
            f"The report cannot be written to {path}: {error.strerror}. Choose a folder that you may write to."
        ) from error
    return folder / "index.html"


def _written(folder: Path) -> dict[str, Any]:
    """For each page of a check what it was made of and its content, as digests; {} if that is not known."""
    try:
        found = json.loads((folder / WRITTEN).read_bytes())
    except (OSError, ValueError):
        return {}
    return found if isinstance(found, dict) else {}


def _digest(path: Path) -> str:
    """SHA-256 of a file; empty if there is none. A page that somebody has edited is written anew."""
    try:
        return hashlib.sha256(path.read_bytes()).hexdigest()
    except FileNotFoundError:
        return ""


File = tuple[str, str, Callable[[], str]]
"""A file of the report: its name, the digest of everything that it is made of, empty if that is new in every run, and
what gives its text.
"""


def _files(overview: Overview, history: "History | None") -> Iterator[File]:
    """The overview comes last: what it leads to is there by then."""
    for asset in sorted(TEMPLATES.iterdir()):
        if asset.suffix in ASSETS:
            yield f"assets/{asset.name}", file_digest(asset), partial(asset.read_text, encoding="utf-8")
    yield "assets/controls.js", page_code(), controls_script
    yield "assets/checks.js", "", partial(_checks_script, overview)
    yield from _check_pages(overview, history)
    yield "index.html", "", lambda: jinja_environment().get_template("index.html").render(page=overview)


def _checks_script(overview: Overview) -> str:
    """What the pages of all checks share: what is said of the run, and what checks are chosen and named by."""
    keys = ",\n".join(json.dumps(keys_of(view), separators=(",", ":")) for view in overview.all)
    run = json.dumps(" · ".join(overview.summary))
    return f'"use strict";\nconst RUN = {run};\nconst CHECKS = [\n{keys}\n];\n'


def _check_pages(overview: Overview, history: "History | None") -> Iterator[File]:
    code = page_code()
    neighbours = (None, *(view.name for view in overview.all), None)
    for number, view in enumerate(overview.all):
        shown = {
            "previous": neighbours[number],
            "following": neighbours[number + 2],
            "place": number + 1,
            "total": len(overview.all),
            "environment": dict(overview.environment),
            "trend": _trend(view, history),
        }
        made_of = json.dumps((code, view.name, view.raw, shown), sort_keys=True)
        digest = hashlib.sha256(made_of.encode()).hexdigest()
        yield f"checks/{view.name}.html", digest, partial(_check_page, view, shown)


def _check_page(view: CheckView, shown: Mapping[str, Any]) -> str:
    return jinja_environment().get_template("check.html").render(check=view, **shown)


@cache
def page_code() -> str:
    """Digest of all code, templates included, that makes the page of a check from its results."""
    templates = [file_digest(path) for path in sorted(TEMPLATES.glob("*.html"))]
    return digest_of(code_digest(*sorted(used_by((__name__,), PACKAGES))), templates)


def controls_script() -> str:
    """The script that brings the controls of the viewer: one for all checks."""
    return f"lightgauge.controls = {json.dumps(jinja_environment().get_template('controls.html').render())};\n"


def _trend(view: CheckView, history: "History | None") -> str:
    """The course of a check as SVG; empty where no history has it."""
    from comparisons.report.trend import trend_plot  # which reads the history, and that what is accepted

    return "" if history is None else trend_plot(history.entries(view.raw["id"]))


@cache
def jinja_environment() -> "Environment":
    """What renders the templates of all pages."""
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


def write_files(folder: Path, files: Iterable[tuple[str, str]]) -> Path:
    """Write texts by their names within a folder, the page last; returns its path.

    Raises
    ------
    InputError
        They cannot be written.
    """
    path = folder
    try:
        for name, text in files:
            path = folder / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text, encoding="utf-8")
    except OSError as error:
        raise InputError(
            f"The page cannot be written to {path}: {error.strerror}. Choose a folder that you may write to."
        ) from error
    return path
