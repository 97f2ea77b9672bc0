from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from scenes.errors import SceneError
from scenes.exr import write_exr
from scenes.features import Features, features_of
from scenes.geometry import geometry_of
from scenes.image import Image as ImageFile
from scenes.model import Scene

MATERIALS = {
    "white": {"type": "diffuse", "reflectance": [0.7, 0.7, 0.7]},
    "black": {"type": "diffuse", "reflectance": [0, 0, 0]},
    "skin": {"type": "translucent", "medium": "skin1"},
    "plastic": {"type": "layered", "reflectance": [0, 0, 0], "film": {"alpha": 0.1}},
    "lacquer": {"type": "principled", "base_color": [0, 0, 0]},
    "fibre": {"type": "fibre", "sigma_a": [0.1, 0.2, 0.3]},
}
SLAB = {"name": "slab", "type": "slab", "thickness": 1.0, "width": 100.0, "material": "skin"}
BALL = {"name": "ball", "type": "sphere", "detail": 2, "material": "skin"}
EYE = {
    "name": "eye",
    "type": "eye",
    "material": "white",
    "iris": "white",
    "ior": 1.376,
    "sclera_radius": 12.0,
    "cornea_radius": 7.8,
    "limbus_radius": 5.9,
    "detail": 32,
}
PANEL = {"name": "panel", "type": "rectangle", "size": [1, 1], "position": [0, 5, 0], "material": "black"}
SUN = {"type": "directional", "direction": [0, 0, -1], "irradiance": [1, 1, 1]}
SKY = {"type": "constant", "radiance": [1, 1, 1]}
HAIR = {"name": "fur", "on": "ball", "material": "fibre", "count": 5, "length": 0.1, "radius": 0.001}
LINE = {"type": "line", "start": [0, 0, -9], "end": [5, 0, -9], "radius": 0.1, "radiance": [1, 1, 1]}
PANEL_LIGHT = {"type": "area", "shape": "panel", "radiance": [1, 1, 1]}

Derive = Callable[..., Features]


@pytest.fixture
def derive(make_scene: Callable[..., Scene]) -> Derive:
    def features(
        shapes: list[dict[str, Any]], *emitters: dict[str, Any], subject: list[str] | None = None, **more: Any
    ) -> Features:
        judged = subject or [shapes[0]["name"]]
        scene = make_scene(materials=MATERIALS, shapes=shapes, emitters=list(emitters), subject=judged, **more)
        return features_of(scene, geometry_of(scene))

    return features


def test_a_slab_under_the_sun(derive: Derive) -> None:
    features = derive([SLAB], SUN)
    assert features.has_media
    assert features.subject_is_translucent
    assert features.subject_is_slab
    assert features.is_lit_by_directional_lights_alone
    assert features.is_body_alone
    assert features.subject_is_alone
    assert not features.has_eye


def test_two_bodies_are_no_slab_and_one_opaque_one_makes_the_subject_not_translucent(derive: Derive) -> None:
    features = derive([SLAB, BALL], SUN, SKY, subject=["slab", "ball"])
    assert features.subject_is_translucent
    assert not features.subject_is_slab
    assert not features.is_lit_by_directional_lights_alone
    features = derive([SLAB, {**BALL, "material": "white"}], subject=["slab", "ball"])
    assert features.has_media
    assert not features.subject_is_translucent
    assert not features.is_lit_by_directional_lights_alone
    assert not derive([{**SLAB, "material": "white"}]).subject_is_slab


def test_emitters_that_reflect_nothing_leave_a_body_alone(derive: Derive) -> None:
    features = derive([BALL, PANEL], PANEL_LIGHT, LINE)
    assert features.has_surface_lights
    assert features.is_body_alone
    assert not features.subject_is_alone
    assert not derive([BALL, PANEL], LINE).is_body_alone
    assert not derive([BALL, {**PANEL, "material": "white"}], PANEL_LIGHT).is_body_alone


