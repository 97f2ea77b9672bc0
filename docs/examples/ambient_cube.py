"""An ambient cube: the light at the subject's centre from six directions, and from it that of any normal.

The light is captured by a pass that ships with lightgauge; two small shaders are this technique's own.
"""

from collections.abc import Mapping

from realtime.capture import Surfels, bounce_passes, reflected
from realtime.frame import Frame
from realtime.gbuffer import gbuffer_pass, resolve_pass
from realtime.graph import Pass
from realtime.technique import Technique
from realtime.techniques.indirect_probe import CAPTURE, captured
from scenes.checks import SettingValue
from scenes.features import Features
from scenes.model import Scene


def _passes(scene: Scene, features: Features, settings: Mapping[str, SettingValue]) -> list[Pass]:
    return [
        gbuffer_pass(),
        *captured(features, settings),
        *bounce_passes(features),
        Pass("six sides", _gather, reads=("surfels", "lit"), uses=("reflected",), writes=("sides",)),
        Pass("shade", _shade, reads=("normal", "albedo", "sides"), writes=("shaded",)),
        resolve_pass("shaded"),
    ]


def _gather(frame: Frame) -> None:
    surfels: Surfels = frame.resources["surfels"]
    sides = frame.context.buffer(reserve=6 * 16)
    surfels.buffer.bind_to_storage_buffer(0)
    reflected(frame).bind_to_storage_buffer(1)
    sides.bind_to_storage_buffer(2)
    shader = frame.program("ambient_cube_gather.comp")
    frame.dispatch(shader, 6, group=(6, 1), centre=tuple(frame.subject_centre), **surfels.uniforms())
    frame.resources["sides"] = sides


def _shade(frame: Frame) -> None:
    shaded = frame.texture(frame.size, 4)
    frame.resources["normal"].use(1)
    frame.resources["albedo"].use(2)
    frame.resources["sides"].bind_to_storage_buffer(2)
    shaded.bind_to_image(0, read=False, write=True)
    frame.dispatch(frame.program("ambient_cube_shade.comp"), *frame.size)
    frame.resources["shaded"] = shaded


TECHNIQUES = {
    "mine.ambient_cube": Technique(
        name="mine.ambient_cube",
        approximates="indirect_radiance",
        summary="irradiance on the six sides of a cube at the subject's centre, blended by the squared normal",
        source="McTaggart (2004). Half-Life 2 / Valve Source Shading. Game Developers Conference.",
        limits="As one probe for all points of the subject; six numbers a channel cannot follow a small bright wall.",
        passes=_passes,
        parameters=CAPTURE,
    )
}
