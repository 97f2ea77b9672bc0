"""The talk's layers with the blur that a lens gives: slices of depth, each scattered over its own circles of confusion.

The scene is cut by clip planes where it jumps in depth. Each slice is drawn in full, so what nearer slices hide is
there when their blurred edges let it through. A sample's light and alpha go to all of its disk in equal parts, in
linear radiance, whatever the pixels in the disk show themselves. Slices are put over one another front to back; with
the first moments of their alpha over the lens it is known which side of the lens a slice leaves free.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from realtime.camera import Camera, sensor_camera
from realtime.frame import Frame
from realtime.graph import Pass, Skip
from realtime.lens import INVISIBLE_PX, coc_scale, focus_distance
from realtime.shader import set_uniforms
from realtime.technique import Parameter, Technique
from realtime.views import LIMITS, SHADING, SHADING_USES, background, draw_pinhole, draw_view, shading_passes
from scenes.checks import SettingValue
from scenes.errors import InputError
from scenes.features import Features
from scenes.image import Bool, Float32, Float64
from scenes.mesh import Mesh
from scenes.model import PIXEL_GRID, Perspective, Scene

if TYPE_CHECKING:
    import moderngl

Integers = NDArray[np.integer]

GRID = PIXEL_GRID
TEXEL = 0.25
"""Size [px] of a source in the finest octave: gather.comp's points have the same place in all pixels then."""

SAMPLES = 2
"""Samples along an edge of a pixel in the picture that the cuts are found in."""

BINS = 128
"""Circles of confusion between which the scene may be cut."""

STEEPEST = 0.5
"""By how many px the circle of confusion of one surface changes from a pixel to the next at most."""

WORTH_A_LAYER = 1e-4
"""Share of all jumps in depth that one more layer must separate."""

SEAM = 0.2
"""What it costs to cut a surface, for each neighbouring pair of samples and pixel of blur, against a jump of 1 px."""

MAX_LAYERS = Parameter("max_layers", 8, (1, 2, 3, 4, 6, 8), "slices of depth at most", (1, BINS), off=1)
TAPS = Parameter("taps", 800, (50, 100, 200, 400, 800, 1600), "sources in the largest disk of each octave", (13, 4096))


@dataclass(frozen=True)
class Slice:
    """Planar depths from `near` to `far`, and the largest circle of confusion [px] that is seen between them."""

    near: float
    far: float
    radius: float


def pairs(values: NDArray[Any], distance: int) -> tuple[NDArray[Any], NDArray[Any]]:
    """The two sides (N,), (N,) of each pair of places in (H, W) that are `distance` apart along x or along y."""
    shifted = ((values[:, :-distance], values[:, distance:]), (values[:-distance], values[distance:]))
    one, other = (np.concatenate([pair[side].ravel() for pair in shifted]) for side in (0, 1))
    return one, other


def cuts(coc: Float64, reaches: Bool, most: int) -> list[float]:
    """Where to cut the range of signed circles of confusion (H, W) [px] into at most `most` layers; ascending.

    The picture has SAMPLES x SAMPLES samples a pixel; `reaches` (H, W) says which of them count. Nothing in a layer is
    behind anything else in it, so a jump in depth between two places as near as the larger of their disks costs what
    the disks differ by. A cut costs a seam where it runs through a surface. The fewest cuts are made after which one
    more is not worth a layer. The best cuts of a line are found by dynamic programming: Fisher 1958, "On Grouping for
    Maximum Homogeneity".
    """
    seen = coc[reaches]
    low, high = float(seen.min()), float(seen.max())
    if high - low <= INVISIBLE_PX:
        return []
    scale = BINS / (high - low)
    inside = np.zeros((BINS + 1, BINS + 1))
    crossing = np.zeros(BINS + 1)
    distance = 1
    while distance == 1 or distance <= SAMPLES * np.abs(seen).max():
        one, other = pairs(coc, distance)
        counts = np.logical_or(*pairs(reaches, distance))
        if distance > 1:
            counts &= np.maximum(np.abs(one), np.abs(other)) * SAMPLES >= distance
        ends = [np.clip(side[counts], low, high) for side in (np.minimum(one, other), np.maximum(one, other))]
        jump = np.maximum(ends[1] - ends[0] - STEEPEST * distance / SAMPLES, 0)
        below, above = (_bins((end - low) * scale) for end in ends)
        inside += _jumps_inside(below, above, jump)
        if distance == 1:
            crossing = _crossing(below[jump == 0], above[jump == 0])
        distance *= 2
    seam = SEAM * crossing * np.maximum(np.abs(low + np.arange(BINS + 1) / scale), 1)
    best, starts = inside[0], []
    for _ in range(most - 1):
        split = (best + seam)[:, None] + inside
        fewer, best = best, split.min(axis=0)
        if fewer[BINS] - best[BINS] <= WORTH_A_LAYER * inside[0, BINS]:
            break
        starts.append(split.argmin(axis=0))
    borders = [BINS]
    for start in reversed(starts):
        borders.append(int(start[borders[-1]]))
    occupied = np.unique(_bins((seen - low) * scale))
    return sorted({low + _middle_of_gap(occupied, border) / scale for border in borders[1:] if border > 0})


