"""Which code a verdict depends on: all that judges by its metrics, and nothing of other commands."""

import importlib.metadata
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest

from comparisons import code
from comparisons.code import LIBRARIES, PACKAGES, judging_code, library_versions, modules_of, rendering_code
from comparisons.metrics import METRICS
from realtime import code as drawing
from realtime.techniques import MODULES
from scenes.digest import PACKAGES_FOLDER, imports_of, used_by
from scenes.errors import InputError


def judging(*metrics: str) -> set[str]:
    return {path.relative_to(PACKAGES_FOLDER).as_posix() for path in modules_of(metrics)}


def test_a_metric_counts_where_it_is_asked_for() -> None:
    assert "comparisons/metrics/delta_e_itp.py" in judging("nrmse", "delta_e_itp")
    assert "comparisons/metrics/delta_e_itp.py" not in judging("nrmse", "flip")
    assert {"comparisons/metrics/rel_mse_clipped.py", "comparisons/metrics/rel_mse.py"} <= judging("rel_mse_clipped")
    assert judging_code(("nrmse",)) != judging_code(("rmse",))


def test_what_measures_decides_and_shows_counts() -> None:
    assert {
        "comparisons/judgement.py",
        "comparisons/sequential.py",
        "comparisons/gate.py",
        "comparisons/statistics.py",
        "comparisons/significance.py",
        "comparisons/metrics/metric.py",
        "comparisons/metrics/sample.py",
        "comparisons/report/pictures.py",
        "comparisons/report/pixels.py",
        "reference/estimator.py",
        "scenes/exr.py",
    } <= judging("nrmse")


def test_commands_pages_and_everything_else_does_not_count() -> None:
    others = ("commands/", "answers/", "bench/", "stress/", "fit/", "outputs/", "report/page", "report/view", "cli")
    found = judging(*METRICS)
    assert not [name for name in found if name.startswith(tuple(f"comparisons/{other}" for other in others))]
    assert "comparisons/metrics/__init__.py" not in found, "another metric there changes none of these"


def test_every_module_that_is_imported_counts() -> None:
    """But for packages, which only name their modules, and what they import for others: metrics, pages, drawing."""
    program = (
        "import sys, comparisons.judgement;"
        f"print(*(m.__file__ for n, m in sys.modules.items() if n.split('.')[0] in {PACKAGES!r}))"
    )
    said = subprocess.run(
        [sys.executable, "-c", program], cwd=PACKAGES_FOLDER, capture_output=True, text=True, check=True
    ).stdout
    for_others = used_by(("comparisons.report.page", "comparisons.metrics", "realtime.render"), (*PACKAGES, "realtime"))
    modules = {Path(path) for path in said.split() if not path.endswith("__init__.py")}
    assert len(modules) > 30
    assert modules - for_others <= modules_of(("nrmse",))


OF_FILES = {"OpenEXR", "pillow", "pydantic"}
"""They read and write what has a content of its own."""

OF_TRUTH = {"mitsuba", "drjit"}
"""Their versions count with the truth."""


def test_every_library_that_draws_or_judges_counts() -> None:
    files = modules_of(METRICS).union(*(drawing.modules_of(name) for name in MODULES))
    imported = {name.partition(".")[0] for path in files for name in imports_of(path)}
    own = {*PACKAGES, "realtime"}
    packages = importlib.metadata.packages_distributions()
    libraries = {name for top in imported - own - sys.stdlib_module_names for name in packages.get(top, [top])}
    assert libraries - OF_FILES - OF_TRUTH <= set(LIBRARIES)
    assert library_versions()["numpy"] == importlib.metadata.version("numpy")


def test_an_unknown_metric_is_an_error() -> None:
    with pytest.raises(InputError, match="unknown metric 'nmrse'"):
        judging_code(("nmrse",))


def test_what_describes_a_metric_counts(monkeypatch: pytest.MonkeyPatch) -> None:
    before = judging_code.__wrapped__(("nrmse",))
    monkeypatch.setitem(METRICS, "nrmse", replace(METRICS["nrmse"], noise_power=1))
    assert judging_code.__wrapped__(("nrmse",)) != before


def test_the_code_that_renders_is_that_of_both_sides(monkeypatch: pytest.MonkeyPatch) -> None:
    seen: list[str] = []

    def digest(*paths: Path) -> str:
        seen.extend(path.relative_to(PACKAGES_FOLDER).as_posix() for path in paths)
        return ""

    monkeypatch.setattr(code, "code_digest", digest)
    rendering_code.__wrapped__()
    assert {"scenes/geometry.py", "realtime/render.py", "reference/integrators/light_paths.py"} <= set(seen)
    assert not [name for name in seen if name.startswith("comparisons/")]
