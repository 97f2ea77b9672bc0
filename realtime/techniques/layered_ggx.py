"""Layers of metal flakes, rough films and clear coats by microfacets: what Mitsuba evaluates, term by term."""

from __future__ import annotations

from collections.abc import Mapping

from realtime.frame import Frame
from realtime.graph import Pass
from realtime.layers import FRESNEL, begin_shading, bind_layers, coated, lit_passes
from realtime.shader import set_uniforms
from realtime.technique import Parameter, Technique
from scenes.checks import SettingValue
from scenes.features import Features
from scenes.mesh import Mesh
from scenes.model import Scene

PARAMETERS = (
    Parameter(
        "fresnel",
        "exact",
        FRESNEL,
        "exact: a metal's complex index; lazanyi, schlick: polynomials in the cosine",
        off="schlick",
    ),
    Parameter(
        "spread",
        0.45,
        (0.0, 0.3, 0.45, 0.6),
        "how much a lamp's angular radius widens highlights, in units of alpha; 0: it counts as a point",
        (0, 2),
        off=0.0,
        tuned=(0.0, 1.0),
    ),
)


def _passes(scene: Scene, features: Features, settings: Mapping[str, SettingValue]) -> list[Pass]:
    return lit_passes(scene, _shade)


def _shade(frame: Frame) -> None:
    count = begin_shading(frame)
    for mesh in frame.meshes:
        _draw(frame, mesh, count)


def _draw(frame: Frame, mesh: Mesh, count: int) -> None:
    defines, uniforms = bind_layers(frame, coated(frame.scene, mesh), str(frame.settings["fresnel"]))
    shader = frame.program("raster/mesh.vert", "layered/shade.frag", **defines)
    set_uniforms(shader, light_count=count, spread=float(frame.settings["spread"]), **uniforms)
    frame.draw(shader, frame.camera, lambda other: other.name == mesh.name)


TECHNIQUES = {
    "layered.ggx": Technique(
        name="layered.ggx",
        approximates="layered_radiance",
        summary="GGX flakes of metal over a rough film over pigment, or Burley's principled material",
        source="walter-2007",
        limits=(
            "Nothing hides a light but the surface's own plane: no shadows, no light from other surfaces, which convex "
            "subjects on their own do not need. A ball or disk shines from its centre with highlights made wider, and "
            "is seen whole or not at all; skies, lines and surfaces that emit are refused."
        ),
        passes=_passes,
        parameters=PARAMETERS,
        grid=4,
    )
}
