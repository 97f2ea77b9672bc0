"""Light from infinitely far away as one latitude-longitude image."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from realtime.frame import Frame
from scenes.errors import InputError
from scenes.exr import read_exr
from scenes.features import Features
from scenes.image import Float32, Float64
from scenes.model import ConstantLight, EnvironmentLight, Scene

if TYPE_CHECKING:
    import moderngl


def require_no_sky(scene: Scene, features: Features, lit: str) -> None:
    """Refuse light from everywhere, of which some techniques know nothing; `lit` says what they light.

    Raises
    ------
    InputError
        The scene has a sky.
    """
    if features.has_sky:
        raise InputError(
            f"Found a sky in '{scene.name}'; {lit} by point, directional and surface emitters. Remove the constant or "
            "environment emitter, or leave out the check."
        )


def sky_pixels(scene: Scene) -> Float32:
    """Radiance (H, W, 3) of all infinite emitters together, row 0 at +Y; one black pixel when there are none."""
    total = np.zeros((1, 1, 3), dtype=np.float32)
    for emitter in scene.emitters:
        if isinstance(emitter, ConstantLight):
            total = total + np.array(emitter.radiance, dtype=np.float32)
        elif isinstance(emitter, EnvironmentLight):
            total = total + np.float32(emitter.scale) * read_exr(scene.folder / emitter.path).pixels[..., :3]
    return np.ascontiguousarray(total)


def sky_directions(height: int, width: int) -> tuple[Float64, Float64]:
    """Where each pixel of a latitude-longitude image lies (H * W, 3), and its solid angle; see glsl/lib/sky.glsl."""
    down, around = np.pi * np.arange(height) / (height - 1), 2 * np.pi * ((np.arange(width) + 0.5) / width - 0.5)
    edges = np.cos(np.clip(down[:, None] + np.pi / (height - 1) * np.array([-0.5, 0.5]), 0, np.pi))
    solid_angles = np.repeat((edges[:, 0] - edges[:, 1]) * 2 * np.pi / width, width)
    x, z = np.sin(down)[:, None] * np.sin(around), -np.sin(down)[:, None] * np.cos(around)
    y = np.broadcast_to(np.cos(down)[:, None], x.shape)
    return np.stack([x, y, z], axis=-1).reshape(-1, 3), solid_angles


def sky_texture(frame: Frame) -> moderngl.Texture:
    """The sky as shaders look it up with glsl/lib/sky.glsl, filtered linearly."""

    def upload() -> moderngl.Texture:
        made = frame.filtered_texture(sky_pixels(frame.scene))
        made.repeat_y = False
        return made

    return frame.once("sky", upload)
