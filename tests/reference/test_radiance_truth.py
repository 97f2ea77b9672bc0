"""Radiance against closed forms, and against Mitsuba's own path tracer."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest

from reference.estimator import Reference, Truth, seed_of
from reference.integrators.ray_casts import mean_over_pixels
from reference.quantities.radiance import indirect_block, light_paths_block
from reference.stage import Stage, build_stage
from scenes.exr import write_exr
from scenes.geometry import geometry_of
from scenes.image import Float64, Image
from scenes.model import Scene

MakeScene = Callable[..., Scene]
MakeReference = Callable[..., Reference]
MakeCavity = Callable[..., dict[str, Any]]

GREY = {"type": "diffuse", "reflectance": [0.6, 0.6, 0.6]}
POINT = {"type": "point", "position": [0.4, 0.9, 1.2], "intensity": [2.0, 2.0, 2.0]}
INDIRECT = "indirect_radiance"
BALL = {"name": "ball", "type": "sphere", "radius": 0.5, "detail": 5, "material": "skin"}


STANDARD_ERRORS = 5
"""Known from 8 to 16 estimates, they are exceeded by chance in one of a thousand tests; 3 would be in one of thirty."""


def close_up(distance: float, fov_deg: float) -> dict[str, Any]:
    """Looks at the origin from the side, so that the subject fills the image."""
    direction = np.array([0.48, 0.6, 0.64])
    return {
        "type": "perspective",
        "origin": (distance * direction).tolist(),
        "target": [0.0, 0.0, 0.0],
        "fov_deg": fov_deg,
        "width": 16,
        "height": 16,
    }


def diffuse(*reflectance: float) -> dict[str, Any]:
    return {"type": "diffuse", "reflectance": list(reflectance)}


def assert_agrees(estimates: Float64, exact: Float64, most: float) -> None:
    """Means (K, 3) of independent estimates against a value: to STANDARD_ERRORS, and to a relative error of `most`.

    The standard error must be so small that three of it are less than `most`.
    """
    mean, error = estimates.mean(axis=0), estimates.std(axis=0, ddof=1) / np.sqrt(len(estimates))
    assert (3 * error < most * mean).all(), f"too noisy to tell: {error / mean}"
    np.testing.assert_allclose(mean, exact, rtol=most)
    assert (np.abs(mean - exact) < STANDARD_ERRORS * error).all(), f"off by {(mean - exact) / error} standard errors"


def means(truth: Truth) -> Float64:
    """Mean over the judged pixels of each accumulator, (K, 3)."""
    found: Float64 = truth.accumulators[:, truth.mask].astype(float).mean(axis=1)
    return found


@pytest.mark.slow
def test_a_sphere_in_a_glowing_one(make_scene: MakeScene, make_cavity: MakeCavity, reference: MakeReference) -> None:
    """Two zones, all uniform: of what leaves the outer sphere, F = (r/R)² reaches the inner one, the rest itself.

    B = pi Le + rho B ((1 - F) + F a), so B = pi Le / (1 - rho ((1 - F) + F a)); the inner sphere shows
    a (B - pi Le) / pi beyond its direct light. Each colour channel has its own numbers.
    """
    rho, a, emitted = np.array([0.2, 0.5, 0.7]), np.array([0.9, 0.6, 0.3]), np.array([1.0, 2.0, 0.5])
    scene = make_scene(
        sensor=close_up(0.85, 30.0),
        materials={"wall": diffuse(*rho), "skin": diffuse(*a)},
        shapes=[make_cavity(1.0, "wall"), BALL],
        emitters=[{"type": "area", "shape": "cavity", "radiance": emitted.tolist()}],
    )
    truth = reference(scene).truth("indirect_radiance", 8192)
    assert truth.mask.all()
    F = 0.5**2
    leaving = np.pi * emitted / (1 - rho * ((1 - F) + F * a))
    assert_agrees(means(truth), a * (leaving - np.pi * emitted) / np.pi, most=0.005)


def estimates_of(stage: Stage, spp: int, count: int = 8) -> Float64:
    """Mean over the image of independent blocks, (count, 3). The subject must fill the image."""
    assert (mean_over_pixels(stage, lambda hit: [hit.stage.mi.Float(hit.valid)]) == 1).all()
    pixels = np.arange(stage.width * stage.height)
    seeds = [seed_of("test", k) for k in range(count)]
    return np.stack([indirect_block(stage, pixels, seed, spp, None).mean(axis=0) for seed in seeds])


def test_a_white_furnace(make_scene: MakeScene, mi: ModuleType) -> None:
    """All surfaces reflect rho and emit Le, so radiance is Le / (1 - rho) everywhere.

    Less what the subject emits, Le, and what it reflects of emitted light, rho Le: indirect light is
    Le rho² / (1 - rho). The subject is two boxes that face each other, so it also reflects onto itself.
    """
    rho, emitted = np.array([0.3, 0.6, 0.9]), (0.7, 1.0, 0.2)
    crate = {"type": "box", "size": [0.6, 0.9, 0.5], "material": "all", "rotation_deg": [20.0, 30.0, 0.0]}
    scene = make_scene(
        sensor=close_up(1.2, 8.0),
        materials={"all": diffuse(*rho)},
        subject=["ball", "other"],
        shapes=[
            {"name": "room", "type": "room", "size": [3.0, 2.5, 3.0], "material": "all"},
            crate | {"name": "ball", "position": [0.0, 0.0, -0.2]},
            crate | {"name": "other", "position": [-0.1, -0.5, 0.4]},
        ],
        emitters=[],
    )
    glowing = tuple(replace(mesh, radiance=emitted) for mesh in geometry_of(scene))
    made = estimates_of(build_stage(mi, scene, glowing), spp=128)
    assert_agrees(made, np.array(emitted) * rho**2 / (1 - rho), most=0.01)


def test_an_integrating_sphere_lit_from_its_centre(
    make_scene: MakeScene, make_cavity: MakeCavity, reference: MakeReference
) -> None:
    """B = rho I / (R² (1 - rho)). The ball, with r/R = 1/20, disturbs this by about (r/R)² = 0.25 %."""
    rho = np.array([0.2, 0.5, 0.8])
    sensor = close_up(0.3, 6.0) | {"origin": [0.6, 0.3, 0.5], "target": [0.0, 0.0, 0.5]}
    scene = make_scene(
        sensor=sensor,
        materials={"wall": diffuse(*rho), "skin": GREY},
        shapes=[make_cavity(1.0, "wall"), BALL | {"radius": 0.05, "position": [0.0, 0.0, 0.5]}],
        emitters=[POINT | {"position": [0.0, 0.0, 0.0]}],
    )
    truth = reference(scene).truth("indirect_radiance", 1024)
    np.testing.assert_allclose(means(truth).mean(axis=0), 0.6 * 2 * rho / (1 - rho) / np.pi, rtol=0.01)


def test_the_first_few_samples_are_as_right_as_many(
    make_scene: MakeScene, make_cavity: MakeCavity, reference: MakeReference
) -> None:
    """Blocks of few samples: samplers that stratify too few of them are biased by whole percents."""
    scene = make_scene(
        sensor=close_up(0.85, 30.0) | {"width": 48, "height": 48},
        materials={"wall": GREY, "skin": GREY},
        shapes=[make_cavity(1.0, "wall"), BALL],
        emitters=[{"type": "area", "shape": "cavity", "radiance": [1.0, 1.0, 1.0]}],
    )
    F, rho, a = 0.5**2, 0.6, 0.6
    exact = a * (1 / (1 - rho * ((1 - F) + F * a)) - 1)
    assert_agrees(means(reference(scene).truth("indirect_radiance", 64)), np.full(3, exact), most=0.01)


@pytest.mark.parametrize("light", [POINT, {"type": "area", "shape": "room", "radiance": [1.0, 1.0, 1.0]}])
def test_black_surroundings_reflect_nothing(
    make_scene: MakeScene, reference: MakeReference, light: dict[str, Any]
) -> None:
    room = {"name": "room", "type": "room", "size": [3.0, 2.5, 3.0], "material": "black"}
    scene = make_scene(
        sensor=close_up(1.2, 30.0),
        materials={"black": diffuse(0.0, 0.0, 0.0), "skin": GREY},
        shapes=[room, BALL],
        emitters=[light],
    )
    assert not reference(scene).truth("indirect_radiance", 64).accumulators.any()


@pytest.mark.parametrize(
    "light",
    [
        {"type": "constant", "radiance": [1.0, 1.0, 1.0]},
        {"type": "directional", "direction": [0.0, -1.0, -1.0], "irradiance": [1.0] * 3},
    ],
    ids=["constant", "directional"],
)
def test_paths_find_no_indirect_light_on_a_convex_subject_alone(
    make_scene: MakeScene, mi: ModuleType, light: dict[str, Any]
) -> None:
    """A box: its faces are flat, whereas points of a smooth mesh see a little of it above their tangent plane."""
    crate = {"name": "ball", "type": "box", "size": [0.7, 0.7, 0.7], "material": "skin"}
    scene = make_scene(sensor=close_up(1.5, 5.0), materials={"skin": GREY}, shapes=[crate], emitters=[light])
    assert not estimates_of(build_stage(mi, scene, geometry_of(scene)), spp=64, count=2).any()


def test_a_smooth_convex_subject_is_hardly_lit_by_itself(make_scene: MakeScene, mi: ModuleType) -> None:
    """Some paths leave on the side of the smooth normal but below the facet: less than a thousandth of direct light."""
    scene = make_scene(
        sensor=close_up(1.5, 20.0),
        materials={"skin": GREY},
        shapes=[BALL],
        emitters=[{"type": "constant", "radiance": [1.0, 1.0, 1.0]}],
    )
    assert estimates_of(build_stage(mi, scene, geometry_of(scene)), spp=64).mean() < 1e-3 * 0.6


def test_emission_of_the_subject_itself_is_left_out(make_scene: MakeScene, mi: ModuleType) -> None:
    """Neither as what is seen nor as what falls on another part of it directly, but after a bounce it counts."""
    dark = make_scene(
        sensor=close_up(1.2, 30.0),
        materials={"white": diffuse(0.0, 0.0, 0.0), "red": diffuse(0.0, 0.0, 0.0), "skin": GREY},
        shapes=[{"name": "room", "type": "room", "size": [3.0, 2.5, 3.0], "material": "white"}, BALL],
        emitters=[],
    )
    meshes = tuple(replace(m, radiance=(1.0, 1.0, 1.0)) if m.is_subject else m for m in geometry_of(dark))
    assert estimates_of(build_stage(mi, dark, meshes), spp=16, count=2).max() < 1e-3
    white = tuple(m if m.is_subject else replace(m, material=dark.materials["skin"]) for m in meshes)
    assert estimates_of(build_stage(mi, dark, white), spp=16, count=2).min() > 0.01


DEPTHS = {"radiance": (-1, None), "direct_radiance": (2, 1), "indirect_radiance": (-1, 2)}
"""Quantities as differences of Mitsuba's `path`, whose depth 1 is emitted, 2 is emitted and direct light."""


