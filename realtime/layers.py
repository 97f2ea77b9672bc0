"""Layered materials as shaders get them: uniforms, textures and defines of glsl/layered/material.glsl."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from realtime.film import COSINES, film_table
from realtime.frame import Frame
from realtime.gbuffer import resolve_pass
from realtime.graph import Pass
from realtime.lights import FACET, PARALLEL, POINT, Light, light_rows
from scenes.errors import InputError
from scenes.geometry import texture_of
from scenes.image import Float64
from scenes.materials import Diffuse, Film, Layered, Metal, Principled, Texture
from scenes.mesh import Mesh
from scenes.metals import refractive_index
from scenes.model import DirectionalLight, DiskLight, PointLight, Scene, SphereLight

if TYPE_CHECKING:
    import moderngl

Coated = Diffuse | Layered | Principled

MOST_METALS = 4
FRESNEL = ("exact", "lazanyi", "schlick")
"""What metals reflect at an angle, in the order in which glsl/layered/material.glsl counts them."""

DIP_COSINE = 1 / 7
"""Where Lazanyi and Szirmay-Kalos' term is made exact: see `F_lazanyi` in glsl/lib/fresnel_metal.glsl."""


def bind_layers(
    frame: Frame, material: Coated, fresnel: str = "exact", unit: int = 0
) -> tuple[dict[str, int], dict[str, Any]]:
    """Bind a material's textures to up to six units from `unit` on.

    Returns
    -------
    Defines to compile layered/material.glsl with, and its uniforms.
    """
    if isinstance(material, Principled):
        return {"PRINCIPLED": 1}, principled_uniforms(material)
    film = material.film if isinstance(material, Layered) else None
    metals = material.metals if isinstance(material, Layered) else ()
    maps = {"base_map": frame.once(("base", material), lambda: frame.surface_texture(material.reflectance))}
    for i, metal in enumerate(metals):
        maps[f"weight_map_{i}"] = frame.once(("weight", metal), lambda own=metal: _weight_map(frame, own))  # type: ignore[misc]
    defines = {"METALS": len(metals), "FRESNEL": FRESNEL.index(fresnel)}
    uniforms = metal_uniforms(metals, fresnel)
    if film is not None:
        maps["film_map"] = frame.once(("film", film), lambda: _film_map(frame, film))
        defines["FILM"] = 1
        uniforms |= film_uniforms(film)
    for i, (name, texture) in enumerate(maps.items()):
        texture.use(unit + i)
        uniforms[name] = unit + i
    return defines, uniforms


def metal_uniforms(metals: tuple[Metal, ...], fresnel: str = "exact") -> dict[str, Any]:
    """Reflection of each metal and its roughness; places without one stay 1."""
    first, second, alphas = np.ones((MOST_METALS, 3)), np.ones((MOST_METALS, 3)), np.ones(MOST_METALS)
    for i, metal in enumerate(metals):
        eta, k = refractive_index(metal.metal)
        first[i], second[i] = (eta, k) if fresnel == "exact" else lazanyi(eta, k)
        alphas[i] = metal.alpha
    return {
        "metal_first": tuple(first.ravel().tolist()),
        "metal_second": tuple(second.ravel().tolist()),
        "metal_alpha": tuple(alphas.tolist()),
    }


def film_uniforms(film: Film) -> dict[str, float]:
    """Roughness, index, and what the film throws back of diffuse light from within."""
    internal = film_table(film.alpha, film.ior).internal
    return {"film_alpha": film.alpha, "film_ior": film.ior, "film_internal": internal}


def principled_uniforms(material: Principled) -> dict[str, Any]:
    """The struct Burley of glsl/lib/burley.glsl, member by member."""
    ior = 2 / (1 - (0.08 * material.specular) ** 0.5) - 1
    values = material.model_dump(exclude={"type", "specular"}) | {"ior": ior}
    return {f"principled.{name}": value for name, value in values.items()}


def lazanyi(eta: Float64, k: Float64) -> tuple[Float64, Float64]:
    """What a metal reflects straight back, and how far its reflection dips below Schlick's curve: each (3,)."""
    c = 1 - DIP_COSINE
    straight = conductor_reflectance(1.0, eta, k)
    schlick = straight + (1 - straight) * c**5
    return straight, (schlick - conductor_reflectance(DIP_COSINE, eta, k)) / (DIP_COSINE * c**6)


