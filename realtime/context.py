"""The only place where an OpenGL context is made."""

from __future__ import annotations

import os
from functools import cache
from typing import TYPE_CHECKING

from scenes.errors import NoGraphics

if TYPE_CHECKING:
    import moderngl

GL_VERSION = 430
"""Compute shaders and storage buffers."""

_WHAT_TO_DO = (
    "lightgauge draws off screen through EGL and needs OpenGL 4.3. On Debian or Ubuntu: "
    "apt-get install --no-install-recommends libegl1 libgl1 libgl1-mesa-dri (a software renderer is enough). "
    "With several "
    "GPUs, GLCONTEXT_DEVICE_INDEX chooses one."
)


@cache
def make_context() -> moderngl.Context:
    """The off-screen OpenGL context of this process.

    There is only one: objects that the garbage collector deletes are deleted by number in whichever context is
    current, so with two of them the images of one lose their textures to the other's clean-up.

    Raises
    ------
    NoGraphics
        There is no EGL, no device, or its OpenGL is too old.
    """
    import moderngl

    try:
        context = moderngl.create_context(standalone=True, require=GL_VERSION, backend="egl")  # type: ignore[arg-type]
    except Exception as error:  # moderngl raises bare Exceptions, whatever is missing
        raise NoGraphics(f"No OpenGL context could be made ({error}). {_WHAT_TO_DO}") from error
    context.gc_mode = "auto"
    return context


def renderer_name(context: moderngl.Context) -> str:
    """The driver in words."""
    return f"{context.info['GL_RENDERER']}, OpenGL {context.info['GL_VERSION']}"


def environment_choice() -> dict[str, str]:
    """The settings of the environment that select an OpenGL driver, for keys of cached images."""
    names = ("GLCONTEXT_DEVICE_INDEX", "LIBGL_ALWAYS_SOFTWARE", "GALLIUM_DRIVER", "__EGL_VENDOR_LIBRARY_FILENAMES")
    return {name: os.environ[name] for name in names if name in os.environ}
