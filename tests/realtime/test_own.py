"""Techniques from a user's file: what is registered, what they are made of, and what is refused."""

import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from realtime import own
from realtime.own import file_of, load_own, load_packed, own_files, packed, source_digest
from realtime.render import Renderer, plan_of
from realtime.techniques import OWN, technique
from scenes.errors import InputError
from scenes.features import features_of
from scenes.geometry import geometry_of
from scenes.model import Scene

ROOT = Path(__file__).parents[2]
EXAMPLE = ROOT / "docs" / "examples" / "ambient_cube.py"

FILL = """\
from realtime.graph import Pass
from realtime.technique import Parameter, Technique


def draw(frame):
    shade = frame.program("fill.comp")
    image = frame.texture((frame.scene.sensor.width, frame.scene.sensor.height), 4)
    image.bind_to_image(0, read=False, write=True)
    frame.dispatch(shade, *image.size, level=float(frame.settings["level"]))
    frame.resources["image"] = image


def passes(scene, features, settings):
    return [Pass("fill", draw, writes=("image",))]


TECHNIQUES = {
    "mine.fill": Technique(
        name="mine.fill",
        approximates="indirect_radiance",
        summary="one value everywhere",
        source="nobody",
        limits="all",
        passes=passes,
        parameters=(Parameter("level", 0.5, (0.5, 1.0), "what is everywhere"),),
    )
}
"""

SHADER = """\
#version 430
#include "value.glsl"
#include "lib/wrap.glsl"
layout(local_size_x = 8, local_size_y = 8) in;
layout(binding = 0, rgba32f) writeonly uniform image2D image;
uniform float level;
void main() { imageStore(image, ivec2(gl_GlobalInvocationID.xy), vec4(level * VALUE)); }
"""


@pytest.fixture
def write(tmp_path: Path, techniques_forgotten: None) -> Callable[..., Path]:
    """Writes FILL with some of its text replaced, and its shaders; what was loaded is forgotten after the test."""

    def made(*changes: tuple[str, str], name: str = "fill.py", value: str = "2.0", shader: str = SHADER) -> Path:
        text = FILL
        for old, new in changes:
            assert old in text
            text = text.replace(old, new)
        (tmp_path / "fill.comp").write_text(shader, encoding="utf-8")
        (tmp_path / "value.glsl").write_text(f"const float VALUE = {value};\n", encoding="utf-8")
        (tmp_path / name).write_text(text, encoding="utf-8")
        return tmp_path / name

    return made


def forget_all() -> None:
    own._files.clear()
    OWN.clear()


def refusal(path: Path) -> str:
    with pytest.raises(InputError) as refused:
        load_own(path)
    return str(refused.value)


def drawn(scene: Scene, name: str = "mine.fill") -> float:
    pixels = Renderer(scene).render(technique(name), {}, timed=False).image.pixels
    assert np.ptp(pixels) == 0
    return float(pixels[0, 0, 0])


def test_a_file_that_is_loaded_is_known_by_the_names_in_it(write: Callable[..., Path]) -> None:
    path = write()
    assert load_own(path) == ("mine.fill",)
    assert technique("mine.fill").summary == "one value everywhere"
    assert own_files() == (path,)
    assert file_of("mine.fill") == path
    assert file_of("indirect.talk") is None


def test_it_draws_with_shaders_that_lie_beside_it(write: Callable[..., Path], make_scene: Callable[..., Scene]) -> None:
    load_own(write())
    assert drawn(make_scene()) == 1.0


def test_loading_a_file_twice_changes_nothing(write: Callable[..., Path]) -> None:
    path = write()
    load_own(path)
    first = technique("mine.fill")
    load_own(path.parent / ".." / path.parent.name / path.name)
    assert technique("mine.fill") is first


