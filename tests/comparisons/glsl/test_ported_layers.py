"""The shader functions of layered materials, run in double precision, against Mitsuba's materials."""

import json
import math
from collections.abc import Callable
from types import ModuleType
from typing import Any

import numpy as np
import pytest

from comparisons.glsl.values import Value
from comparisons.stress.examination import program_of
from realtime.film import COSINES, film_table
from realtime.layers import principled_uniforms
from reference.layers import layered_dict
from reference.to_mitsuba import instantiate
from scenes.image import Float32, Float64
from scenes.materials import Layered, Principled, Texture
from scenes.metals import refractive_index

PORTED = 1e-10
"""Relative mean squared error that a port may have."""
COUNT = 4096

Evaluate = Callable[[Layered | Principled, Float64, Float64], Float64]


@pytest.fixture
def by_mitsuba(mi: ModuleType) -> Evaluate:
    """The BRDF times the cosine (N, 3) for directions (N, 3) about +z."""
    import drjit as dr

    def run(material: Layered | Principled, V: Float64, L: Float64) -> Float64:
        ball = {"type": "sphere", "bsdf": layered_dict(material, no_texture)}
        bsdf = instantiate(mi, {"type": "scene", "shape": ball}).shapes()[0].bsdf()
        si = dr.zeros(mi.SurfaceInteraction3f, len(V))
        si.wi = mi.Vector3f(V.T.astype(np.float32))
        return np.array(bsdf.eval(mi.BSDFContext(), si, mi.Vector3f(L.T.astype(np.float32))), dtype=np.float64).T

    return run


def no_texture(texture: Texture) -> Float32:
    raise AssertionError("nothing here has a texture")


def directions(seed: int) -> Float64:
    """(N, 3), uniform over the upper hemisphere, as float32 has them."""
    rng = np.random.default_rng(seed)
    z, phi = rng.uniform(0.005, 1.0, COUNT), rng.uniform(0.0, 2 * math.pi, COUNT)
    s = np.sqrt(1 - z**2)
    return np.stack([s * np.cos(phi), s * np.sin(phi), z], axis=1).astype(np.float32).astype(float)


def shader(file: str, function: str, **inputs: Value) -> Float64:
    """A function of glsl/lib in double precision; what is constant is given once."""
    arrays = {name: repeated(value) for name, value in inputs.items()}
    return np.asarray(program_of(f"lib/{file}").evaluate(function, arrays, np.float64).outputs["return"], np.float64)


def repeated(value: Any) -> Value:
    if isinstance(value, dict):
        return {name: repeated(part) for name, part in value.items()}
    array = np.asarray(value, dtype=np.float64)
    return array if array.ndim and len(array) == COUNT else np.broadcast_to(array, (COUNT, *array.shape)).copy()


def frame_of(V: Float64, L: Float64) -> dict[str, Float64]:
    H = (V + L) / np.linalg.norm(V + L, axis=1, keepdims=True)
    return {"N": np.broadcast_to([0.0, 0.0, 1.0], V.shape).copy(), "V": V, "L": L, "H": H}


def by_shader(material: Layered | Principled, V: Float64, L: Float64) -> Float64:
    """What layered/material.glsl puts together."""
    facets = frame_of(V, L)
    if isinstance(material, Principled):
        uniforms = {name.partition(".")[2]: value for name, value in principled_uniforms(material).items()}
        return shader("burley.glsl", "burley_reflection", m=uniforms, **facets, wider=0.0)
    value = base_by_shader(material, facets)
    cos_d = np.sum(V * facets["H"], axis=1)
    for metal in material.metals:
        assert isinstance(metal.weight, float)
        eta, k = refractive_index(metal.metal)
        F = shader("fresnel_metal.glsl", "F_conductor", cos_i=cos_d, eta=eta, k=k)
        flakes = shader("ggx.glsl", "ggx_reflection", **facets, alpha=metal.alpha)
        value = (1 - metal.weight) * value + metal.weight * F * flakes[:, None]
    return value


