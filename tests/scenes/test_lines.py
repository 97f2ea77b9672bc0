import tomllib
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from scenes.lines import KeyPath, key_lines, line_of

DOCUMENT = '''\
# [no] = "table"
title = "a # [b] {"  # = [c]
multi = """
[[no]]
x = 1 \\""" still"""
literal = \'\'\'
# k = [
\'\'\'
a.b . "c d" = 3
array = [  # ]
  1,
  [2,
   "],"],
  { x = 1, y.z = ["#",
5] },
]
[materials]
red = { type = "diffuse", reflectance = [1, 2,
 3] }
[materials."blue \\u0078"]
type = 'd"['
date = 1979-05-27T07:32:00Z

[[shapes]]
name = "a"
walls.left = "red"
  [shapes.more]
  x = 1
  [[shapes.parts]]
  y = 2
[[shapes]]
[[ shapes . parts ]]
z = 1
[[shapes.parts]]
z = """{"""
empty = []
none = {}
'''


@pytest.mark.parametrize(
    ("path", "line"),
    [
        (("title",), 2),
        (("multi",), 3),
        (("literal",), 6),
        (("a", "b", "c d"), 9),
        (("array",), 10),
        (("array", 0), 11),
        (("array", 1, 0), 12),
        (("array", 1, 1), 13),
        (("array", 2, "x"), 14),
        (("array", 2, "y", "z", 0), 14),
        (("array", 2, "y", "z", 1), 15),
        (("materials",), 17),
        (("materials", "red", "reflectance"), 18),
        (("materials", "red", "reflectance", 2), 19),
        (("materials", "blue x"), 20),
        (("materials", "blue x", "date"), 22),
        (("shapes",), 24),
        (("shapes", 0), 24),
        (("shapes", 0, "walls", "left"), 26),
        (("shapes", 0, "more", "x"), 28),
        (("shapes", 0, "parts", 0), 29),
        (("shapes", 0, "parts", 0, "y"), 30),
        (("shapes", 1), 31),
        (("shapes", 1, "parts", 0), 32),
        (("shapes", 1, "parts", 0, "z"), 33),
        (("shapes", 1, "parts", 1), 34),
        (("shapes", 1, "parts", 1, "z"), 35),
        (("shapes", 1, "parts", 1, "none"), 37),
    ],
)
def test_keys_stand_where_a_reader_sees_them(path: KeyPath, line: int) -> None:
    assert key_lines(DOCUMENT)[path] == line


def paths_of(value: Any, path: KeyPath = ()) -> set[KeyPath]:
    if isinstance(value, dict):
        items: list[tuple[str | int, Any]] = list(value.items())
    elif isinstance(value, list):
        items = list(enumerate(value))
    else:
        items = []
    return {(*path, key) for key, _ in items}.union(*(paths_of(item, (*path, key)) for key, item in items))


def test_exactly_the_paths_of_the_parser_are_found() -> None:
    assert set(key_lines(DOCUMENT)) == paths_of(tomllib.loads(DOCUMENT))


def test_windows_line_ends_count_once() -> None:
    assert key_lines("a = 1\r\n\r\nb = [\r\n2]\r\n") == {("a",): 1, ("b",): 3, ("b", 0): 4}


def test_the_nearest_enclosing_line_stands_in_for_a_missing_key() -> None:
    lines = key_lines("x = 1\n[[shapes]]\nname = 'a'\n")
    assert line_of(lines, ("shapes", 0, "radius")) == 2
    assert line_of(lines, ("shapes", 7, "radius")) == 2
    assert line_of(lines, ("sensor", "type")) == 1
    assert line_of(lines, ()) == 1


keys = st.text("abc-_1", min_size=1, max_size=4) | st.text(min_size=1, max_size=4)
scalars = st.integers() | st.booleans() | st.text(max_size=6) | st.floats(allow_nan=False, allow_infinity=False)
values = st.recursive(
    scalars, lambda inner: st.lists(inner, max_size=3) | st.dictionaries(keys, inner, max_size=3), max_leaves=8
)


def written(value: Any) -> str:
    """A value in TOML, with arrays over several lines."""
    match value:
        case bool():
            return str(value).lower()
        case str():
            return '"' + "".join(f"\\U{ord(c):08X}" if c in '"\\' or not c.isprintable() else c for c in value) + '"'
        case list():
            return "[" + "".join(f"\n{written(item)}, # ]" for item in value) + "\n]"
        case dict():
            return "{" + ", ".join(f"{written(key)} = {written(item)}" for key, item in value.items()) + "}"
        case _:
            return repr(value)


@settings(max_examples=60, deadline=None)
@given(st.dictionaries(keys, values, max_size=5))
def test_any_document_has_a_line_for_each_path_in_order(document: dict[str, Any]) -> None:
    starts = {}
    text = ""
    for key, value in document.items():
        starts[(key,)] = text.count("\n") + 1
        text += f"{written(key)} = {written(value)}\n"
    lines = key_lines(text)
    assert set(lines) == paths_of(tomllib.loads(text))
    assert {path: lines[path] for path in starts} == starts
