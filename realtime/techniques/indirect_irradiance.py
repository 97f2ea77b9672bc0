"""The captured surroundings as surface elements that each shaded point gathers from its own place."""

from collections.abc import Mapping

from realtime.frame import Frame
from realtime.gbuffer import gbuffer_pass, resolve_pass
from realtime.graph import Pass
from realtime.technique import Technique
from realtime.techniques.indirect_probe import CAPTURE, captured
from scenes.features import Features
from scenes.model import Scene, SettingValue


def _passes(scene: Scene, features: Features, settings: Mapping[str, SettingValue]) -> list[Pass]:
    return [
        gbuffer_pass(),
        *captured(features, settings),
        Pass("gather", _gather, reads=("position", "normal", "albedo", "surfels", "reflected"), writes=("shaded",)),
        resolve_pass("shaded"),
    ]


def _gather(frame: Frame) -> None:
    resources = frame.resources
    shaded = frame.texture(frame.size, 4)
    for unit, name in enumerate(("position", "normal", "albedo")):
        resources[name].use(unit)
    resources["surfels"].bind_to_storage_buffer(0)
    resources["reflected"].bind_to_storage_buffer(1)
    shaded.bind_to_image(0, read=False, write=True)
    shader = frame.program("indirect/gather.comp")
    frame.dispatch(shader, *frame.size, surfel_count=resources["surfel_count"], closed=resources["closed"])
    resources["shaded"] = shaded


TECHNIQUES = {
    "indirect.irradiance": Technique(
        name="indirect.irradiance",
        approximates="indirect_radiance",
        summary="the captured cube as surface elements, gathered by every shaded point from where it is itself",
        source="wallace-1989",
        limits=(
            "What the cube does not see from the subject's centre does not shine; the subject neither shades itself nor "
            "reflects onto itself; bounces leak through what stands between two surfaces that the cube sees."
        ),
        passes=_passes,
        parameters=CAPTURE,
    )
}