def path_estimates(stage: Stage, name: str, spp: int, count: int = 8) -> Float64:
    """A quantity by Mitsuba's own path tracer: means of the image, (count, 3)."""
    mi = stage.mi
    depths = [depth for depth in DEPTHS[name] if depth is not None]
    integrators = [mi.load_dict({"type": "path", "max_depth": depth}) for depth in depths]
    images = []
    for k in range(count):
        whole, *less = (
            np.array(mi.render(stage.scene, integrator=i, spp=spp, seed=seed_of("path", k))).astype(float)
            for i in integrators
        )
        images.append((whole - sum(less)).mean(axis=(0, 1)))
    return np.stack(images)


ROOM = {"name": "room", "type": "room", "size": [3.0, 2.5, 3.0], "material": "white", "walls": {"left": "red"}}
FLOOR = {
    "name": "floor",
    "type": "rectangle",
    "size": [6.0, 5.0],
    "position": [0.0, -0.7, 0.0],
    "rotation_deg": [-90.0, 0.0, 0.0],
    "material": "red",
}
CRATE = {"name": "ball", "type": "box", "size": [0.8, 0.9, 0.7], "rotation_deg": [0.0, 20.0, 0.0], "material": "white"}
KNOT = {"name": "ball", "type": "torus_knot", "radius": 0.4, "tube": 0.16, "material": "white"}
DISK = {
    "type": "disk",
    "position": [0.2, 1.2, 0.3],
    "normal": [0.0, -1.0, 0.1],
    "radius": 0.3,
    "radiance": [9.0, 8.0, 7.0],
}
SKY = {"type": "constant", "radiance": [0.4, 0.6, 1.0]}
SUN = {"type": "directional", "direction": [0.4, -1.0, -0.3], "irradiance": [2.0, 1.8, 1.5]}
CASES: dict[str, list[dict[str, Any]]] = {
    "point light in a room": [ROOM, CRATE, POINT],
    "disk light in a room": [ROOM, CRATE, DISK],
    "sky over a floor": [FLOOR, CRATE, SKY],
}
SLOW_CASES: dict[str, list[dict[str, Any]]] = {
    "glowing walls": [ROOM, CRATE, {"type": "area", "shape": "room", "radiance": [1.0, 0.8, 0.6]}],
    "sun and sky over a floor": [FLOOR, CRATE, SUN, SKY],
    "picture of a sky over a floor": [FLOOR, CRATE, {"type": "environment", "path": "sky.exr", "scale": 0.5}],
    "knot in a room": [ROOM, KNOT, POINT, DISK],
}


