"""Shader functions under stress: every one has a domain, known figures are found again, and what was mended holds."""

import json
import shlex
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from comparisons.answers.shader_function import run_function
from comparisons.glsl.values import Array, Value
from comparisons.stress.domains import DOMAINS, WITHOUT
from comparisons.stress.examination import examined, program_of, subject
from comparisons.stress.functions import STRESSES, outcome, outcomes, subjects
from comparisons.stress.inputs import drawn, lane, rounded, unit_of
from comparisons.stress.limits import Standing, standing, with_limit
from comparisons.stress.reproduction import example_of, from_json, to_json, traced
from comparisons.stress.search import simplest
from realtime.shader import GLSL
from scenes.errors import InputError

SINGLE = ("fp32", "extremes", "random")
AS_PUBLISHED = {
    ("lib/refract.glsl:refract_talk", "extremes"),  # no total reflection
    ("lib/sphere.glsl:SphereIntersect", "random"),  # squares of the distance cancel
    ("cornea_talk/eye.frag:blend", "extremes"),  # opposite normals leave none
}
"""The talk's functions, shown as they are."""
LIGHT = {"place_kind": [1, 2, 3, 0], "axis_area": [0, 1, 0, 1], "strength": [1, 1, 1, 0]}


def runs_alone(file: str, name: str) -> bool:
    domain = next((d for key, d in DOMAINS.items() if key.startswith(f"{file}:")), None)
    try:
        program_of(file, tuple(domain.defines.items()) if domain else ()).inputs(name)
    except InputError:
        return False
    return True


def functions_of(file: str) -> list[str]:
    defines = next((tuple(d.defines.items()) for key, d in DOMAINS.items() if key.startswith(f"{file}:")), ())
    program = program_of(file, defines)
    return [name for name in program.functions if program.file_of(name) == file and name != "main"]


@pytest.mark.parametrize("path", sorted(GLSL.glob("*/*")), ids=lambda path: str(path.relative_to(GLSL)))
def test_every_function_that_runs_by_itself_has_a_domain(path: Path) -> None:
    """Also those of passes; all of lib/ do."""
    file = str(path.relative_to(GLSL))
    for name in functions_of(file):
        assert (f"{file}:{name}" in DOMAINS) != (f"{file}:{name}" in WITHOUT or not runs_alone(file, name)), name
        assert f"{file}:{name}" in DOMAINS or not file.startswith("lib/")


@pytest.mark.parametrize("name", list(DOMAINS))
def test_inputs_are_in_order_and_functions_give_numbers_in_use(name: str) -> None:
    """In double precision nothing in use is undefined."""
    of = subject(name)
    made = of.evaluate(drawn(of.kinds, np.random.default_rng(3), 512), np.float64)
    assert (made.first < 0).all(), made.faults


@pytest.mark.slow
@pytest.mark.parametrize("stress", SINGLE)
@pytest.mark.parametrize("name", list(DOMAINS))
def test_single_precision_does_for_all_functions_but_those_shown_as_published(name: str, stress: str) -> None:
    found = outcome(subject(name), stress)
    assert (found.first_failing is not None) == ((name, stress) in AS_PUBLISHED), found


@pytest.mark.slow
@pytest.mark.parametrize("stress", STRESSES)
@pytest.mark.parametrize("name", list(DOMAINS))
def test_breaks_are_documented_where_they_begin(name: str, stress: str) -> None:
    found = with_limit(outcome(subject(name), stress))
    assert standing(found) in (Standing.HOLDS, Standing.KNOWN), found


def turned(v: Array, axis: Array, angle: float) -> Array:
    c, s = np.cos(angle), np.sin(angle)
    return np.asarray(v * c + np.cross(axis, v) * s + axis * (axis @ v) * (1 - c))


def luna(view: float, count: int = 4000) -> dict[str, Value]:
    """Rays on the cap of the talk's unit eye, seen at an angle to the gaze from far away."""
    rng = np.random.default_rng(4)
    d = turned(np.array([0.0, -1.0, 0.0]), np.array([1.0, 0.0, 0.0]), np.radians(view))
    y = rng.uniform(0.806, 1.0, count * 2)
    phi = rng.uniform(0, 2 * np.pi, count * 2)
    r = np.sqrt(1 - y * y)
    normal = np.stack([r * np.cos(phi), y, r * np.sin(phi)], axis=1)
    normal = normal[normal @ d < -0.05][:count]
    many = np.ones(len(normal))
    iris_radius = 2.0
    return {
        "coord": rounded(normal), "normal": rounded(normal), "ray": rounded(np.tile(d, (len(normal), 1))),
        "ior": 1.376 * many, "sphere_radius": many, "limbus_height": 0.805 * many,
        "iris_centre": (0.805 + np.sqrt(iris_radius**2 - 0.352)) * many, "iris_radius": iris_radius * many,
    }  # fmt: skip


