"""Where the budgets of a check are written."""

import tomllib
from pathlib import Path

from comparisons.own import origins_of
from scenes.checks import Check
from scenes.known import about
from scenes.lines import KeyPath, key_lines, line_of
from scenes.model import Scene
from scenes.paths import shown_path


def file_of(scene: Scene) -> Path:
    """The TOML file that a scene was read from."""
    return scene.folder / f"{scene.name}.toml"


def places_of(scene: Scene, check: Check) -> tuple[str, ...]:
    """FILE:LINE of each criterion of a check; empty for one that was given on the command line.

    A standard check, that the scene does not spell out, is on line 1; so is every one if the file has been removed or
    broken since it was loaded.
    """
    path = file_of(scene)
    lines = _lines_of(path)
    places, shown = [], shown_path(path)
    for origin in origins_of(scene, check):
        written, number = origin or (check, 0)
        index = scene.checks.index(written) if written in scene.checks else None
        line = 1 if index is None else line_of(lines, ("checks", index, "criteria", number))
        places.append(f"{shown}:{line}" if origin else "")
    return tuple(places)


def _lines_of(path: Path) -> dict[KeyPath, int]:
    """The lines of all checks and their criteria."""
    try:
        return {tuple(key): line for key, line in about(path, "lines of criteria", _found_in)}
    except (OSError, ValueError):
        return {}


def _found_in(path: Path) -> list[tuple[KeyPath, int]]:
    text = path.read_text(encoding="utf-8")
    tomllib.loads(text)  # raises ValueError, which key_lines may not, where it is no TOML
    return [(key, line) for key, line in key_lines(text).items() if key[0] == "checks" and _is_shown(key)]


def _is_shown(key: KeyPath) -> bool:
    return len(key) == 2 or (len(key) == 4 and key[2] == "criteria")
