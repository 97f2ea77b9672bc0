"""NaNs and infinities inside shaders, found where they arise."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from comparisons.stress.techniques import small, subject_of
from comparisons.stress.watch import Bad, Watch
from realtime.frame import Frame
from realtime.graph import Pass
from realtime.instrument import NO_INSTRUMENT
from realtime.render import Renderer
from realtime.shader import OwnShaders
from realtime.technique import Technique
from realtime.techniques import MODULES, technique
from scenes.load import library_scenes, load_scene
from scenes.model import Scene

SHADER = """#version 430
layout(local_size_x = 4, local_size_y = 4) in;
layout(binding = 0, rgba32f) writeonly uniform image2D image;
layout(std430, binding = 0) readonly buffer Given {{ float given[]; }};
uniform float gain;
{functions}
void main() {{
    ivec2 at = ivec2(gl_GlobalInvocationID.xy);
    float x = float(at.x), y = float(at.y), made = 0.0;
    {body}
    imageStore(image, at, vec4(made, 0.0, 0.0, 1.0));
}}
"""
SIZE = 8
QUICK = ("cornea.talk", "shadow.vcm_analytic", "raster.normal")
Found = tuple[str, str, str, int]


def drawing(text: str, gain: float = 1.0, given: float = 1.0) -> Technique:
    """A technique that runs a compute shader over 8 x 8 pixels."""

    def run(frame: Frame) -> None:
        frame.resources["image"] = frame.texture(frame.size, 4)
        frame.resources["image"].bind_to_image(0, read=False, write=True)
        buffer = frame.context.buffer(np.array([given], np.float32).tobytes())
        buffer.bind_to_storage_buffer(0)
        frame.dispatch(frame.program("made.comp"), *frame.size, group=(4, 4), gain=gain)

    return Technique(
        name="made",
        approximates="indirect_radiance",
        summary="",
        source="",
        limits="",
        passes=lambda *_: [Pass("draw", run, ("image",))],
        grid=1,
        shaders=OwnShaders(Path(), {"made.comp": text}),
    )


@pytest.fixture
def canvas(gl: object, make_scene: Callable[..., Scene]) -> Scene:
    scene = make_scene()
    return scene.model_copy(update={"sensor": scene.sensor.model_copy(update={"width": SIZE, "height": SIZE})})


@pytest.fixture
def found(canvas: Scene) -> Callable[..., list[Found]]:
    """Draws with a body, watched; what was bad as (how, text, what, count). Nothing of it is in the image."""

    def draw(body: str, functions: str = "", **given: Any) -> list[Found]:
        made, watch = drawing(SHADER.format(body=body, functions=functions), **given), Watch()
        assert np.isfinite(Renderer(canvas, watch).render(made, {}, timed=False).image.pixels).all()
        return [(bad.how, bad.text, bad.what, bad.count) for bad in watch.found]

    return draw


ALL = SIZE * SIZE


@pytest.mark.parametrize(
    ("body", "expected"),
    [
        ("made = sqrt(x) / (1.0 + y);", []),
        ("made = max(0.0, sqrt(-1.0 - x));", [("made", "sqrt(-1.0 - x)", "NaN", ALL)]),
        ("made = min(1.0, 1.0 / (0.0 * x));", [("made", "1.0 / (0.0 * x)", "infinity", ALL)]),
        ("made = min(7.0, exp(200.0 * x));", [("made", "exp(200.0 * x)", "infinity", ALL - SIZE)]),
        ("vec3 n = normalize(vec3(0.0 * x)); made = clamp(n.y, 0.0, 1.0);",
         [("made", "normalize(vec3(0.0 * x))", "NaN", ALL)]),
        ("made = x > 3.0 ? log(-y) : 0.0; made = made < 2.0 ? made : 0.0; made = max(0.0, made);",
         [("made", "log(-y)", "NaN and infinity", ALL // 2)]),
        ("float d = x * 1e30; d *= d; made = 1.0 / (1.0 + d);", [("made", "d *= d", "infinity", ALL - SIZE)]),
        ("for (int i = 0; i < 3; ++i) made += max(0.0, acos(x + float(i) + 2.0));",
         [("made", "acos(x + float(i) + 2.0)", "NaN", ALL)]),
        ("mat3 m = inverse(mat3(0.0 * x)); made = max(0.0, min(m[0].x, 1.0));",
         [("made", "inverse(mat3(0.0 * x))", "NaN", ALL)]),
    ],
)  # fmt: skip
def test_what_is_laundered_is_found(found: Callable[..., list[Found]], body: str, expected: list[Found]) -> None:
    """You should see the operation that made it; the image holds nothing of it."""
    assert found(body) == expected


def test_what_follows_is_not_blamed(found: Callable[..., list[Found]]) -> None:
    bad = found("float a = sqrt(-1.0 - x); float b = 2.0 * a + 1.0; made = max(0.0, f(b));",
                "float f(float v) { return v * v - v; }")  # fmt: skip
    assert bad == [("made", "sqrt(-1.0 - x)", "NaN", ALL)]


def test_two_causes_in_one_invocation_are_both_found(found: Callable[..., list[Found]]) -> None:
    bad = found("float a = max(0.0, sqrt(-1.0 - x)), b = max(0.0, log(-1.0 - y)); made = a + b;")
    assert bad == [("made", "sqrt(-1.0 - x)", "NaN", ALL), ("made", "log(-1.0 - y)", "NaN", ALL)]


@pytest.mark.parametrize("given", [{"gain": np.inf}, {"given": np.nan}])
def test_what_comes_from_outside_is_read(found: Callable[..., list[Found]], given: dict[str, float]) -> None:
    name, what = ("gain", "infinity") if "gain" in given else ("given[0]", "NaN")
    assert found("made = max(0.0, min(gain * given[0], 1.0));", **given) == [("read", name, what, ALL)]


def test_the_blend_of_a_mix_hides_nothing(found: Callable[..., list[Found]]) -> None:
    """The trap of a branch-free eye: whatever the weight 1 is given to, the other side of a mix is computed too."""
    bad = found("made = max(0.0, mix(sqrt(-1.0 - x), 0.5, 1.0));")
    assert bad == [("made", "sqrt(-1.0 - x)", "NaN", ALL)]


def test_the_place_is_told(canvas: Scene) -> None:
    watch = Watch()
    text = SHADER.format(body="if (at == ivec2(5, 2)) made = max(0.0, sqrt(-x));", functions="")
    Renderer(canvas, watch).render(drawing(text), {}, timed=False)
    (bad,) = watch.found
    assert bad == Bad("draw", "made", "made.comp", 10, "sqrt(-x)", "NaN", 1, (5, 2), canvas.name)
    assert str(bad) == f"made.comp:10: sqrt(-x) is NaN, made in 1 invocations of pass 'draw' of {canvas.name}"


def test_vertices_are_watched_and_textures_searched(canvas: Scene) -> None:
    """A NaN that a vertex hands on ends in a texture, from which it is not taken."""
    texts = {
        "made.vert": "#version 430\nin vec2 in_place; out float made;\n"
        "void main() { gl_Position = vec4(in_place, 0.0, 1.0); made = sqrt(-2.0 + in_place.x); }\n",
        "made.frag": "#version 430\nin float made; layout(location = 0) out vec4 color;\n"
        "void main() { color = vec4(made); }\n",
    }

    def run(frame: Frame) -> None:
        target = frame.texture(frame.size, 4)
        frame.context.framebuffer([target]).use()
        shader = frame.program("made.vert", "made.frag")
        corners = np.array([[-1, -1], [3, -1], [-1, 3]], np.float32)
        frame.context.vertex_array(shader, [(frame.context.buffer(corners.tobytes()), "2f4", "in_place")]).render()
        frame.resources["hidden"] = target
        frame.resources["image"] = frame.texture(frame.size, 4)
        frame.resources["image"].write(np.ones((SIZE, SIZE, 4), np.float32).tobytes())

    step = Pass("draw", run, ("hidden", "image"))
    shaders = OwnShaders(Path(), texts)
    made = Technique("made", "indirect_radiance", "", "", "", lambda *_: [step], grid=1, shaders=shaders)
    watch = Watch()
    Renderer(canvas, watch).render(made, {}, timed=False)
    vertices, fragments, texture = watch.found
    assert (vertices.how, vertices.file, vertices.text, vertices.count) == (
        "made", "made.vert", "sqrt(-2.0 + in_place.x)", 2)  # fmt: skip
    assert (fragments.how, fragments.text) == ("read", "made")
    assert (texture.how, texture.text, texture.what) == ("stored", "texture 'hidden'", "NaN")


def test_a_second_frame_is_judged_by_itself(canvas: Scene) -> None:
    watch = Watch()
    renderer = Renderer(canvas, watch)
    for gain, count in ((np.inf, 1), (1.0, 0)):
        renderer.render(drawing(SHADER.format(body="made = min(gain, 1.0);", functions=""), gain=gain), {}, timed=False)
        assert len(watch.found) == count


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=() if name in QUICK else pytest.mark.slow) for name in MODULES]
)
def test_the_image_is_kept(name: str, gl: object) -> None:
    """You should see no more than what the compiler rounds otherwise: some last bits."""
    subject, watch = subject_of(name), Watch()
    settings = dict(subject.case.settings)
    kept, watched = (
        Renderer(subject.case.scene, instrument).render(subject.technique, settings, timed=False).image.pixels
        for instrument in (NO_INSTRUMENT, watch)
    )
    np.testing.assert_allclose(watched, kept, rtol=1e-5, atol=1e-6 * kept.max())
    assert watch.sites > 30


def test_the_eye_without_branches_is_full_of_hidden_nans(gl: object) -> None:
    """2005's eye, both surfaces computed and one selected: rays that miss the bowl give NaN normals, unseen.

    You should see none in the image, thousands inside, and none inside where the shader branches.
    """
    scene = small(load_scene(library_scenes()["eye-talk-view75"]))
    counts = {}
    for branching in (False, True):
        watch = Watch()
        image = Renderer(scene, watch).render(technique("cornea.talk"), {"branching": branching}, timed=False).image
        assert np.isfinite(image.pixels).all()
        counts[branching] = {(bad.file, bad.text): bad.count for bad in watch.found}
    assert counts[True] == {}
    assert list(counts[False]) == [("lib/sphere.glsl", "sqrt(disc)")]
    assert counts[False]["lib/sphere.glsl", "sqrt(disc)"] > 2000