@pytest.mark.parametrize("part", ["fill.py", "fill.comp", "value.glsl"])
def test_whatever_belongs_to_it_is_in_its_digest(write: Callable[..., Path], part: str) -> None:
    path = write()
    load_own(path)
    before = source_digest("mine.fill")
    (path.parent / "other.glsl").write_text("// nothing reads this", encoding="utf-8")
    load_own(path)
    assert source_digest("mine.fill") == before
    with (path.parent / part).open("a", encoding="utf-8") as file:
        file.write("\n")
    load_own(path)
    assert source_digest("mine.fill") != before
    assert source_digest("indirect.talk") == ""


def test_a_table_that_it_names_belongs_to_it(write: Callable[..., Path]) -> None:
    path = write(("def draw", 'TABLE = "table.npy"\n\n\ndef draw'))
    (path.parent / "table.npy").write_bytes(b"1")
    load_own(path)
    before = source_digest("mine.fill")
    (path.parent / "table.npy").write_bytes(b"2")
    load_own(path)
    assert source_digest("mine.fill") != before


def test_what_is_drawn_is_what_was_loaded_and_a_changed_file_is_loaded_anew(
    write: Callable[..., Path], make_scene: Callable[..., Scene]
) -> None:
    path = write()
    load_own(path)
    write(value="8.0")
    assert drawn(make_scene()) == 1.0, "the digest in the key of the check is that of the first content"
    load_own(path)
    assert drawn(make_scene()) == 4.0


def test_another_process_knows_the_same_from_the_path(write: Callable[..., Path]) -> None:
    path = write()
    load_own(path)
    code = "import sys, pathlib, realtime.own as own; print(own.load_own(pathlib.Path(sys.argv[1])), end=' ');"
    code += "print(own.source_digest('mine.fill'))"
    known = subprocess.run([sys.executable, "-c", code, path], cwd=ROOT, capture_output=True, text=True, check=True)
    assert known.stdout == f"('mine.fill',) {source_digest('mine.fill')}\n"


def test_another_machine_knows_the_same_from_a_parcel(
    write: Callable[..., Path], make_scene: Callable[..., Scene], tmp_path: Path
) -> None:
    load_own(write())
    parcel = packed("mine.fill")
    assert parcel is not None
    assert sorted(parcel.files) == ["fill.comp", "fill.py", "value.glsl"]
    forget_all()
    assert load_packed(parcel, tmp_path / "there") == ("mine.fill",)
    assert source_digest("mine.fill") == parcel.digest
    assert drawn(make_scene()) == 1.0
    forget_all()
    load_own(write(value="8.0"))
    edited = packed("mine.fill")
    assert edited is not None
    forget_all()
    load_packed(parcel, tmp_path / "there")
    load_packed(edited, tmp_path / "there")
    assert drawn(make_scene()) == 4.0, "the technique that was edited takes the place of the one before"


def test_a_shipped_technique_needs_no_parcel() -> None:
    assert packed("indirect.talk") is None


def test_what_lies_elsewhere_does_not_travel(write: Callable[..., Path]) -> None:
    path = write(shader=SHADER.replace("value.glsl", "../outside.glsl"))
    (path.parent.parent / "outside.glsl").write_text("const float VALUE = 1.0;", encoding="utf-8")
    load_own(path)
    with pytest.raises(InputError, match=r"uses '\.\./outside\.glsl', which lies outside its folder"):
        packed("mine.fill")


@pytest.mark.parametrize(
    ("change", "line", "said"),
    [
        (("from realtime.graph", "import no_such_package\nfrom realtime.graph"), 1, "ModuleNotFoundError: No module"),
        (("def draw(frame):", "def draw(frame:"), 5, "was never closed"),
        (("TECHNIQUES = {", "raise SystemExit(0)\nTECHNIQUES = {"), 17, "SystemExit: 0"),
        (("TECHNIQUES = {", "TECHNIQUES = {1 / 0: 1,"), 17, "ZeroDivisionError: division by zero"),
    ],
)
def test_a_file_that_python_refuses_is_named_with_the_line(
    write: Callable[..., Path], change: tuple[str, str], line: int, said: str
) -> None:
    message = refusal(write(change))
    assert f"fill.py:{line}: " in message
    assert said in message


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (("TECHNIQUES = {", "OTHERS = {"), "TECHNIQUES must be a dict"),
        (('"mine.fill": Technique(', '"mine.full": Technique('), "found a technique named 'mine.fill'"),
        (('    "mine.fill": Technique(', '    "mine.fill": dict('), "must be a Technique whose name is that; found {"),
        (("mine.fill", "indirect.talk"), "'indirect.talk' is already the name of a technique that ships"),
        (("mine.fill", "my fill"), "'my fill' is no name for a technique"),
        (("mine.fill", "mine.fill[a]"), "'mine.fill[a]' is no name for a technique"),
    ],
)
def test_a_file_without_proper_techniques_is_refused(
    write: Callable[..., Path], change: tuple[str, str], said: str
) -> None:
    assert said in refusal(write(change))
    assert OWN == {}


