"""Displacement with occlusion as NVIDIA's talk on the GeForce 7800 GTX demos (2005) publishes it.

A ray marches through a 3D texture that holds, for each place in the block, the distance to its surface.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from realtime.frame import Frame
from realtime.gbuffer import resolve_pass
from realtime.graph import Pass
from realtime.relief import require_lit_relief, the_relief
from realtime.relief_polygons import LIMITS, draw_polygons
from realtime.relief_volume import DistanceVolume, cubic, signed_distances, voxel_distances
from realtime.shadows import lights_pass
from realtime.technique import Parameter, Technique
from realtime.techniques.displacement_parallax import FACETS
from scenes.checks import SettingValue
from scenes.features import Features
from scenes.geometry import heights_of
from scenes.model import Scene

FORMATS = {"r8": "f1", "r16f": "f2", "r32f": "f4"}

MARCH = (
    Parameter("iterations", 16, (4, 8, 16, 32, 64, 96, 128), "steps of the march: NUM_ITERATIONS", (1, 1024)),
    Parameter(
        "distances",
        "voxels",
        ("voxels", "cubic", "signed"),
        "voxels: as published, from a volume of 0 and 1, in texture space; cubic: in voxels, as if they were cubes; "
        "signed: lengths from nodes, below 0 inside",
    ),
    Parameter("slices", 32, (8, 16, 32, 64), "of the volume along the depth", (2, 512)),
    Parameter("format", "r16f", tuple(FORMATS), "of a distance in the volume"),
    Parameter(
        "border", "clamp", ("clamp", "discard"), "what a ray that leaves the block shows: its border, or nothing"
    ),
)


def _volume_pass() -> Pass:
    return Pass("distance volume", _volume, writes=("volume",), is_baked=True)


def _volume(frame: Frame) -> None:
    settings, shape = frame.settings, the_relief(frame.scene)
    heights, slices = heights_of(frame.scene, shape), int(settings["slices"])
    volume = {
        "voxels": lambda: voxel_distances(heights, slices),
        "cubic": lambda: voxel_distances(heights, slices, cubic(heights, slices)),
        "signed": lambda: signed_distances(heights, slices, (*shape.size, shape.depth)),
    }[str(settings["distances"])]()
    frame.resources["volume"] = _uploaded(frame, volume, FORMATS[str(settings["format"])])


def _uploaded(frame: Frame, volume: DistanceVolume, dtype: str) -> tuple[Any, dict[str, Any]]:
    """The volume as a texture that does not repeat, and the uniforms with which displacement/talk.frag reads it."""
    low, high = min(0.0, float(volume.values.min())), float(volume.values.max())
    span = high - low if high > low else 1.0
    stored = (volume.values - low) / span
    texels = np.round(255 * stored).astype(np.uint8) if dtype == "f1" else stored.astype(f"<{dtype}")
    texture = frame.context.texture3d(stored.shape[::-1], 1, np.ascontiguousarray(texels).tobytes(), dtype=dtype)
    texture.filter = (frame.context.LINEAR, frame.context.LINEAR)
    texture.repeat_x = texture.repeat_y = texture.repeat_z = False
    uniforms = {"metric": volume.metric, "first_texel": volume.first, "last_texel": volume.last, "decode": (span, low)}
    return texture, uniforms


def _march(frame: Frame, *, shows_uv: bool) -> None:
    texture, uniforms = frame.resources["volume"]
    texture.use(2)
    draw_polygons(
        frame,
        "displacement/talk.frag",
        shows_uv=shows_uv,
        NORMALISED=1,
        NUM_ITERATIONS=int(frame.settings["iterations"]),
        **({"DISCARD_OUTSIDE": 1} if frame.settings["border"] == "discard" else {}),
        **uniforms,
    )


def _uv_passes(scene: Scene, features: Features, settings: Mapping[str, SettingValue]) -> list[Pass]:
    the_relief(scene)
    march = Pass("march", lambda frame: _march(frame, shows_uv=True), reads=("volume",), writes=("shaded",))
    return [_volume_pass(), march, resolve_pass("shaded")]


def _passes(scene: Scene, features: Features, settings: Mapping[str, SettingValue]) -> list[Pass]:
    require_lit_relief(scene, features)
    return [
        _volume_pass(),
        lights_pass(int(settings["facets"])),
        Pass("march", lambda frame: _march(frame, shows_uv=False), reads=("volume", "lights"), writes=("shaded",)),
        resolve_pass("shaded"),
    ]


STEPS = (
    "The eye vector is normalised at the corners of the polygon and interpolated: seen from close by it is off between "
    "them. In a volume of voxels distances end half a voxel inside the surface, and the march passes through it. A ray "
    "that leaves the block shows its border, or with border = discard nothing."
)

TECHNIQUES = {
    t.name: t
    for t in (
        Technique(
            name="displacement.talk_uv",
            approximates="displaced_uv",
            summary="the talk's march along the eye vector through a volume of distances",
            source="nvidia-2005",
            limits=f"{LIMITS} {STEPS}",
            passes=_uv_passes,
            parameters=MARCH,
            channels=(0, 1),
            grid=1,
        ),
        Technique(
            name="displacement.talk",
            approximates="displaced_radiance",
            summary="colour and normal map looked up where the talk's march ends",
            source="nvidia-2005",
            limits=f"{LIMITS} {STEPS}",
            passes=_passes,
            parameters=(*MARCH, FACETS),
            grid=4,
        ),
    )
}
