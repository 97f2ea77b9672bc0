"""Scenes that extend one another: the same room under another lamp, without writing the room again.

`extends = "room.toml"` names a file in the same folder, from which a scene takes what it does not say itself. A table
(`sensor`, `materials`, `truth`) is taken key by key, everything else as a whole. A scene's title, description and
checks are always its own.
"""

import re
import tomllib
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from scenes.errors import SceneError
from scenes.lines import KeyPath, key_lines, line_of

EXTENDS = "extends"
OWN = (EXTENDS, "title", "description", "checks")


@dataclass(frozen=True)
class Source:
    """A scene file as written."""

    path: Path
    text: str
    document: dict[str, Any]

    @cached_property
    def _lines(self) -> dict[KeyPath, int]:
        return key_lines(self.text)

    def line(self, path: KeyPath) -> int:
        """Where a key stands, or what encloses it."""
        return line_of(self._lines, path)


def sources(path: Path, read: Callable[[Path], str]) -> list[Source]:
    """A scene file and those that it extends, the nearest first; `read` gives the text of each.

    Raises
    ------
    SceneError
        One of them is not TOML, is not there, or extends itself; the message begins with `FILE:LINE`.
    """
    found = [_source(path, read)]
    while EXTENDS in found[-1].document:
        child = found[-1]
        name = child.document[EXTENDS]
        parent = child.path.parent / str(name)
        if not isinstance(name, str) or name not in _names_beside(child.path):
            raise _refused(child, f"found {name!r}; allowed: the name of a TOML file in the same folder")
        if parent.resolve() in [source.path.resolve() for source in found]:
            raise _refused(child, f"found {name!r}, which extends this scene in turn; allowed: files that do not")
        found.append(_source(parent, read))
    return found


def _source(path: Path, read: Callable[[Path], str]) -> Source:
    text = read(path)
    return Source(path, text, _parse(path, text))


def _names_beside(path: Path) -> set[str]:
    return {file.name for file in path.parent.iterdir() if file.is_file()}


def merged(found: list[Source]) -> dict[str, Any]:
    """The whole document of the first source."""
    document: dict[str, Any] = {}
    for source in reversed(found):
        inherited = {key: value for key, value in document.items() if key not in OWN}
        said = {key: value for key, value in source.document.items() if key != EXTENDS}
        document = inherited | {key: _joined(inherited.get(key), value) for key, value in said.items()}
    return document


def home_of(found: list[Source], path: KeyPath) -> Source:
    """The source that says what stands at a key path of the whole document."""
    for source in found if path[0] not in OWN else []:
        value = source.document.get(str(path[0]))
        is_joined = isinstance(value, dict) and len(path) > 1
        if value is not None and (not is_joined or path[1] in value):
            return source
    return found[0]


def _joined(inherited: Any, said: Any) -> Any:
    return inherited | said if isinstance(inherited, dict) and isinstance(said, dict) else said


def _refused(source: Source, why: str) -> SceneError:
    return SceneError(f"{source.path}:{source.line((EXTENDS,))}: {EXTENDS}: {why}")


def _parse(path: Path, text: str) -> dict[str, Any]:
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        message = str(error)
        found = re.search(r" \(at line (\d+), column (\d+)\)", message)
        line, place = (found[1], f" at column {found[2]}") if found else (text.count("\n") + 1, "")
        what = message.removesuffix(found[0]) if found else message
        raise SceneError(f"{path}:{line}: this is not TOML: {what}{place}. Mend the line.") from error
