"""Soft shadows of a ball of light, by the cheaper of two ways that keeps to a wanted error.

One map of distances around the ball's centre with percentage-closer soft shadows (Fernando 2005), or the mean over the
hard shadows of points spread in the ball (Heckbert, Herf 1997, "Simulating Soft Shadows with Graphics Hardware"). The
points are as dense as 1 / sqrt(R² - r²), which looks like a uniform disk from everywhere; points on the ball's surface
converge to another shadow.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np

from realtime.camera import cube_cameras
from realtime.frame import Frame
from realtime.gbuffer import resolve_pass
from realtime.graph import Pass, Skip
from realtime.shader import set_uniforms
from realtime.technique import Parameter, Technique
from realtime.vcm import box_corners, is_outside, receivers_pass, the_omni_light
from scenes.checks import SettingValue
from scenes.errors import InputError
from scenes.features import Features
from scenes.image import Float64
from scenes.model import Scene, SphereLight

if TYPE_CHECKING:
    import moderngl

BLOCKER_TAPS, FILTER_TAPS = 24, 48

AUTO, PCSS, POINTS = "auto", "pcss", "lights"

CHEAP_POINTS = 4
"""As many maps, read at one place a sample, are drawn and read faster by llvmpipe than one that is read at
BLOCKER_TAPS + FILTER_TAPS places.
"""

SPREADING_STEPS = 400
"""Rounds of `ball_points`; eight times as many moves lower the error of the projections by 3 to 7 %."""

PARAMETERS = (
    Parameter("method", AUTO, (AUTO, PCSS, POINTS), "percentage-closer soft shadows, or points of light"),
    Parameter(
        "wanted_rmse", 0.02, (0.012, 0.015, 0.02, 0.04), "error near shadows that decides on the points", (0.011, 1)
    ),
    Parameter("side", 512, (128, 256, 512, 1024), "texels along an edge of a map's faces", (16, 4096)),
)

NOTHING_THERE = 3e38
"""Distance where a map shows nothing."""

POINTS_FLOOR, POINTS_ERROR, POINTS_RESOLVED, POINTS_POWER = 0.0105, 0.041, 0.19, 0.68
"""Error near shadows of N points: FLOOR is left of edges at 4 x 4 samples a pixel in maps of 512²; to it adds, squared,
the smaller of ERROR W / N for a light of W pixels radius, whose steps a pixel averages, and RESOLVED / N^POWER for one
whose steps are seen. Fitted in a room with lights of 2 to 20 cm radius, where they are right to a third.
"""

PCSS_FLOOR, PCSS_ERROR = 0.02, 0.36
"""Of percentage-closer soft shadows, from the same room: the floor, and what adds per radius over distance."""


def points_for(wanted_rmse: float, radius_px: float) -> int:
    """How many points keep to an error near shadows, with a light whose radius is some pixels where the subject is."""
    more = math.sqrt(wanted_rmse**2 - POINTS_FLOOR**2)
    averaged, resolved = POINTS_ERROR * radius_px / more, math.pow(POINTS_RESOLVED / more, 1 / POINTS_POWER)
    return max(1, math.ceil(min(averaged, resolved)))


def pcss_rmse(size: float) -> float:
    """The error near shadows of percentage-closer soft shadows; `size` is the light's radius over its distance."""
    return math.hypot(PCSS_FLOOR, PCSS_ERROR * size)


def _semicircle_means(count: int) -> Float64:
    """Means of the x of a unit disk over `count` strips of equal area, from left to right."""
    x = np.linspace(-1, 1, 4097)
    area = 0.5 + (x * np.sqrt(1 - x * x) + np.arcsin(x)) / np.pi
    edges = np.interp(np.linspace(0, 1, count + 1), area, x)
    moment = -2 * (1 - edges**2) ** 1.5 / (3 * np.pi)
    means: Float64 = count * np.diff(moment)
    return means


@lru_cache
def ball_points(count: int) -> Float64:
    """Points (count, 3) in the unit ball whose projections onto any line spread as those of a uniform disk.

    A ball of the density 1 / sqrt(1 - r²), and it alone, looks like a uniform disk from everywhere. Paulin et al. 2020,
    "Sliced Optimal Transport Sampling", section 4: move all points along random directions to where the sorted
    projections should be.
    """
    if count == 1:
        return np.zeros((1, 3))
    rng = np.random.default_rng(1)
    points = rng.normal(size=(count, 3)) / 2
    targets = _semicircle_means(count)
    for step in range(SPREADING_STEPS):
        axes = np.linalg.qr(rng.normal(size=(3, 3)))[0]
        along = points @ axes
        moves = targets[np.argsort(np.argsort(along, axis=0), axis=0)] - along
        points = points + (1 - step / SPREADING_STEPS) * moves @ axes.T
    return points


def _passes(scene: Scene, features: Features, settings: Mapping[str, SettingValue]) -> list[Pass]:
    the_omni_light(scene)
    return [
        receivers_pass(),
        Pass("soft shadow", _shadow, reads=("position", "face_normal"), writes=("visibility",)),
        resolve_pass("visibility"),
    ]


