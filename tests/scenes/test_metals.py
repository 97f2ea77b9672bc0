"""Metals by name, and what is said of layered materials that cannot be."""

from collections.abc import Callable
from typing import Any, get_args

import numpy as np
import pytest

from scenes.errors import SceneError
from scenes.materials import MetalName
from scenes.metals import INDICES, refractive_index
from scenes.model import Scene

MakeScene = Callable[..., Scene]

SUIT: dict[str, Any] = {
    "type": "layered",
    "reflectance": [0.5, 0.5, 0.5],
    "metals": [{"metal": "Cr", "alpha": 0.2, "weight": 0.5}],
}


def test_every_metal_that_a_scene_may_name_has_its_indices() -> None:
    assert set(get_args(MetalName)) == set(INDICES)


@pytest.mark.parametrize("metal", get_args(MetalName))
def test_metals_mirror_most_light_straight_on(metal: MetalName) -> None:
    """Gold and copper less and less from red to blue; all others are nearly grey, tungsten with a half."""
    eta, k = refractive_index(metal)
    straight = ((eta - 1) ** 2 + k**2) / ((eta + 1) ** 2 + k**2)
    greys = {"Ag": 0.95, "Al": 0.92, "Cr": 0.67, "W": 0.5}
    if metal in greys:
        np.testing.assert_allclose(straight, greys[metal], atol=0.08)
    else:
        assert straight[0] > 0.9
        assert (np.diff(straight) < -0.1).all()


def test_shares_are_no_colours(make_scene: MakeScene) -> None:
    metal = SUIT["metals"][0] | {"weight": {"path": "share.png"}}
    with pytest.raises(
        SceneError, match=r"skin\.metals\[0\]\.weight\.color_space: found \"srgb\" .*allowed: \"linear\""
    ):
        make_scene(materials={"red": SUIT, "white": SUIT, "skin": SUIT | {"metals": [metal]}})


def test_a_texture_of_a_share_must_be_there(make_scene: MakeScene) -> None:
    metal = SUIT["metals"][0] | {"weight": {"path": "share.png", "color_space": "linear"}}
    with pytest.raises(SceneError, match=r"weight\.path: found the path \"share\.png\", where there is no file"):
        make_scene(materials={"red": SUIT, "white": SUIT, "skin": SUIT | {"metals": [metal]}})


def test_an_eye_has_no_layers(make_scene: MakeScene) -> None:
    eye = {
        "name": "ball",
        "type": "eye",
        "material": "skin",
        "iris": "skin",
        "sclera_radius": 1.0,
        "cornea_radius": 0.7,
        "limbus_radius": 0.5,
        "ior": 1.376,
    }
    with pytest.raises(
        SceneError, match=r'shapes.0..material: found the layered material "skin"; allowed: a diffuse one'
    ):
        make_scene(materials={"skin": SUIT}, shapes=[eye])
