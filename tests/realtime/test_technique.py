import pytest

from realtime.technique import Parameter, Technique
from realtime.techniques import MODULES, technique
from reference.quantities import MODULES as QUANTITIES
from scenes.checks import SettingValue
from scenes.errors import InputError

MADE_UP = Technique(
    name="made.up",
    approximates="depth",
    summary="a technique for tests",
    source="none",
    limits="none",
    passes=lambda scene, features, settings: [],
    parameters=(
        Parameter("count", 4, (2, 4), "how many", (1, 8)),
        Parameter("width", 0.5, (0.5, 1.0), "how wide"),
        Parameter("on", True, (True, False), "whether"),
        Parameter("way", "long", ("long", "short"), "which"),
    ),
)


@pytest.mark.parametrize("name", MODULES)
def test_every_registered_technique_is_described(name: str) -> None:
    found = technique(name)
    assert found.name == name
    assert found.approximates in QUANTITIES
    assert all((found.summary, found.source, found.limits))
    for parameter in found.parameters:
        assert parameter.default in parameter.sweep
        assert all(
            parameter.bounds[0] <= value <= parameter.bounds[1]
            for value in parameter.sweep
            if not isinstance(value, str)
        )
        assert {type(value) for value in parameter.sweep} == {type(parameter.default)}


def test_an_unknown_technique_lists_the_known_ones_and_the_closest() -> None:
    with pytest.raises(InputError, match=r"Unknown technique 'indirect\.talkk'.*Did you mean 'indirect\.talk'\?"):
        technique("indirect.talkk")


def test_settings_are_the_defaults_where_nothing_is_given() -> None:
    assert MADE_UP.settings({}) == {"count": 4, "width": 0.5, "on": True, "way": "long"}
    assert MADE_UP.settings({"on": False, "way": "short"}) == {
        "count": 4,
        "width": 0.5,
        "on": False,
        "way": "short",
    }


def test_an_integer_is_a_number_where_a_float_is_expected() -> None:
    assert MADE_UP.settings({"width": 2})["width"] == 2


def test_an_unknown_setting_is_refused_with_the_known_ones() -> None:
    with pytest.raises(InputError, match=r"'made\.up' has no setting 'cuont'.*count, width, on, way"):
        MADE_UP.settings({"cuont": 3})


def test_a_text_that_is_no_choice_is_refused_with_the_choices() -> None:
    with pytest.raises(InputError, match=r"'way' of 'made\.up' is 'shrot'; allowed: 'long', 'short'\."):
        MADE_UP.settings({"way": "shrot"})


@pytest.mark.parametrize("count", [0, 9, -1])
def test_a_setting_out_of_bounds_is_refused_with_the_bounds(count: int) -> None:
    with pytest.raises(InputError, match=rf"Setting 'count' of 'made\.up' is {count}; 1 to 8 is allowed"):
        MADE_UP.settings({"count": count})


@pytest.mark.parametrize(
    ("name", "value"), [("count", 2.0), ("count", True), ("width", True), ("on", 1), ("width", "1")]
)
def test_a_setting_of_another_type_is_refused(name: str, value: SettingValue) -> None:
    with pytest.raises(InputError, match=f"Setting '{name}'"):
        MADE_UP.settings({name: value})
