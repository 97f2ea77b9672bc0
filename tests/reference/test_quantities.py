"""The registry of quantities."""

import pytest

from reference.quantities import EFFECTS, MODULES, effect_of, quantity
from scenes.errors import InputError


def test_every_quantity_belongs_to_one_effect() -> None:
    assert sorted(name for names in EFFECTS.values() for name in names) == sorted(MODULES)
    assert effect_of("iris_uv") == "eye"


@pytest.mark.parametrize("name", MODULES)
def test_every_quantity_goes_by_its_name(name: str) -> None:
    assert quantity(name).name == name


def test_an_unknown_quantity_is_refused_with_the_closest_name() -> None:
    with pytest.raises(InputError, match="Did you mean 'depth'"):
        quantity("dept")
