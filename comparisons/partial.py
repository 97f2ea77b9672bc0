"""What a long command has finished so far, so that one that is cut off goes on from there."""

import json
from pathlib import Path
from typing import Any, TypeVar

from pydantic import TypeAdapter, ValidationError

from reference.store import write_text

T = TypeVar("T")


class Partial:
    """Finished parts, by keys that stand for all that they depend on; each is on the disk as soon as it is kept."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._parts = _read(path)

    def found(self, key: str, kind: type[T]) -> T | None:
        """The part of that key, if there is one of that kind."""
        try:
            return TypeAdapter(kind).validate_python(self._parts[key])
        except (KeyError, ValidationError):
            return None

    def keep(self, key: str, part: Any) -> None:
        self._parts[key] = TypeAdapter(type(part)).dump_python(part, mode="json")
        write_text(self._path, json.dumps(self._parts))

    def remove(self) -> None:
        """Forget everything: all is finished."""
        self._path.unlink(missing_ok=True)


def _read(path: Path) -> dict[str, Any]:
    try:
        parts = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return {}
    return parts if isinstance(parts, dict) else {}
