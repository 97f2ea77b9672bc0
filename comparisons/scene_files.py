"""Which scene files are meant by the arguments of a command: names, paths, folders, wildcards."""

import fnmatch
import glob
import os
import tomllib
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

from scenes.errors import InputError
from scenes.load import find_scene, library_scenes

SIGNS_OF_A_SCENE = ("sensor", "shapes", "extends")
"""A TOML file without any of these keys is something else, such as a project's settings."""


@dataclass(frozen=True)
class SceneFile:
    """A scene to load; `argument` names it on a command line."""

    argument: str
    path: Path

    @property
    def name(self) -> str:
        return self.path.stem


@dataclass(frozen=True)
class Found:
    """The scene files that are meant, each once, and the TOML files among them that hold no scene."""

    scenes: tuple[SceneFile, ...]
    passed_over: tuple[Path, ...]


def find(arguments: Iterable[str]) -> Found:
    """The scene files that the arguments name, in their order; all shipped ones if there are none.

    An argument is a name in the library, the path of a TOML file, a folder, which stands for all scenes below it, or a
    pattern with wildcards: of names in the library, or of paths, where `**` reaches through folders. Hidden files and
    folders are left out unless they are named. Files that were looked for are in alphabetical order.

    Raises
    ------
    InputError
        An argument names nothing.
    """
    given = list(arguments) or list(library_scenes())
    scenes: dict[Path, SceneFile] = {}
    passed_over: dict[Path, None] = {}
    for argument in given:
        named, others = _named_by(argument)
        passed_over |= dict.fromkeys(others)
        if not named:
            raise InputError(
                f"'{argument}' names no scene. Allowed are a name from `lightgauge list`, the path of a TOML file, a "
                "folder with some below it, and patterns of these such as 'eye-*' or 'mine/**/*.toml', in quotes."
            )
        for scene in named:
            scenes.setdefault(scene.path.resolve(), scene)
    return Found(tuple(scenes.values()), tuple(passed_over))


def _named_by(argument: str) -> tuple[list[SceneFile], list[Path]]:
    """The scene files that one argument names, and the TOML files among them that hold no scene."""
    library = library_scenes()
    path = Path(argument)
    is_folder = bool(argument) and argument not in library and path.is_dir()
    if not is_folder and (path.exists() or not glob.has_magic(argument)):
        return [SceneFile(argument, find_scene(argument))], []
    if names := fnmatch.filter(library, argument):
        return [SceneFile(name, library[name]) for name in names], []
    files = {file: _may_be_a_scene(file) for file in (_below(path) if is_folder else _matching(argument))}
    scenes = [SceneFile(str(file), file) for file, is_scene in files.items() if is_scene]
    return scenes, [file for file, is_scene in files.items() if not is_scene]


def _matching(pattern: str) -> Iterator[Path]:
    """The TOML files that match, and those in folders that do."""
    for path in map(Path, sorted(glob.glob(pattern, recursive=True))):  # noqa: PTH207  # Path.glob finds hidden files too
        if path.is_dir():
            yield from _below(path)
        elif path.suffix == ".toml":
            yield path


def _below(folder: Path) -> Iterator[Path]:
    for here, folders, files in os.walk(folder):
        folders[:] = sorted(name for name in folders if not name.startswith("."))
        yield from (Path(here, name) for name in sorted(files) if name.endswith(".toml") and not name.startswith("."))


def _may_be_a_scene(path: Path) -> bool:
    """Whether a TOML file holds a scene; one that cannot be read might."""
    try:
        document = tomllib.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return True
    return any(key in document for key in SIGNS_OF_A_SCENE)
