"""Layered materials in Mitsuba against a port of their equations to NumPy, in double precision."""

import json
import math
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest

from reference.layers import layered_dict
from reference.to_mitsuba import instantiate
from scenes.image import Float32, Float64
from scenes.materials import Layered, Principled, Texture
from scenes.metals import INDICES, refractive_index

EXACT = 1e-11
"""Relative mean squared error that float32 leaves in some hundred operations: a few units of the seventh digit."""

Evaluate = Callable[..., Float64]


def layered(**fields: Any) -> Layered:
    return Layered.model_validate_json(json.dumps({"type": "layered", "reflectance": [0.5, 0.2, 0.1]} | fields))


def principled(**fields: Any) -> Principled:
    return Principled.model_validate_json(json.dumps({"type": "principled", "base_color": [0.5, 0.2, 0.1]} | fields))


CR, AL = {"metal": "Cr", "alpha": 0.15, "weight": 0.3}, {"metal": "Al", "alpha": 0.08, "weight": 0.15}
LAYERED = {
    "one metal": layered(metals=[CR | {"weight": 1.0}]),
    "smooth gold": layered(metals=[{"metal": "Au", "alpha": 0.01, "weight": 0.5}]),
    "blend": layered(metals=[CR, AL]),
    "film": layered(film={"alpha": 0.35}),
    "dense film": layered(film={"alpha": 1.0, "ior": 2.4}),
    "smooth film": layered(film={"alpha": 0.02, "ior": 1.2}),
    "plastic": layered(film={"alpha": 0.35}, metals=[CR, AL]),
}
PRINCIPLED = {
    "default": principled(),
    "clearcoat": principled(clearcoat=1.0, clearcoat_gloss=0.7),
    "metallic": principled(metallic=0.6, roughness=0.2),
    "sheen": principled(sheen=1.0, specular=0.0),
    "all": principled(metallic=0.3, roughness=0.7, specular=0.9, clearcoat=0.5, sheen=0.4),
}


@pytest.fixture
def evaluate(mi: ModuleType) -> Evaluate:
    """evaluate(material, wi, wo): Mitsuba's BRDF times the cosine (N, 3) for directions (N, 3) about +z."""
    import drjit as dr

    def run(material: Layered | Principled, wi: Float64, wo: Float64) -> Float64:
        bsdf = bsdf_of(mi, layered_dict(material, no_texture))
        si = dr.zeros(mi.SurfaceInteraction3f, len(wi))
        si.wi = mi.Vector3f(wi.T.astype(np.float32))
        value = bsdf.eval(mi.BSDFContext(), si, mi.Vector3f(wo.T.astype(np.float32)))
        return np.array(value, dtype=np.float64).T

    return run


def bsdf_of(mi: ModuleType, plain: dict[str, Any]) -> Any:
    return instantiate(mi, {"type": "scene", "shape": {"type": "sphere", "bsdf": plain}}).shapes()[0].bsdf()


def no_texture(texture: Texture) -> Float32:
    raise AssertionError("nothing here has a texture")


def directions(count: int, seed: int) -> Float64:
    """(N, 3), uniform over the upper hemisphere, as float32 has them."""
    rng = np.random.default_rng(seed)
    z, phi = rng.uniform(0.01, 1.0, count), rng.uniform(0.0, 2 * math.pi, count)
    s = np.sqrt(1 - z**2)
    return np.stack([s * np.cos(phi), s * np.sin(phi), z], axis=1).astype(np.float32).astype(float)


def ggx(alpha: float, H: Float64) -> Float64:
    """Walter et al. 2007, "Microfacet Models for Refraction through Rough Surfaces", equation 33."""
    tan2 = (H[:, 0] ** 2 + H[:, 1] ** 2) / H[:, 2] ** 2
    return alpha**2 / (math.pi * H[:, 2] ** 4 * (alpha**2 + tan2) ** 2)


def smith(alpha: float, v: Float64) -> Float64:
    """The same, equation 34."""
    tan2 = (v[..., 0] ** 2 + v[..., 1] ** 2) / v[..., 2] ** 2
    return np.asarray(2 / (1 + np.sqrt(1 + alpha**2 * tan2)))


