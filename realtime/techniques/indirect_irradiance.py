"""The captured surroundings as surface elements that each point of the subject gathers from its own place."""

from __future__ import annotations

from collections.abc import Mapping

from realtime.capture import Surfels, bind_visibility, bounce_passes, reflected
from realtime.frame import Frame
from realtime.gbuffer import gbuffer_pass, resolve_pass
from realtime.graph import Pass
from realtime.subject import Visibility, by_mesh, draw_received_pass, subject_passes
from realtime.technique import Parameter, Technique
from realtime.techniques.indirect_probe import CAPTURE, captured
from scenes.checks import SettingValue
from scenes.features import Features
from scenes.model import Scene

SUBJECT_SURFELS = Parameter(
    "subject_surfels", 512, (64, 128, 256, 512, 1024), "surfels on each mesh of the subject", (1, 8192)
)


def _passes(scene: Scene, features: Features, settings: Mapping[str, SettingValue]) -> list[Pass]:
    convex = "the subject is convex: what a point receives is gathered at every pixel"
    bumpy = "the subject is not convex: what a point receives is gathered at the vertices, past the subject itself"
    return [
        gbuffer_pass(),
        *captured(features, settings),
        *subject_passes(features, int(settings[SUBJECT_SURFELS.name])),
        *bounce_passes(features, lights_itself=not features.subject_is_convex),
        Pass(
            "gather",
            _gather,
            reads=("position", "normal", "albedo", "surfels", "lit"),
            uses=("reflected",),
            writes=("shaded",),
            skip="" if features.subject_is_convex else bumpy,
        ),
        Pass(
            "gather at vertices",
            _gather_vertices,
            reads=("surfels", "visibility", "lit"),
            uses=("reflected",),
            writes=("received",),
            skip=convex if features.subject_is_convex else "",
        ),
        draw_received_pass(skip=convex if features.subject_is_convex else ""),
        resolve_pass("shaded"),
    ]


def _gather(frame: Frame) -> None:
    resources = frame.resources
    surfels: Surfels = resources["surfels"]
    shaded = frame.texture(frame.size, 4)
    for unit, name in enumerate(("position", "normal", "albedo")):
        resources[name].use(unit)
    surfels.buffer.bind_to_storage_buffer(0)
    reflected(frame).bind_to_storage_buffer(1)
    shaded.bind_to_image(0, read=False, write=True)
    frame.dispatch(frame.program("indirect/gather.comp"), *frame.size, **surfels.uniforms())
    resources["shaded"] = shaded


def _gather_vertices(frame: Frame) -> None:
    surfels: Surfels = frame.resources["surfels"]
    visibility: Visibility = frame.resources["visibility"]
    receivers = visibility.receivers
    received = frame.context.buffer(reserve=receivers.vertices * 16)
    surfels.buffer.bind_to_storage_buffer(0)
    reflected(frame).bind_to_storage_buffer(1)
    receivers.buffer.bind_to_storage_buffer(2)
    received.bind_to_storage_buffer(4)
    frame.dispatch(
        frame.program("indirect/gather_vertices.comp"),
        receivers.vertices,
        group=(1, 1),
        first=receivers.count - receivers.vertices,
        **surfels.uniforms(),
        **bind_visibility(frame),
    )
    frame.resources["received"] = by_mesh(frame, received)


TECHNIQUES = {
    "indirect.irradiance": Technique(
        name="indirect.irradiance",
        approximates="indirect_radiance",
        summary="the captured cube as surface elements, gathered by every point of the subject from where it is itself",
        source="wallace-1989",
        limits=(
            "What the cube does not see from the subject's centre does not shine; bounces leak through what "
            "stands between "
            "two surfaces that the cube sees. What a subject that is not convex receives is interpolated between "
            "its vertices."
        ),
        passes=_passes,
        parameters=(*CAPTURE, SUBJECT_SURFELS),
    )
}
