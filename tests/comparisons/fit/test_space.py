"""Which settings are fitted, and within what range."""

import pytest

from comparisons.fit.space import Axis, Choice, Part, parts_of
from realtime.technique import Parameter, Technique
from realtime.techniques import MODULES, technique
from scenes.errors import InputError

MADE_UP = Technique(
    name="made.up",
    approximates="depth",
    summary="none",
    source="none",
    limits="none",
    passes=lambda scene, features, settings: [],
    parameters=(
        Parameter("c", 2.5, (0.0, 2.5), "tuned by eye", (0, 1000), tuned=(0, 10)),
        Parameter("side", 64, (32, 64, 128), "texels", (1, 4096)),
        Parameter("lookup", "slab", ("slab", "beer"), "which"),
        Parameter("shadows", True, (False, True), "whether"),
        Parameter("plane", 0.0, (0.0,), "where"),
    ),
)


def test_without_names_what_is_declared_as_tuned_is_fitted() -> None:
    assert parts_of(MADE_UP, (), {}) == (Axis("c", 2.5, 0, 10),)


def test_what_is_set_is_not_fitted() -> None:
    assert parts_of(MADE_UP, (), {"c": 3.0}) == ()


@pytest.mark.parametrize(
    ("text", "part"),
    [
        ("side", Axis("side", 64, 32, 128, is_whole=True)),
        ("c", Axis("c", 2.5, 0, 10)),
        ("c=1e-2..7.5", Axis("c", 2.5, 0.01, 7.5)),
        ("lookup", Choice("lookup", "slab", ("slab", "beer"))),
        ("shadows", Choice("shadows", True, (False, True))),
    ],
)
def test_a_name_takes_the_range_given_or_tuned_or_swept(text: str, part: Part) -> None:
    assert parts_of(MADE_UP, [text], {}) == (part,)


@pytest.mark.parametrize(
    ("texts", "message"),
    [
        (["d"], r"Unknown parameter of made\.up 'd'\. Known: c, side"),
        (["c", "c=1..2"], "'c' is to be fitted twice"),
        (["c=1"], r"The range '1' of 'c' is not clear.*c=0\.1\.\.0\.5"),
        (["c=3..2"], "The range of 'c' is 3 to 2; it must rise"),
        (["c=0..2000"], "within what 'made.up' allows: 0 to 1000"),
        (["c=0..nan"], "it must rise"),
        (["plane"], "'plane' of 'made.up' has no range"),
        (["lookup=1..2"], "'lookup' of 'made.up' is no number: all of slab, beer are tried"),
        (["side"], "'side' is both set, to 32, and to be fitted"),
    ],
)
def test_what_cannot_be_fitted_is_refused(texts: list[str], message: str) -> None:
    with pytest.raises(InputError, match=message):
        parts_of(MADE_UP, texts, {"side": 32})


def test_over_more_than_a_decade_equal_steps_are_equal_factors() -> None:
    assert [Axis("a", 1.0, 0.1, 10.0).value(place) for place in (0, 0.5, 1)] == [0.1, 1.0, 10.0]
    assert [Axis("a", 1.0, 1.0, 10.0).value(place) for place in (0, 0.5, 1)] == [1.0, 5.5, 10.0]


@pytest.mark.parametrize("axis", [Axis("a", 1.0, 0.01, 10.0), Axis("a", 1.0, -2.0, 10.0), Axis("n", 3, 1, 9, True)])
def test_a_value_is_found_again_at_its_place(axis: Axis) -> None:
    for place in (0.0, 0.25, 0.5, 1.0):
        value = axis.value(place)
        assert axis.value(axis.place(value)) == value


def test_values_have_three_digits_and_stay_in_range() -> None:
    assert Axis("a", 1.0, 0.0, 1.0).value(1 / 3) == 0.333
    assert Axis("a", 1.0, 0.12345, 0.98765).value(0.0) == 0.12345
    assert Axis("n", 1, 1, 8, True).value(0.5) == 4


def test_the_edges_of_a_range_are_named() -> None:
    axis = Axis("a", 1.0, 0.1, 10.0)
    assert [axis.edge(value) for value in (0.1, 0.2, 9.99)] == ["low", "", "high"]


@pytest.mark.parametrize("name", MODULES)
def test_tuned_constants_have_their_published_value_within_their_range(name: str) -> None:
    for axis in parts_of(technique(name), (), {}):
        assert isinstance(axis, Axis)
        assert axis.low <= axis.published <= axis.high


def test_the_talk_s_constants_are_declared_as_tuned() -> None:
    talks = ("indirect.talk", "shadow.soft_talk", "translucency.talk", "defocus.talk", "cornea.talk")
    declared = {part.name for name in talks for part in parts_of(technique(name), (), {})}
    assert {"c_height", "step_rad", "power", "near_start", "far_ramp", "kernel", "iris_curvature"} <= declared
