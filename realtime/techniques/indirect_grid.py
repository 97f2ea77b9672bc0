"""A grid of probes over the subject's box, and what the subject hides and reflects of itself by rays traced once."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from realtime.capture import Surfels, bounce_passes, reflected
from realtime.frame import Frame
from realtime.gbuffer import gbuffer_pass, resolve_pass
from realtime.graph import Pass
from realtime.probe_grid import ProbeGrid, probe_passes
from realtime.subject import Transfer, by_mesh, draw_received_pass, subject_surfels_pass, transfer_pass
from realtime.technique import Parameter, Technique
from realtime.techniques.indirect_irradiance import SUBJECT_SURFELS
from realtime.techniques.indirect_probe import CAPTURE, captured
from scenes.checks import SettingValue
from scenes.features import Features
from scenes.model import Scene

PROBES = Parameter("probes", 4, (1, 2, 4, 6), "probes along each side of the subject's box", (1, 16))
DIRECTIONS = Parameter("directions", 64, (32, 64, 128, 256), "rays by which a point finds what hides it", (1, 4096))


def _passes(scene: Scene, features: Features, settings: Mapping[str, SettingValue]) -> list[Pass]:
    bumpy = "the subject is not convex: what a point receives is found at the vertices, past the subject itself"
    hides = "the subject is convex: it hides and lights no part of itself" if features.subject_is_convex else ""
    light, transport, bounce = bounce_passes(features, lights_itself=not features.subject_is_convex)
    passes = [
        gbuffer_pass(),
        *captured(features, settings),
        subject_surfels_pass(int(settings[SUBJECT_SURFELS.name])),
        transfer_pass(features, int(settings[DIRECTIONS.name])),
        light,
        transport,
        Pass(
            "own transport",
            _own_transport,
            reads=("surfels", "transfer", "transport"),
            writes=("transport",),
            skip=hides,
            is_baked=True,
        ),
        bounce,
        *probe_passes(int(settings[PROBES.name])),
        Pass(
            "shade",
            _shade,
            reads=("position", "normal", "albedo", "probes"),
            writes=("shaded",),
            skip="" if features.subject_is_convex else bumpy,
        ),
        Pass(
            "receive",
            _receive,
            reads=("surfels", "probes", "transfer", "lit"),
            uses=("reflected",),
            writes=("received",),
            skip=hides,
        ),
        draw_received_pass(skip=hides),
        resolve_pass("shaded"),
    ]
    if black := _why_black(features):
        return [*(replace(step, skip=black) for step in passes), Pass("black", _black, writes=("image",))]
    return passes


def _why_black(features: Features) -> str:
    if features.is_dark:
        return "no emitter is present: the image is black"
    if features.nothing_reflects:
        return "every surface is black, and so is the image"
    if features.subject_is_convex and features.brightest_reflectance == 0:
        return "nothing sends light back to a convex subject: the image is black"
    return ""


def _black(frame: Frame) -> None:
    sensor = frame.scene.sensor
    frame.resources["image"] = frame.context.texture(
        (sensor.width, sensor.height), 4, bytes(16 * sensor.width * sensor.height), dtype="f4"
    )


def _own_transport(frame: Frame) -> None:
    resources = frame.resources
    surfels: Surfels = resources["surfels"]
    transfer: Transfer = resources["transfer"]
    buffers = (surfels.buffer, resources["transport"], transfer.hits, transfer.vectors)
    for binding, buffer in enumerate(buffers):
        buffer.bind_to_storage_buffer(binding)
    shader = frame.program("indirect_grid/own_transport.comp")
    own = surfels.count - surfels.surroundings
    frame.dispatch(shader, own, group=(1, 1), **surfels.uniforms(), **transfer.uniforms())


def _shade(frame: Frame) -> None:
    resources = frame.resources
    grid: ProbeGrid = resources["probes"]
    shaded = frame.texture(frame.size, 4)
    for unit, name in enumerate(("position", "normal", "albedo")):
        resources[name].use(unit)
    grid.coefficients.bind_to_storage_buffer(2)
    shaded.bind_to_image(0, read=False, write=True)
    frame.dispatch(frame.program("indirect_grid/shade.comp"), *frame.size, **grid.uniforms())
    resources["shaded"] = shaded


def _receive(frame: Frame) -> None:
    surfels: Surfels = frame.resources["surfels"]
    grid: ProbeGrid = frame.resources["probes"]
    transfer: Transfer = frame.resources["transfer"]
    receivers = transfer.receivers
    received = frame.context.buffer(reserve=receivers.vertices * 16)
    buffers = (receivers.buffer, reflected(frame), grid.coefficients, transfer.vectors, received, transfer.hits)
    for binding, buffer in enumerate(buffers):
        buffer.bind_to_storage_buffer(binding)
    frame.dispatch(
        frame.program("indirect_grid/receive.comp"),
        receivers.vertices,
        group=(64, 1),
        first=receivers.count - receivers.vertices,
        **surfels.uniforms(),
        **transfer.uniforms(),
        **grid.uniforms(),
    )
    frame.resources["received"] = by_mesh(frame, received)


TECHNIQUES = {
    "indirect.grid": Technique(
        name="indirect.grid",
        approximates="indirect_radiance",
        summary=(
            "a grid of probes over the subject's box, each with the bounced surroundings in nine harmonics; rays "
            "traced once tell what the subject hides and reflects of itself"
        ),
        source="greger-1998",
        limits=(
            "What the cube does not see from the subject's centre does not shine; bounces and probes look through "
            "what stands between two surfaces that the cube sees. Light around the subject has no more detail than "
            "nine harmonics hold. What a subject that is not convex receives is interpolated between its vertices."
        ),
        passes=_passes,
        parameters=(*CAPTURE, SUBJECT_SURFELS, PROBES, DIRECTIONS),
    )
}