def conductor_reflectance(cosine: float, eta: Float64, k: Float64) -> Float64:
    """Fresnel's reflectance of a metal, by complex amplitudes."""
    n = eta + 1j * k
    inside = np.sqrt(n * n - (1 - cosine**2))
    s, p = (cosine - inside) / (cosine + inside), (n * n * cosine - inside) / (n * n * cosine + inside)
    reflected: Float64 = (np.abs(s) ** 2 + np.abs(p) ** 2) / 2
    return reflected


def _weight_map(frame: Frame, metal: Metal) -> moderngl.Texture:
    """The mean of a texture's channels, as the scene defines it."""
    if isinstance(metal.weight, Texture):
        return frame.filtered_texture(texture_of(frame.scene, metal.weight)[::-1].mean(axis=-1, keepdims=True))
    return frame.filtered_texture(np.full((1, 1, 1), metal.weight, dtype=np.float32))


def _film_map(frame: Frame, film: Film) -> moderngl.Texture:
    table = film_table(film.alpha, film.ior).transmittance
    texture = frame.texture((COSINES, 1), 1)
    texture.write(table.astype(np.float32).tobytes())
    return texture


def coated(scene: Scene, mesh: Mesh) -> Coated:
    """The material of a mesh, if it is a surface that light does not enter.

    Raises
    ------
    InputError
        It is another one.
    """
    if not isinstance(mesh.material, Diffuse | Layered | Principled):
        raise InputError(
            f"Scene '{scene.name}' has '{mesh.shape}', which light passes; surfaces that are diffuse, layered or "
            "principled can be drawn here. Give it such a material, or leave out the check."
        )
    return mesh.material


def lit_passes(scene: Scene, shade: Callable[[Frame], None]) -> list[Pass]:
    """List the lamps, draw all meshes by `shade`, and write `image`.

    Raises
    ------
    InputError
        An emitter is no point, sphere, disk or parallel beam.
    """
    lamps_of(scene)
    return [
        Pass("lamps", _upload_lamps, writes=("lamps",)),
        Pass("shade", shade, reads=("lamps",), writes=("shaded",)),
        resolve_pass("shaded"),
    ]


def _upload_lamps(frame: Frame) -> None:
    lamps = lamps_of(frame.scene)
    frame.resources["lamps"] = frame.context.buffer(light_rows(lamps).tobytes()), len(lamps)


def begin_shading(frame: Frame) -> int:
    """Draw into a new `shaded`, black as yet, with depth; bind `lamps` as shaders read them, and return their count."""
    context, size = frame.context, frame.size
    shaded = frame.resources["shaded"] = frame.texture(size, 4)
    framebuffer = context.framebuffer([shaded], context.depth_renderbuffer(size))
    framebuffer.use()
    frame.submit(framebuffer.clear)
    context.enable_only(context.DEPTH_TEST)
    buffer, count = frame.resources["lamps"]
    buffer.bind_to_storage_buffer(3)
    return int(count)


def lamps_of(scene: Scene) -> list[Light]:
    """Every emitter as one light at its centre, with its cross-section as `area`.

    Raises
    ------
    InputError
        An emitter is no point, sphere, disk or parallel beam.
    """
    return [_lamp(scene, source) for source in range(len(scene.emitters))]


def _lamp(scene: Scene, source: int) -> Light:
    emitter, nowhere = scene.emitters[source], np.zeros(3)
    match emitter:
        case PointLight():
            return Light(POINT, np.array(emitter.position), nowhere, np.array(emitter.intensity), 0.0, source)
        case DirectionalLight():
            direction = np.array(emitter.direction) / np.linalg.norm(emitter.direction)
            return Light(PARALLEL, nowhere, direction, np.array(emitter.irradiance), 0.0, source)
        case SphereLight():
            area = np.pi * emitter.radius**2
            return Light(POINT, np.array(emitter.position), nowhere, area * np.array(emitter.radiance), area, source)
        case DiskLight():
            area = np.pi * emitter.radius**2
            normal = np.array(emitter.normal) / np.linalg.norm(emitter.normal)
            return Light(FACET, np.array(emitter.position), normal, area * np.array(emitter.radiance), area, source)
        case _:
            raise InputError(
                f"Scene '{scene.name}' is lit by an emitter of type '{emitter.type}'; this technique takes lamps that "
                "have one direction and a round shape: point, sphere, disk and directional. Use one of these, or leave "
                "out the check."
            )