def test_a_line_light_is_a_surface_light(derive: Derive) -> None:
    assert derive([BALL], LINE).has_surface_lights
    assert not derive([BALL], SUN).has_surface_lights


def test_an_eye_is_no_convex_subject_and_no_medium(derive: Derive) -> None:
    features = derive([EYE], SUN)
    assert features.has_eye
    assert not features.subject_is_convex
    assert not features.subject_is_translucent
    assert not features.has_media


def test_what_light_passes_reflects_nothing_diffusely(derive: Derive) -> None:
    assert derive([EYE, {**BALL, "position": [40, 0, 0]}], SUN).brightest_reflectance == 0
    assert derive([BALL, {**EYE, "position": [40, 0, 0]}], SUN).brightest_reflectance == 0.7


def test_black_surfaces_reflect_nothing(derive: Derive) -> None:
    assert derive([PANEL], PANEL_LIGHT).nothing_reflects
    assert not derive([PANEL, {**BALL, "material": "white"}], PANEL_LIGHT).nothing_reflects
    assert not derive([PANEL, BALL], PANEL_LIGHT).nothing_reflects


def test_one_omni_light_is_a_point_or_a_ball(derive: Derive) -> None:
    point = {"type": "point", "position": [0, 3, 0], "intensity": [1, 1, 1]}
    ball = {"type": "sphere", "position": [0, 3, 0], "radius": 0.1, "radiance": [1, 1, 1]}
    assert derive([PANEL], point, SKY).has_one_omni_light
    features = derive([PANEL], ball)
    assert features.has_one_omni_light
    assert features.has_sphere_light
    assert features.has_surface_lights
    assert not derive([PANEL], point, ball).has_one_omni_light
    assert not derive([PANEL], SUN, LINE).has_one_omni_light


@pytest.mark.parametrize("material", ["plastic", "lacquer"])
def test_layers_reflect_whatever_their_base(derive: Derive, material: str) -> None:
    features = derive([BALL, {**PANEL, "material": material}], SUN)
    assert features.brightest_reflectance == 1
    assert features.has_layers
    assert not features.is_body_alone
    assert not derive([{**PANEL, "material": material}]).nothing_reflects


def test_hair_is_something_beside_the_subject_and_reflects(derive: Derive, tmp_path: Path) -> None:
    black = {**BALL, "material": "black"}
    bald, hairy = derive([black], SUN), derive([black], SUN, hair=[HAIR])
    for features, is_bald in ((bald, True), (hairy, False)):
        assert features.subject_is_alone is is_bald
        assert features.is_body_alone is is_bald
        assert features.nothing_reflects is is_bald
    assert not hairy.has_painted_hair
    Image.new("RGB", (2, 2)).save(tmp_path / "paint.png")
    assert derive([black], SUN, hair=[HAIR | {"color": {"path": "paint.png"}}]).has_painted_hair


@pytest.mark.parametrize("key", ["density", "kill", "length_map", "weight"])
def test_a_texture_that_only_a_truth_reads_is_read_with_all_others(
    key: str, make_scene: Callable[..., Scene], tmp_path: Path
) -> None:
    """So that `lightgauge explain` says what is wrong with it."""
    write_exr(tmp_path / "odd.exr", ImageFile(np.full((2, 2, 3), 1.5, dtype=np.float32)))
    odd = {"path": "odd.exr", "color_space": "linear"}
    metal = {"metal": "Cr", "alpha": 0.1, "weight": odd if key == "weight" else 0.5}
    suit = {"type": "layered", "reflectance": [0, 0, 0], "metals": [metal]}
    scene = make_scene(
        materials=MATERIALS | {"suit": suit}, shapes=[BALL], hair=[HAIR | ({} if key == "weight" else {key: odd})]
    )
    with pytest.raises(SceneError, match=r"odd\.exr: found values from 1\.5 to 1\.5; allowed is 0 to 1"):
        features_of(scene, geometry_of(scene))
