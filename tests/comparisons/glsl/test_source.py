"""Shader text without directives, and where its lines come from."""

import pytest

from comparisons.glsl.source import preprocessed
from realtime.shader import Source, load
from scenes.errors import RenderError


def source_of(*lines: str) -> Source:
    return Source("\n".join(lines) + "\n", tuple(("made.glsl", number) for number in range(1, len(lines) + 1)))


def test_macros_are_expanded_and_branches_taken() -> None:
    made = preprocessed(
        source_of(
            "#version 430",
            "#define SQUARE(x) ((x) * (x))",
            "#if STEPS > 3 && defined(FAR)",
            "float y = SQUARE(2.0);  // a comment",
            "#else",
            "float y = 0.0;",
            "#endif",
            "int steps = STEPS;",
        ),
        {"STEPS": 4, "FAR": True},
    )
    assert [line.strip() for line in made.text.splitlines() if line.strip()] == [
        "#version 430",
        "float y = ((2.0) * (2.0));",
        "int steps = 4;",
    ]


def test_lines_stay_where_they_are() -> None:
    source = load("lib/cornea_talk.glsl", {"EXIT_BRANCH": 1})
    made = preprocessed(source)
    number = next(i for i, line in enumerate(made.text.splitlines()) if "made.exits = back.y" in line)
    file, line = made.lines[number]
    assert file == "lib/cornea_talk.glsl"
    assert "made.exits = back.y" in source.text.splitlines()[number]
    assert made.locate(f"0:{number + 1}(3): error") == f"{file}:{line}: error"


def test_what_the_compiler_has_to_see_stays() -> None:
    made = preprocessed(source_of("#version 430", "#extension GL_ARB_shader_ballot : enable", "#pragma optimize(off)"))
    assert made.text.split("\n")[:3] == [
        "#version 430",
        "#extension GL_ARB_shader_ballot : enable",
        "#pragma optimize(off)",
    ]


def test_version_is_known_to_conditions() -> None:
    made = preprocessed(source_of("#version 430", "#if __VERSION__ >= 430 && GL_core_profile", "float y;", "#endif"))
    assert "float y;" in made.text


@pytest.mark.parametrize(
    ("lines", "place"),
    [
        (("float x;", "#if (1", "#endif"), "made.glsl:2"),
        (("#if 1", "#error too few steps", "#endif"), "made.glsl:2: #error too few steps"),
        (("#ifdef A", "float x;"), "made.glsl:1: Unterminated #if"),
    ],
)
def test_wrong_directives_are_placed(lines: tuple[str, ...], place: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(RenderError, match=place):
        preprocessed(source_of(*lines))
    assert capsys.readouterr().err == ""
