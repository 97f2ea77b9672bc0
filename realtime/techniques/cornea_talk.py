"""The eye as NVIDIA's talk on the GeForce 7800 GTX demos ("Luna", 2005) publishes it.

Its fragments are polygons; the iris behind them is ray-traced in object space. The talk's lights have colours without
a radiometric scale and without falloff: the colour of a light is set here so that albedo * N.L * colour is physically
right at the eye's centre.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from realtime.eye import (
    EyeModel,
    bind_surroundings,
    eye_model,
    eye_uniforms,
    iris_texture,
    is_eye,
    mirrored_passes,
    sclera_albedo,
    the_eye,
    to_eye_frame,
)
from realtime.eye_shadows import draw_eye_shadows
from realtime.frame import Frame, columns
from realtime.gbuffer import resolve_pass
from realtime.graph import Pass
from realtime.shader import set_uniforms
from realtime.shadows import scene_lights
from realtime.talk_cube import two_lights
from realtime.technique import Parameter, Technique
from scenes.checks import SettingValue
from scenes.features import Features
from scenes.model import Scene
from scenes.procedural import rotation_xyz
from scenes.shapes import Eye

GEOMETRY = (
    Parameter(
        "iris_curvature",
        2.0,
        (1.5, 2.0, 4.0),
        "radius of the iris' sphere over that of the sclera, for an eye whose own iris is flat",
        (1, 100),
        tuned=(1, 20),
    ),
    Parameter(
        "surface",
        "interpolated",
        ("interpolated", "spheres"),
        "positions and normals: interpolated from the polygons, as published, or those of the true spheres",
    ),
)
SHADING = (
    Parameter("branching", True, (False, True), "branch to the iris, or compute both and select", off=False),
    Parameter("shadow_side", 512, (256, 512, 1024), "texels along an edge of a light's shadow map", (1, 4096)),
)
MIRROR = (Parameter("side", 128, (64, 128, 256), "texels along an edge of the reflection cube's faces", (1, 2048)),)


def exit_branch_is_dead(model: EyeModel) -> str:
    """Why no ray that enters through the cornea leaves through it; empty if some may.

    Refraction bends a ray to within asin(1 / n) of the normal. Its chord of the cornea's sphere then spans at least
    pi - 2 asin(1 / n) as seen from the sphere's centre. It cannot end in a cap of half angle `a` in which it begins if
    that exceeds 2 a: cos(a) >= 1 / n.
    """
    needed = 1 / model.cap_cosine
    if model.ior < needed:
        return ""
    return f"no refracted ray leaves through the cornea's side: n = {model.ior:g} >= 1 / cos(cap) = {needed:.4g}"


def talk_iris_sphere(model: EyeModel, curvature: float) -> tuple[float, float]:
    """Centre (on the axis) and radius of the sphere of the iris.

    That of the eye's own iris if it is a bowl; else one of `curvature` sclera radii through the limbus.
    """
    if model.iris_curvature:
        return model.iris_centre, model.iris_curvature
    radius = curvature * model.sclera_radius
    return model.limbus_height + math.sqrt(radius**2 - model.limbus_radius**2), radius


def _exit_pass(scene: Scene) -> Pass:
    model = eye_model(the_eye(scene))
    return Pass(
        "exit through the cornea's side",
        lambda frame: frame.resources.update(exit_branch=True),
        writes=("exit_branch",),
        skip=exit_branch_is_dead(model),
        is_baked=True,
    )


def _uv_passes(scene: Scene, features: Features, settings: Mapping[str, SettingValue]) -> list[Pass]:
    return [
        _exit_pass(scene),
        Pass("eye", lambda frame: _draw(frame, IRIS_UV=1), uses=("exit_branch",), writes=("shaded",)),
        resolve_pass("shaded"),
    ]


def _iris_passes(scene: Scene, features: Features, settings: Mapping[str, SettingValue]) -> list[Pass]:
    return _shading_passes(scene, features)


def _eye_passes(scene: Scene, features: Features, settings: Mapping[str, SettingValue]) -> list[Pass]:
    mirrored = mirrored_passes(features, int(settings["side"]), int(settings["shadow_side"]))
    return [*mirrored, *_shading_passes(scene, features, WHOLE_EYE=1)]


def _shading_passes(scene: Scene, features: Features, **seen: int) -> list[Pass]:
    lamps = {light.shape for light in scene.emitters if light.type == "area"}
    others = [s.name for s in scene.shapes if s.name not in scene.subject and s.name not in lamps]
    unshadowed = "" if others else "nothing but lamps is beside the eye: nothing casts a shadow on it"
    if not features.has_local_or_directional_lights:
        unshadowed = "no emitter but the sky: nothing casts a shadow map"
    return [
        _exit_pass(scene),
        Pass("two lights", _two_lights, writes=("two_lights",)),
        Pass("eye's shadow maps", _shadows, reads=("two_lights",), writes=("eye_shadows",), skip=unshadowed),
        Pass(
            "eye",
            lambda frame: _draw(frame, **seen),
            reads=("two_lights",),
            uses=("exit_branch", "eye_shadows", "sky", "cube_radiance"),
            writes=("shaded",),
        ),
        resolve_pass("shaded"),
    ]


def _two_lights(frame: Frame) -> None:
    centre = np.array(the_eye(frame.scene).position)
    frame.resources["two_lights"] = two_lights(scene_lights(frame, facets=64), centre)


def _shadows(frame: Frame) -> None:
    eye = the_eye(frame.scene)
    places = [place for place, _ in frame.resources["two_lights"]]
    side = int(frame.settings["shadow_side"])
    frame.resources["eye_shadows"] = draw_eye_shadows(frame, eye_model(eye), np.array(eye.position), places, side)


def _draw(frame: Frame, **seen: int) -> None:
    context, resources, settings = frame.context, frame.resources, frame.settings
    eye = the_eye(frame.scene)
    model = eye_model(eye)
    centre, radius = talk_iris_sphere(model, float(settings["iris_curvature"]))
    defines = {
        **seen,
        **({"EXIT_BRANCH": 1} if "exit_branch" in resources else {}),
        **({"TRUE_SPHERES": 1} if settings["surface"] == "spheres" else {}),
    }
    uniforms = {
        **eye_uniforms(frame, eye, model),
        "eye_position": eye.position,
        "talk_iris_centre": centre,
        "talk_iris_radius": radius,
    }
    if "IRIS_UV" not in seen:
        shading_defines, shading_uniforms = _shading(frame, eye)
        defines |= shading_defines
        uniforms |= shading_uniforms
    shader = frame.program("cornea_talk/eye.vert", "cornea_talk/eye.frag", **defines)
    set_uniforms(shader, **uniforms)
    shaded = frame.texture(frame.size, 4)
    framebuffer = context.framebuffer([shaded], context.depth_renderbuffer(frame.size))
    framebuffer.use()
    frame.submit(framebuffer.clear)
    context.enable_only(context.DEPTH_TEST | context.CULL_FACE)
    frame.draw(shader, frame.camera, lambda mesh: is_eye(eye, mesh))
    resources["shaded"] = shaded


def _shading(frame: Frame, eye: Eye) -> tuple[dict[str, int], dict[str, Any]]:
    """Bind what shading reads beyond the geometry; returns its defines and uniforms."""
    resources = frame.resources
    defines = bind_surroundings(frame) | ({"BRANCHING": 1} if frame.settings["branching"] else {})
    iris_texture(frame, eye).use(1)
    rotation = rotation_xyz(eye.rotation_deg)
    places = [np.array(place) for place, _ in resources["two_lights"]]
    seen_from_eye = [to_eye_frame(eye, p[:3]) if p[3] else p[:3] @ rotation for p in places]
    uniforms: dict[str, Any] = {
        "sclera_albedo": sclera_albedo(frame.scene, eye),
        "light_places": [(*v, p[3]) for v, p in zip(seen_from_eye, places, strict=True)],
        "light_colors": [tuple(color) for _, color in resources["two_lights"]],
    }
    if "eye_shadows" in resources:
        shadows = resources["eye_shadows"]
        shadows.maps.use(2)
        defines["SHADOWS"] = 1
        uniforms["shadow_matrices"] = [columns(camera.matrix) for camera in shadows.cameras]
        uniforms["shadow_origins"] = [tuple(camera.eye) for camera in shadows.cameras]
        uniforms["shadow_axes"] = [tuple(camera.forward) for camera in shadows.cameras]
    return defines, uniforms


LIMITS = (
    "As published: the eyeball is a sphere, the iris a bowl through the limbus. Polygons are the surface: their "
    "positions and normals are off by the square of their size. Nothing hides the eye."
)
LIGHT_LIMITS = (
    f"{LIMITS} Two lights without falloff, whose light is neither bent nor focused nor weakened by the cornea nor "
    "thinned by n² on its way out; wrapped diffuse light adds a fifth; no light but theirs reaches iris and sclera."
)

TECHNIQUES = {
    t.name: t
    for t in (
        Technique(
            name="cornea.talk_uv",
            approximates="iris_uv",
            summary="the talk's object-space ray through a polygon eyeball to a bowl-shaped iris",
            source="nvidia-2005",
            limits=LIMITS,
            passes=_uv_passes,
            parameters=GEOMETRY,
            channels=(0, 1),
            grid=1,
        ),
        Technique(
            name="cornea.talk_iris",
            approximates="iris_radiance",
            summary="the talk's iris: wrapped diffuse light of two lights, weakened by its Fresnel term",
            source="nvidia-2005",
            limits=LIGHT_LIMITS,
            passes=_iris_passes,
            parameters=(*GEOMETRY, *SHADING),
        ),
        Technique(
            name="cornea.talk",
            approximates="eye_radiance",
            summary="the talk's eye: ray-traced iris, white, highlights of exponent 4000, reflection cube",
            source="nvidia-2005",
            limits=(
                f"{LIGHT_LIMITS} The four blended parameters include the normal: the iris' highlight sits on the bowl, "
                "not on the wet surface."
            ),
            passes=_eye_passes,
            parameters=(*GEOMETRY, *SHADING, *MIRROR),
        ),
    )
}