def fresnel(cosine: Float64, n: complex | float) -> Float64:
    """Fresnel's amplitudes with a complex index (Born & Wolf 1999, "Principles of Optics", section 14.2)."""
    inside = np.sqrt(n * n - (1 - cosine**2) + 0j)
    s = (cosine - inside) / (cosine + inside)
    p = (n * n * cosine - inside) / (n * n * cosine + inside)
    return np.asarray((np.abs(s) ** 2 + np.abs(p) ** 2) / 2)


def half(wi: Float64, wo: Float64) -> Float64:
    H = wi + wo
    return np.asarray(H / np.linalg.norm(H, axis=1, keepdims=True))


def microfacets(alpha: float, wi: Float64, wo: Float64) -> Float64:
    """Torrance & Sparrow's reflection, without Fresnel's term, times the cosine of wo."""
    return ggx(alpha, half(wi, wo)) * smith(alpha, wi) * smith(alpha, wo) / (4 * wi[:, 2])


def visible_normals(wi: Float64, alpha: float, nodes: Float64) -> Float64:
    """Normals (N, M, 3) for points (M, 2) of a disk: Heitz 2018, "Sampling the GGX Distribution of Visible Normals"."""
    V = wi * (alpha, alpha, 1.0)
    V /= np.linalg.norm(V, axis=1, keepdims=True)
    side = np.stack([-V[:, 1], V[:, 0], np.zeros(len(V))], axis=1)
    length = np.linalg.norm(side, axis=1, keepdims=True)
    side = np.where(length > 0, side / np.where(length > 0, length, 1.0), (1.0, 0.0, 0.0))
    across = np.cross(V, side)
    a, b = nodes.T
    s = (1 + V[:, 2:]) / 2
    b = (1 - s) * np.sqrt(np.maximum(1 - a**2, 0)) + s * b
    c = np.sqrt(np.maximum(1 - a**2 - b**2, 0))
    N = a[None, :, None] * side[:, None] + b[..., None] * across[:, None] + c[..., None] * V[:, None]
    N = N * (alpha, alpha, 1.0)
    return np.asarray(N / np.linalg.norm(N, axis=-1, keepdims=True))


def disk_rule(count: int) -> tuple[Float64, Float64]:
    """Points (M, 2) of the unit disk and weights: Gauss's in the square, mapped as by Shirley & Chiu 1997."""
    x, w = np.polynomial.legendre.leggauss(count)
    a, b = (v.ravel() for v in np.meshgrid(x, x))
    weights = np.outer(w, w).ravel() / 4
    first = np.abs(a) > np.abs(b)
    r, ratio = np.where(first, a, b), np.where(first, b / a, a / b)
    phi = np.where(first, ratio, 2 - ratio) * math.pi / 4
    return np.stack([r * np.cos(phi), r * np.sin(phi)], axis=1), weights


def rough_part(cosines: Float64, alpha: float, eta: float, count: int, transmitted: bool) -> Float64:
    """What of light from a direction a rough surface lets through, or reflects, in one encounter."""
    nodes, weights = disk_rule(count)
    parts = []
    for cosine in np.maximum(cosines, 1e-6):
        wi = np.array([[math.sqrt(1 - cosine**2), 0.0, cosine]])
        m = visible_normals(wi, alpha, nodes)[0]
        d = np.minimum(m @ wi[0], 1.0)
        F = np.where(1 - (1 - d**2) / eta**2 > 0, fresnel(d, eta), 1.0)
        if transmitted:
            cos_t = np.sqrt(np.maximum(1 - (1 - d**2) / eta**2, 0))
            wo, part = m * (d / eta - cos_t)[:, None] - wi / eta, 1 - F
            leaves = wo[:, 2] < 0
        else:
            wo, part = 2 * d[:, None] * m - wi, F
            leaves = wo[:, 2] > 0
        wo = np.where(leaves[:, None], wo, (0.0, 0.0, 1.0))
        parts.append(np.sum(weights * part * smith(alpha, wo) * leaves))
    return np.array(parts)


