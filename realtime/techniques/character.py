"""The whole character: everything that the other techniques draw, in one picture, each effect with its own switch.

Surfaces are drawn first, from every view through the lens; then what lies in them (eyes, bodies that light enters) and
before them (hair). What does not depend on the view is found once: shadow maps, the light between surfaces, the light
inside bodies, on irises and on hair.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from realtime.character_body import light_bodies, measure_bodies, put_bodies
from realtime.character_eyes import light_eyes, shade_eyes
from realtime.character_frames import seen_by, without_relief
from realtime.character_hair import hair_passes, put_hair
from realtime.character_light import received_passes
from realtime.character_parts import ACCURATE, OFF, TALK
from realtime.character_talk import blur_near, blur_surroundings, collect_parts, draw_surfaces
from realtime.character_view import put_behind
from realtime.frame import Frame
from realtime.gbuffer import resolve_pass
from realtime.graph import Pass
from realtime.lens import coc_scale, lens_views
from realtime.shadows import lights_pass, shadow_pass
from realtime.technique import Parameter, Technique
from realtime.techniques.cornea_anatomical import GEOMETRY, LIGHT
from scenes.checks import SettingValue
from scenes.features import Features
from scenes.model import Scene

VIEW_GRID = 2
"""Samples along each side of a pixel in each view through the lens."""

CHOICES = (ACCURATE, TALK, OFF)
EFFECTS = {
    "shadows": (
        CHOICES,
        "lamps by maps of many points, or of one each, or no surface hides a lamp; fibres shade each other in any case",
    ),
    "indirect": (
        CHOICES,
        "radiosity by traced rays and the sky, on hair too; the talk's blurred cube, not on hair; or none",
    ),
    "translucency": (CHOICES, "discrete ordinates, the talk's thickness, or bodies are as if they were Lambertian"),
    "eyes": (CHOICES, "true corneas, the talk's, or the white alone"),
    "suit": (CHOICES, "microfacets, the talk's three layers, or as if it were Lambertian"),
    "relief": (CHOICES, "rays through a quadtree, the talk's march, or a flat block as high as it is on the whole"),
    "hair": (CHOICES, "ribbons of fibres lit by all, the talk's lines, or none"),
    "lens": (CHOICES, "views through the lens, the talk's far and near pass, or a pinhole"),
}


def _parameters(default: str, lens: str) -> tuple[Parameter, ...]:
    chosen = {name: lens if name == "lens" else default for name in EFFECTS}
    return (
        *(Parameter(name, chosen[name], choices, words, off=OFF) for name, (choices, words) in EFFECTS.items()),
        Parameter("facets", 8, (1, 4, 8, 16), "points that stand for each lamp", (1, 4096)),
        Parameter("shadow_side", 512, (128, 256, 512), "texels along an edge of a shadow tile", (1, 4096)),
        Parameter("rays", 64, (16, 32, 64), "by which a vertex finds the light around it", (1, 4096)),
        Parameter("pieces", 2, (1, 2, 4), "points that stand for each lamp that shines into a body", (1, 256)),
        Parameter("cells", 32, (16, 24, 32), "along each edge of the grid of light inside a body", (4, 32)),
        Parameter("iterations", 16, (4, 8, 16), "times that light inside a body is scattered again", (1, 1000)),
        Parameter("order", 4, (4, 6, 8), "N of the S_N set of directions inside a body", (4, 8)),
        Parameter("light_side", 256, (128, 256, 512), "texels along an edge of what a lamp sees of a body", (1, 4096)),
        Parameter("layers", 8, (4, 8), "most layers of a body that a ray may cross", (1, 32)),
        *(replace(each, off=None) for each in (*GEOMETRY, *LIGHT) if each.name != "facets"),
        Parameter("views", 16, (4, 16, 64), "through the lens", (1, 4096)),
    )


def _passes(scene: Scene, features: Features, settings: Mapping[str, SettingValue]) -> list[Pass]:
    off = {name: f"{name} are switched off" if settings[name] == OFF else "" for name in EFFECTS}
    accurate = {name: settings[name] == ACCURATE for name in EFFECTS}
    unlit = "" if features.has_local_or_directional_lights else "no emitter but the sky: nothing casts a shadow map"
    traced = "" if accurate["indirect"] else "light from surfaces is not traced"
    whole = "" if features.has_media and accurate["translucency"] else "no body that light enters is drawn as one"
    seen_through = "" if features.has_eye and accurate["eyes"] else "no eye is drawn with its true cornea"
    drawn_alone = "" if TALK in settings.values() else "no part is drawn by a technique of the talk"
    sharp = "" if settings["lens"] == TALK and coc_scale(scene.sensor) else "nothing is blurred as in the talk"
    steps = [
        lights_pass(1 if settings["shadows"] == TALK else int(settings["facets"])),
        shadow_pass(int(settings["shadow_side"]), skip=off["shadows"] or unlit),
        *received_passes(int(settings["rays"]), skip=traced),
        Pass("measure bodies", measure_bodies, writes=("contents",), skip=whole, is_baked=True),
        Pass("light bodies", light_bodies, reads=("contents",), uses=("radiosity",), writes=("bodies",), skip=whole),
        Pass("light eyes", light_eyes, reads=("lights",), uses=UNSEEN, writes=("eyes",), skip=seen_through),
        Pass("parts", collect_parts, writes=("parts",), skip=drawn_alone),
        *hair_passes(scene, features, settings),
        Pass("far pass", blur_surroundings, reads=("lights",), uses=(*UNSEEN, "parts"), writes=("behind",), skip=sharp),
        Pass("views", _draw_views, reads=("lights",), uses=(*UNSEEN, *SEEN), writes=("image",)),
        Pass("near pass", blur_near, reads=("image",), writes=("image",), skip=sharp),
    ]
    return steps if settings["relief"] != OFF else [replace(step, run=without_relief(step.run)) for step in steps]


UNSEEN = ("shadow_atlas", "radiosity", "received")
SEEN = ("bodies", "eyes", "parts", "strands", "hair_samples", "hair_radiance", "hair_order", "behind")
"""What views are drawn with, if it is there."""


def _draw_views(frame: Frame) -> None:
    if frame.settings["lens"] == ACCURATE and coc_scale(frame.scene.sensor) > 0:
        _accumulate(frame)
        return
    view = seen_by(frame, frame.camera, frame.grid)
    _draw(view)
    resolve_pass("shaded").run(view)
    frame.resources["image"] = view.resources["image"]


def _accumulate(frame: Frame) -> None:
    """The mean of views from all over the lens."""
    context, sensor, count = frame.context, frame.scene.sensor, int(frame.settings["views"])
    size, fine = (sensor.width, sensor.height), (VIEW_GRID * sensor.width, VIEW_GRID * sensor.height)
    means = (frame.texture(size, 4), frame.texture(size, 4))
    frame.submit(context.framebuffer(means).clear)
    add = frame.program("defocus/accumulate.comp", GRID=VIEW_GRID)
    wide = sensor.model_copy(update={"width": fine[0], "height": fine[1]})
    for camera in lens_views(wide, *frame.clip_planes, count):
        view = seen_by(frame, camera, VIEW_GRID)
        _draw(view)
        view.resources["shaded"].use(0)
        for unit, texture in enumerate(means):
            texture.bind_to_image(unit, read=True, write=True)
        frame.dispatch(add, *size, weight=1 / count)
    frame.resources["image"] = means[0]


def _draw(view: Frame) -> None:
    """Write `shaded`: all that a view shows."""
    resources = view.resources
    draw_surfaces(view)
    if "behind" in resources:
        put_behind(view, resources["behind"])
    if "eyes" in resources:
        shade_eyes(view)
    if "bodies" in resources:
        put_bodies(view)
    if "hair_radiance" in resources:
        put_hair(view)


LIMITS = (
    "Lamps are points spread over them. Surfaces that are not Lambertian send light on as if they were, and reflect "
    "all light but that of lamps as if it came evenly from all around. Hair casts no shadow on what is not hair, "
    "bodies cast the shadow of something opaque, and nothing casts one into a body. Bodies are drawn one after "
    "another, the farthest first, and hide hair that is behind them."
)
TECHNIQUES = {
    t.name: t
    for t in (
        Technique(
            name="character.talk",
            approximates="full_radiance",
            summary="the talk's techniques for every effect, in one picture",
            source="nvidia-2005",
            limits=(
                f"{LIMITS} The limits of the talk's techniques besides: of each part that one of them draws, no more "
                "light is known than it knows."
            ),
            passes=_passes,
            parameters=_parameters(TALK, TALK),
            grid=4,
        ),
        Technique(
            name="character.accurate",
            approximates="full_radiance",
            summary="the best technique for every effect, lit by everything, through the lens",
            source="goral-1984",
            limits=LIMITS,
            passes=_passes,
            parameters=_parameters(ACCURATE, ACCURATE),
            grid=4,
        ),
    )
}
