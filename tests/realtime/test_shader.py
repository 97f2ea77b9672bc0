from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from realtime.shader import GLSL, OwnShaders, load, program, set_uniforms
from scenes.errors import RenderError

if TYPE_CHECKING:
    import moderngl


def write(folder: Path, **files: str) -> Path:
    """Files by their stem; all are named *.comp."""
    for stem, text in files.items():
        (folder / f"{stem}.comp").write_text(text, encoding="utf-8")
    return folder


def include(*stems: str) -> str:
    return "".join(f'#include "{stem}.comp"\n' for stem in stems)


def test_includes_nest_and_every_line_remembers_its_place(tmp_path: Path) -> None:
    write(
        tmp_path,
        top="#version 430\n" + include("mid") + "top\n",
        mid="mid 1\n" + include("low") + "mid 3\n",
        low="low\n",
    )
    source = load("top.comp", root=tmp_path)
    assert source.text.splitlines() == ["#version 430", "mid 1", "low", "mid 3", "top"]
    places = [("top.comp", 1), ("mid.comp", 1), ("low.comp", 1), ("mid.comp", 3), ("top.comp", 3)]
    assert list(source.lines) == places


def test_a_file_included_twice_is_there_once(tmp_path: Path) -> None:
    write(tmp_path, top="#version 430\n" + include("a", "b"), a=include("low"), b=include("low") + "b\n", low="low\n")
    assert load("top.comp", root=tmp_path).text.splitlines() == ["#version 430", "low", "b"]


@pytest.mark.parametrize("last", ["top", "a", "b"])
def test_a_circle_of_includes_is_named_in_full(tmp_path: Path, last: str) -> None:
    write(tmp_path, top=include("a"), a=include("b"), b=include(last))
    with pytest.raises(RenderError, match=rf"top\.comp -> a\.comp -> b\.comp -> {last}\.comp"):
        load("top.comp", root=tmp_path)


def test_a_missing_include_is_named_with_the_file_that_wants_it(tmp_path: Path) -> None:
    write(tmp_path, top=include("a"), a=include("gone"))
    with pytest.raises(RenderError, match=r"'gone\.comp' does not exist, included by a\.comp"):
        load("top.comp", root=tmp_path)


def test_a_missing_shader_is_named(tmp_path: Path) -> None:
    with pytest.raises(RenderError, match=r"'gone\.comp' does not exist\."):
        load("gone.comp", root=tmp_path)


def test_defines_come_after_the_version_and_move_no_line_number(tmp_path: Path) -> None:
    write(tmp_path, top="#version 430\nlast\n")
    source = load("top.comp", {"GRID": 4, "STEP": 0.25, "ON": True}, root=tmp_path)
    assert source.text.splitlines() == ["#version 430", "#define GRID 4", "#define STEP 0.25", "#define ON 1", "last"]
    assert source.lines[-1] == ("top.comp", 2)


def test_defines_come_after_a_version_that_a_comment_precedes(tmp_path: Path) -> None:
    write(tmp_path, top="/* a card\n*/\n#version 430\nlast\n")
    source = load("top.comp", {"GRID": 4}, root=tmp_path)
    assert source.text.splitlines() == ["/* a card", "*/", "#version 430", "#define GRID 4", "last"]
    assert source.lines[-1] == ("top.comp", 4)


def test_a_users_file_comes_before_a_shipped_one_but_never_into_one(tmp_path: Path) -> None:
    shipped = write(tmp_path, a=include("b"), b="shipped b\n", c=include("b"))
    own = OwnShaders(tmp_path / "mine", {"top.comp": include("a", "b"), "b.comp": "own b\n"})
    source = load("top.comp", root=shipped, own=own)
    assert source.text.splitlines() == ["shipped b", "own b"]
    assert source.lines == (("b.comp", 1), (str(tmp_path / "mine" / "b.comp"), 1))
    assert load("c.comp", root=shipped, own=own).text == "shipped b\n"


@pytest.mark.parametrize(
    ("log", "expected"),
    [
        ("0:3(7): error: syntax error", "low.comp:1: error: syntax error"),
        ("0(3) : error C0000", "low.comp:1 error C0000"),
        ("0:99(1): error: past the end", "0:99(1): error: past the end"),
    ],
    ids=["Mesa", "NVIDIA", "a line that is not ours"],
)
def test_a_log_is_translated_to_files_and_lines(tmp_path: Path, log: str, expected: str) -> None:
    write(tmp_path, top="#version 430\n" + include("mid"), mid="mid\n" + include("low"), low="low\n")
    assert load("top.comp", root=tmp_path).locate(log) == expected


def test_a_compile_error_names_file_and_line(
    gl: "moderngl.Context", tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    write(
        tmp_path,
        top="#version 430\nlayout(local_size_x = 1) in;\n" + include("low") + "void main() { f(); }\n",
        low="// a comment\n\nvoid f() { undeclared = 1; }\n",
    )
    monkeypatch.setattr("realtime.shader.load.__defaults__", (None, tmp_path))
    with pytest.raises(RenderError, match=r"(?s)top\.comp does not compile.*low\.comp:3: error.*undeclared"):
        program(gl, "top.comp")


def test_a_compile_error_is_placed_in_the_stage_that_has_it(gl: "moderngl.Context", tmp_path: Path) -> None:
    own = OwnShaders(tmp_path, {"mine.frag": "#version 430\nout vec4 color;\nvoid main() { color = undeclared; }\n"})
    with pytest.raises(RenderError) as refused:
        program(gl, "raster/mesh.vert", "mine.frag", own=own)
    assert f"does not compile: {tmp_path / 'mine.frag'}:3: error: `undeclared' undeclared" in str(refused.value)
    assert "mesh.vert:" not in str(refused.value)


def test_a_define_reaches_the_compiler(gl: "moderngl.Context", tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    write(tmp_path, top="#version 430\nlayout(local_size_x = WIDTH) in;\nvoid main() {}\n")
    monkeypatch.setattr("realtime.shader.load.__defaults__", (None, tmp_path))
    assert program(gl, "top.comp", defines={"WIDTH": 32}) is not None
    with pytest.raises(RenderError, match=r"top\.comp:2"):
        program(gl, "top.comp")


def test_a_uniform_that_the_compiler_removed_is_passed_over(
    gl: "moderngl.Context", tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    write(tmp_path, top="#version 430\nlayout(local_size_x = 1) in;\nuniform float unused;\nvoid main() {}\n")
    monkeypatch.setattr("realtime.shader.load.__defaults__", (None, tmp_path))
    shader = program(gl, "top.comp")
    assert "unused" not in shader
    set_uniforms(shader, unused=1.0)


def test_files_of_the_library_are_pure() -> None:
    """No uniforms, samplers, buffers or main, so that each function can be tested by itself."""
    files = sorted((GLSL / "lib").glob("*.glsl"))
    assert files
    for path in files:
        code = [line.split("//")[0] for line in path.read_text(encoding="utf-8").splitlines()]
        impure = [line for line in code if any(w in line.split() for w in ("uniform", "buffer")) or "void main" in line]
        assert not impure, path.name
        assert not any("sampler" in line for line in code), path.name