def base(material: Layered, wi: Float64, wo: Float64) -> Float64:
    """The film and what is below it, with Mitsuba's 64 cosines and its 32² and 128² directions at each."""
    albedo, film = np.array(material.reflectance), material.film
    if film is None:
        return np.asarray(albedo / math.pi * wo[:, 2:])
    cosines = np.linspace(0.0, 1.0, 64)
    through = rough_part(cosines, film.alpha, film.ior, 32, transmitted=True)
    internal = 2 * np.mean(rough_part(cosines, film.alpha, 1 / film.ior, 128, transmitted=False) * cosines)
    entering, leaving = (np.interp(v[:, 2], cosines, through) for v in (wi, wo))
    below = albedo / (math.pi * film.ior**2 * (1 - albedo * internal))
    mirrored = fresnel(np.sum(wi * half(wi, wo), axis=1), film.ior) * microfacets(film.alpha, wi, wo)
    return np.asarray(mirrored[:, None] + below * (entering * leaving * wo[:, 2])[:, None])


def layered_port(material: Layered, wi: Float64, wo: Float64) -> Float64:
    value = base(material, wi, wo)
    cosine = np.sum(wi * half(wi, wo), axis=1)
    for metal in material.metals:
        assert isinstance(metal.weight, float)
        indices = zip(*refractive_index(metal.metal), strict=True)
        F = np.stack([fresnel(cosine, complex(eta, k)) for eta, k in indices], axis=1)
        value = (1 - metal.weight) * value + metal.weight * F * microfacets(metal.alpha, wi, wo)[:, None]
    return value


def principled_port(material: Principled, wi: Float64, wo: Float64) -> Float64:
    """Burley 2012, "Physically-Based Shading at Disney", with Mitsuba's choices.

    Sheen is not divided by pi, the coat not by the facets' cosines, and dielectrics have Fresnel's own term.
    """
    color = np.array(material.base_color)
    H = half(wi, wo)
    d = np.sum(wi * H, axis=1)
    weight_i, weight_o, weight_d = ((1 - c) ** 5 for c in (wi[:, 2], wo[:, 2], d))
    alpha = max(0.001, material.roughness**2)
    eta = 2 / (1 - math.sqrt(0.08 * material.specular)) - 1
    metal = color + (1 - color) * weight_d[:, None]
    F = (1 - material.metallic) * fresnel(d, eta)[:, None] + material.metallic * metal
    value = F * microfacets(alpha, wi, wo)[:, None]
    a = 0.1 + (0.001 - 0.1) * material.clearcoat_gloss
    D = (a**2 - 1) / (math.pi * math.log(a**2) * (1 + (a**2 - 1) * H[:, 2] ** 2))
    coat = (0.04 + 0.96 * weight_d) * D * smith(0.25, wi) * smith(0.25, wo) * wo[:, 2]
    value = value + (material.clearcoat / 4 * coat)[:, None]
    retro = 2 * material.roughness * d**2
    lobe = (1 - weight_i / 2) * (1 - weight_o / 2) + retro * (weight_i + weight_o + weight_i * weight_o * (retro - 1))
    diffuse = (1 - material.metallic) * wo[:, 2]
    value = value + color / math.pi * (diffuse * lobe)[:, None]
    return np.asarray(value + (material.sheen * diffuse * weight_d)[:, None])


def relative_error(found: Float64, exact: Float64) -> float:
    """Mean of the squared error, each relative to its own value."""
    return float(np.mean((found - exact) ** 2 / (exact**2 + (1e-2 * exact.mean()) ** 2)))


@pytest.mark.parametrize("name", LAYERED)
def test_layers_are_what_their_equations_say(evaluate: Evaluate, name: str) -> None:
    wi, wo = directions(4096, 1), directions(4096, 2)
    found, exact = evaluate(LAYERED[name], wi, wo), layered_port(LAYERED[name], wi, wo)
    assert relative_error(found, exact) < EXACT


@pytest.mark.parametrize("name", PRINCIPLED)
def test_principled_is_what_its_equations_say(evaluate: Evaluate, name: str) -> None:
    wi, wo = directions(4096, 3), directions(4096, 4)
    found, exact = evaluate(PRINCIPLED[name], wi, wo), principled_port(PRINCIPLED[name], wi, wo)
    assert relative_error(found, exact) < EXACT