def _bins(places: Float64) -> Integers:
    indices: Integers = np.minimum(places.astype(int), BINS - 1)
    return indices


def _jumps_inside(below: Integers, above: Integers, jump: Float64) -> Float64:
    """For bins a to b - 1 the sum of the jumps that begin and end among them: (BINS + 1, BINS + 1)."""
    jumps = np.zeros((BINS, BINS))
    np.add.at(jumps, (below, above), jump)
    inside = np.zeros((BINS + 1, BINS + 1))
    inside[:BINS, 1:] = np.cumsum(np.cumsum(jumps[::-1], axis=0)[::-1], axis=1)
    return np.triu(inside)


def _crossing(below: Integers, above: Integers) -> Float64:
    """How many pairs have the lower border of bin 0 to BINS between them."""
    begin, end = (np.bincount(side + 1, minlength=BINS + 1) for side in (below, above))
    return np.cumsum(begin - end).astype(float)


def _middle_of_gap(occupied: Integers, end: int) -> float:
    """The middle of the empty bins on both sides of the lower border of bin `end`."""
    return float(occupied[occupied < end].max() + 1 + occupied[occupied >= end].min()) / 2


def slices(seen: Float64, planes: list[float], sensor: Perspective, near: float, far: float) -> list[Slice]:
    """Layers, nearest first, between the depths of ascending planes; `seen` (N,) and planes are signed radii [px]."""
    depths = [near, *(1 / (1 / focus_distance(sensor) - plane / coc_scale(sensor)) for plane in planes), far]
    parts = [seen[(seen >= low) & (seen < high)] for low, high in pairwise([-math.inf, *planes, math.inf])]
    return [
        Slice(start, end, float(np.abs(part).max(initial=0.0)))
        for (start, end), part in zip(pairwise(depths), parts, strict=True)
    ]


def widened(sensor: Perspective, margin: int) -> Perspective:
    """The sensor with `margin` pixels more on each side."""
    width, height = sensor.width + 2 * margin, sensor.height + 2 * margin
    growth = width / sensor.width if sensor.fov_axis == "x" else height / sensor.height
    tangent = growth * math.tan(math.radians(sensor.fov_deg) / 2)
    return sensor.model_copy(update={"width": width, "height": height, "fov_deg": math.degrees(2 * math.atan(tangent))})


def within_reach(coc: Float64, margin: int) -> Bool:
    """Whose circles of confusion (H, W) [px], in a picture `margin` pixels wider on each side, reach the image.

    The picture has SAMPLES x SAMPLES samples a pixel.
    """
    height, width = coc.shape
    beyond = [margin - (0.5 + np.minimum(np.arange(n), n - 1 - np.arange(n))) / SAMPLES for n in (height, width)]
    outside = np.hypot(*np.meshgrid(*(np.maximum(side, 0) for side in beyond), indexing="ij"))
    reaches: Bool = outside <= np.abs(coc)
    return reaches


@lru_cache(maxsize=8)
def disk_areas(finest_radius: float, octaves: int, bins: int = 513) -> Float32:
    """What a disk covers as gather.comp sees it [px²]: (octaves, bins), by radius from 0 to the octave's largest.

    Every source is at the same place among the points that stand for pixels, so one sum holds for all; from texels of
    2 px on it is that of the integral to 1e-3.
    """
    areas = np.zeros((octaves, bins))
    for octave in range(octaves):
        texel = TEXEL * 2**octave
        edge = edge_width(texel)
        radii = np.linspace(0, finest_radius * 2**octave, bins)
        if texel > 1:
            areas[octave] = math.pi * (radii**2 + edge**2 / 12)
            continue
        half = math.ceil(2 * (radii[-1] + edge)) + 1
        along = np.arange(-half, half + 1) / 2 + (texel / 2 - 0.25) % 0.5
        distances = np.hypot(along, along[:, None])
        areas[octave] = [np.clip((r - distances) / edge + 0.5, 0, 1).sum() / 4 for r in radii]
    return areas.astype(np.float32)


def edge_width(texel: float) -> float:
    """Over what width [px] the disk of a source fades: its own, but no less than the distance of a pixel's points."""
    return max(0.5, texel)


