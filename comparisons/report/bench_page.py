"""The page of a benchmark, and its plots as files that stand alone."""

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from comparisons.bench.result import bench_of
from comparisons.report.bench_plots import front_plot, scaling_plots
from comparisons.report.bench_view import view_of
from comparisons.report.page import TEMPLATES, jinja_environment, write_files

PLOTS = "plots"


def write_bench_page(folder: Path, bench: Mapping[str, Any]) -> Path:
    """Write `index.html`, `assets/style.css` and `plots/*.svg` from the content of bench.json.

    Parameters
    ----------
    folder : Path
        Created when missing.
    bench : dict
        `Bench.to_json()`, schema 1.

    Returns
    -------
    Path
        The page.

    Raises
    ------
    InputError
        The benchmark cannot be read as schema 1, or the files cannot be written.
    """
    return write_files(folder, _files(bench))


def _files(bench: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    """Names and contents, the page last: what it leads to is there by then."""
    found = bench_of(bench)
    view = view_of(found)
    fronts = {group.name: plot for group in view.groups if (plot := front_plot(group)) is not None}
    scaling = scaling_plots(found.scaling)
    for plot in (*fronts.values(), *scaling):
        yield f"{PLOTS}/{plot.name}.svg", plot.svg
    yield "assets/style.css", (TEMPLATES / "style.css").read_text(encoding="utf-8")
    template = jinja_environment().get_template("bench.html")
    yield "index.html", template.render(bench=view, fronts=fronts, scaling=scaling, plots=PLOTS)
