"""Content addresses: what an image depends on, as SHA-256 of canonical JSON."""

import ast
import hashlib
import json
import re
from collections.abc import Callable, Collection, Iterable
from functools import cache
from pathlib import Path
from typing import Any

from scenes.errors import SceneError
from scenes.known import about
from scenes.model import Scene

IMAGE_PARTS = {"length_unit", "sensor", "materials", "shapes", "hair", "emitters", "subject"}
DOCUMENTED = (ast.Module, ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef)
PACKAGES_FOLDER = Path(__file__).parents[1]
FILE_NAME = re.compile(r"[\w*./-]+\.\w+")


def digest_of(*parts: Any) -> str:
    """SHA-256, 64 hexadecimal digits, of JSON-able parts; the order of keys in a dict does not matter."""
    canonical = json.dumps(parts, sort_keys=True, separators=(",", ":"), allow_nan=False)
    return hashlib.sha256(canonical.encode()).hexdigest()


def file_content(path: Path) -> bytes:
    """All bytes of a file; raises SceneError if it cannot be read."""
    try:
        return path.read_bytes()
    except OSError as error:
        raise _unreadable(path, error) from error


def file_digest(path: Path) -> str:
    """SHA-256, 64 hexadecimal digits, of a file's bytes; raises SceneError if it cannot be read."""
    try:
        digest: str = about(path, "sha256", lambda file: hashlib.sha256(file.read_bytes()).hexdigest())
    except OSError as error:
        raise _unreadable(path, error) from error
    return digest


def _unreadable(path: Path, error: OSError) -> SceneError:
    return SceneError(f"{path}: cannot be read ({error.strerror}). Correct the path or restore the file.")


def code_digest(*paths: Path) -> str:
    """Digest of what Python files do: comments, docstrings and layout do not matter."""
    return digest_of(*[_of_code(path)["code"] for path in paths])


def imports_of(path: Path) -> list[str]:
    """The modules that a Python file imports, wherever in it, and whatever it imports from them."""
    names: list[str] = _of_code(path)["imports"]
    return names


def names_in(path: Path) -> list[str]:
    """Whatever a Python file says that could be the name of a file; `*` stands for what is filled in later."""
    names: list[str] = _of_code(path)["names"]
    return names


def _of_code(path: Path) -> dict[str, Any]:
    """What a Python file does, as a digest; the modules that it imports; and what could be names of files in it."""

    def found(file: Path) -> dict[str, Any]:
        tree = ast.parse(file.read_bytes())
        names = sorted({text for node in ast.walk(tree) if FILE_NAME.fullmatch(text := _text_of(node))})
        imports = sorted(_imported_names(tree))  # before the docstrings are taken out of the tree
        return {"code": digest_of(_plain(_without_docstrings(tree))), "imports": imports, "names": names}

    facts: dict[str, Any] = about(path, "python", found)
    return facts


def _text_of(node: ast.AST) -> str:
    """The text that a constant or an f-string stands for; empty for anything else."""
    if isinstance(node, ast.JoinedStr):
        return "".join(_text_of(part) or "*" for part in node.values)
    return node.value if isinstance(node, ast.Constant) and isinstance(node.value, str) else ""


def used_by(modules: Iterable[str], packages: Collection[str], registries: Collection[str] = ()) -> frozenset[Path]:
    """The files of modules and of whatever they import from some packages, and so on.

    `registries` are modules that are passed over: they only name others, which are imported when asked for.
    """
    found: set[Path] = set()
    waiting = list(modules)
    seen = set(registries)
    while waiting:
        name = waiting.pop()
        if name not in seen and name.partition(".")[0] in packages:
            seen.add(name)
            file, imported = _module(name)
            if file is not None:
                found.add(file)
                waiting += imported
    return frozenset(found)


@cache
def _module(name: str) -> tuple[Path | None, list[str]]:
    """The file of a module and what it imports; no file if there is no such module."""
    place = PACKAGES_FOLDER.joinpath(*name.split("."))
    file = next((f for f in (place.with_suffix(".py"), place / "__init__.py") if f.exists()), None)
    return file, imports_of(file) if file else []


@cache
def with_imports(path: Path) -> frozenset[Path]:
    """A module's file and, whatever it imports from its own top-level package, theirs, and so on.

    Modules lie where their names say, below the folder that holds the package.
    """
    package = next(parent for parent in path.parents if not (parent.parent / "__init__.py").exists())
    found: set[Path] = set()
    waiting = [path]
    while waiting:
        module = waiting.pop()
        if module not in found:
            found.add(module)
            names = imports_of(module)
            files = (package.parent.joinpath(*name.split(".")).with_suffix(".py") for name in names)
            waiting += [file for file in files if file.is_relative_to(package) and file.exists()]
    return frozenset(found)


def _imported_names(tree: ast.Module) -> set[str]:
    """The modules that import statements name, and what they import from them, which may be modules too."""
    names: set[str] = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module is not None:
            names |= {node.module, *(f"{node.module}.{alias.name}" for alias in node.names)}
    return names


def scene_parts(scene: Scene) -> dict[str, Any]:
    """Everything in a scene that can change an image, JSON-able; files count by their content, not by their path."""
    parts: dict[str, Any] = scene.model_dump(mode="json", include=IMAGE_PARTS)
    content: dict[str, Any] = with_files_by_content(parts, lambda path: file_digest(scene.folder / path))
    return content


def with_files_by_content(value: Any, digest: Callable[[str], str]) -> Any:
    """The value with every `path` replaced by the digest of that file and its suffix, which says how to read it."""
    if isinstance(value, dict):
        return {
            key: f"{digest(item)}{Path(item).suffix.lower()}"
            if key == "path" and isinstance(item, str)
            else with_files_by_content(item, digest)
            for key, item in value.items()
        }
    if isinstance(value, list):
        return [with_files_by_content(item, digest) for item in value]
    return value


def _without_docstrings(tree: ast.Module) -> ast.Module:
    for node in ast.walk(tree):
        if isinstance(node, DOCUMENTED) and ast.get_docstring(node, clean=False) is not None:
            node.body = node.body[1:]
    return tree


def _plain(node: Any) -> Any:
    """A syntax tree as nested lists. Empty fields are left out, since every version of Python adds some of them."""
    if isinstance(node, ast.AST):
        fields = [[name, _plain(value)] for name, value in ast.iter_fields(node) if value not in (None, [])]
        return [type(node).__name__, fields]
    if isinstance(node, list):
        return [_plain(item) for item in node]
    return repr(node)
