"""The files of a run: results.json, the report, its pictures."""

import json
import os
import platform
import re
import shutil
import subprocess
from collections.abc import Iterable, Mapping
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

from comparisons.doctor import require_writable, version_of
from comparisons.gate import Verdict
from comparisons.history import noted
from comparisons.report.names import stems_of
from comparisons.report.page import write_report
from comparisons.result import SCHEMA, CheckResult
from reference.store import Store, write_text
from scenes.errors import InputError

SHOWN = re.compile(r"(images|pixels)/[^/]+")
"""Where a report has its pictures, and nothing but those."""


def prepare_folder(folder: Path, option: str = "-o") -> None:
    """Make the folder of a report before anything is rendered for it.

    Raises
    ------
    InputError
        It cannot be written to; `option` names another.
    """
    for part in (folder, folder / "images", folder / "pixels"):
        require_writable(part, "output folder", option)


def with_pictures(folder: Path, store: Store, results: Iterable[CheckResult]) -> list[CheckResult]:
    """Copy the pictures of checks, and their pixels as scripts, from the store into the report's folder."""
    found = list(results)
    shown = [
        replace(result, images=shown_at(stem, result.images))
        for result, stem in zip(found, stems_of(result.id for result in found), strict=True)
    ]
    for before, after in zip(found, shown, strict=True):
        for name, kept in before.images.items():
            _copy(store.root / kept, folder / after.images[name])
    return shown


def _copy(source: Path, target: Path) -> None:
    """Copy a file with the time of its last change, unless the target has that time and as many bytes already."""
    wanted = source.stat()
    with suppress(FileNotFoundError):
        found = target.stat()
        if (found.st_size, found.st_mtime_ns) == (wanted.st_size, wanted.st_mtime_ns):
            return
    shutil.copyfile(source, target)
    os.utime(target, ns=(wanted.st_atime_ns, wanted.st_mtime_ns))


def shown_at(stem: str, images: Mapping[str, str]) -> dict[str, str]:
    """Where a report has the pictures of a check, by what they show, as `images` has their files elsewhere."""
    return {name: _shown_at(stem, name, Path(kept).suffix) for name, kept in images.items()}


def _shown_at(stem: str, name: str, suffix: str) -> str:
    return f"pixels/{stem}.js" if suffix == ".js" else f"images/{stem}-{name}{suffix}"


def results_json(results: Iterable[CheckResult], started: str, seconds: float, notes: Iterable[str]) -> dict[str, Any]:
    """The content of results.json: every number that the report shows."""
    found = list(results)
    return {
        "schema": SCHEMA,
        "environment": environment(found),
        "started": started,
        "seconds": seconds,
        "counts": {str(v): sum(r.verdict is v for r in found) for v in Verdict},
        "store_note": " ".join(notes) or None,
        "checks": [r.to_json() for r in found],
    }


def environment(results: Iterable[CheckResult]) -> dict[str, Any]:
    """Versions, machine and commit of a run."""
    renderers = sorted({r.gl_renderer for r in results if r.gl_renderer})
    return {
        **{name: version_of(name) for name in ("lightgauge", "mitsuba", "drjit", "moderngl", "numpy")},
        "python": platform.python_version(),
        "platform": platform.platform(),
        "cpu_count": os.cpu_count(),
        "gl_renderer": "; ".join(renderers) or None,
        "commit": commit(),
    }


def commit() -> str | None:
    """The commit of the current folder's checkout, `+` behind it if files differ from that; None if it is none."""
    head = _git("rev-parse", "--short=12", "HEAD")
    return head and head + ("+" if _git("status", "--porcelain", "--untracked-files=no") else "")


def _git(*arguments: str) -> str | None:
    try:
        outcome = subprocess.run(["git", *arguments], capture_output=True, text=True, timeout=10, check=False)
    except (OSError, subprocess.TimeoutExpired):
        return None
    return outcome.stdout.strip() or None


def write_run(folder: Path, results: dict[str, Any], history: Path | None = None) -> Path:
    """Write results.json, note the run in that history if there is one, and write the report; returns the page."""
    before = shown_by(folder)
    write_text(folder / "results.json", results_text(results))
    page = write_page(folder, results, history)
    for path in before - _shown_in(results):
        (folder / path).unlink(missing_ok=True)
    return page


def results_text(results: Mapping[str, Any]) -> str:
    """The text of results.json, one line a check."""
    checks = ",\n".join(json.dumps(check, allow_nan=False) for check in results["checks"])
    others = json.dumps({key: value for key, value in results.items() if key != "checks"}, indent=1, allow_nan=False)
    return f'{others[:-2]},\n "checks": [\n{checks}\n]\n}}\n'


def shown_by(folder: Path) -> set[str]:
    """The pages and pictures of the checks of the run in a folder, if there is one; no other files that lie there."""
    try:
        _, results = read_run(folder)
        return _shown_in(results)
    except (InputError, KeyError, TypeError, AttributeError):
        return set()


def _shown_in(results: Mapping[str, Any]) -> set[str]:
    pages = {f"checks/{stem}.html" for stem in stems_of(check["id"] for check in results["checks"])}
    pictures = {path for check in results["checks"] for path in check["images"].values()}
    return pages | {path for path in pictures if SHOWN.fullmatch(path)}


def write_page(folder: Path, results: dict[str, Any], history: Path | None = None) -> Path:
    """Write the report of a run that is finished, and note that in a history if it isn't there yet."""
    return write_report(folder, results, None if history is None else noted(history, results))


def read_run(run: Path) -> tuple[Path, dict[str, Any]]:
    """The folder and the results of a finished run, named by its folder or its results.json.

    Raises
    ------
    InputError
        There are none, or they cannot be read.
    """
    path = run / "results.json" if run.is_dir() else run
    try:
        results = json.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError as error:
        raise InputError(
            f"'{path}' does not exist. Name the folder of a run, as given to `lightgauge run -o FOLDER`."
        ) from error
    except (OSError, ValueError) as error:
        raise InputError(f"'{path}' cannot be read as the results of a run ({error}). Run the checks again.") from error
    is_object = isinstance(results, dict)
    if is_object and results.get("schema", SCHEMA) != SCHEMA:
        raise InputError(
            f"'{path}' has schema {results['schema']}; this version reads schema {SCHEMA}. Run the checks again."
        )
    checks, environment = (results.get(key) for key in ("checks", "environment")) if is_object else (None, None)
    is_run = isinstance(environment or {}, dict) and all(isinstance(check, dict) for check in _listed(checks))
    if not (is_object and is_run):
        raise InputError(f"'{path}' is JSON, but not the results of a run. Run the checks again.")
    return path.parent, results


def _listed(value: Any) -> list[Any]:
    """A list as it is; anything else as the only element of one."""
    return value if isinstance(value, list) else [value]
