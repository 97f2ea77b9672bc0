"""The registry of quantities."""

from collections.abc import Callable
from typing import Any

import pytest

from reference.quantities import EFFECTS, MODULES, effect_of, quantity
from scenes.errors import InputError
from scenes.features import features_of
from scenes.geometry import geometry_of
from scenes.materials import Fibre
from scenes.model import Scene
from scenes.shapes import Hair

SUN = {"type": "directional", "direction": [0, 0, -1], "irradiance": [1, 1, 1]}
LAMP = {"type": "sphere", "position": [0, 3, 0], "radius": 0.1, "radiance": [1, 1, 1]}
EYE = {
    "type": "eye",
    "iris": "skin",
    "ior": 1.3375,
    "sclera_radius": 12.0,
    "cornea_radius": 7.8,
    "limbus_radius": 5.9,
    "detail": 32,
}
SUBJECTS: list[tuple[dict[str, Any], dict[str, Any]]] = [
    ({"type": "diffuse", "reflectance": [0.5, 0.5, 0.5]}, {"type": "sphere", "detail": 1}),
    ({"type": "translucent", "medium": "skin1"}, {"type": "sphere", "detail": 1}),
    ({"type": "layered", "reflectance": [0, 0, 0], "film": {"alpha": 0.1}}, {"type": "sphere", "detail": 1}),
    ({"type": "diffuse", "reflectance": [0.5, 0.5, 0.5]}, EYE),
    (
        {"type": "diffuse", "reflectance": [0.5, 0.5, 0.5]},
        {"type": "relief", "size": [1.0, 1.0], "depth": 0.1, "heights": "bumps", "resolution": 8},
    ),
]
"""A material and a shape of it; each quantity is defined on one of them."""

OF_HAIR = {"hair_geometry", "hair_tangent", "hair_coverage", "hair_radiance", "full_radiance"}
WITHOUT_HAIR = {"depth", "normal", "albedo", "coverage", "emission", "receiver_coverage", "thickness"}
"""These say in the docstrings of their modules that they leave hair out."""


def test_every_quantity_belongs_to_one_effect() -> None:
    assert sorted(name for names in EFFECTS.values() for name in names) == sorted(MODULES)
    assert effect_of("iris_uv") == "eye"


@pytest.mark.parametrize("name", MODULES)
def test_every_quantity_goes_by_its_name(name: str) -> None:
    assert quantity(name).name == name


def test_an_unknown_quantity_is_refused_with_the_closest_name() -> None:
    with pytest.raises(InputError, match="Did you mean 'depth'"):
        quantity("dept")


@pytest.mark.parametrize("name", MODULES)
def test_hair_counts_or_is_left_out_in_words_or_makes_a_quantity_undefined(
    name: str, make_scene: Callable[..., Scene]
) -> None:
    bald = [
        make_scene(
            materials={"skin": material}, shapes=[shape | {"name": "it", "material": "skin"}], subject=["it"], **lit
        )
        for material, shape in SUBJECTS
        for lit in ({"emitters": [SUN]}, {"emitters": [LAMP]})
    ]
    hair = Hair(name="fur", on="it", material="fibre", count=5, length=0.1, radius=0.001)
    fibre = {"fibre": Fibre(type="fibre", sigma_a=(0.1, 0.2, 0.3))}
    hairy = [
        scene.model_copy(update={"hair": (hair,), "materials": scene.materials | fibre})
        for scene in bald
        if name in OF_HAIR or not quantity(name).refuses(features_of(scene, geometry_of(scene)))
    ]
    assert hairy
    answers = [quantity(name).refuses(features_of(scene, geometry_of(scene))) for scene in hairy]
    if name in OF_HAIR | WITHOUT_HAIR:
        assert "" in answers
    else:
        assert "" not in answers
