"""What the interpreter makes of GLSL, statement by statement."""

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import pytest

from comparisons.glsl.interpreter import Evaluation, Program
from comparisons.glsl.syntax import parse
from comparisons.glsl.values import Array, Value
from realtime.shader import Source
from scenes.errors import InputError

X = np.array([-2.0, -1.0, 0.0, 1.0, 2.0, 3.0])
Evaluate = Callable[..., Evaluation]


@pytest.fixture
def run() -> Evaluate:
    """run(text, name, real, **inputs): a function of a text on inputs (N, ...)."""

    def evaluate(text: str, name: str = "f", real: type[np.floating[Any]] = np.float32, **given: Value) -> Evaluation:
        source = Source(text, tuple(("test.glsl", k + 1) for k in range(text.count("\n") + 1)))
        return Program(source, parse(text)).evaluate(name, given, real)

    return evaluate


def returned(evaluation: Evaluation) -> Array:
    return np.asarray(evaluation.outputs["return"])


@pytest.mark.parametrize(
    ("body", "expected"),
    [
        ("return x < 0.0 ? -x : 2.0 * x;", [2, 1, 0, 2, 4, 6]),
        ("if (x < 0.0) return 7.0; else if (x == 0.0) x = 5.0; return x;", [7, 7, 5, 1, 2, 3]),
        ("float s = 0.0; for (int i = 0; i < int(x); ++i) s += float(i) + 1.0; return s;", [0, 0, 0, 1, 3, 6]),
        ("float s = 0.0; for (int i = 0; i < 5; ++i) { if (i == 1) continue; if (float(i) > x) break; s += 1.0; } "
         "return s;", [0, 0, 1, 1, 2, 3]),
        ("while (x < 1.0) { x += 1.0; if (x == 0.0) return -9.0; } return x;", [-9, -9, 1, 1, 2, 3]),
        ("int k = 0; do { ++k; x -= 1.0; } while (x > 0.0); return float(k);", [1, 1, 1, 1, 2, 3]),
        ("float s = 0.0; switch (int(x)) { case 0: s += 1.0; case 1: s += 10.0; break; case 2: return 7.0; "
         "default: s = 5.0; } return s;", [5, 5, 11, 10, 7, 5]),
        ("float s = 4.0; switch (int(x)) { case 1: s = 1.0; break; } return s;", [4, 4, 4, 1, 4, 4]),
        ("int i = 7; i /= 2; i = -i / 2; return float(i % 2) + float(5u >> 1) + 0.0 * x;", [1, 1, 1, 1, 1, 1]),
        ("bool b = x > 0.0 && 1.0 / x > 0.4 || x == -2.0; return b ? 1.0 : 0.0;", [1, 0, 0, 1, 1, 0]),
        ("float x2 = x; { float x2 = 9.0; x2 += 1.0; } return x2;", [-2, -1, 0, 1, 2, 3]),
        ("int k = 2; int m = k++ + ++k; return float(10 * m + k) + 0.0 * x;", [64] * 6),
    ],
)  # fmt: skip
def test_statements_are_carried_out_by_each_invocation_alone(run: Evaluate, body: str, expected: list[float]) -> None:
    np.testing.assert_array_equal(returned(run(f"float f(float x) {{ {body} }}", x=X)), expected)


@pytest.mark.parametrize(
    ("body", "expected"),
    [
        ("vec3 v = vec3(1.0, 2.0, 3.0); v.xz = v.zx * 2.0; return v.x + 10.0 * v.y + 100.0 * v[2];", 226),
        (
            "mat2 m = mat2(1.0, 2.0, 3.0, 4.0); vec2 v = vec2(1.0, 10.0); return dot(m * v, vec2(1.0, 100.0));",
            31 + 4200,
        ),
        ("mat2 m = mat2(1.0, 2.0, 3.0, 4.0); return dot(vec2(1.0, 10.0) * m, vec2(1.0, 100.0));", 21 + 4300),
        ("mat2 m = mat2(1.0, 2.0, 3.0, 4.0); return (m * m)[1][0];", 15),
        ("float[3] a = float[3](1.0, 2.0, 4.0); a[int(x)] += 10.0; return a[0] + a[1] + a[2];", 17),
        ("S s; s.a = 7; float a[1]; a[0] = 5; return s.a / 2 + a[0] / 2;", 6),
        ("S s = S(1.0, vec2(2.0)); s.v.y = 5.0; S t = s; t.a = 7.0; return s.a + s.v.y + t.a;", 13),
        ("float y; g(x, y); return y;", 3),
        ("return mix(2.0, 4.0, 0.25) + step(0.5, x) + smoothstep(0.0, 2.0, x);", 4),
        ("return C * float(any(lessThan(vec2(0.0, x), vec2(-1.0, 2.0))));", 3),
    ],
)
def test_values_of_all_kinds(run: Evaluate, body: str, expected: float) -> None:
    text = f"""const float C = 3.0;
struct S {{ float a; vec2 v; }};
void g(float x, out float y) {{ x += 2.0; y = x; }}
float f(float x) {{ {body} }}"""
    assert returned(run(text, x=np.array([1.0])))[0] == expected


