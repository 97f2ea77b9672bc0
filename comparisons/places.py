"""Where the budgets of a check are written."""

import os
from functools import cache
from pathlib import Path

from scenes.lines import KeyPath, key_lines, line_of
from scenes.model import Check, Scene


def file_of(scene: Scene) -> Path:
    """The TOML file that a scene was read from."""
    return scene.folder / f"{scene.name}.toml"


def places_of(scene: Scene, check: Check) -> tuple[str, ...]:
    """FILE:LINE of each criterion of a check; of a standard one, that the scene does not spell out, line 1."""
    path = file_of(scene)
    lines = _lines(path.read_text(encoding="utf-8"))
    index = scene.checks.index(check) if check in scene.checks else len(scene.checks)
    keys = (("checks", index, "criteria", number) for number in range(len(check.criteria)))
    return tuple(f"{shown_path(path)}:{line_of(lines, key) if index < len(scene.checks) else 1}" for key in keys)


@cache
def _lines(text: str) -> dict[KeyPath, int]:
    return key_lines(text)


def shown_path(path: Path) -> str:
    """A path relative to the current folder if it lies below it, else the whole of it."""
    relative = Path(os.path.relpath(path))
    return str(path.resolve() if ".." in relative.parts else relative)
