"""Radiance of layered surfaces: the closed form against equations, path tracing and furnaces."""

import math
from collections.abc import Callable
from types import ModuleType
from typing import Any

import numpy as np
import pytest

from reference.estimator import Reference, seed_of
from reference.quantities import quantity
from reference.quantities.radiance import light_paths_block
from reference.stage import Stage, build_stage, pixel_grid
from scenes.errors import SceneError
from scenes.features import features_of
from scenes.geometry import geometry_of
from scenes.image import Float64
from scenes.metals import refractive_index
from scenes.model import PIXEL_GRID, Scene

MakeScene = Callable[..., Scene]
MakeReference = Callable[..., Reference]

ALPHA = 0.15
CHROMIUM: dict[str, Any] = {
    "type": "layered",
    "reflectance": [0.0, 0.0, 0.0],
    "metals": [{"metal": "Cr", "alpha": ALPHA, "weight": 1.0}],
}
SUIT: dict[str, Any] = {
    "type": "layered",
    "reflectance": [0.5, 0.2, 0.1],
    "film": {"alpha": 0.35},
    "metals": [{"metal": "Cr", "alpha": 0.15, "weight": 0.3}],
}
COATED: dict[str, Any] = {
    "type": "principled",
    "base_color": [0.3, 0.2, 0.1],
    "roughness": 0.4,
    "clearcoat": 1.0,
    "metallic": 0.3,
}
BALL: dict[str, Any] = {"name": "ball", "type": "sphere", "radius": 1.0, "material": "suit"}
SUN: dict[str, Any] = {"type": "directional", "direction": [-0.5, -0.6, -0.7], "irradiance": [3.0, 2.0, 1.0]}
LAMP: dict[str, Any] = {"type": "point", "position": [2.0, -1.0, 3.0], "intensity": [10.0, 20.0, 30.0]}
SENSOR: dict[str, Any] = {
    "type": "perspective",
    "origin": [0.0, 0.0, 5.0],
    "target": [0.0, 0.0, 0.0],
    "fov_deg": 25.0,
    "width": 16,
    "height": 16,
}

MakeSuit = Callable[..., Scene]


@pytest.fixture
def suit(make_scene: MakeScene) -> MakeSuit:
    """A ball of a material, lit by emitters."""

    def make(material: dict[str, Any], *emitters: dict[str, Any], **more: Any) -> Scene:
        given = {"sensor": SENSOR, "materials": {"suit": material}, "shapes": [BALL], "emitters": list(emitters)}
        return make_scene(**given | more)

    return make


def chromium(N: Float64, V: Float64, L: Float64) -> Float64:
    """Reflected radiance per unit of irradiance (N, 3) of rough chromium: Walter et al. 2007, equations 20, 33, 34."""
    H = (V + L) / np.linalg.norm(V + L, axis=1, keepdims=True)
    cos_i, cos_o, cos_h, d = (np.sum(a * b, axis=1) for a, b in ((N, V), (N, L), (N, H), (V, H)))
    D = ALPHA**2 / (math.pi * (cos_h**2 * (ALPHA**2 - 1) + 1) ** 2)
    G1 = [2 / (1 + np.sqrt(1 + ALPHA**2 * (1 / np.maximum(c, 1e-9) ** 2 - 1))) for c in (cos_i, cos_o)]
    eta, k = refractive_index("Cr")
    n = eta + 1j * k
    inside = np.sqrt(n**2 - 1 + d[:, None] ** 2)
    s, p = ((d[:, None] * m - inside) / (d[:, None] * m + inside) for m in (1, n**2))
    F = (np.abs(s) ** 2 + np.abs(p) ** 2) / 2
    seen = (cos_i > 0) & (cos_o > 0)
    return np.where(seen[:, None], F * (D * G1[0] * G1[1] / (4 * np.maximum(cos_i, 1e-9)))[:, None], 0.0)


