"""NaNs and infinities caught where they arise, inside the shaders: max, min and mix hide many from the image."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, fields, is_dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from comparisons.glsl.rewrite import Kind, Site, enclosed, wrap
from comparisons.glsl.source import preprocessed
from comparisons.glsl.syntax import parse
from realtime.graph import Pass
from realtime.instrument import Instrument
from realtime.shader import Source
from scenes.errors import RenderError

if TYPE_CHECKING:
    import moderngl

    from realtime.frame import Frame

MOST_SITES = 1 << 15
_WORDS = 4
_PLACES = {
    "fragment_shader": "uvec2(gl_FragCoord.xy)",
    "compute_shader": "gl_GlobalInvocationID.xy",
    "vertex_shader": "uvec2(gl_VertexID, 0)",
    "geometry_shader": "uvec2(gl_PrimitiveIDIn, 0)",
}
_BLOCKS = {
    "fragment_shader": "GL_MAX_FRAGMENT_SHADER_STORAGE_BLOCKS",
    "vertex_shader": "GL_MAX_VERTEX_SHADER_STORAGE_BLOCKS",
    "geometry_shader": "GL_MAX_GEOMETRY_SHADER_STORAGE_BLOCKS",
}
_FLOATS = ("float", "vec2", "vec3", "vec4")
_MATRICES = ("mat2", "mat3", "mat4")
EXACT = ("int", "ivec2", "ivec3", "ivec4", "uint", "uvec2", "uvec3", "uvec4", "bool", "bvec2", "bvec3", "bvec4")
"""Types whose values are never rounded, and always finite."""


@dataclass(frozen=True)
class Bad:
    """A value that is not finite.

    step : name of the pass
    how : 'made' by an operation that got finite ones; 'read' by the first of an invocation that took it, from a
        uniform, an attribute, a buffer; or 'stored' in a texture
    file, line, text : the expression; for a texture its name is the text
    what : NaN, infinity, or NaN and infinity
    count : invocations of the pass in which it was; texels, for a texture
    place : pixel, invocation, vertex or primitive that was the first to do so
    scene : where it was found
    """

    step: str
    how: str
    file: str
    line: int
    text: str
    what: str
    count: int
    place: tuple[int, int]
    scene: str

    def __str__(self) -> str:
        where = f"{self.file}:{self.line}: " if self.file else ""
        unit = "texels" if self.how == "stored" else "invocations"
        place = f"pass '{self.step}' of {self.scene}"
        return f"{where}{self.text} is {self.what}, {self.how} in {self.count} {unit} of {place}"


class Watch(Instrument):
    """Finds what is not finite in a frame: `found` has it once the frame is drawn.

    The image stays as it is, but for last bits that compilers round otherwise once a value is used twice, and for what
    GLSL leaves undefined: the minimum of a number and NaN.

    An operation is blamed only if nothing that it took was bad, so what follows from a bad value is not listed again.
    Of all such sites an invocation tells the first and the last; one that discards its fragment tells none.
    `sites` counts the expressions watched. Shaders of a stage that may not write to buffers on this GPU are left alone;
    what they hand on is seen where it is read.
    """

    def __init__(self) -> None:
        self.found: list[Bad] = []
        self._sites: list[tuple[Site, str, int]] = []
        self._buffer: moderngl.Buffer | None = None
        self._info: dict[str, Any] = {}

    @property
    def sites(self) -> int:
        return len(self._sites)

    def begin(self, frame: Frame) -> None:
        self.found.clear()
        self._info = frame.context.info
        if self._buffer is None:
            self._buffer = frame.context.buffer(reserve=4 * _WORDS * MOST_SITES)
        self._buffer.clear()
        self._buffer.bind_to_storage_buffer(self._binding)

    @property
    def _binding(self) -> int:
        """The last one that there is: techniques count theirs from 0."""
        return int(self._info["GL_MAX_SHADER_STORAGE_BUFFER_BINDINGS"]) - 1

    def rewrite(self, source: Source, stage: str) -> Source:
        if stage in _BLOCKS and int(self._info[_BLOCKS[stage]]) == 0:
            return source
        plain = preprocessed(source)
        first_site = self.sites

        def watched(site: Site, inside: str) -> str:
            if site.kind is Kind.CONSTANT:
                return inside
            number = self.sites - first_site
            self._sites.append((site, *plain.lines[site.line - 1]))
            return (
                f"lg_read({inside}, {number})" if site.kind is Kind.READ else f"lg_made(lg_mark(), {inside}, {number})"
            )

        text = wrap(parse(plain.text), watched)
        if self.sites > MOST_SITES:
            raise RenderError(f"The shaders have more than {MOST_SITES} expressions, which is all that is watched.")
        return Source(enclosed(text, _functions(), _main(stage, self._binding, first_site)), plain.lines)

    def after_pass(self, step: Pass, frame: Frame) -> None:
        assert self._buffer is not None
        scene = frame.scene.name
        frame.context.memory_barrier()
        words = np.frombuffer(self._buffer.read(size=4 * _WORDS * max(self.sites, 1)), np.uint32).reshape(-1, _WORDS)
        self._buffer.clear()
        for number in np.flatnonzero(words[:, 0]):
            count, nans, *place = map(int, words[number])
            site, file, line = self._sites[number]
            how = "made" if site.kind is Kind.OPERATION else "read"
            self.found.append(
                Bad(step.name, how, file, line, site.text, _what(nans, count), count, (place[0], place[1]), scene)
            )
        for name in step.writes:
            self.found.extend(_stored(step.name, name, frame.resources.get(name), scene))


def _what(nans: int, count: int) -> str:
    return "infinity" if nans == 0 else "NaN" if nans == count else "NaN and infinity"


def _stored(step: str, name: str, value: Any, scene: str) -> Iterator[Bad]:
    for texture in _textures(value):
        texels = np.frombuffer(texture.read(), np.dtype(texture.dtype))
        bad = np.flatnonzero(~np.isfinite(texels))
        if len(bad):
            row, column = divmod(int(bad[0]) // texture.components, texture.width)
            what = _what(int(np.isnan(texels).sum()), len(bad))
            yield Bad(step, "stored", "", 0, f"texture '{name}'", what, len(bad), (column, row), scene)


def _textures(value: Any) -> Iterator[Any]:
    """The textures of floats that a resource is or holds."""
    import moderngl

    if isinstance(value, moderngl.Texture | moderngl.TextureArray | moderngl.Texture3D):
        if value.dtype in ("f2", "f4"):
            yield value
    elif is_dataclass(value):
        for field in fields(value):
            yield from _textures(getattr(value, field.name))


def _functions() -> str:
    """What the watched text calls, in one line. Bits are asked, as compilers may take all floats for finite.

    Sites only set two numbers, without branches: with atomics at every site a shader takes minutes to compile.
    """
    parts = [
        "uint lg_bad = 0u, lg_first = 0u, lg_last = 0u;",
        "uint lg_mark() { return lg_bad; }",
        "void lg_note(bool is_bad, bool is_origin, bool is_nan, int site) {",
        "uint code = uint(2 * site + (is_nan ? 3 : 2));",
        "lg_first = is_bad && lg_bad == 0u ? code : lg_first; lg_last = is_bad && is_origin ? code : lg_last;",
        "lg_bad += uint(is_bad); }",
    ]
    for i, kind in enumerate(_FLOATS, 1):
        bits = "uint" if i == 1 else f"uvec{i}"
        infinity = f"{bits}(0x7f800000u)"
        is_bad, is_nan = f"b >= {infinity}", f"b > {infinity}"
        if i > 1:
            is_bad, is_nan = f"any(greaterThanEqual(b, {infinity}))", f"any(greaterThan(b, {infinity}))"
        masked = f"{bits} b = floatBitsToUint(x) & 0x7fffffffu;"
        parts += [
            f"{kind} lg_made(uint mark, {kind} x, int site) {{ {masked}",
            f"lg_note({is_bad}, mark == lg_bad, {is_nan}, site); return x; }}",
            f"{kind} lg_read({kind} x, int site) {{ {masked}",
            f"lg_note({is_bad}, lg_bad == 0u, {is_nan}, site); return x; }}",
        ]
    for i, kind in enumerate(_MATRICES, 2):
        made, read = (" ".join(f"lg_{c}x[{k}], site);" for k in range(i)) for c in ("made(mark, ", "read("))
        parts.append(f"{kind} lg_made(uint mark, {kind} x, int site) {{ {made} return x; }}")
        parts.append(f"{kind} lg_read({kind} x, int site) {{ {read} return x; }}")
    for kind in EXACT:
        parts.append(f"{kind} lg_made(uint mark, {kind} x, int site) {{ return x; }}")
        parts.append(f"{kind} lg_read({kind} x, int site) {{ return x; }}")
    return " ".join(parts) + " "


def _main(stage: str, binding: int, first_site: int) -> str:
    """A main that runs the shader's own and then hands over what was noted."""
    return (
        f"layout(std430, binding = {binding}) buffer LgFound {{ uint lg_found[]; }};\n"
        f"void lg_report(uint code) {{ uint at = {_WORDS}u * ({first_site}u + code / 2u - 1u);"
        " if ((code & 1u) != 0u) atomicAdd(lg_found[at + 1u], 1u);"
        f" if (atomicAdd(lg_found[at], 1u) == 0u) {{ uvec2 place = {_PLACES[stage]};"
        " lg_found[at + 2u] = place.x; lg_found[at + 3u] = place.y; } }\n"
        "void main() { lg_bad = lg_first = lg_last = 0u; lg_main(); if (lg_first != 0u) lg_report(lg_first);"
        " if (lg_last != 0u && lg_last != lg_first) lg_report(lg_last); }\n"
    )
