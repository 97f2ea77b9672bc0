"""Shader text as a tree."""

import re
from pathlib import Path

import pytest

from comparisons.glsl.source import preprocessed
from comparisons.glsl.syntax import Parameter, parse, walk
from realtime.shader import GLSL, load
from scenes.errors import RenderError

FILES = sorted(str(path.relative_to(GLSL)) for path in GLSL.rglob("*.*") if path.is_file())
MACRO = re.compile(r"\b[A-Z][A-Z0-9_]{2,}\b")


@pytest.mark.parametrize("name", FILES)
def test_every_shader_is_understood(name: str) -> None:
    """You should see no error, whether its macros are defined or not."""
    source = load(name)
    constants = set(re.findall(r"const \w+ (\w+)", source.text))
    macros = set(MACRO.findall(re.sub(r"//.*", "", source.text))) - constants
    for defines in ({}, dict.fromkeys(macros, 2)):
        plain = preprocessed(source, defines)
        found = parse(plain.text)
        assert found.text.decode() == plain.text
        assert {f.name for f in found.functions()} >= set(re.findall(r"^\w+ (\w+)\([^;]*?\) \{", plain.text, re.M))


def test_functions_and_structs_are_listed() -> None:
    found = parse(
        """
        layout(local_size_x = 8) in;
        struct Hit { vec3 point, normal; float weights[3]; };
        float[9] basis(vec3 d) { return float[9](d.x, 0, 0, 0, 0, 0, 0, 0, 0); }
        bool hit(const in highp vec3 o, out Hit found[2], inout int count);
        bool hit(const in highp vec3 o, out Hit found[2], inout int count) { return true; }
        void main() { int n = int(gl_GlobalInvocationID.x); }
        """
    )
    basis, hit, main = found.functions()
    assert (basis.name, basis.returns, basis.parameters) == ("basis", "float[9]", (Parameter("d", "vec3"),))
    assert hit.parameters == (
        Parameter("o", "vec3"),
        Parameter("found", "Hit[2]", "out"),
        Parameter("count", "int", "inout"),
    )
    assert main.parameters == ()
    assert found.words(main.body) == "{ int n = int(gl_GlobalInvocationID.x); }"
    assert found.structs() == {"Hit": (("vec3", "point"), ("vec3", "normal"), ("float[3]", "weights"))}


@pytest.mark.parametrize(
    "expression",
    [
        "float(i) * x",
        "(float(i)) * x",
        "vec3[2](a, b)[i]",
        "-x * (y) - (z)",
        "texture(map, uv).rgb * 2.0",
        "int(x) & 1",
    ],
)
def test_expressions_are_no_declarations(expression: str) -> None:
    found = parse(f"void main() {{ y = {expression}; {expression}; }}")
    assert not [node for node in walk(found.root) if node.type == "declaration"]


def test_what_is_no_glsl_is_told_by_line() -> None:
    with pytest.raises(RenderError, match=r"Line 3 .*: x = = 2"):
        parse("void main() {\n float x;\n x = = 2.0;\n}")


def test_files_are_found() -> None:
    assert len(FILES) > 100
    assert all((GLSL / Path(name)).suffix in (".glsl", ".frag", ".vert", ".geom", ".comp") for name in FILES)
