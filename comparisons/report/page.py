"""The HTML page of a run: one file that needs nothing but the pictures beside it."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

from comparisons.report import numbers, view
from comparisons.report.pictures import DIVERGING, NOT_A_NUMBER, NOT_JUDGED, WITHIN_NOISE
from scenes.errors import InputError

if TYPE_CHECKING:
    from jinja2 import Environment


def write_report(folder: Path, results: dict[str, Any]) -> Path:
    """Write `folder/index.html` from the content of `results.json` and the pictures that lie under `folder`.

    Parameters
    ----------
    folder : Path
        Created when missing. The pictures that the checks name are relative to it.
    results : dict
        Schema 1. A missing or null number is shown as a dash.

    Returns
    -------
    Path
        The page.

    Raises
    ------
    InputError
        The results cannot be read as schema 1, or the page cannot be written.
    """
    html = _templates().get_template("index.html").render(page=view.page_of(results))
    path = folder / "index.html"
    try:
        folder.mkdir(parents=True, exist_ok=True)
        path.write_text(html, encoding="utf-8")
    except OSError as error:
        raise InputError(
            f"The report cannot be written to {path}: {error.strerror}. Choose a folder that you may write to."
        ) from error
    return path


def _templates() -> "Environment":
    from jinja2 import Environment, FileSystemLoader, StrictUndefined

    environment = Environment(
        loader=FileSystemLoader(Path(__file__).parent / "templates"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters.update(seconds=numbers.format_seconds, count=numbers.format_count)
    environment.globals.update(
        missing=numbers.MISSING,
        severity=view.SEVERITY,
        glyphs=view.GLYPHS,
        bar_length=view.BAR_LENGTH,
        bar_budget=view.BAR_BUDGET,
        colours={
            "gradient": ", ".join(DIVERGING),
            "unjudged": NOT_JUDGED,
            "undefined": NOT_A_NUMBER,
            "within_noise": WITHIN_NOISE,
        },
    )
    return environment
