"""One irradiance probe at the subject's centre, looked up by the normal."""

from collections.abc import Mapping

from realtime.capture import Surfels, bounce_passes, reflected, surfel_passes
from realtime.frame import Frame
from realtime.gbuffer import gbuffer_pass, resolve_pass
from realtime.graph import Pass
from realtime.technique import Parameter, Technique
from scenes.checks import SettingValue
from scenes.errors import InputError
from scenes.features import Features
from scenes.model import Scene

CAPTURE = (
    Parameter("side", 96, (24, 48, 96), "texels along an edge of the captured cube's faces", (1, 2048)),
    Parameter("block", 6, (6, 8, 12, 24), "texels along an edge of a surfel; divides `side`", (1, 2048)),
    Parameter("shadow_side", 256, (64, 128, 256, 512), "texels along an edge of a shadow tile", (1, 2048)),
    Parameter("facets", 16, (1, 4, 16), "point lights that stand for each emitting surface", (1, 4096)),
)


def captured(features: Features, settings: Mapping[str, SettingValue]) -> list[Pass]:
    """The passes up to the lit surfels of the surroundings, as the settings of CAPTURE say.

    Raises
    ------
    InputError
        `block` does not divide `side`.
    """
    side, block, shadow_side, facets = (int(settings[p.name]) for p in CAPTURE)
    if side % block:
        raise InputError(f"Found side = {side} and block = {block}; block must divide side, as 6 divides 96.")
    return surfel_passes(features, side, block, shadow_side, facets)


def _passes(scene: Scene, features: Features, settings: Mapping[str, SettingValue]) -> list[Pass]:
    return [
        gbuffer_pass(),
        *captured(features, settings),
        *bounce_passes(features),
        Pass("project", _project, reads=("surfels", "lit"), uses=("reflected",), writes=("coefficients",)),
        Pass("probe", _shade, reads=("normal", "albedo", "coefficients"), writes=("shaded",)),
        resolve_pass("shaded"),
    ]


def _project(frame: Frame) -> None:
    surfels: Surfels = frame.resources["surfels"]
    coefficients = frame.context.buffer(reserve=9 * 16)
    surfels.buffer.bind_to_storage_buffer(0)
    reflected(frame).bind_to_storage_buffer(1)
    coefficients.bind_to_storage_buffer(2)
    shader = frame.program("indirect/project.comp")
    frame.dispatch(shader, 9, group=(9, 1), centre=tuple(frame.subject_centre), **surfels.uniforms())
    frame.resources["coefficients"] = coefficients


def _shade(frame: Frame) -> None:
    resources = frame.resources
    shaded = frame.texture(frame.size, 4)
    resources["normal"].use(1)
    resources["albedo"].use(2)
    resources["coefficients"].bind_to_storage_buffer(2)
    shaded.bind_to_image(0, read=False, write=True)
    frame.dispatch(frame.program("indirect/probe.comp"), *frame.size)
    resources["shaded"] = shaded


TECHNIQUES = {
    "indirect.probe": Technique(
        name="indirect.probe",
        approximates="indirect_radiance",
        summary="one probe at the subject's centre: bounced surroundings as SH irradiance, looked up by the normal",
        source="ramamoorthi-2001",
        limits=(
            "Every point of the subject is treated as if it were at its centre; the subject neither shades itself nor "
            "reflects onto itself; bounces leak through what stands between two surfaces that the cube sees."
        ),
        passes=_passes,
        parameters=CAPTURE,
    )
}