@pytest.mark.parametrize(
    ("view", "real", "median", "p99"),
    [
        (0.0, np.float32, 9e-9, 4e-8), (0.0, np.float16, 0.7e-4, 3.3e-4),
        (75.0, np.float32, 6e-8, 3e-7), (75.0, np.float16, 5e-4, 2.5e-3),
    ],
)  # fmt: skip
def test_the_talk_s_iris_needs_more_than_half_precision(view: float, real: Any, median: float, p99: float) -> None:
    """Figures of an independent prototype, in uv: the median and the 99th percentile. Here from other rays."""
    of = subject("lib/cornea_talk.glsl:trace_iris_talk")
    inputs = luna(view)
    points = [of.evaluate(inputs, kind).outputs["return"]["point"].astype(np.float64) for kind in (real, np.float64)]
    error = np.linalg.norm((points[0] - points[1])[:, [0, 2]], axis=1) / (2 * 0.5932)
    assert median / 2 < np.median(error) < median * 2
    assert p99 / 2 < np.quantile(error, 0.99) < p99 * 2


def test_a_quarter_of_rays_are_nan_with_n_instead_of_its_inverse() -> None:
    """Rays of even density in the cosine: those below sqrt(1 - 1 / n^2) = 0.687 has no refracted ray."""
    of = subject("lib/refract.glsl:refract_talk")
    cosine = np.linspace(0.005, 0.995, 100)
    ray = np.stack([np.sqrt(1 - cosine**2), -cosine, 0 * cosine], axis=1)
    made = of.evaluate({"in_ray": ray, "in_normal": np.array([[0.0, 1.0, 0.0]]), "in_u": np.array([1.376])}, np.float32)
    assert ((made.first >= 0) == (cosine < np.sqrt(1 - 1 / 1.376**2))).all()
    assert str(made.faults[0]).startswith("lib/refract.glsl:6 sqrt(")


def from_afar(distance: float) -> dict[str, Value]:
    rng = np.random.default_rng(6)
    origin = unit_of(rng.normal(size=(4000, 3))) * distance
    aim = unit_of(rng.normal(size=(4000, 3))) * 1.2 * rng.random((4000, 1)) ** (1 / 3)
    return {"o": rounded(origin), "d": rounded(unit_of(aim - origin))}


def test_the_published_discriminant_fails_from_afar_and_the_stable_one_does_not() -> None:
    """At 1000 radii: percents of false hits and misses and errors of percents of a radius, against 1e-4."""
    far, one = from_afar(1000.0), np.ones(1)
    talk, stable = subject("lib/sphere.glsl:SphereIntersect"), subject("lib/sphere.glsl:sphere_roots")
    published = {"rayo": far["o"], "rayd": far["d"], "sphere_radius_squared": one}
    single = talk.evaluate(published, np.float32).outputs["return"]
    double = talk.evaluate(published, np.float64).outputs["return"]
    assert 0.01 < np.mean(np.isnan(single) != np.isnan(double)) < 0.10
    hits = np.isfinite(single) & np.isfinite(double)
    assert 1e-2 < np.median(np.abs(single - double)[hits]) < 2e-1
    found = examined(stable, far | {"radius": np.ones(4000)}, np.float32)
    assert np.median(found.error[found.counts]) < 1e-4
    assert found.own.max() < 1e-4


@pytest.mark.parametrize(
    ("name", "inputs", "expected"),
    [
        ("lib/beam.glsl:beam_of", {"light": LIGHT, "position": [1, 2, 3]}, 0),
        ("lib/lights.glsl:unshadowed_irradiance", {"light": LIGHT, "position": [1, 2, 3], "normal": [0, 1, 0]}, 0),
        ("lib/disk.glsl:disk_hit",
         {"o": [1, 1, 0], "d": [1, 0, 0], "centre": [0, 0, 0], "normal": [0, 1, 0], "radius": 1.0}, 0),
        ("lib/sky.glsl:sky_uv", {"d": [0, 1, 0], "rows": 8.0}, 0.5),
        ("lib/blinn_phong.glsl:blinn_phong",
         {"N": [0, 1, 0], "L": [1, 0, 0], "to_eye": [-1, 0, 0], "exponent": 4000.0}, 0),
    ],
)  # fmt: skip
def test_what_was_undefined_is_mended(name: str, inputs: dict[str, Any], expected: float) -> None:
    """At the light itself, along a disk, straight up, with the light straight behind."""
    of = subject(name)
    made = of.evaluate(from_json(of, json.dumps(inputs)), np.float32)
    assert (made.first < 0).all()
    value = made.outputs["return"]
    assert np.ravel(value["irradiance"] if isinstance(value, dict) else value)[0] == expected