def test_two_files_must_not_share_a_name(write: Callable[..., Path]) -> None:
    load_own(write())
    assert "'mine.fill' is already the name of a technique in" in refusal(write(name="again.py"))


@pytest.mark.parametrize("name", ["gone.py", "gone.frag", "notes.txt", ""])
def test_what_is_no_file_of_a_technique_is_refused(tmp_path: Path, name: str) -> None:
    (tmp_path / "notes.txt").write_text("", encoding="utf-8")
    assert "Name a Python file (.py), a fragment shader (.frag, .glsl) or a look (.toml)" in refusal(tmp_path / name)


def test_an_include_that_is_nowhere_is_named_with_its_line(write: Callable[..., Path]) -> None:
    message = refusal(write(shader=SHADER.replace("lib/wrap", "lib/warp")))
    assert "fill.comp:3: the included file 'lib/warp.glsl' is neither in" in message


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (("    image.bind_to", "    image.level\n    image.bind_to"), "fill.py:8: AttributeError: "),
        (('"fill.comp"', '"fil" + "l.comp"'), "only those are known that the technique names in full"),
        (('"fill.comp"', '"gone.comp"'), "Shader file 'gone.comp' does not exist"),
        (('    frame.resources["image"] = image\n', ""), "must leave in frame.resources['image']"),
        (("sensor.width,", "sensor.width * 2,"), "must leave in frame.resources['image'] a texture of 16 x 12"),
    ],
)
def test_a_pass_that_fails_is_the_users_to_mend(
    write: Callable[..., Path], make_scene: Callable[..., Scene], change: tuple[str, str], said: str
) -> None:
    load_own(write(change))
    with pytest.raises(InputError) as refused:
        drawn(make_scene())
    assert said in str(refused.value)


def test_a_shader_that_does_not_compile_is_named_with_its_line(
    write: Callable[..., Path], make_scene: Callable[..., Scene]
) -> None:
    load_own(write(value="nothing"))
    with pytest.raises(InputError, match=r"(?s)The shader fill\.comp does not compile: \S*value\.glsl:1: .*nothing"):
        drawn(make_scene())


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (('writes=("image",)', 'writes=("picture",)'), "no pass of this plan writes 'image'"),
        (('writes=("image",)', 'reads=("depth",), writes=("image",)'), "reads 'depth', which no earlier pass"),
        (("return [Pass", "return 1, [Pass"), "must be a list of realtime.graph.Pass"),
        (("    return [Pass", "    scene.nothing\n    return [Pass"), "fill.py:14: AttributeError"),
    ],
)
def test_passes_that_make_no_plan_are_refused_before_anything_is_drawn(
    write: Callable[..., Path], make_scene: Callable[..., Scene], change: tuple[str, str], said: str
) -> None:
    load_own(write(change))
    scene = make_scene()
    with pytest.raises(InputError) as refused:
        plan_of(technique("mine.fill"), scene, features_of(scene, geometry_of(scene)), {})
    assert said in str(refused.value)


def test_an_unknown_name_may_be_one_of_the_users(write: Callable[..., Path]) -> None:
    with pytest.raises(InputError, match=r"If it is your own, name its file with --technique,"):
        technique("mine.fill")
    load_own(write())
    with pytest.raises(InputError, match=r"Did you mean 'mine\.fill'\?"):
        technique("mine.fil")