def test_a_covered_share_is_the_mean_of_a_textures_channels(mi: ModuleType) -> None:
    """Mitsuba alone would take the luminance: 0.72 for green."""
    import drjit as dr

    material = layered(reflectance=[0.0, 0.0, 0.0], metals=[CR | {"weight": {"path": "share.png"}}])
    green = np.zeros((2, 2, 3), dtype=np.float32)
    green[..., 1] = 0.6
    bsdf = bsdf_of(mi, layered_dict(material, lambda texture: green))
    si = dr.zeros(mi.SurfaceInteraction3f)
    si.wi = mi.Vector3f(0, 0.6, 0.8)
    found = np.array(bsdf.eval(mi.BSDFContext(), si, mi.Vector3f(0, 0, 1)), dtype=np.float64).ravel()
    full = layered(reflectance=[0.0, 0.0, 0.0], metals=[CR | {"weight": 0.2}])
    exact = layered_port(full, np.array([[0, 0.6, 0.8]]), np.array([[0.0, 0.0, 1.0]]))[0]
    np.testing.assert_allclose(found, exact, rtol=1e-5)


def test_nothing_is_reflected_from_behind_or_to_behind(evaluate: Evaluate) -> None:
    above, below = directions(64, 5), directions(64, 6) * (1, 1, -1)
    for material in (LAYERED["plastic"], PRINCIPLED["all"]):
        assert (evaluate(material, above, below) == 0).all()
        assert (evaluate(material, below, above) == 0).all()


def test_a_white_furnace_never_shines(evaluate: Evaluate) -> None:
    """A white base under every coat reflects at most all light, whatever its roughness: integrated over a hemisphere.

    A film in one encounter loses what its facets would have passed on: the rougher, the darker.
    """
    z, weight = np.polynomial.legendre.leggauss(96)
    z, weight = (z + 1) / 2, weight / 2
    phi = (np.arange(192) + 0.5) / 192 * 2 * math.pi
    s = np.sqrt(1 - z**2)[:, None]
    wo = np.stack([s * np.cos(phi), s * np.sin(phi), np.broadcast_to(z[:, None], (96, 192))], axis=-1).reshape(-1, 3)
    solid_angle = np.repeat(weight * 2 * math.pi / 192, 192)
    for cosine in (0.1, 0.5, 1.0):
        wi = np.broadcast_to([math.sqrt(1 - cosine**2), 0.0, cosine], wo.shape)
        for alpha in (0.1, 0.3, 1.0):
            metals = [{"metal": "Ag", "alpha": alpha, "weight": 0.5}]
            for white in (
                layered(reflectance=[1, 1, 1], metals=metals),
                layered(reflectance=[1, 1, 1], film={"alpha": alpha}, metals=metals),
            ):
                reflected = (evaluate(white, wi, wo) * solid_angle[:, None]).sum(axis=0)
                assert (reflected < 1.002).all()
                assert (reflected > 0.3).all()


def test_metals_have_the_indices_that_mitsuba_renders_with(mi: ModuleType) -> None:
    for metal, (eta, k) in INDICES.items():
        parameters = mi.traverse(mi.load_dict({"type": "roughconductor", "material": metal}))
        np.testing.assert_allclose(np.array(parameters["eta.value"]).ravel(), eta, rtol=3e-6)
        np.testing.assert_allclose(np.array(parameters["k.value"]).ravel(), k, rtol=3e-6)


def test_indices_of_metals_are_their_spectra_under_light_of_equal_energy(mi: ModuleType) -> None:
    """By the tables of another library. White light would give the red of gold's index 0.08, not 0.14."""
    import colour

    shape = colour.SpectralShape(360, 830, 5)
    observer = colour.MSDS_CMFS["CIE 1931 2 Degree Standard Observer"].copy().align(shape)
    matching = observer.values / observer.values[:, 1].sum()
    to_rgb = colour.models.RGB_COLOURSPACE_sRGB.matrix_XYZ_to_RGB
    folder = Path(str(mi.__file__)).parent / "data" / "ior"
    for metal, indices in INDICES.items():
        for name, index in zip(("eta", "k"), indices, strict=True):
            wavelengths, values = np.loadtxt(folder / f"{metal}.{name}.spd").T
            spectrum = np.interp(observer.wavelengths, wavelengths, values)
            np.testing.assert_allclose(to_rgb @ (spectrum @ matching), index, rtol=2e-3, atol=2e-3)
