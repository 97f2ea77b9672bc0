"""What shines through a translucent subject: the lights as the translucency techniques see them, and its medium."""

from collections.abc import Iterator

import numpy as np

from realtime.frame import Frame
from realtime.lights import FACET, PARALLEL, Light, lights_of
from scenes.errors import InputError
from scenes.image import Float64
from scenes.materials import Translucent
from scenes.media import coefficients
from scenes.mesh import Mesh
from scenes.model import LineLight, Scene

ELEMENT = 3
"""A short piece of a line light: `axis` runs along it, `strength` is its intensity [W/sr] straight across."""


def backlights(scene: Scene, meshes: tuple[Mesh, ...], pieces: int) -> list[Light]:
    """All emitters but the sky as small lights; emitting surfaces and lines are cut into `pieces`."""
    lines = {f"emitter-{i}" for i, emitter in enumerate(scene.emitters) if isinstance(emitter, LineLight)}
    lights = lights_of(scene, tuple(mesh for mesh in meshes if mesh.name not in lines), pieces)
    return lights + [
        element
        for source, emitter in enumerate(scene.emitters)
        if isinstance(emitter, LineLight)
        for element in _elements(emitter, pieces, source)
    ]


def scene_backlights(frame: Frame, pieces: int) -> list[Light]:
    """The `backlights` of the scene that a frame shows, listed once."""
    return frame.once(("backlights", pieces), lambda: backlights(frame.scene, frame.meshes, pieces))


def _elements(light: LineLight, pieces: int, source: int) -> Iterator[Light]:
    """A tube seen from the side is as bright as its silhouette: I = radiance * 2 radius * length * sin(angle)."""
    start, end = np.array(light.start), np.array(light.end)
    length = float(np.linalg.norm(end - start))
    strength = np.array(light.radiance) * 2 * light.radius * length / pieces
    for t in (np.arange(pieces) + 0.5) / pieces:
        yield Light(ELEMENT, start + t * (end - start), (end - start) / length, strength, 0.0, source)


def beam(light: Light, point: Float64) -> tuple[Float64, Float64]:
    """Where the light travels at a point (3,), and its irradiance (3,) across the beam, nothing in its way.

    The float64 twin of glsl/lib/beam.glsl.
    """
    if light.kind == PARALLEL:
        return light.axis, light.strength
    v = point - light.place
    r2 = float(v @ v)
    travel = v / np.sqrt(r2)
    along = float(travel @ light.axis)
    if light.kind == FACET:
        return travel, light.strength * np.pi * max(along, 0.0) / (np.pi * r2 + light.area)
    if light.kind == ELEMENT:
        return travel, light.strength * np.sqrt(max(1 - along * along, 0.0)) / r2
    return travel, light.strength / r2


def single_scattering_albedo(sigma_a: Float64, sigma_s: Float64) -> Float64:
    """Part (3,) of what is taken from a beam that is scattered; 0 in a channel in which nothing is."""
    sigma_t = sigma_a + sigma_s
    albedo: Float64 = np.divide(sigma_s, sigma_t, out=np.zeros(3), where=sigma_t > 0)
    return albedo


def subject_medium(scene: Scene) -> tuple[Float64, Float64]:
    """Absorption and reduced scattering (3,) of the subject, per unit of length of the scene.

    Raises
    ------
    InputError
        Some of the subject is not translucent, or its shapes are of several media.
    """
    found = []
    for shape in scene.shapes:
        if shape.name in scene.subject:
            material = scene.materials[shape.material]
            if not isinstance(material, Translucent):
                raise InputError(
                    f"The subject's shape '{shape.name}' is of the material '{shape.material}', which is "
                    f"{material.type}; light passes through translucent ones only. Make it translucent, or leave the "
                    "shape out of the subject."
                )
            found.append(coefficients(material, scene.length_unit))
    if any(not np.array_equal(one, found[0]) for one in found):
        raise InputError(
            f"The subject of scene '{scene.name}' is of several media; one table of transmission serves one medium. "
            "Give its shapes the same material."
        )
    return found[0]