@pytest.mark.parametrize(
    "things",
    [*CASES.values(), *(pytest.param(things, marks=pytest.mark.slow) for things in SLOW_CASES.values())],
    ids=[*CASES, *SLOW_CASES],
)
def test_it_is_what_the_path_tracer_finds_beyond_direct_light(
    make_scene: MakeScene, mi: ModuleType, tmp_path: Path, things: list[dict[str, Any]]
) -> None:
    sky = np.random.default_rng(3).gamma(0.5, 2.0, (8, 16, 3)).astype(np.float32)
    write_exr(tmp_path / "sky.exr", Image(sky))
    scene = make_scene(
        sensor=close_up(1.2, 20.0),
        materials={"white": diffuse(0.7, 0.7, 0.7), "red": diffuse(0.6, 0.2, 0.1)},
        shapes=[thing for thing in things if "name" in thing],
        emitters=[thing for thing in things if "name" not in thing],
    )
    stage = build_stage(mi, scene, geometry_of(scene))
    spp = 1024 if ROOM not in things else 512 if KNOT in things else 256
    assert_same(estimates_of(stage, spp), path_estimates(stage, INDIRECT, spp))


def assert_same(own: Float64, path: Float64) -> None:
    """Independent estimates (8, 3) of one thing by two integrators."""
    error = np.sqrt((own.var(axis=0, ddof=1) + path.var(axis=0, ddof=1)) / 8)
    difference = own.mean(axis=0) - path.mean(axis=0)
    assert (error < 0.004 * path.mean(axis=0)).all(), f"too noisy to tell: {error / path.mean(axis=0)}"
    assert (np.abs(difference) <= STANDARD_ERRORS * error).all(), f"{difference / error} standard errors"
    assert (np.abs(difference) < 0.01 * path.mean(axis=0)).all()