def _choice(frame: Frame, centre: Float64, radius: float) -> tuple[str, int]:
    """The way to take, PCSS or POINTS, and the number of maps that it needs."""
    method, wanted = str(frame.settings["method"]), float(frame.settings["wanted_rmse"])
    points = points_for(wanted, radius / _pixel_at_subject(frame))
    expected = pcss_rmse(radius / float(np.linalg.norm(centre - frame.subject_centre)))
    if radius == 0:
        frame.skipped.append(Skip("percentage-closer filter, all maps but one", "a point light has no size"))
        return POINTS, 1
    if method == PCSS:
        return PCSS, 1
    if method == AUTO and points > CHEAP_POINTS and expected <= wanted:
        why = f"one filtered map keeps to the wanted error: about {expected:.3f} of {wanted:g}"
        frame.skipped.append(Skip(f"maps of {points} points", why))
        return PCSS, 1
    if method == AUTO:
        why = (
            f"hard maps are quicker: {points} of them suffice"
            if points <= CHEAP_POINTS
            else f"its error is about {expected:.3f}, {wanted:g} is wanted"
        )
        frame.skipped.append(Skip("percentage-closer filter", why))
    return POINTS, points


def _pixel_at_subject(frame: Frame) -> float:
    """Width of a pixel at the subject's distance from the sensor."""
    sensor = frame.scene.sensor
    across = sensor.width if sensor.fov_axis == "x" else sensor.height
    distance = float(np.linalg.norm(frame.subject_centre - np.array(sensor.origin)))
    return 2 * distance * math.tan(math.radians(sensor.fov_deg) / 2) / across


def _shadow(frame: Frame) -> None:
    index, centre = the_omni_light(frame.scene)
    light = frame.scene.emitters[index]
    radius = light.radius if isinstance(light, SphereLight) else 0.0
    method, count = _choice(frame, centre, radius)
    distances = _map(frame, int(frame.settings["side"]))
    framebuffer = frame.context.framebuffer([distances], frame.context.depth_renderbuffer(distances.size))
    visibility = frame.texture(frame.size, 4)
    frame.submit(frame.context.framebuffer([visibility]).clear)
    draw_distances = frame.program("raster/mesh.vert", "shadow_soft/distances.frag")
    set_uniforms(draw_distances, ball_centre=tuple(centre), ball_radius=radius)
    boxes = {mesh.name: box_corners(mesh) for mesh in frame.meshes if mesh.name != f"emitter-{index}"}
    drawn = 0
    for point in centre + radius * ball_points(count):
        drawn += _draw_distances(frame, draw_distances, framebuffer, point, boxes)
        for unit, texture in enumerate((frame.resources["position"], frame.resources["face_normal"], distances)):
            texture.use(unit)
        visibility.bind_to_image(0)
        uniforms: dict[str, Any] = {"centre": tuple(point), "share": 1 / count}
        if method == PCSS:
            shader = frame.program("shadow_soft/pcss.comp", BLOCKER_TAPS=BLOCKER_TAPS, FILTER_TAPS=FILTER_TAPS)
            nearest = float(np.frombuffer(distances.read(), dtype=np.float32).min())
            frame.dispatch(shader, *frame.size, radius=radius, nearest=nearest, **uniforms)
        else:
            frame.dispatch(frame.program("shadow_soft/point.comp"), *frame.size, **uniforms)
    total = 6 * count * len(boxes)
    if drawn < total:
        left_out = f"{total - drawn} of {total} draws into the faces of the maps"
        frame.skipped.append(Skip(left_out, "their boxes lie outside the face's frustum"))
    frame.resources["visibility"] = visibility


def _map(frame: Frame, side: int) -> moderngl.Texture:
    """Six faces of `side` texels, side by side."""
    largest = int(frame.context.info["GL_MAX_TEXTURE_SIZE"])
    if 6 * side > largest:
        raise InputError(
            f"Found side = {side}; its map needs a texture {6 * side} texels wide, and this GPU allows {largest}. "
            f"Set side to {largest // 6} or less."
        )
    return frame.texture((6 * side, side), 1)


def _draw_distances(
    frame: Frame, shader: Any, framebuffer: moderngl.Framebuffer, place: Float64, boxes: Mapping[str, Float64]
) -> int:
    """Draw the distances from a place of the meshes that have boxes into six tiles side by side; how many draws."""
    side, (middle, radius) = framebuffer.height, frame.bounds
    framebuffer.use()
    frame.submit(framebuffer.clear, red=NOTHING_THERE)
    frame.context.enable_only(frame.context.DEPTH_TEST)
    far = float(np.linalg.norm(place - middle)) + 1.01 * radius
    drawn = 0
    near = frame.near_plane(place, lambda mesh: mesh.name in boxes)
    for tile, camera in enumerate(cube_cameras(place, near, far)):
        framebuffer.viewport = (tile * side, 0, side, side)
        seen = {name for name, corners in boxes.items() if not is_outside(camera, corners)}
        frame.draw(shader, camera, lambda mesh, seen=seen: mesh.name in seen)  # type: ignore[misc]
        drawn += len(seen)
    return drawn


TECHNIQUES = {
    "shadow.soft": Technique(
        name="shadow.soft",
        approximates="visibility",
        summary="a ball's soft shadows by one filtered map or by many points, whichever keeps to the wanted error",
        source="fernando-2005",
        limits=(
            "Many points are right but for the resolution of maps and image. The filter takes all that blocks the "
            "light for a plane at its mean distance, and knows only what the ball's centre sees. Nothing casts that is "
            "closer to a point of the light than a thousandth of the scene's size, or rises less than a texel. The "
            "wanted error is a guide, fitted in one room: where edges fill the image, errors are up to twice as large."
        ),
        passes=_passes,
        parameters=PARAMETERS,
        channels=(0,),
        grid=4,
    )
}
