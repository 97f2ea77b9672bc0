"""Parallax mapping, the rival in the talk: one lookup of the height moves the texture coordinates."""

from __future__ import annotations

from collections.abc import Mapping

from realtime.gbuffer import resolve_pass
from realtime.graph import Pass
from realtime.relief import require_lit_relief, the_relief
from realtime.relief_polygons import LIMITS, draw_polygons
from realtime.shadows import lights_pass
from realtime.technique import Parameter, Technique
from scenes.checks import SettingValue
from scenes.features import Features
from scenes.model import Scene

FRAGMENT = "displacement/parallax.frag"
FACETS = Parameter("facets", 16, (1, 4, 16, 64), "points that stand for each emitting surface", (1, 4096))


def _uv_passes(scene: Scene, features: Features, settings: Mapping[str, SettingValue]) -> list[Pass]:
    the_relief(scene)
    draw = Pass("polygons", lambda frame: draw_polygons(frame, FRAGMENT, shows_uv=True), writes=("shaded",))
    return [draw, resolve_pass("shaded")]


def _passes(scene: Scene, features: Features, settings: Mapping[str, SettingValue]) -> list[Pass]:
    require_lit_relief(scene, features)
    return [
        lights_pass(int(settings["facets"])),
        Pass(
            "polygons",
            lambda frame: draw_polygons(frame, FRAGMENT, shows_uv=False),
            reads=("lights",),
            writes=("shaded",),
        ),
        resolve_pass("shaded"),
    ]


SLOPES = "It holds for smooth fields whose displacement along the surface, depth times tan(angle), is a few texels."

TECHNIQUES = {
    t.name: t
    for t in (
        Technique(
            name="displacement.parallax_uv",
            approximates="displaced_uv",
            summary="texture coordinates moved by the height at the polygon, one lookup",
            source="kaneko-2001",
            limits=f"{LIMITS} {SLOPES}",
            passes=_uv_passes,
            channels=(0, 1),
            grid=1,
        ),
        Technique(
            name="displacement.parallax",
            approximates="displaced_radiance",
            summary="colour and normal map looked up by parallax mapping",
            source="kaneko-2001",
            limits=f"{LIMITS} {SLOPES}",
            passes=_passes,
            parameters=(FACETS,),
            grid=4,
        ),
    )
}
