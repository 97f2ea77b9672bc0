"""Techniques of a user: from a Python file, from a fragment shader, or a shipped one with another look."""

import ast
import re
import sys
import traceback
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from types import ModuleType
from typing import Any

from realtime.fragment import fragment_technique
from realtime.frame import Frame
from realtime.graph import Pass, plan
from realtime.looks import read_look, technique_of
from realtime.shader import GLSL, INCLUDE, STAGES, OwnShaders
from realtime.technique import Technique
from realtime.techniques import MODULES, OWN
from realtime.techniques import technique as technique_named
from scenes.checks import SettingValue
from scenes.digest import digest_of, file_digest
from scenes.errors import InputError, NoCompiler, NoGraphics, RenderError, unknown_name
from scenes.features import Features
from scenes.model import Scene
from scenes.paths import shown_path

NAME = re.compile(r"[A-Za-z0-9_-]+(\.[A-Za-z0-9_-]+)*")
FILE_NAME = re.compile(r"[\w./ -]{1,200}")
FRAGMENT_SUFFIXES = (".frag", ".glsl")
LOOK_SUFFIX = ".toml"
KINDS = "a Python file (.py), a fragment shader (.frag, .glsl) or a look (.toml)"

Passes = Callable[[Scene, Features, Mapping[str, SettingValue]], list[Pass]]


@dataclass(frozen=True)
class _File:
    """What was loaded from a user's file: the names of its techniques, and what they are made of.

    parts : paths of all files that belong to it, itself included, relative to its folder
    """

    names: tuple[str, ...]
    digest: str
    parts: tuple[str, ...]


@dataclass(frozen=True)
class Parcel:
    """A user's file and all that belongs to it, for another machine: bytes by path, and the digest of their content."""

    name: str
    digest: str
    files: Mapping[str, bytes] = field(compare=False, repr=False)


_files: dict[Path, _File] = {}


def load_own(path: Path) -> tuple[str, ...]:
    """Register the techniques in a user's file, and return their names; a file that has not changed is loaded once.

    Raises
    ------
    InputError
        There is no such file, it cannot be executed, it does not describe techniques, or a name is taken.
    """
    path = path.resolve()
    if path.suffix not in (".py", *FRAGMENT_SUFFIXES, LOOK_SUFFIX) or not path.is_file():
        raise InputError(f"'{shown_path(path)}' is no file that may hold a technique. Name {KINDS}.")
    text = _read(path)
    shaders, others = _belongings(path, text)
    digest = digest_of(path.name, text, shaders.texts, [file_digest(path.parent / other) for other in others])
    if path in _files and _files[path].digest == digest:
        return _files[path].names
    found = _techniques_in(path, text, shaders)
    _forget(path)
    for technique in found:
        _require_free(technique.name, path)
    for technique in found:
        OWN[technique.name] = replace(technique, shaders=shaders, passes=_guarded(technique, path))
    names = tuple(technique.name for technique in found)
    _files[path] = _File(names, digest, tuple(sorted({path.name, *shaders.texts, *others})))
    return names


def _techniques_in(path: Path, text: str, shaders: OwnShaders) -> tuple[Technique, ...]:
    if path.suffix == ".py":
        return _from_python(path, text)
    if path.suffix == LOOK_SUFFIX:
        look = read_look(text, shown_path(path))
        if look.technique not in MODULES:
            raise InputError(f"{shown_path(path)}: {unknown_name('technique that ships', look.technique, MODULES)}")
        return (technique_of(look, technique_named(look.technique), shown_path(path)),)
    return fragment_technique(path.name, shaders)


def own_files() -> tuple[Path, ...]:
    """The files that techniques were loaded from; `load_own` on each of them makes another process know the same."""
    return tuple(_files)


def file_of(name: str) -> Path | None:
    """The file that a technique was loaded from; None for one that ships."""
    return next((path for path, file in _files.items() if name in file.names), None)


def source_digest(name: str) -> str:
    """Digest of the files that a user's technique is made of, as they were when it was loaded; empty for a shipped one.

    These are its file, the shaders that it includes or names, and all other files that it names, by their path relative
    to it.
    """
    path = file_of(name)
    return _files[path].digest if path else ""


