"""GLSL from files: nested #include, each file once, and compile errors that name the file and line they come from."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from scenes.errors import RenderError

if TYPE_CHECKING:
    import moderngl

GLSL = Path(__file__).parent / "glsl"

_INCLUDE = re.compile(r'^\s*#include\s+"([^"]+)"\s*$')
_STAGES = {".vert": "vertex_shader", ".frag": "fragment_shader", ".geom": "geometry_shader", ".comp": "compute_shader"}
_POSITION = re.compile(r"\b0:(\d+)\((\d+)\)|\b0\((\d+)\)\s*:")


@dataclass(frozen=True)
class Source:
    """Shader text with its includes resolved; `lines[i]` is the file and line that line i + 1 comes from."""

    text: str
    lines: tuple[tuple[str, int], ...]

    def locate(self, log: str) -> str:
        """A driver's log with its line numbers turned into files and lines (Mesa `0:12(5)`, NVIDIA `0(12) :`)."""

        def place(match: re.Match[str]) -> str:
            number = int(match.group(1) or match.group(3))
            if not 1 <= number <= len(self.lines):
                return match.group(0)
            file, line = self.lines[number - 1]
            return f"{file}:{line}"

        return _POSITION.sub(place, log)


def load(name: str, defines: Mapping[str, int | float] | None = None, root: Path = GLSL) -> Source:
    """The shader `name` under `root`, with `defines` after its #version line.

    Raises
    ------
    RenderError
        A file is missing, or includes itself.
    """
    lines: list[tuple[str, str, int]] = []
    _append(root, name, (), set(), lines)
    added = [(f"#define {k} {_literal(v)}", "defines", i + 1) for i, (k, v) in enumerate((defines or {}).items())]
    lines[1:1] = added
    return Source("\n".join(t for t, _, _ in lines) + "\n", tuple((f, n) for _, f, n in lines))


def _literal(value: int | float) -> str:
    return str(int(value)) if isinstance(value, (bool, int)) else repr(float(value))


def _append(root: Path, name: str, above: tuple[str, ...], seen: set[str], lines: list[tuple[str, str, int]]) -> None:
    if name in above:
        raise RenderError(f"Shader includes run in a circle: {' -> '.join((*above, name))}. Break it at one of them.")
    if name in seen:
        return
    seen.add(name)
    try:
        text = (root / name).read_text(encoding="utf-8")
    except FileNotFoundError as error:
        origin = f", included by {above[-1]}" if above else ""
        raise RenderError(
            f"Shader file '{name}' does not exist{origin}. Paths are relative to the glsl folder."
        ) from error
    for number, line in enumerate(text.splitlines(), 1):
        include = _INCLUDE.match(line)
        if include:
            _append(root, include.group(1), (*above, name), seen, lines)
        else:
            lines.append((line, name, number))


def program(context: moderngl.Context, *names: str, defines: Mapping[str, int | float] | None = None) -> Any:
    """Compile and link shader files; the suffix tells the stage.

    Raises
    ------
    RenderError
        The compiler refused; the message names files and lines.
    """
    sources = {name: load(name, defines) for name in names}
    stages = {_STAGES[Path(name).suffix]: source.text for name, source in sources.items()}
    try:
        if "compute_shader" in stages:
            return context.compute_shader(stages["compute_shader"])
        return context.program(**stages)  # type: ignore[arg-type]
    except Exception as error:  # moderngl's own error class lives behind its import
        log = str(error)
        for source in sources.values():
            log = source.locate(log)
        raise RenderError(f"The shader {' + '.join(names)} does not compile: {log.strip()}") from error


def set_uniforms(shader: Any, **values: Any) -> None:
    """Set the uniforms that the compiler kept; one that it removed as unused is passed over."""
    for name, value in values.items():
        if name in shader:
            shader[name] = value