def is_hollow(mesh: Mesh, eye: Float64, closed: frozenset[str]) -> bool:
    """Whether the inner side of a mesh can be seen without a clip plane that cuts it open; `closed` names solids."""
    low, high = mesh.surface.positions.min(axis=0), mesh.surface.positions.max(axis=0)
    return mesh.name not in closed or bool(np.all((low <= eye) & (eye <= high)))


def _draw_coc(frame: Frame, camera: Camera, framebuffer: moderngl.Framebuffer) -> None:
    """Draw circles of confusion and depths; what a clip plane cuts open is seen through."""
    sensor = frame.scene.sensor
    scale, inverse_focus = coc_scale(sensor), 1 / focus_distance(sensor)
    largest = float(max(sensor.width, sensor.height))
    frame.submit(framebuffer.clear, red=min(scale * inverse_focus, largest))
    framebuffer.use()
    frame.context.enable_only(frame.context.DEPTH_TEST)
    shader = frame.program("raster/mesh.vert", "defocus_layers/coc.frag")
    set_uniforms(shader, coc_scale=scale, inverse_focus=inverse_focus, largest=largest)
    hollow = frame.resources["hollow"]
    set_uniforms(shader, outside_only=False)
    frame.draw(shader, camera, which=lambda mesh: mesh.name in hollow)
    set_uniforms(shader, outside_only=True)
    frame.draw(shader, camera, which=lambda mesh: mesh.name not in hollow)


def _see_coc(frame: Frame) -> None:
    """Write the circles of confusion of what reaches the image, also from beyond its border; `hollow` names meshes."""
    eye, closed = frame.camera.eye, frame.closed
    frame.resources["hollow"] = {mesh.name for mesh in frame.meshes if is_hollow(mesh, eye, closed)}
    sensor = frame.scene.sensor
    margin = math.ceil(max(sensor.width, sensor.height) / 8)
    coc, reaches = _coc_around(frame, margin)
    largest = float(np.abs(coc[reaches]).max())
    if largest > margin:
        coc, reaches = _coc_around(frame, math.ceil(largest))
    frame.resources |= {"coc": coc, "reaches": reaches}


def _coc_around(frame: Frame, margin: int) -> tuple[Float64, Bool]:
    wide = widened(frame.scene.sensor, margin)
    size = wide.width * SAMPLES, wide.height * SAMPLES
    drawn = frame.texture(size, 1)
    framebuffer = frame.context.framebuffer([drawn], frame.context.depth_renderbuffer(size))
    _draw_coc(frame, sensor_camera(wide, *frame.clip_planes), framebuffer)
    coc = np.frombuffer(drawn.read(), dtype=np.float32).reshape(drawn.height, drawn.width).astype(np.float64)
    return coc, within_reach(coc, margin)


def _cut(frame: Frame) -> None:
    coc, reaches = frame.resources["coc"], frame.resources["reaches"]
    planes = cuts(coc, reaches, int(frame.settings[MAX_LAYERS.name]))
    frame.resources["slices"] = slices(coc[reaches], planes, frame.scene.sensor, *frame.clip_planes)


def _draw(frame: Frame) -> None:
    found: list[Slice] = frame.resources["slices"]
    largest = max(each.radius for each in found)
    if largest <= INVISIBLE_PX:
        why = f"no circle of confusion is larger than {largest:.2g} px; {INVISIBLE_PX} px would not show"
        frame.skipped.append(Skip("layers and blur", why))
        draw_pinhole(frame)
        return
    if len(found) < int(frame.settings[MAX_LAYERS.name]):
        why = "a further clip plane would part nothing that blurs, or cut surfaces open"
        frame.skipped.append(Skip(f"more than {len(found)} layers", why))
    size = frame.scene.sensor.width, frame.scene.sensor.height
    image, covered = frame.texture(size, 4), frame.texture(size, 2)
    frame.submit(frame.context.framebuffer([image, covered]).clear)
    for each in found:
        is_last = each is found[-1]
        layer = _blurred(frame, each, (*background(frame), 1.0) if is_last else (0.0, 0.0, 0.0, 0.0))
        for unit, part in enumerate(layer):
            part.use(unit)
        image.bind_to_image(0, read=True, write=True)
        covered.bind_to_image(1, read=True, write=True)
        frame.dispatch(frame.program("defocus_layers/composite.comp"), *size, last=is_last)
    frame.resources["image"] = image


