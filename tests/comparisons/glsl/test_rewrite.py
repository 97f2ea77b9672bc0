"""Which expressions of a shader are wrapped, and that wrapping them changes nothing."""

import numpy as np
import pytest

from comparisons.glsl.rewrite import Kind, Site, enclosed, wrap
from comparisons.glsl.source import preprocessed
from comparisons.glsl.syntax import parse
from comparisons.stress.techniques import subject_of
from realtime.instrument import Instrument
from realtime.render import Renderer
from realtime.shader import Source
from realtime.techniques import MODULES

MARKS = {Kind.OPERATION: "<{}>", Kind.READ: "[{}]", Kind.CONSTANT: "{}"}
BEFORE = """struct S { vec3 p; float t; }; uniform sampler2D map; uniform image2D image; vec3 f(float x, out vec3 y);
vec3 f(float x, out vec3 y) { return y; } """


def marked(body: str) -> str:
    text = wrap(parse(f"{BEFORE}void main() {{ {body} }}"), lambda site, inside: MARKS[site.kind].format(inside))
    return text.removeprefix(BEFORE + "void main() { ").removesuffix(" }")


@pytest.mark.parametrize(
    ("body", "expected"),
    [
        ("float x = a + 2.0 * b;", "float x = <[a] + <2.0 * [b]>>;"),
        ("x = -a.y;", "x = -[a.y];"),
        ("x += a;", "x = <[x] + ([a])>;"),
        ("v[i + 1].xy *= 2.0;", "v[<[i] + 1>].xy = <[v[<[i] + 1>].xy] * (2.0)>;"),
        ("v[int(g())] -= x;", "v[<int(<g()>)>] -= x;"),
        ("bits |= 1u << k;", "bits |= 1u << k;"),
        ("x = y = sqrt(z);", "x = y = <sqrt([z])>;"),
        ("vec3 n = f(a * b, s.p);", "vec3 n = f(<[a] * [b]>, s.p);"),
        ("S s = S(p, a / b);", "S s = S(p, <[a] / [b]>);"),
        ("S s = c ? one : other;", "S s = c ? one : other;"),
        ("x = (c > a ? one : other) + 1.0;", "x = <([c] > [a] ? [one] : [other]) + 1.0>;"),
        ("const float k = 2.0 * 3.0;", "const float k = 2.0 * 3.0;"),
        ("float a[2 * 3];", "float a[2 * 3];"),
        ("vec2 a[2] = vec2[](x * u, v);", "vec2 a[2] = vec2[](<[x] * [u]>, v);"),
        ("c = texture(map, uv).rgb * k;", "c = <<texture(map, [uv])>.rgb * [k]>;"),
        ("c = textureOffset(map, uv, OFFSET);", "c = <textureOffset(map, [uv], OFFSET)>;"),
        ("imageStore(image, at, v + w);", "imageStore(image, [at], <[v] + [w]>);"),
        ("atomicAdd(counts[i % 2], 1u);", "atomicAdd(counts[i % 2], 1u);"),
        ("x = modf(y, whole);", "x = <modf([y], whole)>;"),
        ("int n = rows.length();", "int n = rows.length();"),
        ("for (int i = 0; i < n; ++i) x += w[i];", "for (int i = 0; [i] < [n]; ++i) x = <[x] + ([w[i]])>;"),
        ("switch (k) { case 1: x = a * b; }", "switch (k) { case 1: x = <[a] * [b]>; }"),
        ("if (isnan(x)) x = y;", "if (<isnan(x)>) x = y;"),
        ("if (any(lessThan(a, b))) return;", "if (<any(<lessThan([a], [b])>)>) return;"),
    ],
)
def test_operations_and_what_they_read_are_wrapped(body: str, expected: str) -> None:
    """You should see operations in <>, what they read in [], and what is written or has to be constant as it was."""
    assert marked(body) == expected


def test_globals_and_layouts_are_left_alone() -> None:
    text = "layout(binding = 1) uniform sampler2D map;\nconst float PI = 2.0 * 1.5;\nfloat start = 1.0 + 2.0;\n"
    assert wrap(parse(text), lambda site, inside: f"<{inside}>") == text


def test_sites_tell_their_lines_and_words() -> None:
    sites: list[Site] = []

    def note(site: Site, inside: str) -> str:
        sites.append(site)
        return f"w({inside})"

    text = wrap(parse("void main() {\n  x = a /\n    sqrt(b);\n}"), note)
    assert text == "void main() {\n  x = w(w(a) /\n    w(sqrt(w(b))));\n}"
    assert [(site.kind, site.line, site.text) for site in sites] == [
        (Kind.READ, 2, "a"),
        (Kind.READ, 3, "b"),
        (Kind.OPERATION, 3, "sqrt(b)"),
        (Kind.OPERATION, 2, "a /\n    sqrt(b)"),
    ]


def test_a_text_is_enclosed_behind_its_directives() -> None:
    text = "#version 430\n\n#extension GL_x : enable\nin float main_light;\nvoid main() {}\n"
    made = enclosed(text, "float first; ", "void main() { lg_main(); }\n")
    assert made.splitlines() == [
        "#version 430",
        "",
        "#extension GL_x : enable",
        "float first; in float main_light;",
        "void lg_main() {}",
        "void main() { lg_main(); }",
    ]


TYPES = (
    *("float", "vec2", "vec3", "vec4", "int", "ivec2", "ivec3", "ivec4", "uint", "uvec2", "uvec3", "uvec4"),
    *("bool", "bvec2", "bvec3", "bvec4", "mat2", "mat3", "mat4"),
)


class Idle(Instrument):
    """Hands each value through a function that does nothing."""

    def __init__(self) -> None:
        self.sites = 0

    def rewrite(self, source: Source, stage: str) -> Source:
        plain = preprocessed(source)
        first = " ".join(f"{kind} lg_same({kind} x) {{ return x; }}" for kind in TYPES)
        return Source(enclosed(wrap(parse(plain.text), self._wrapped), first), plain.lines)

    def _wrapped(self, site: Site, inside: str) -> str:
        self.sites += 1
        return f"lg_same({inside})"


QUICK = ("cornea.talk", "shadow.vcm_analytic", "defocus.layers")


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=() if name in QUICK else pytest.mark.slow) for name in MODULES]
)
def test_shaders_that_are_rewritten_draw_the_same_image(name: str, gl: object) -> None:
    subject, idle = subject_of(name), Idle()
    settings = dict(subject.case.settings)
    one = Renderer(subject.case.scene).render(subject.technique, settings, timed=False)
    other = Renderer(subject.case.scene, idle).render(subject.technique, settings, timed=False)
    np.testing.assert_array_equal(one.image.pixels, other.image.pixels)
    assert idle.sites > 40
