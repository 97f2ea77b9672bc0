"""GLSL from files: nested #include, each file once, and compile errors that name the file and line they come from."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from scenes.errors import RenderError
from scenes.paths import shown_path

if TYPE_CHECKING:
    import moderngl

GLSL = Path(__file__).parent / "glsl"

INCLUDE = re.compile(r'^\s*#include\s+"([^"]+)"\s*$')
STAGES = {
    ".vert": "vertex_shader",
    ".frag": "fragment_shader",
    ".glsl": "fragment_shader",
    ".geom": "geometry_shader",
    ".comp": "compute_shader",
}
"""By suffix; a .glsl file is included by others, unless it is a user's, who may call a fragment shader that."""

_POSITION = re.compile(r"\b0:(\d+)\((\d+)\)|\b0\((\d+)\)\s*:")


@dataclass(frozen=True)
class OwnShaders:
    """The shader files of a user's technique as they were when it was loaded, by their path relative to its `folder`.

    They are found before the shipped ones of the same name, by the technique's passes and by each other; what a shipped
    file includes is always shipped.
    """

    folder: Path
    texts: Mapping[str, str]

    def shown(self, name: str) -> str:
        """The path of one of the files, for a message."""
        return shown_path(self.folder / name)


NO_SHADERS = OwnShaders(GLSL, {})


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


def load(
    name: str, defines: Mapping[str, int | float] | None = None, root: Path = GLSL, *, own: OwnShaders = NO_SHADERS
) -> Source:
    """The shader `name` among `own` files or else under `root`, with `defines` after its #version line.

    Raises
    ------
    RenderError
        A file is missing, or includes itself.
    """
    lines: list[tuple[str, str, int]] = []
    _append(root, own, name, (), set(), lines)
    added = [(f"#define {k} {_literal(v)}", "defines", i + 1) for i, (k, v) in enumerate((defines or {}).items())]
    version = next((i for i, (text, _, _) in enumerate(lines) if text.lstrip().startswith("#version")), 0)
    lines[version + 1 : version + 1] = added
    return Source("\n".join(t for t, _, _ in lines) + "\n", tuple((f, n) for _, f, n in lines))


def _literal(value: int | float) -> str:
    return str(int(value)) if isinstance(value, (bool, int)) else repr(float(value))


def _append(
    root: Path, own: OwnShaders, name: str, above: tuple[str, ...], seen: set[str], lines: list[tuple[str, str, int]]
) -> None:
    shown = own.shown(name) if name in own.texts else name
    if shown in above:
        raise RenderError(f"Shader includes run in a circle: {' -> '.join((*above, shown))}. Break it at one of them.")
    if shown in seen:
        return
    seen.add(shown)
    text = own.texts[name] if name in own.texts else _shipped(root, own, name, above)
    inner = own if name in own.texts else NO_SHADERS
    for number, line in enumerate(text.splitlines(), 1):
        include = INCLUDE.match(line)
        if include:
            _append(root, inner, include.group(1), (*above, shown), seen, lines)
        else:
            lines.append((line, shown, number))


def _shipped(root: Path, own: OwnShaders, name: str, above: tuple[str, ...]) -> str:
    try:
        return (root / name).read_text(encoding="utf-8")
    except FileNotFoundError as error:
        origin = f", included by {above[-1]}" if above else ""
        beside = f" or to {own.folder}; of the latter, only those are known that the technique names in full"
        raise RenderError(
            f"Shader file '{name}' does not exist{origin}. Paths are relative to the glsl folder"
            f"{beside if own is not NO_SHADERS else ''}."
        ) from error


def program(
    context: moderngl.Context,
    *names: str,
    defines: Mapping[str, int | float] | None = None,
    own: OwnShaders = NO_SHADERS,
    rewrite: Callable[[Source, str], Source] = lambda source, stage: source,
) -> Any:
    """Compile and link shader files; the suffix tells the stage. `rewrite` gets each text and its stage beforehand.

    Raises
    ------
    RenderError
        The compiler refused; the message names files and lines.
    """
    stages_of = {STAGES[Path(name).suffix]: name for name in names}
    sources = {stage: rewrite(load(name, defines, own=own), stage) for stage, name in stages_of.items()}
    stages = {stage: source.text for stage, source in sources.items()}
    try:
        if "compute_shader" in stages:
            return context.compute_shader(stages["compute_shader"])
        return context.program(**stages)  # type: ignore[arg-type]
    except Exception as error:  # moderngl's own error class lives behind its import
        log = str(error)
        for stage, source in sources.items():
            log = source.locate(log) if stage in log or len(sources) == 1 else log
        message = log.rpartition("===\n")[2].strip()
        raise RenderError(f"The shader {' + '.join(names)} does not compile: {message}") from error


def set_uniforms(shader: Any, **values: Any) -> None:
    """Set the uniforms that the compiler kept; one that it removed as unused is passed over."""
    for name, value in values.items():
        if name in shader:
            shader[name] = value
