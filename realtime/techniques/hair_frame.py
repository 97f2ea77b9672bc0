"""Hair on a frame that is recomputed from the deformed surface, drawn as ribbons with their true coverage."""

from __future__ import annotations

from collections.abc import Mapping

from realtime.gbuffer import resolve_pass
from realtime.graph import Pass
from realtime.hair import SEGMENTS, hair_points_passes, samples_pass, scalp_passes
from realtime.hair_charts import chart_pass, film_roots_pass
from realtime.hair_light import FRAME_LIGHT, hair_light_passes
from realtime.hair_ribbons import draw_pass, order_pass
from realtime.technique import Parameter, Technique
from scenes.checks import SettingValue
from scenes.features import Features
from scenes.model import Scene

GRID = 4
"""Samples along each side of a pixel: the edges of ribbons wider than a sample are exact to one."""

HANDEDNESS = Parameter(
    "handedness", True, (False, True), "whether hair on the mirrored half of a chart is mirrored", off=False
)


def _chart_passes(settings: Mapping[str, SettingValue], tangent: bool) -> list[Pass]:
    return [*scalp_passes(), film_roots_pass(), chart_pass(tangent, bool(settings["handedness"]))]


def _geometry_passes(scene: Scene, features: Features, settings: Mapping[str, SettingValue]) -> list[Pass]:
    return _chart_passes(settings, tangent=False)


def _tangent_passes(scene: Scene, features: Features, settings: Mapping[str, SettingValue]) -> list[Pass]:
    return [*scalp_passes(), film_roots_pass(), chart_pass(tangent=True)]


def _coverage_passes(scene: Scene, features: Features, settings: Mapping[str, SettingValue]) -> list[Pass]:
    return [
        *hair_points_passes(bool(settings["handedness"])),
        samples_pass(),
        draw_pass(shaded=False),
        resolve_pass("hair"),
    ]


def _passes(scene: Scene, features: Features, settings: Mapping[str, SettingValue]) -> list[Pass]:
    return [
        *hair_points_passes(bool(settings["handedness"])),
        samples_pass(),
        *hair_light_passes(scene, features, settings),
        order_pass(),
        draw_pass(shaded=True),
        resolve_pass("hair"),
    ]


LIMITS = (
    "A hair is as thick at its root as at its tip, and is open there. Skin deforms by one morph target and two bones."
)
LIGHT_LIMITS = (
    f"{LIMITS} Light is found at points along a hair, as the mean over its width. Of two segments one is all in front."
)
TECHNIQUES = {
    t.name: t
    for t in (
        Technique(
            name="hair.frame_geometry",
            approximates="hair_geometry",
            summary="tips of hairs on frames recomputed from the deformed skin",
            source="lengyel-2001",
            limits=LIMITS,
            passes=_geometry_passes,
            parameters=(HANDEDNESS,),
            grid=1,
        ),
        Technique(
            name="hair.frame_tangent",
            approximates="hair_tangent",
            summary="tangents of frames recomputed from the deformed skin",
            source="lengyel-2001",
            limits=LIMITS,
            passes=_tangent_passes,
            grid=1,
        ),
        Technique(
            name="hair.frame_coverage",
            approximates="hair_coverage",
            summary="ribbons as opaque as the part of a sample that they cover",
            source="yuksel-2010",
            limits=LIMITS,
            passes=_coverage_passes,
            parameters=(SEGMENTS, HANDEDNESS),
            channels=(3,),
            grid=GRID,
        ),
        Technique(
            name="hair.frame",
            approximates="hair_radiance",
            summary="ribbons of fibres with three lobes, with what other hair takes and scatters found on a grid",
            source="chiang-2016",
            limits=LIGHT_LIMITS,
            passes=_passes,
            parameters=(SEGMENTS, HANDEDNESS, *FRAME_LIGHT),
            grid=GRID,
        ),
    )
}