def test_chromium_under_a_sun_and_a_lamp_is_what_equations_say(suit: MakeSuit, mi: ModuleType) -> None:
    """At the places that rays meet, in double precision from there on."""
    scene = suit(CHROMIUM, SUN, LAMP)
    stage = build_stage(mi, scene, geometry_of(scene))
    found = exact_image(scene, stage)
    x, y = pixel_grid(16, range(16), PIXEL_GRID)
    si = stage.scene.ray_intersect(stage.rays(mi.Float(x), mi.Float(y)))
    P, N, face = (np.array(v, dtype=np.float64).T for v in (si.p, si.sh_frame.n, si.n))
    V = SENSOR["origin"] - P
    V /= np.linalg.norm(V, axis=1, keepdims=True)
    total = np.zeros((len(P), 3))
    away = LAMP["position"] - P
    distance = np.linalg.norm(away, axis=1, keepdims=True)
    sun = -np.array(SUN["direction"]) / np.linalg.norm(SUN["direction"])
    for L, irradiance in (
        (np.broadcast_to(sun, P.shape), np.array(SUN["irradiance"])),
        (away / distance, np.array(LAMP["intensity"]) / distance**2),
    ):
        faces = np.sum(face * L, axis=1) > 0
        total += np.where(faces[:, None], chromium(N, V, L) * irradiance, 0.0)
    total[~np.array(si.is_valid())] = 0.0
    exact = total.reshape(16, 16, PIXEL_GRID**2, 3).mean(axis=2)
    error = np.mean((found - exact) ** 2 / (exact**2 + (1e-2 * exact.mean()) ** 2))
    assert error < 1e-11


def exact_image(scene: Scene, stage: Stage) -> Float64:
    integrator = quantity("layered_radiance").integrator(features_of(scene, geometry_of(scene)))
    assert integrator.exact is not None
    return integrator.exact(stage).astype(np.float64)


@pytest.mark.parametrize("material", [SUIT, COATED], ids=["layers", "principled"])
def test_the_closed_form_is_what_path_tracing_finds(suit: MakeSuit, mi: ModuleType, material: dict[str, Any]) -> None:
    """Light of the sun and a lamp behind: what is left out for a convex subject on its own is nothing."""
    scene = suit(material, SUN, LAMP | {"position": [-4.0, 1.0, -1.0]})
    stage = build_stage(mi, scene, geometry_of(scene))
    covered = np.flatnonzero(np.hypot(*(np.mgrid[:16, :16] - 7.5)) < 5.5)
    expected = exact_image(scene, stage).reshape(256, 3)[covered].mean(axis=0)
    blocks = [light_paths_block(0, None, stage, covered, seed_of("layers", k), 512) for k in range(8)]
    means = np.stack(blocks).mean(axis=1)
    error = means.std(axis=0, ddof=1) / np.sqrt(8)
    assert (error < 0.01 * expected).all()
    assert (np.abs(means.mean(axis=0) - expected) < 5 * error).all()


@pytest.mark.slow
def test_a_small_ball_of_light_is_a_point(suit: MakeSuit, reference: MakeReference) -> None:
    radius, place = 0.02, LAMP["position"]
    intensity = math.pi * radius**2 * 5000.0
    ball = suit(SUIT, {"type": "sphere", "position": place, "radius": radius, "radiance": [5000.0] * 3})
    sampled = reference(ball).truth("layered_radiance", 512)
    assert not sampled.is_exact
    point = suit(SUIT, LAMP | {"intensity": [intensity] * 3})
    exact = reference(point).truth("layered_radiance", 0)
    assert exact.is_exact
    means = sampled.accumulators[:, sampled.mask].astype(float).mean(axis=1)
    error = means.std(axis=0, ddof=1) / np.sqrt(len(means))
    expected = exact.accumulators[0, exact.mask].astype(float).mean(axis=0)
    assert (error < 0.02 * expected).all()
    np.testing.assert_allclose(means.mean(axis=0), expected, atol=float(5 * error.max()))


