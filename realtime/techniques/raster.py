"""What the rasteriser sees: the real-time half of parity."""

from realtime.gbuffer import gbuffer_pass, resolve_pass
from realtime.technique import Technique
from scenes.model import PIXEL_GRID

_LIMITS = "Triangles only; the mean over a regular grid of samples, so edges are exact to one sample."


def _raster(name: str, summary: str, source: str, channels: tuple[int, ...]) -> Technique:
    return Technique(
        name=f"raster.{name}",
        approximates=name,
        summary=summary,
        source="opengl-4.6",
        limits=_LIMITS,
        passes=lambda scene, features, settings: [gbuffer_pass(), resolve_pass(source)],
        channels=channels,
        grid=PIXEL_GRID,
    )


TECHNIQUES = {
    t.name: t
    for t in (
        _raster("depth", "distance along the viewing axis", "albedo", (3,)),
        _raster("normal", "shading normal in world space", "normal", (0, 1, 2)),
        _raster("albedo", "diffuse reflectance of the first surface", "albedo", (0, 1, 2)),
        _raster("coverage", "fraction of the pixel that the subject covers", "normal", (3,)),
    )
}
