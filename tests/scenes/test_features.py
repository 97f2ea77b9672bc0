from collections.abc import Callable
from typing import Any

import pytest

from scenes.features import Features, features_of
from scenes.geometry import geometry_of
from scenes.model import Scene

MATERIALS = {
    "white": {"type": "diffuse", "reflectance": [0.7, 0.7, 0.7]},
    "black": {"type": "diffuse", "reflectance": [0, 0, 0]},
    "skin": {"type": "translucent", "medium": "skin1"},
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
LINE = {"type": "line", "start": [0, 0, -9], "end": [5, 0, -9], "radius": 0.1, "radiance": [1, 1, 1]}
PANEL_LIGHT = {"type": "area", "shape": "panel", "radiance": [1, 1, 1]}

Derive = Callable[..., Features]


@pytest.fixture
def derive(make_scene: Callable[..., Scene]) -> Derive:
    def features(shapes: list[dict[str, Any]], *emitters: dict[str, Any], subject: list[str] | None = None) -> Features:
        judged = subject or [shapes[0]["name"]]
        scene = make_scene(materials=MATERIALS, shapes=shapes, emitters=list(emitters), subject=judged)
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
