"""Shader text as the compiler proper sees it: no comments, macros expanded, the branches of #if taken or left out."""

from __future__ import annotations

import io
import re
from collections.abc import Mapping
from typing import Any, NoReturn

from pcpp import Preprocessor  # type: ignore[import-untyped]

from realtime.shader import Source
from scenes.errors import RenderError

_VERSION = re.compile(r"^\s*#\s*version\s+(\d+)", re.MULTILINE)


def preprocessed(source: Source, defines: Mapping[str, int | float] | None = None) -> Source:
    """What is left of a shader once its directives are carried out, with `defines` added to its own.

    #version, #extension and #pragma stay. Each line stays where it is, so that the map of lines holds.

    Raises
    ------
    RenderError
        A directive is wrong; the message names file and line.
    """
    version = _VERSION.search(source.text)
    preprocessor = _Preprocessor(source)
    preprocessor.define(f"__VERSION__ {version.group(1) if version else 110}")
    preprocessor.define("GL_core_profile 1")
    for name, value in (defines or {}).items():
        preprocessor.define(f"{name} {int(value) if isinstance(value, bool) else repr(value)}")
    written = io.StringIO()
    preprocessor.parse(source.text)
    preprocessor.write(written)
    return Source(written.getvalue(), source.lines)


class _Preprocessor(Preprocessor):  # type: ignore[misc]
    """pcpp for a text whose places are those of another: it raises errors rather than print them."""

    def __init__(self, source: Source) -> None:
        super().__init__()
        self.of = source
        self.line_directive = None  # lines that are left out stay as empty ones

    def on_directive_unknown(self, directive: Any, tokens: Any, passed: bool, before: Any) -> None:
        if directive.value == "error":
            self.on_error("", directive.lineno, "#error " + "".join(token.value for token in tokens))

    def on_error(self, file: str, line: int, message: str) -> NoReturn:
        name, number = self.of.lines[line - 1] if 1 <= line <= len(self.of.lines) else ("shader", line)
        raise RenderError(f"A directive of the shader cannot be carried out: {name}:{number}: {message.strip()}")