def test_a_plate_under_an_even_sky_shows_its_albedo(suit: MakeSuit, mi: ModuleType) -> None:
    """Radiance 1 from everywhere: what is seen is the part of light that facets reflect once, by quadrature."""
    plate = {"name": "ball", "type": "rectangle", "size": [2.0, 2.0], "material": "suit"}
    tilt = math.radians(60)
    sensor = SENSOR | {"origin": [5 * math.sin(tilt), 0.0, 5 * math.cos(tilt)], "fov_deg": 0.5, "width": 4, "height": 4}
    sky = {"type": "constant", "radiance": [1.0, 1.0, 1.0]}
    scene = suit(CHROMIUM, sky, shapes=[plate], sensor=sensor)
    stage = build_stage(mi, scene, geometry_of(scene))
    blocks = [light_paths_block(0, None, stage, np.arange(16), seed_of("sky", k), 1024) for k in range(8)]
    means = np.stack(blocks).mean(axis=1)
    z, weight = np.polynomial.legendre.leggauss(256)
    z, weight = (z + 1) / 2, weight / 2
    phi = (np.arange(512) + 0.5) / 512 * 2 * math.pi
    s = np.sqrt(1 - z**2)[:, None]
    L = np.stack([s * np.cos(phi), s * np.sin(phi), np.broadcast_to(z[:, None], (256, 512))], axis=-1).reshape(-1, 3)
    V = np.broadcast_to([math.sin(tilt), 0.0, math.cos(tilt)], L.shape)
    N = np.broadcast_to([0.0, 0.0, 1.0], L.shape)
    albedo = (chromium(N, V, L) * np.repeat(weight * 2 * math.pi / 512, 512)[:, None]).sum(axis=0)
    error = means.std(axis=0, ddof=1) / np.sqrt(8)
    assert (error < 0.002).all()
    assert (np.abs(means.mean(axis=0) - albedo) < 5 * error).all()
    assert (albedo < 1).all()


@pytest.mark.slow
def test_a_lambertian_ball_is_what_radiance_says(suit: MakeSuit, reference: MakeReference) -> None:
    scene = suit({"type": "diffuse", "reflectance": [0.5, 0.2, 0.1]}, SUN)
    exact = reference(scene).truth("layered_radiance", 0).accumulators[0]
    truth = reference(scene).truth("radiance", 1024)
    means = truth.accumulators[:, truth.mask].astype(float).mean(axis=1)
    error = means.std(axis=0, ddof=1) / np.sqrt(len(means))
    assert (np.abs(means.mean(axis=0) - exact[truth.mask].mean(axis=0)) < 5 * error).all()


def test_layered_surfaces_have_no_albedo_in_parity(suit: MakeSuit, reference: MakeReference) -> None:
    """On the other side neither: what they reflect is no number."""
    for material in (SUIT, COATED):
        assert (reference(suit(material, SUN)).truth("albedo", 0).accumulators == 0).all()


def test_the_cheapest_sufficient_way_is_chosen(suit: MakeSuit, make_scene: MakeScene) -> None:
    sky = {"type": "constant", "radiance": [1.0, 1.0, 1.0]}
    box = {"name": "box", "type": "box", "size": [9.0, 0.1, 9.0], "position": [0.0, -1.2, 0.0], "material": "suit"}
    expected = {
        "closed form: 0": suit(SUIT),
        "closed form: reflected lights": suit(SUIT, SUN, LAMP),
        "direct light only": suit(SUIT, SUN, sky),
        "path tracing": suit(SUIT, SUN, shapes=[BALL, box]),
    }
    for name, scene in expected.items():
        chosen = quantity("layered_radiance").integrator(features_of(scene, geometry_of(scene)))
        assert chosen.name == name


def test_bodies_that_light_enters_are_refused(suit: MakeSuit, reference: MakeReference) -> None:
    skin = {"type": "translucent", "sigma_a": [1.0, 1.0, 1.0], "sigma_s": [1.0, 1.0, 1.0]}
    with pytest.raises(SceneError, match=r"layered_radiance is not defined here: .* translucent body, an eye or hair"):
        reference(suit(skin, SUN)).truth("layered_radiance", 16)


def test_other_radiance_refuses_layers(suit: MakeSuit, reference: MakeReference) -> None:
    with pytest.raises(SceneError, match=r"radiance is not defined here: .* layered material"):
        reference(suit(SUIT, SUN)).truth("radiance", 16)