def packed(name: str) -> Parcel | None:
    """What makes a user's technique known on another machine; None for a shipped one.

    Raises
    ------
    InputError
        A file of it lies outside its folder.
    """
    path = file_of(name)
    if path is None:
        return None
    for part in _files[path].parts:
        if not (path.parent / part).resolve().is_relative_to(path.parent):
            raise InputError(
                f"{shown_path(path)}: it uses '{part}', which lies outside its folder and cannot travel to another "
                "machine with it. Put it beside the technique or below."
            )
    files = {part: (path.parent / part).read_bytes() for part in _files[path].parts}
    return Parcel(path.name, _files[path].digest, files)


def load_packed(parcel: Parcel, folder: Path) -> tuple[str, ...]:
    """As `load_own`, for a parcel, whose files are written to `folder`; what came there before is forgotten.

    Raises
    ------
    InputError
        As there, or the files were changed after their technique was loaded.
    """
    for file in _files.values():
        if file.digest == parcel.digest:
            return file.names
    home = (folder / parcel.digest).resolve()
    for part, content in parcel.files.items():
        (home / part).parent.mkdir(parents=True, exist_ok=True)
        (home / part).write_bytes(content)
    for path in own_files():
        if path.is_relative_to(folder.resolve()):
            _forget(path)
    names = load_own(home / parcel.name)
    if _files[home / parcel.name].digest != parcel.digest:
        raise InputError(f"'{parcel.name}' has changed since it was loaded. Begin the run anew.")
    return names


def _forget(path: Path) -> None:
    if path in _files:
        for name in _files.pop(path).names:
            del OWN[name]


def _require_free(name: str, path: Path) -> None:
    other = file_of(name)
    if name in MODULES or other:
        whose = f"a technique in {shown_path(other)}" if other else "a technique that ships with lightgauge"
        raise InputError(f"{shown_path(path)}: '{name}' is already the name of {whose}. Choose another one.")
    if not NAME.fullmatch(name):
        raise InputError(
            f"{shown_path(path)}: '{name}' is no name for a technique. Allowed are letters, digits, '_' and '-', in "
            "parts separated by dots, such as mine.hemisphere."
        )


def _read(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"{shown_path(path)}: the file cannot be read as UTF-8 text ({error}). Mend it.") from error


def _belongings(path: Path, text: str) -> tuple[OwnShaders, list[str]]:
    """The shaders that belong to a technique, and its other files, by their path relative to it."""
    if path.suffix == LOOK_SUFFIX:
        return OwnShaders(path.parent, {}), []
    if path.suffix != ".py":
        return OwnShaders(path.parent, _with_includes(path.parent, [path.name])), []
    beside = [name for name in _names_in(path, text) if (path.parent / name).is_file()]
    shaders = [name for name in beside if Path(name).suffix in STAGES]
    others = [name for name in beside if name not in shaders]
    return OwnShaders(path.parent, _with_includes(path.parent, shaders)), others


def _names_in(path: Path, code: str) -> list[str]:
    """Whatever a Python file says in full that could be the name of a file, sorted."""
    try:
        tree = ast.parse(code)
    except SyntaxError as error:
        raise InputError(f"{shown_path(path)}:{error.lineno}: {error.msg}. Correct the technique.") from error
    constants = (node.value for node in ast.walk(tree) if isinstance(node, ast.Constant))
    return sorted({text for text in constants if isinstance(text, str) and FILE_NAME.fullmatch(text)})


def _with_includes(folder: Path, names: Sequence[str]) -> dict[str, str]:
    """Shader files of a folder and what they include from there.

    Raises
    ------
    InputError
        One of them includes what is neither there nor among the shipped ones, or cannot be read.
    """
    texts: dict[str, str] = {}
    waiting = list(names)
    while waiting:
        name = waiting.pop()
        if name in texts:
            continue
        texts[name] = _read(folder / name)
        for number, included in _includes(texts[name]):
            if (folder / included).is_file():
                waiting.append(included)
            elif not (GLSL / included).is_file():
                raise InputError(
                    f"{shown_path(folder / name)}:{number}: the included file '{included}' is neither in {folder} nor "
                    f"among the shipped shaders in {GLSL}. Correct its name, which is relative to one of these."
                )
    return texts


