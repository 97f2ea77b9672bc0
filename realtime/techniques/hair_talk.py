"""The talk's hair: guides in texture space, brought to the world by bases that morph and skin, drawn as lines."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from realtime.gbuffer import resolve_pass
from realtime.graph import Pass
from realtime.hair import SEGMENTS, samples_pass
from realtime.hair_guides import chart_between_passes, hairs_between_passes
from realtime.hair_light import TALK_LIGHT, hair_talk_light_passes
from realtime.hair_ribbons import draw_pass
from realtime.sky import require_no_sky
from realtime.technique import Technique
from scenes.checks import SettingValue
from scenes.features import Features
from scenes.model import Scene

PIECES = replace(SEGMENTS, default=8)


def _geometry_passes(scene: Scene, features: Features, settings: Mapping[str, SettingValue]) -> list[Pass]:
    return chart_between_passes(tangent=False)


def _tangent_passes(scene: Scene, features: Features, settings: Mapping[str, SettingValue]) -> list[Pass]:
    return chart_between_passes(tangent=True)


def _coverage_passes(scene: Scene, features: Features, settings: Mapping[str, SettingValue]) -> list[Pass]:
    return [*hairs_between_passes(), samples_pass(), draw_pass(shaded=False, lines=True), resolve_pass("hair")]


def _passes(scene: Scene, features: Features, settings: Mapping[str, SettingValue]) -> list[Pass]:
    require_no_sky(scene, features, "the talk's hair is lit")
    return [
        *hairs_between_passes(),
        samples_pass(),
        *hair_talk_light_passes(scene, features, settings),
        draw_pass(shaded=True, lines=True),
        resolve_pass("hair"),
    ]


LIMITS = (
    "Bases are stored for the skin at rest and for its morph target; what lies between both, and what bones do to them "
    "together, is interpolated, and nothing makes them orthonormal again. Hairs are interpolated in the world. A line "
    "is one pixel wide, however far or thin its hair."
)
LIGHT_LIMITS = (
    f"{LIMITS} Nothing is in the way of light, and it is scattered once; there may be no sky. Colours were painted: "
    "here they send as much in all, and as much of it as a highlight, as the fibre does to an eye at its side."
)
TECHNIQUES = {
    t.name: t
    for t in (
        Technique(
            name="hair.talk_geometry",
            approximates="hair_geometry",
            summary="tips of hairs between guides that bases, morphed and skinned like positions, take to the world",
            source="nvidia-2005",
            limits=LIMITS,
            passes=_geometry_passes,
            grid=1,
        ),
        Technique(
            name="hair.talk_tangent",
            approximates="hair_tangent",
            summary="tangents of bases that are morphed and skinned like positions",
            source="nvidia-2005",
            limits=LIMITS,
            passes=_tangent_passes,
            grid=1,
        ),
        Technique(
            name="hair.talk_coverage",
            approximates="hair_coverage",
            summary="lines of one pixel",
            source="nvidia-2005",
            limits=LIMITS,
            passes=_coverage_passes,
            parameters=(PIECES,),
            channels=(3,),
            grid=1,
        ),
        Technique(
            name="hair.talk",
            approximates="hair_radiance",
            summary="lines of one pixel, lit as Kajiya and Kay have it, in colours matched to the fibre's albedo",
            source="kajiya-1989",
            limits=LIGHT_LIMITS,
            passes=_passes,
            parameters=(PIECES, *TALK_LIGHT),
            grid=1,
        ),
    )
}