def _blurred(frame: Frame, each: Slice, behind: tuple[float, float, float, float]) -> list[moderngl.Texture]:
    """Radiance and alpha of a slice at each pixel, and their first moments over the lens in x and y."""
    context, grid, sensor = frame.context, frame.grid, frame.scene.sensor
    margin = math.ceil(each.radius) + 1
    wide = widened(sensor, margin)
    camera, size = sensor_camera(wide, each.near, each.far), (wide.width * grid, wide.height * grid)
    largest = int(context.info["GL_MAX_TEXTURE_SIZE"])
    if max(size) > largest:
        raise InputError(
            f"Found circles of confusion with a radius of {each.radius:.0f} px in an image of {sensor.width} x "
            f"{sensor.height}; with what reaches it from beyond its border at {grid} x {grid} samples a pixel that is "
            f"a texture of {size[0]} x {size[1]}, and this GPU allows {largest}. Lower the sensor's width and height, "
            "or aperture_radius."
        )
    radiance, coc, depth = frame.texture(size, 4), frame.texture(size, 1), context.depth_renderbuffer(size)
    _draw_coc(frame, camera, context.framebuffer([coc], depth))
    seen = context.framebuffer([radiance])
    frame.submit(seen.clear, *behind)
    draw_view(frame, camera, context.framebuffer([radiance], depth), depth_func="==")

    finest_radius = TEXEL * math.sqrt(int(frame.settings[TAPS.name]) / math.pi)
    octaves = _octaves(frame, radiance, coc, finest_radius)
    areas = disk_areas(finest_radius, octaves[-1] + 1)
    table = frame.once(("disk areas", areas.shape), lambda: _area_table(frame, areas))
    parts = [frame.texture((sensor.width, sensor.height), 4) for _ in range(3)]
    frame.submit(context.framebuffer(parts).clear)
    for octave in octaves:
        texel = TEXEL * 2**octave
        side = round(texel * grid)
        texels = -(-size[0] // side), -(-size[1] // side)
        spread, radius = frame.texture(texels, 4), frame.texture(texels, 1)
        for unit, texture in enumerate((radiance, coc, table)):
            texture.use(unit)
        spread.bind_to_image(0, read=False, write=True)
        radius.bind_to_image(1, read=False, write=True)
        frame.dispatch(
            frame.program("defocus_layers/sources.comp"),
            *texels,
            finest_radius=finest_radius,
            octave=octave,
            side=side,
            texel=texel,
        )
        spread.use(0)
        radius.use(1)
        for unit, part in enumerate(parts):
            part.bind_to_image(unit, read=True, write=True)
        frame.dispatch(
            frame.program("defocus_layers/gather.comp"),
            sensor.width,
            sensor.height,
            texel=texel,
            edge=edge_width(texel),
            reach=finest_radius * 2**octave,
            margin=margin,
        )
    return parts


def _area_table(frame: Frame, areas: Float32) -> moderngl.Texture:
    table = frame.context.texture(areas.shape[::-1], 1, areas.tobytes(), dtype="f4")
    table.repeat_x = table.repeat_y = False
    return table


def _octaves(frame: Frame, radiance: moderngl.Texture, coc: moderngl.Texture, finest_radius: float) -> list[int]:
    """The octaves of blur that a layer holds, ascending; the finest one if it is empty."""
    bits = frame.context.buffer(bytes(4))
    bits.bind_to_storage_buffer(0)
    radiance.use(0)
    coc.use(1)
    frame.dispatch(frame.program("defocus_layers/octaves.comp"), *coc.size, finest_radius=finest_radius)
    found = int(np.frombuffer(bits.read(), dtype=np.uint32)[0])
    return [octave for octave in range(32) if found >> octave & 1] or [0]


def _passes(scene: Scene, features: Features, settings: Mapping[str, SettingValue]) -> list[Pass]:
    opened = "the lens is open: the layers are drawn" if coc_scale(scene.sensor) > 0 else ""
    closed = "" if opened else "the camera is a pinhole: everything is sharp"
    return [
        *shading_passes(features, settings),
        Pass("circles of confusion", _see_coc, writes=("coc", "reaches", "hollow"), skip=closed),
        Pass("cut into layers", _cut, reads=("coc", "reaches"), writes=("slices",), skip=closed),
        Pass("layers and blur", _draw, reads=("slices", "hollow"), uses=SHADING_USES, writes=("image",), skip=closed),
        Pass("pinhole", draw_pinhole, uses=SHADING_USES, writes=("image",), skip=opened),
    ]


TECHNIQUES = {
    "defocus.layers": Technique(
        name="defocus.layers",
        approximates="defocus_radiance",
        summary="slices of depth, each scattered over its own circles of confusion, put over one another",
        source="potmesil-1982",
        limits=(
            f"{LIMITS} A slice shows what is nearest in it: what something hides in its own slice is not there when "
            "its blurred edge lets it through. Which part of the lens a slice covers is known to first order. A lamp "
            "smaller than a sample has the light of the samples that hit it. Disks larger than the image's longer side "
            "count as that large. With the camera inside a closed shape's box, its inner side shows where a clip plane "
            "cuts it."
        ),
        passes=_passes,
        parameters=(MAX_LAYERS, TAPS, *SHADING),
        grid=GRID,
    )
}