def _includes(text: str) -> Iterator[tuple[int, str]]:
    for number, line in enumerate(text.splitlines(), 1):
        if include := INCLUDE.match(line):
            yield number, include.group(1)


def _from_python(path: Path, text: str) -> tuple[Technique, ...]:
    """The techniques that a Python file defines as TECHNIQUES."""
    module = ModuleType(f"lightgauge_own_{path.stem}")
    module.__file__ = str(path)
    sys.modules[module.__name__] = module  # dataclasses look their module up there
    _attempt(path, lambda: exec(compile(text, str(path), "exec"), vars(module)))
    found = vars(module).get("TECHNIQUES")
    if not isinstance(found, dict) or not found:
        what = "nothing of that name" if found is None else f"{found!r:.60}"
        raise InputError(
            f"{shown_path(path)}: TECHNIQUES must be a dict from names to realtime.technique.Technique, with at least "
            f"one entry; found {what}."
        )
    for name, technique in found.items():
        if not isinstance(technique, Technique) or technique.name != name:
            what = f"a technique named '{technique.name}'" if isinstance(technique, Technique) else f"{technique!r:.60}"
            raise InputError(
                f"{shown_path(path)}: TECHNIQUES['{name}'] must be a Technique whose name is that; found {what}."
            )
    return tuple(found.values())


def _guarded(technique: Technique, path: Path) -> Passes:
    """The passes of a technique; whatever goes wrong in them is an InputError that names the user's file and line."""

    def passes(scene: Scene, features: Features, settings: Mapping[str, SettingValue]) -> list[Pass]:
        made = _attempt(path, partial(technique.passes, scene, features, settings))
        if not isinstance(made, list) or not all(isinstance(step, Pass) for step in made):
            raise InputError(
                f"{shown_path(path)}: the passes of '{technique.name}' must be a list of realtime.graph.Pass; found "
                f"{made!r:.60}."
            )
        try:
            plan(made, "image")
        except ValueError as error:
            raise InputError(
                f"{shown_path(path)}: '{technique.name}': {error}. Correct what its passes declare."
            ) from error
        return [replace(step, run=partial(_run, technique, path, step)) for step in made]

    return passes


def _run(technique: Technique, path: Path, step: Pass, frame: Frame) -> None:
    _attempt(path, partial(step.run, frame))
    if "image" in step.writes:
        _require_image(technique, path, frame)


def _attempt(path: Path, act: Callable[[], Any]) -> Any:
    """What a user's code returns; whatever it raises becomes an InputError that names the line of the user's file."""
    try:
        return act()
    except (InputError, NoGraphics, NoCompiler, KeyboardInterrupt):
        raise
    except RenderError as error:
        raise InputError(str(error)) from error
    except BaseException as error:  # it may raise anything, and must not end the process either
        lines = [frame.lineno for frame in traceback.extract_tb(error.__traceback__) if frame.filename == str(path)]
        raise InputError(
            f"{shown_path(path)}:{lines[-1] if lines else 1}: {type(error).__name__}: {error}. Correct the technique, "
            "or install what it imports."
        ) from error


def _require_image(technique: Technique, path: Path, frame: Frame) -> None:
    image, sensor = frame.resources.get("image"), frame.scene.sensor
    wanted = (sensor.width, sensor.height), 4, "f4"
    found = tuple(getattr(image, name, None) for name in ("size", "components", "dtype"))
    if found != wanted:
        raise InputError(
            f"{shown_path(path)}: the passes of '{technique.name}' must leave in frame.resources['image'] a texture of "
            f"{sensor.width} x {sensor.height} with 4 components of type f4, as realtime.gbuffer.resolve_pass does; "
            f"found {'nothing' if image is None else f'size, components and type {found}'}."
        )