ROOMY: dict[str, Any] = {"shapes": [ROOM, CRATE], "emitters": [POINT, DISK]}
LONELY_BOX: dict[str, Any] = {"shapes": [CRATE], "emitters": [SUN, SKY]}
LONELY_BALL: dict[str, Any] = {"shapes": [BALL], "emitters": [SKY]}


@pytest.mark.parametrize(
    ("name", "things", "chosen"),
    [
        ("radiance", ROOMY, "path tracing"),
        ("direct_radiance", ROOMY, "direct light only"),
        ("indirect_radiance", ROOMY, "indirect-only path tracing"),
        ("radiance", LONELY_BOX, "direct light only"),
        ("direct_radiance", LONELY_BOX, "direct light only"),
        ("radiance", LONELY_BALL, "closed form: reflectance times sky"),
        ("direct_radiance", LONELY_BALL, "closed form: reflectance times sky"),
    ],
)
def test_the_cheapest_integrator_that_suffices_is_equal_to_the_general_one(
    make_scene: MakeScene, reference: MakeReference, mi: ModuleType, name: str, things: dict[str, Any], chosen: str
) -> None:
    materials = {"white": diffuse(0.7, 0.7, 0.7), "red": diffuse(0.6, 0.2, 0.1), "skin": diffuse(0.8, 0.5, 0.3)}
    scene = make_scene(sensor=close_up(1.2, 20.0), materials=materials, **things)
    truth = reference(scene).truth(name, 4096)
    assert truth.integrator.name == chosen
    assert truth.mask.all()
    stage = build_stage(mi, scene, geometry_of(scene))
    own = means(truth).reshape(-1, 2, 3).mean(axis=1) if not truth.is_exact else np.repeat(means(truth), 8, axis=0)
    assert_same(own, path_estimates(stage, name, 256))