def base_by_shader(material: Layered, facets: dict[str, Float64]) -> Float64:
    albedo, film, cos_o = np.array(material.reflectance), material.film, facets["L"][:, 2]
    if film is None:
        return np.asarray(albedo / math.pi * cos_o[:, None])
    table = film_table(film.alpha, film.ior)
    nodes = np.linspace(0.0, 1.0, COSINES)
    entering, leaving = (np.interp(facets[name][:, 2], nodes, table.transmittance) for name in ("V", "L"))
    below = shader(
        "film.glsl",
        "below_film",
        albedo=albedo,
        entering=entering,
        leaving=leaving,
        ior=film.ior,
        internal=table.internal,
    )
    mirrored = shader("rough_film.glsl", "film_reflection", **facets, alpha=film.alpha, ior=film.ior)
    return np.asarray(mirrored[:, None] + below * cos_o[:, None])


def relative_error(found: Float64, exact: Float64) -> float:
    return float(np.mean((found - exact) ** 2 / (exact**2 + (1e-2 * exact.mean()) ** 2)))


def layered(**fields: Any) -> Layered:
    return Layered.model_validate_json(json.dumps({"type": "layered", "reflectance": [0.5, 0.2, 0.1]} | fields))


def principled(**fields: Any) -> Principled:
    return Principled.model_validate_json(json.dumps({"type": "principled", "base_color": [0.5, 0.2, 0.1]} | fields))


METALS = [{"metal": "Cr", "alpha": 0.15, "weight": 0.3}, {"metal": "Al", "alpha": 0.08, "weight": 0.15}]


@pytest.mark.parametrize(
    "material",
    [
        layered(metals=METALS),
        layered(metals=[{"metal": name, "alpha": 0.3, "weight": 0.25} for name in ("Ag", "Au", "Cu", "W")]),
        layered(film={"alpha": 0.35}, metals=METALS),
        layered(film={"alpha": 0.05, "ior": 1.3}),
        layered(film={"alpha": 1.0, "ior": 2.2}),
        principled(clearcoat=1.0, clearcoat_gloss=0.2, metallic=0.3, roughness=0.4),
        principled(sheen=0.7, specular=0.0, roughness=1.0),
        principled(metallic=1.0, roughness=0.3, clearcoat=0.5, clearcoat_gloss=1.0),
    ],
    ids=["blend", "four metals", "plastic", "smooth film", "dense film", "clear coat", "sheen", "lacquered metal"],
)
def test_shaders_in_double_precision_are_mitsubas_materials(
    by_mitsuba: Evaluate, material: Layered | Principled
) -> None:
    """One of each is a float32 apart, whose rounding reads as 1e-13."""
    V, L = directions(1), directions(2)
    assert relative_error(by_shader(material, V, L), by_mitsuba(material, V, L)) < PORTED


def test_the_smallest_roughness_is_ported_too(by_mitsuba: Evaluate) -> None:
    """About the mirror direction, where all of the highlight is: alpha 0.001 rounds away in other forms."""
    material = layered(reflectance=[0.0, 0.0, 0.0], metals=[{"metal": "Al", "alpha": 0.001, "weight": 1.0}])
    V = directions(3)
    slopes = np.random.default_rng(4).normal(0.0, 1e-3, (COUNT, 2))
    m = np.concatenate([slopes, np.ones((COUNT, 1))], axis=1)
    m /= np.linalg.norm(m, axis=1, keepdims=True)
    L = 2 * np.sum(V * m, axis=1, keepdims=True) * m - V
    seen = (V[:, 2] > 0.05) & (L[:, 2] > 0.05)
    found, exact = by_shader(material, V, L), by_mitsuba(material, V, L)
    # Float32 directions are 1e-7 apart, a ten-thousandth of the roughness.
    np.testing.assert_allclose(found[seen].mean(), exact[seen].mean(), rtol=1e-4)
    assert relative_error(found[seen], exact[seen]) < 1e-6
