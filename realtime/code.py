"""The code that an image depends on: the modules that draw it, the shaders that these name, and what those include."""

import re
from functools import cache
from pathlib import Path

from realtime.shader import GLSL, INCLUDE, STAGES
from realtime.techniques import MODULES
from scenes.digest import code_digest, digest_of, file_digest, names_in, used_by
from scenes.known import about

PACKAGES = ("realtime", "scenes")
REGISTRIES = ("realtime.techniques",)
RENDERER = "realtime.render"
LOOK_SUFFIX = ".toml"
COMMENT = re.compile(r"//[^\n]*|/\*.*?\*/", re.DOTALL)


@cache
def drawing_code(technique: str) -> str:
    """Digest of all code that draws a technique; comments do not matter.

    A user's technique may use anything of this package, so any change to it counts. Its own files do not count here:
    see `realtime.own.source_digest`.
    """
    shaders = [(name, shader_code(GLSL / name)) for name in sorted(shaders_of(technique))]
    looks = [(path.name, file_digest(path)) for path in looks_of(technique)]
    return digest_of(code_digest(*sorted(modules_of(technique))), shaders, *([looks] if looks else []))


@cache
def modules_of(technique: str) -> frozenset[Path]:
    """The Python files that draw a technique."""
    if technique in MODULES:
        return used_by((RENDERER, MODULES[technique]), PACKAGES, REGISTRIES)
    own = (".".join(path.relative_to(GLSL.parents[1]).with_suffix("").parts) for path in GLSL.parent.rglob("*.py"))
    return used_by(own, PACKAGES)


def looks_of(technique: str) -> list[Path]:
    """The files of looks that the modules of a technique name, beside themselves."""
    return sorted(
        path
        for module in modules_of(technique)
        for name in names_in(module)
        if Path(name).suffix == LOOK_SUFFIX
        for path in module.parent.glob(name)
    )


def shaders_of(technique: str) -> frozenset[str]:
    """The shader files that may be compiled for a technique, by their path within the folder of shaders.

    They are those that its modules name, and what they include. A name that is put together when a technique runs
    stands for every file that it fits.
    """
    if technique not in MODULES:
        return frozenset(path.relative_to(GLSL).as_posix() for path in GLSL.rglob("*") if path.is_file())
    waiting = [name for path in modules_of(technique) for name in _named_in(path)]
    found: set[str] = set()
    while waiting:
        name = waiting.pop()
        if name not in found:
            found.add(name)
            waiting += _included_by(name)
    return frozenset(found)


@cache
def _named_in(module: Path) -> list[str]:
    """The shader files whose names a module says; `*` in a name stands for what it fills in."""
    patterns = [name for name in names_in(module) if Path(name).suffix in STAGES]
    return [path.relative_to(GLSL).as_posix() for pattern in patterns for path in GLSL.glob(pattern)]


@cache
def _included_by(shader: str) -> list[str]:
    def found(file: Path) -> list[str]:
        lines = file.read_text(encoding="utf-8").splitlines()
        return [include.group(1) for line in lines if (include := INCLUDE.match(line))]

    names: list[str] = about(GLSL / shader, "includes", found)
    return names


def shader_code(path: Path) -> str:
    """Digest of what a shader does: comments and blanks around its lines do not matter."""

    def digest(file: Path) -> str:
        lines = COMMENT.sub(" ", file.read_text(encoding="utf-8")).splitlines()
        return digest_of([kept for line in lines if (kept := line.strip())])

    found: str = about(path, "shader", digest)
    return found
