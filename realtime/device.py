"""The OpenGL context as a frame sees it: it counts how much memory what was made through it takes."""

from __future__ import annotations

import math
import weakref
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import moderngl

DEPTH_BYTES = 4
"""Of a texel of depth: 24 bits are padded, and 32 fill it."""

CUBE_FACES = 6


class Device:
    """Behaves as the `moderngl.Context` that it stands for.

    alive : bytes of the buffers, textures and renderbuffers that were made through it and are not deleted, as their
        formats say; what the driver pads or keeps besides is not known
    peak : the most that `alive` has been
    """

    def __init__(self, context: moderngl.Context) -> None:
        vars(self).update(context=context, alive=0, peak=0)

    if TYPE_CHECKING:
        context: moderngl.Context
        alive: int
        peak: int

    def __getattr__(self, name: str) -> Any:
        return getattr(self.context, name)

    def __setattr__(self, name: str, value: Any) -> None:
        setattr(self.context, name, value)

    def buffer(self, *given: Any, **named: Any) -> moderngl.Buffer:
        made = self.context.buffer(*given, **named)
        self.count(made, made.size)
        return made

    def texture(self, *given: Any, **named: Any) -> moderngl.Texture:
        made = self.context.texture(*given, **named)
        self.count(made, _texels(made) * _texel_bytes(made))
        return made

    def texture3d(self, *given: Any, **named: Any) -> moderngl.Texture3D:
        made = self.context.texture3d(*given, **named)
        self.count(made, _texels(made) * _texel_bytes(made))
        return made

    def texture_array(self, *given: Any, **named: Any) -> moderngl.TextureArray:
        made = self.context.texture_array(*given, **named)
        self.count(made, _texels(made) * _texel_bytes(made))
        return made

    def texture_cube(self, *given: Any, **named: Any) -> moderngl.TextureCube:
        made = self.context.texture_cube(*given, **named)
        self.count(made, CUBE_FACES * _texels(made) * _texel_bytes(made))
        return made

    def depth_texture(self, *given: Any, **named: Any) -> moderngl.Texture:
        made = self.context.depth_texture(*given, **named)
        self.count(made, _texels(made) * DEPTH_BYTES)
        return made

    def depth_texture_cube(self, *given: Any, **named: Any) -> moderngl.TextureCube:
        made = self.context.depth_texture_cube(*given, **named)
        self.count(made, CUBE_FACES * _texels(made) * DEPTH_BYTES)
        return made

    def renderbuffer(self, *given: Any, **named: Any) -> moderngl.Renderbuffer:
        made = self.context.renderbuffer(*given, **named)
        self.count(made, _texels(made) * _texel_bytes(made))
        return made

    def depth_renderbuffer(self, *given: Any, **named: Any) -> moderngl.Renderbuffer:
        made = self.context.depth_renderbuffer(*given, **named)
        self.count(made, _texels(made) * DEPTH_BYTES)
        return made

    def release_target(self) -> None:
        """Let go of the framebuffer in use, which would keep all that it draws into alive."""
        self.context.fbo = None  # type: ignore[assignment]  # as moderngl sets it before the first use

    def count_mipmaps(self, texture: moderngl.Texture) -> None:
        """Count the levels below the first one of a texture."""
        self.count(texture, _texels(texture) * _texel_bytes(texture) // 3)

    def count(self, made: Any, size: int) -> None:
        """Count `size` bytes for as long as an object lives."""
        mine = vars(self)
        mine["alive"] += size
        mine["peak"] = max(mine["peak"], mine["alive"])
        weakref.finalize(made, self._forget, size).atexit = False

    def _forget(self, size: int) -> None:
        vars(self)["alive"] -= size


def _texels(made: Any) -> int:
    """All samples of all texels of a level."""
    return math.prod(map(int, made.size)) * max(1, getattr(made, "samples", 0))


def _texel_bytes(made: Any) -> int:
    """Of a texel of colour; the types of moderngl end in the bytes of a component."""
    return int(made.components) * int(made.dtype[-1])
