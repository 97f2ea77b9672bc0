"""Hard shadows of one omnidirectional light by a virtual cube map.

After NVIDIA's talk on the GeForce 7800 GTX demos ("Luna", "Mad Mod Mike", 2005), which follows King and Newhall 2004,
"Efficient Omnidirectional Shadow Maps".
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from realtime.frame import Frame
from realtime.gbuffer import resolve_pass
from realtime.graph import Pass
from realtime.technique import Parameter, Technique
from realtime.vcm import (
    DEPTH_FORMATS,
    ROUNDING,
    VirtualCubeMap,
    faces_apart,
    literal_remap_faces,
    projection_q,
    receivers_pass,
    remap_faces,
    the_omni_light,
    vcm_pass,
)
from scenes.checks import SettingValue
from scenes.features import Features
from scenes.model import PIXEL_GRID, Scene

REMAP_SIDE = 64
"""The talk: "64x64 faces is plenty"."""

ANALYTIC_MARGIN = 2
"""Texels: the four texels around a place reach one texel beyond it; one more for rounding."""

Passes = Callable[[Scene, Features, Mapping[str, SettingValue]], list[Pass]]


def _map_parameters(far_over_near: float) -> tuple[Parameter, ...]:
    return (
        Parameter("side", 1024, (256, 512, 1024, 2048), "texels along an edge of a tile", (64, 4096)),
        Parameter("far_over_near", far_over_near, (1e2, 1e3, 1e4), "ratio of the clip planes' distances", (2, 1e6)),
        Parameter("depth_format", "D24", DEPTH_FORMATS, "of the virtual cube map"),
    )


TALK = (
    *_map_parameters(100.0),
    Parameter(
        "rotated_taps", False, (False, True), "four bilinear taps in a rotated pattern instead of one", off=False
    ),
    Parameter("zbias", 7e-4, (0.0, 7e-4, 3e-3), "constant by which a receiver's depth is lowered", (0, 1), off=0.0),
    Parameter(
        "margin",
        4,
        (0, 2, 4),
        "texels of a tile beyond 90 degrees: at least the reach of the taps and 1",
        (0, 16),
        off=0,
    ),
)
EDGES = Parameter(
    "edge_to_edge",
    True,
    (False, True),
    "the outermost texels of the remap cube stand for the edges of its faces; as published, for their own centres",
    off=False,
)


def _remapped_passes(literal: bool) -> Passes:
    def passes(scene: Scene, features: Features, settings: Mapping[str, SettingValue]) -> list[Pass]:
        return [
            *_common_passes(scene, settings, int(settings["margin"]), linear=False),
            Pass("remap cube", _fill_literal_remap if literal else _fill_remap, writes=("remap",), is_baked=True),
            Pass(
                "receive",
                lambda frame: _receive_remapped(frame, literal),
                reads=("position", "face_normal", "virtual_cube_map", "remap"),
                writes=("visibility",),
            ),
            resolve_pass("visibility"),
        ]

    return passes


def _analytic_passes(scene: Scene, features: Features, settings: Mapping[str, SettingValue]) -> list[Pass]:
    reads = ("position", "face_normal", "virtual_cube_map")
    return [
        *_common_passes(scene, settings, ANALYTIC_MARGIN, linear=True),
        Pass("receive", _receive_analytic, reads=reads, writes=("visibility",)),
        resolve_pass("visibility"),
    ]


def _common_passes(scene: Scene, settings: Mapping[str, SettingValue], margin: int, linear: bool) -> list[Pass]:
    the_omni_light(scene)
    side, ratio = int(settings["side"]), float(settings["far_over_near"])
    return [receivers_pass(), vcm_pass(side, margin, ratio, str(settings["depth_format"]), linear)]


def _fill_remap(frame: Frame) -> None:
    side, margin, edge_to_edge = (frame.settings[name] for name in ("side", "margin", "edge_to_edge"))
    _upload_remap(frame, remap_faces(REMAP_SIDE, int(side), int(margin), bool(edge_to_edge)))


def _fill_literal_remap(frame: Frame) -> None:
    _upload_remap(frame, literal_remap_faces(REMAP_SIDE, int(frame.settings["side"]), int(frame.settings["margin"])))


def _upload_remap(frame: Frame, faces: NDArray[np.float16]) -> None:
    remap = frame.context.texture_cube((REMAP_SIDE, REMAP_SIDE), 4, dtype="f2")
    remap.filter = (frame.context.LINEAR, frame.context.LINEAR)
    for face, texels in enumerate(faces):
        remap.write(face, texels.tobytes())
    frame.resources["remap"] = remap


def _receive_remapped(frame: Frame, literal: bool) -> None:
    vcm: VirtualCubeMap = frame.resources["virtual_cube_map"]
    vcm.texture.filter = (frame.context.LINEAR, frame.context.LINEAR)
    vcm.texture.compare_func = "<="
    vcm.texture.use(3)
    frame.resources["remap"].use(2)
    edge_to_edge = not literal and bool(frame.settings["edge_to_edge"])
    defines = ({"LITERAL": 1} if literal else {}) | ({"ROTATED_TAPS": 1} if frame.settings["rotated_taps"] else {})
    with faces_apart(frame.context, unit=2):
        _receive(
            frame,
            frame.program("shadow_vcm/remapped.comp", **defines),
            Q=projection_q(vcm.near, vcm.far),
            zbias=float(frame.settings["zbias"]),
            squeeze=REMAP_SIDE / (REMAP_SIDE - 1) if edge_to_edge else 1.0,
        )


def _receive_analytic(frame: Frame) -> None:
    vcm: VirtualCubeMap = frame.resources["virtual_cube_map"]
    vcm.texture.filter = (frame.context.NEAREST, frame.context.NEAREST)
    vcm.texture.compare_func = ""
    vcm.texture.use(2)
    _receive(
        frame,
        frame.program("shadow_vcm/analytic.comp"),
        margin=float(vcm.margin),
        far=vcm.far,
        rounding=ROUNDING[str(frame.settings["depth_format"])],
    )


def _receive(frame: Frame, shader: Any, **uniforms: Any) -> None:
    vcm: VirtualCubeMap = frame.resources["virtual_cube_map"]
    frame.resources["position"].use(0)
    frame.resources["face_normal"].use(1)
    visibility = frame.texture(frame.size, 4)
    visibility.bind_to_image(0, read=False, write=True)
    frame.dispatch(shader, *frame.size, light=tuple(vcm.place), side=float(vcm.side), **uniforms)
    frame.resources["visibility"] = visibility


LIMITS = (
    "Hard shadows: a sphere light counts as a point at its centre. What lies nearer to the light than the near plane "
    "casts no shadow. Where a shadow ends is known to a texel."
)


def _technique(name: str, summary: str, source: str, limits: str, passes: Passes, *own: Parameter) -> Technique:
    return Technique(
        name=f"shadow.{name}",
        approximates="visibility",
        summary=summary,
        source=source,
        limits=limits,
        passes=passes,
        parameters=own,
        channels=(0,),
        grid=PIXEL_GRID,
    )


TECHNIQUES = {
    t.name: t
    for t in (
        _technique(
            "vcm",
            "the talk's virtual cube map: six tiles of depth in one texture, found through a remap cube",
            "nvidia-2005",
            f"{LIMITS} The slide's errata are corrected. The constant bias suits one size of tile and one ratio of "
            "clip planes: too small, lit surfaces shade themselves; too large, light leaks below what touches.",
            _remapped_passes(literal=False),
            *TALK,
            EDGES,
        ),
        _technique(
            "vcm_literal",
            "the talk's virtual cube map with the slide's formulas to the letter",
            "nvidia-2005",
            "A negative baseline, wrong nearly everywhere. As printed, the unpacking does not divide the lower part by "
            "8, and the tiles' places are not divided by the number of tiles. What the print lacks is read in the "
            "simplest way: the face -X goes with +X, +Z with +X and +Y, and shadowCoord.z = c1 / MA + c2.",
            _remapped_passes(literal=True),
            *TALK,
        ),
        _technique(
            "vcm_analytic",
            "a virtual cube map without remap cube, whose texels are compared with the plane of the receiver",
            "king-2004",
            f"{LIMITS} Nothing that rises less than a texel above a receiver's plane casts a shadow on it.",
            _analytic_passes,
            *_map_parameters(1e4),
        ),
    )
}
