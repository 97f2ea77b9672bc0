"""The talk's effects in one picture: each part drawn by the technique that ports the talk's shader for it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING

from realtime.camera import Camera, sensor_camera
from realtime.character_frames import about, run, seen_by, with_settings
from realtime.character_parts import TALK, part_kind
from realtime.character_view import Behind, DrawnPart, draw_parts, see, shade
from realtime.frame import Frame, is_environment
from realtime.gbuffer import resolve_pass
from realtime.graph import plan
from realtime.talk_cube import SURROUNDINGS, cube_bound, cube_passes
from realtime.technique import Technique
from realtime.techniques import cornea_talk, defocus_talk, displacement_talk, indirect_talk, layered_talk
from realtime.techniques import translucency_talk as translucency
from scenes.materials import Layered, Principled, Translucent
from scenes.mesh import Mesh
from scenes.model import ConstantLight, EnvironmentLight
from scenes.shapes import Eye, Relief, Shape

if TYPE_CHECKING:
    import moderngl

EYE = cornea_talk.TECHNIQUES["cornea.talk"]
BODY = translucency.TECHNIQUES["translucency.talk"]
SUIT = layered_talk.TECHNIQUES["layered.talk"]
RELIEF = displacement_talk.TECHNIQUES["displacement.talk"]
INDIRECT = indirect_talk.TECHNIQUES["indirect.talk"]
DEFOCUS = defocus_talk.TECHNIQUES["defocus.talk"]


def collect_parts(frame: Frame) -> None:
    """Write `parts`, what the talk's techniques draw as a `DrawnPart` each, and `talk_cube`, if it is used."""
    frame.resources["parts"] = [
        _part(frame, shape, technique)
        for shape in frame.scene.shapes
        if (technique := _technique(frame, shape)) is not None
    ]


def _technique(frame: Frame, shape: Shape) -> Technique | None:
    material = frame.scene.materials[shape.material]
    for setting, is_one, technique in (
        ("eyes", isinstance(shape, Eye), EYE),
        ("translucency", isinstance(material, Translucent), BODY),
        ("suit", isinstance(material, Layered | Principled), SUIT),
        ("relief", isinstance(shape, Relief), RELIEF),
    ):
        if is_one:
            return technique if frame.settings[setting] == TALK else None
    return None


def _part(frame: Frame, shape: Shape, technique: Technique) -> DrawnPart:
    settings = technique.settings({})
    is_suit = technique is SUIT
    name = f"{technique.name} {shape.name}"
    part = about(frame, name, (shape.name,), settings, lambda mesh: not is_suit or mesh.shape == shape.name)
    features = frame.features
    if technique in (SUIT, RELIEF):  # they refuse a sky, which lights nothing of what the talk draws
        lamps = tuple(e for e in frame.scene.emitters if not isinstance(e, ConstantLight | EnvironmentLight))
        part.scene, features = part.scene.model_copy(update={"emitters": lamps}), replace(features, has_sky=False)
    steps = technique.passes(part.scene, features, settings)[:-1]  # the last one is for pixels
    return DrawnPart(part_kind(frame.scene, shape.name), part, plan(steps, "shaded").passes)


def draw_surfaces(view: Frame, which: Callable[[Mesh], bool] = lambda mesh: True, camera: Camera | None = None) -> None:
    """Write what `see` does of the meshes for which `which` holds, and `shaded`, with the talk's parts and its cube.

    camera : that of the view with other clip planes, by which parts are drawn: what is seen of a relief lies behind the
        polygons that it is drawn on
    """
    see(view, which)
    shade(view)
    shown = {mesh.shape for mesh in view.meshes if which(mesh)}
    parts: list[DrawnPart] = view.resources.get("parts", [])
    draw_parts(view, camera or view.camera, (p for p in parts if shown.intersection(p.frame.scene.subject)))
    if view.settings["indirect"] == TALK:
        _add_indirect(view)


def _add_indirect(view: Frame) -> None:
    """Add to `shaded` what the talk's blurred cube of the surroundings, if there are any, brings to the subject."""
    if not any(is_environment(mesh) for mesh in view.meshes):
        return
    settings = INDIRECT.settings({})
    part = about(view, "indirect.talk", view.scene.subject, settings)
    run(part, cube_passes(view.features, SURROUNDINGS))
    light = view.texture(view.size, 4)
    for unit, name in enumerate(("position", "normal", "whole")):
        view.resources[name].use(unit)
    light.bind_to_image(0, read=False, write=True)
    width, height = view.size
    with cube_bound(part, 3) as captured:
        shader = view.program("indirect_talk/lookup.comp", **captured)
        view.dispatch(shader, width, height, **indirect_talk.lookup_uniforms(part))
    light.use(0)
    view.resources["shaded"].bind_to_image(0)
    view.dispatch(view.program("character/add.comp"), width, height)


def blur_surroundings(frame: Frame) -> None:
    """Write `behind`: the talk's far pass, all but the subject beyond the plane that parts near and far, blurred."""
    own, planes = _defocused(frame)
    sensor = frame.scene.sensor
    width, height = defocus_talk.far_size(own)
    view = seen_by(frame, sensor_camera(sensor, planes.boundary, planes.far), defocus_talk.FAR_SAMPLES)
    view.scene = frame.scene.model_copy(update={"sensor": sensor.model_copy(update={"width": width, "height": height})})
    draw_surfaces(view, is_environment, sensor_camera(sensor, *frame.clip_planes))
    resolve_pass("shaded").run(view)
    depth = defocus_talk.depth_alone(own, (width, height), planes.boundary, planes.far, cut=True)
    own.resources["far"] = defocus_talk.Picture(_filtered(view), depth)
    defocus_talk.blur_far(own)
    frame.resources["behind"] = Behind(own.resources["background"], planes.boundary)


def blur_near(frame: Frame) -> None:
    """Blur `image`, the talk's near pass with `behind` in it, but for what is beyond the plane between them."""
    own, planes = _defocused(frame)
    size = (frame.scene.sensor.width, frame.scene.sensor.height)
    depth = defocus_talk.depth_alone(own, size, planes.front, planes.boundary, cut=planes.front > planes.near)
    own.resources["close"] = defocus_talk.Picture(_filtered(frame), depth)
    defocus_talk.blur_near(own)
    frame.resources["image"] = own.resources["image"]


def _defocused(frame: Frame) -> tuple[Frame, defocus_talk.Planes]:
    """The frame for passes of `defocus.talk`, which write into it alone, and its clip planes, found once."""
    own = with_settings(frame, DEFOCUS.settings({}))
    own.resources = {}
    return own, frame.once("talk planes", lambda: defocus_talk.planes_of(own))


def _filtered(frame: Frame) -> moderngl.Texture:
    """The `image` as a blur reads it: between its pixels, and at its border rather than beyond."""
    image: moderngl.Texture = frame.resources["image"]
    image.filter = (frame.context.LINEAR, frame.context.LINEAR)
    image.repeat_x = image.repeat_y = False
    return image