def test_uniforms_are_inputs_and_functions_keep_their_own_variables(run: Evaluate) -> None:
    text = """uniform vec2 scale;
float g(float y) { float x = 2.0; return x * y; }
float f(float x) { return g(x) + x + scale.y; }"""
    np.testing.assert_array_equal(returned(run(text, x=X, scale=np.array([[0.0, 10.0]]))), 3 * X + 10)


def test_half_precision_rounds_every_operation(run: Evaluate) -> None:
    """IEEE 754 binary16: 11 bits, nothing above 65504, steps of 6e-8 at 0."""
    text = "float f(float x) { return (x + 1.0) - x; }"
    np.testing.assert_array_equal(returned(run(text, real=np.float16, x=np.array([1024.0, 2048.0, 4096.0]))), [1, 0, 0])
    squares = returned(
        run("float f(float x) { return x * x; }", real=np.float16, x=np.array([255.0, 256.0, 2.0**-12, 1e-4]))
    )
    np.testing.assert_array_equal(squares, [65024, np.inf, 2.0**-24, 0])


def test_single_precision_has_no_subnormal_numbers_as_on_gpus(run: Evaluate) -> None:
    assert returned(run("float f(float x) { return x * x; }", x=np.array([1e-20])))[0] == 0
    assert np.isnan(returned(run("vec3 f(vec3 v) { return normalize(v); }", v=np.array([[1e-20, 0, 0]])))).any()


@pytest.mark.parametrize(
    ("expression", "x"),
    [
        ("pow(x, 2.0)", -1.0),
        ("atan(x, 0.0)", 0.0),
        ("clamp(x, 1.0, 0.0)", 0.5),
        ("inversesqrt(x)", -1.0),
        ("acos(x)", 1.0000001),
    ],
)
def test_what_glsl_leaves_undefined_is_not_a_number(run: Evaluate, expression: str, x: float) -> None:
    assert np.isnan(returned(run(f"float f(float x) {{ return {expression}; }}", x=np.array([x])))[0])


def test_the_first_number_that_is_not_finite_is_found_though_the_result_hides_it(run: Evaluate) -> None:
    text = (
        "float f(float x) {\n    float a = 1.0 / x;\n    return max(0.0, min(a, 1.0)) + (x > 5.0 ? sqrt(-x) : 0.0);\n}"
    )
    made = run(text, x=np.array([1.0, 0.0, 6.0]))
    assert np.isfinite(returned(made)[:2]).all()
    assert [str(made.faults[k]) if k >= 0 else "" for k in made.first] == [
        "",
        "test.glsl:2 1.0 / x",
        "test.glsl:3 sqrt(-x)",
    ]


def test_what_is_not_evaluated_is_not_looked_at(run: Evaluate) -> None:
    """Neither the other side of ?: and of an if, nor what a short-circuit leaves out."""
    text = "float f(float x) { if (x > 0.0 && 1.0 / x > 0.0) return x > 1.0 ? sqrt(x - 1.0) : 0.0; return 0.0; }"
    assert (run(text, x=X).first < 0).all()


@pytest.mark.parametrize(
    "text",
    [
        "layout(binding = 0) uniform sampler2D t;\nfloat f(float x) { return texture(t, vec2(x)).r; }",
        "layout(std430, binding = 0) buffer B { float b[]; };\nfloat f(float x) { return b[0]; }",
        "float f(float x) { return gl_FragCoord.x; }",
    ],
)
def test_what_only_a_draw_call_gives_is_refused_with_its_place(run: Evaluate, text: str) -> None:
    with pytest.raises(InputError, match=r"test\.glsl:\d .*by itself"):
        run(text, x=X)


def test_a_loop_without_end_is_refused(run: Evaluate, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("comparisons.glsl.statements.MOST_ITERATIONS", 50)
    with pytest.raises(InputError, match="not ended after 50"):
        run("float f(float x) { while (x == x) x = 1.0; return x; }", x=X)


def test_double_precision_is_that_of_numpy(run: Evaluate) -> None:
    given: Mapping[str, Value] = {"x": X}
    made = run("float f(float x) { return exp(x) / (1.0 + 0.1 * x); }", real=np.float64, **given)
    np.testing.assert_array_equal(returned(made), np.exp(X) / (1 + 0.1 * X))