def test_the_search_ends_with_the_simplest_input_that_fails() -> None:
    """Of all that a failing ray is, only its being across the normal is left, and of the index that it is above 1."""
    of = subject("lib/refract.glsl:refract_talk")
    inputs = drawn(of.kinds, np.random.default_rng(2), 512, extremes=3)
    bad = np.flatnonzero(examined(of, inputs, np.float32).first >= 0)
    found = {name: lane(value, int(bad[3])) for name, value in inputs.items()}
    made = to_json(simplest(of.kinds, found, lambda x: bool(of.evaluate(x, np.float32).first[0] >= 0)))
    assert made["in_ray"] == [0.0, 1.0, 0.0]
    assert made["in_u"] == pytest.approx(1.376)
    assert simplest(of.kinds, found, lambda x: x is None) is found


def test_the_search_leaves_nothing_behind(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    outcome(subject("lib/refract.glsl:refract_talk"), "extremes")
    assert list(tmp_path.iterdir()) == []


def test_outcomes_say_where_it_breaks_and_how_to_see_it_again() -> None:
    heard: list[str] = []
    name = "lib/refract.glsl:refract_talk"
    found = {o.stress: o for o in outcomes([name], lambda what, done: heard.append(what))}
    assert heard == [name]
    assert list(found) == list(STRESSES)
    broken = found["extremes"]
    assert (broken.first_failing, broken.trials[0].error) == (1, None)
    assert "lib/refract.glsl:6 sqrt(" in broken.trials[0].fault
    text = broken.reproduce.partition("--input '")[2].rstrip("'")
    lines, status = run_function([name], [], text)
    assert status == 1
    assert any(line.startswith("! lib/refract.glsl:6  sqrt(") for line in lines)
    assert found["fp32"].first_failing is None
    assert found["fp32"].trials[-1].error == pytest.approx(1.3e-7, rel=0.5)
    assert outcome(subject(name), "extremes", at=2.0).trials[0].magnitude == 2.0


def test_a_failure_in_half_precision_is_shown_again_by_its_command() -> None:
    """You should see a failure, with single precision beside it, which fails at nothing."""
    name = "lib/sphere.glsl:SphereIntersect"
    command = shlex.split(outcome(subject(name), "fp16").reproduce)
    assert command[:-1] == ["lightgauge", "stress", name, "--stress", "fp16", "--input"]
    lines, status = run_function([name], ["fp16"], command[-1])
    assert status == 1
    assert lines[-2].startswith("Half precision is")
    assert lines[-1] == "It fails: the error is too large."
    lines, status = run_function([name], [], command[-1])
    assert status == 0
    assert lines[-1].startswith("Single precision is")


def test_an_input_goes_with_one_precision() -> None:
    with pytest.raises(InputError, match="not with extremes"):
        run_function(["lib/fresnel.glsl:F_talk"], ["extremes"], "{}")


@pytest.mark.parametrize("name", subjects())
def test_inputs_survive_json(name: str) -> None:
    of = subject(name)
    text = example_of(of)
    assert json.dumps(to_json(from_json(of, text))) == json.dumps(json.loads(text))


@pytest.mark.parametrize("name", subjects())
def test_what_a_function_reads_in_json_is_all_that_it_needs(name: str) -> None:
    """You should see results in all precisions, though an input was drawn with more than the function reads."""
    lines, status = run_function([name], [], example_of(subject(name)))
    assert status == 0
    assert lines


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("x", "no JSON"),
        ("[1]", "takes cos_i"),
        ('{"cos": 1}', "but the input gives cos"),
        ('{"cos_i": [1, 2]}', "is a float"),
        ('{"cos_i": "a"}', "is a float"),
    ],
)
def test_bad_inputs_are_refused_with_an_example(text: str, message: str) -> None:
    with pytest.raises(InputError, match=message):
        from_json(subject("lib/fresnel.glsl:F_talk"), text)


@pytest.mark.parametrize("asked", [[], ["indirect.talk"], ["lib/sphere.glsl:a", "lib/sphere.glsl:b"]])
def test_an_input_is_for_one_function(asked: list[str]) -> None:
    with pytest.raises(InputError, match="FILE:FUNCTION"):
        run_function(asked, [], "{}")


def test_a_trace_marks_the_cancellation_of_single_precision() -> None:
    of = subject("lib/sphere.glsl:SphereIntersect")
    text = '{"rayo": [0.3, 1000.3, 0.5], "rayd": [0, -1, 0], "sphere_radius_squared": 1.0}'
    steps = traced(of, from_json(of, text))
    wrong = [step.text for step in steps if step.is_wrong]
    assert wrong[0] == "(b * b) - dot(v, v)"
    assert steps[0].values[2] == pytest.approx((-0.3, -1000.3, -0.5))
