"""Choosing checks by name, as in pytest."""

import pytest

from comparisons.expression import keep_of, quoted
from scenes.errors import InputError

TALK = ("small-room-knot/indirect.talk[c_height=7.0,fitted]", "indirect light", "indirect_radiance")
PROBE = ("small-room-knot/indirect.probe", "indirect light", "indirect_radiance")
DEPTH = ("small-room-knot/raster.depth", "parity", "depth")


@pytest.mark.parametrize(
    ("expression", "kept"),
    [
        ("", (TALK, PROBE, DEPTH)),
        ("  ", (TALK, PROBE, DEPTH)),
        ("indirect", (TALK, PROBE)),
        ("INDIRECT.Talk", (TALK,)),
        ("knot/indirect.talk[c_height=7.0,fitted]", (TALK,)),
        ("parity", (DEPTH,)),
        ("'indirect light'", (TALK, PROBE)),
        ("indirect_radiance", (TALK, PROBE)),
        ("not parity", (TALK, PROBE)),
        ("not not parity", (DEPTH,)),
        ("fitted or depth", (TALK, DEPTH)),
        ("knot and probe", (PROBE,)),
        ("depth or knot and probe", (PROBE, DEPTH)),
        ("(depth or knot) and probe", (PROBE,)),
        ("indirect and not (probe or depth)", (TALK,)),
        ("not probe and not depth", (TALK,)),
        ("not(probe)and(knot)", (TALK, DEPTH)),
        ("android", ()),
    ],
)
def test_an_expression_keeps_what_it_says(expression: str, kept: tuple[tuple[str, ...], ...]) -> None:
    keep = keep_of(expression)
    assert tuple(names for names in (TALK, PROBE, DEPTH) if keep(names)) == kept


def test_a_word_does_not_reach_from_one_name_into_the_next() -> None:
    assert not keep_of("probeindirect")(PROBE)
    assert keep_of("probe and light")(PROBE), "but two words may be found in two names"


@pytest.mark.parametrize(
    ("expression", "column", "found", "allowed"),
    [
        ("indirect probe", 10, "'probe'", "'and', 'or' or the end"),
        ("and", 1, "'and'", "a word, 'not' or '('"),
        ("indirect and", 13, "the end", "a word, 'not' or '('"),
        ("indirect or )", 13, "')'", "a word, 'not' or '('"),
        ("(indirect or probe", 19, "the end", "'and', 'or' or ')'"),
        ("indirect)", 9, "')'", "'and', 'or' or the end"),
        ("()", 2, "')'", "a word, 'not' or '('"),
        ("not", 4, "the end", "a word, 'not' or '('"),
        ("a and 'indirect light", 7, "'''", "a text that ends with ' too"),
    ],
)
def test_a_wrong_expression_is_refused_with_its_place(expression: str, column: int, found: str, allowed: str) -> None:
    with pytest.raises(InputError) as caught:
        keep_of(expression)
    assert f"found {found} at column {column}; allowed: {allowed}." in str(caught.value)


@pytest.mark.parametrize("name", ["indirect.talk[c_height=7.0,fitted]", "my room (2)/raster.depth", "and", 'a "b" c'])
def test_a_quoted_name_means_itself(name: str) -> None:
    assert keep_of(quoted(name))([name])
    assert not keep_of(quoted(name))([name[:-1]])


def test_only_a_name_that_needs_them_gets_quotes() -> None:
    assert quoted("indirect.talk[c_height=7.0,fitted]") == "indirect.talk[c_height=7.0,fitted]"
    assert quoted("my room/raster.depth") == '"my room/raster.depth"'
