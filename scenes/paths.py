"""Paths as they are shown to a user."""

import os
from pathlib import Path


def shown_path(path: Path) -> str:
    """A path relative to the current folder if it lies below it, else the whole of it."""
    relative = Path(os.path.relpath(path))
    return str(path.resolve() if ".." in relative.parts else relative)