@pytest.mark.parametrize(
    ("things", "why"),
    [
        ({"shapes": [ROOM, CRATE], "emitters": []}, "no emitter is present"),
        (LONELY_BOX, "a convex subject on its own: what it reflects never comes back"),
    ],
)
def test_light_that_cannot_be_is_not_sampled(
    make_scene: MakeScene, reference: MakeReference, mi: ModuleType, things: dict[str, Any], why: str
) -> None:
    scene = make_scene(sensor=close_up(1.2, 20.0), materials={"white": GREY, "red": GREY}, **things)
    truth = reference(scene).truth(INDIRECT, 64)
    assert (truth.integrator.why, truth.is_exact) == (why, True)
    assert not truth.accumulators.any()
    assert not estimates_of(build_stage(mi, scene, geometry_of(scene)), spp=64, count=2).any()


@pytest.mark.slow
def test_direct_and_indirect_light_add_up_to_all_light(make_scene: MakeScene, reference: MakeReference) -> None:
    scene = make_scene(sensor=close_up(1.2, 20.0), materials={"white": diffuse(0.7, 0.7, 0.7), "red": GREY}, **ROOMY)
    made = reference(scene)
    whole, direct, indirect = (means(made.truth(name, 4096)).reshape(-1, 2, 3).mean(axis=1) for name in DEPTHS)
    assert_same(direct + indirect, whole)


def test_clamping_spares_what_the_sensor_sees_directly(make_scene: MakeScene, mi: ModuleType) -> None:
    scene = make_scene(sensor=close_up(1.2, 20.0), materials={"skin": GREY}, shapes=[BALL], emitters=[])
    glowing = tuple(replace(mesh, radiance=(9.0, 9.0, 9.0)) for mesh in geometry_of(scene))
    stage = build_stage(mi, scene, glowing)
    made = light_paths_block(0, None, stage, np.arange(16), 1, 4, 0.5)
    assert made[:, :3].min() > 8.99
    assert made[:, :3].max() <= 9.5 + 1e-5
