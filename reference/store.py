"""Content-addressed storage of truth: one folder for each thing that a truth depends on, one EXR for each block in it.

A block is written once, atomically, and never changed; samples merge by adding blocks. A run that is cut off therefore
loses the block in flight and nothing else, and a block whose pixels no longer match their checksum is dropped and
rendered anew.
"""

import json
import os
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from scenes.digest import digest_of
from scenes.errors import ImageError, InputError
from scenes.exr import read_exr, write_exr
from scenes.image import Image


@dataclass
class Store:
    """`notes` collects what was repaired, in words for the user; `touched` the files that were read or written."""

    root: Path
    notes: list[str] = field(default_factory=list)
    touched: set[Path] = field(default_factory=set)

    def shelf(self, parts: dict[str, Any]) -> "Shelf":
        """The place for everything that depends on `parts` and nothing else.

        Raises
        ------
        InputError
            The store cannot be written to.
        """
        key = digest_of(parts)
        folder = self.root / key[:2] / key
        description = folder / "key.json"
        try:
            folder.mkdir(parents=True, exist_ok=True)
            if not description.exists():
                write_text(description, json.dumps(parts, indent=1, sort_keys=True))
        except OSError as error:
            raise InputError(
                f"The store '{self.root}' cannot be written to ({error.strerror or error}). It needs a folder "
                f"that this "
                "user may write to: free it, or name another with --store FOLDER."
            ) from error
        return Shelf(self, key, folder)


@dataclass(frozen=True)
class Shelf:
    store: Store
    key: str
    folder: Path

    def image(self, name: str, render: Callable[[], Image]) -> Image:
        """The image of that name, read if it is there and whole, else rendered and kept."""
        path = self.folder / f"{name}.exr"
        self.store.touched.add(path)
        if path.exists():
            try:
                found = read_exr(path)
                if found.provenance:
                    return found
                fault = f"{path}: the note about its origin is missing."
            except ImageError as error:
                fault = str(error)
            path.unlink(missing_ok=True)
            self.store.notes.append(f"Dropped from the store and rendered anew: {fault}")
        image = render()
        write_exr(path, image)
        return image


def write_text(path: Path, text: str) -> None:
    """Write a whole file or none of it."""
    temporary = path.with_name(f".{path.name}.{os.getpid()}")
    try:
        temporary.write_text(text, encoding="utf-8")
        temporary.replace(path)
    finally:
        temporary.unlink(missing_ok=True)
