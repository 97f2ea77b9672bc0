"""Depth of field as what it is: the mean of views from all over the lens.

How many are needed is predicted from a few of them, by how much they differ; where nothing is out of focus, what a
pinhole sees is what the lens sees.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from realtime.frame import Frame
from realtime.graph import Pass, Skip
from realtime.lens import INVISIBLE_PX, coc_radius, coc_scale, lens_views, planar_depth
from realtime.technique import Parameter, Technique
from realtime.views import LIMITS, SHADING, SHADING_USES, background, draw_pinhole, draw_view, shading_passes
from scenes.checks import SettingValue
from scenes.features import Features
from scenes.image import Float64
from scenes.model import PIXEL_GRID, Scene

if TYPE_CHECKING:
    import moderngl

VIEW_GRID = 2
"""Each view has 2 x 2 samples a pixel: a third to a quarter of the squared error, for twice the time or less."""

FEWEST_VIEWS, MOST_VIEWS = 16, 16384

PILOT_SHARE = 4
"""Views that a prediction may rest on one of: few do not find what is small and bright."""

PRECISION = 0.5
"""Of the error's law; see `views_for`."""

DARK = 0.01
"""A pixel with less than this part of the mean radiance counts as if it had it."""

PARAMETERS = (
    Parameter(
        "views", 0, (0, 16, 64, 256, 1024), "views through the lens; 0: as many as wanted_error needs", (0, MOST_VIEWS)
    ),
    Parameter("wanted_error", 0.015, (0.05, 0.015, 0.005), "relative root mean square error of a pixel", (1e-3, 1)),
)


def _passes(scene: Scene, features: Features, settings: Mapping[str, SettingValue]) -> list[Pass]:
    sharp = "" if coc_scale(scene.sensor) else "the camera is a pinhole: everything is sharp"
    given = f"views = {settings['views']} are given" if settings["views"] else ""
    return [
        *shading_passes(features, settings),
        Pass("measure blur", _measure, writes=("coc_radius",), skip=sharp),
        Pass(
            "predict", _predict, reads=("coc_radius",), uses=SHADING_USES, writes=("view_count",), skip=sharp or given
        ),
        Pass("views", _draw, uses=("coc_radius", "view_count", *SHADING_USES), writes=("image",)),
    ]


def _measure(frame: Frame) -> None:
    """The largest circle of confusion that is seen from the lens: also behind edges and beside the picture."""
    context, sensor = frame.context, frame.scene.sensor
    depth = context.depth_texture((sensor.width, sensor.height))
    framebuffer = context.framebuffer(depth_attachment=depth)
    context.enable_only(context.DEPTH_TEST)
    shader = frame.program("raster/mesh.vert", "defocus/depth.frag")
    largest = 0.0
    for camera in lens_views(sensor, *frame.clip_planes, FEWEST_VIEWS):
        framebuffer.use()
        frame.submit(framebuffer.clear)
        frame.draw(shader, camera)
        stored = np.frombuffer(depth.read(), dtype=np.float32)
        hit = stored[stored < 1].astype(np.float64)
        radii = np.abs(coc_radius(sensor, planar_depth(hit, *frame.clip_planes)))
        largest = max(largest, float(radii.max(initial=0.0)))
    frame.resources["coc_radius"] = largest


def views_for(wanted_error: float, variance: float) -> int:
    """How many views leave that relative error: it is PRECISION variance / views^1.25, squared.

    The law was fitted to pictures of 16 to 1024 views, held against their truth. It lies between that of points at
    random, 1 / views, and that of points spread evenly over a disk that an edge divides, 1 / views^1.5. It holds for
    edges and textures within a factor of 1.3 of the error (PRECISION 0.3 to 0.6); with small lamps the error is up to
    twice as large (1.6). The mean area of the circles of confusion says less: a scene with twice the area of another
    had a fifth of its error.
    """
    count = math.ceil(math.pow(PRECISION * variance / wanted_error**2, 0.8))
    return min(MOST_VIEWS, max(FEWEST_VIEWS, count))


def relative_variance(mean: Float64, mean_of_squares: Float64, count: int) -> float:
    """Mean over pixels and channels of the variance between views, over the squared mean of all views."""
    variance = np.maximum(mean_of_squares - mean**2, 0.0) * count / (count - 1)
    return float(np.mean(variance / (mean**2 + (DARK * mean.mean()) ** 2))) if mean.any() else 0.0


def _predict(frame: Frame) -> None:
    pilot = FEWEST_VIEWS
    while frame.resources["coc_radius"] > INVISIBLE_PX:
        frame.resources |= dict(zip(("mean", "mean_of_squares"), _means(frame, pilot), strict=True))
        mean, squares = (frame.read(name, 4)[..., :3].astype(np.float64) for name in ("mean", "mean_of_squares"))
        variance = relative_variance(mean, squares, pilot)
        count = views_for(float(frame.settings["wanted_error"]), variance)
        if count <= PILOT_SHARE * pilot:
            why = f"views differ by {math.sqrt(variance):.2g} of a pixel's radiance, root mean square"
            frame.skipped.append(Skip(f"more than {count} views", why))
            frame.resources["view_count"] = count
            return
        pilot *= PILOT_SHARE


def _draw(frame: Frame) -> None:
    radius = frame.resources.get("coc_radius", 0.0)
    if radius > INVISIBLE_PX:
        count = int(frame.settings["views"]) or frame.resources["view_count"]
        frame.resources["image"], _ = _means(frame, count)
        return
    if "coc_radius" in frame.resources:
        why = f"the largest circle of confusion has a radius of {radius:.2g} px; up to {INVISIBLE_PX} px cannot be seen"
        frame.skipped.append(Skip("views through the lens", why))
    draw_pinhole(frame)


def _means(frame: Frame, count: int) -> tuple[moderngl.Texture, moderngl.Texture]:
    """Mean of that many views, and of their squares."""
    context, sensor = frame.context, frame.scene.sensor
    size, fine = (sensor.width, sensor.height), (VIEW_GRID * sensor.width, VIEW_GRID * sensor.height)
    view, means = frame.texture(fine, 4), (frame.texture(size, 4), frame.texture(size, 4))
    frame.submit(context.framebuffer(means).clear)
    framebuffer = context.framebuffer([view], context.depth_renderbuffer(fine))
    add = frame.program("defocus/accumulate.comp", GRID=VIEW_GRID)
    for camera in lens_views(
        sensor.model_copy(update={"width": fine[0], "height": fine[1]}), *frame.clip_planes, count
    ):
        frame.submit(framebuffer.clear, *background(frame), 1.0)
        draw_view(frame, camera, framebuffer)
        view.use(0)
        for unit, texture in enumerate(means):
            texture.bind_to_image(unit, read=True, write=True)
        frame.dispatch(add, *size, weight=1 / count)
    return means


TECHNIQUES = {
    "defocus.accumulate": Technique(
        name="defocus.accumulate",
        approximates="defocus_radiance",
        summary="the mean of views from all over the lens, as many as the wanted error needs",
        source="haeberli-1990",
        limits=(
            f"{LIMITS} All pixels share the places on the lens: too few views show as ghosts, not as noise. The number "
            "of views is predicted within a factor of 2 of the error."
        ),
        passes=_passes,
        parameters=(*PARAMETERS, *SHADING),
        grid=PIXEL_GRID,
    )
}
