"""The only place where an OpenGL context is made."""

from __future__ import annotations

import os
from functools import cache
from glob import glob
from pathlib import Path
from typing import TYPE_CHECKING

from scenes.digest import digest_of
from scenes.errors import NoGraphics

if TYPE_CHECKING:
    import moderngl

GL_VERSION = 430
"""Compute shaders and storage buffers."""

CHOOSING = (
    "GLCONTEXT_DEVICE_INDEX",
    "LIBGL_ALWAYS_SOFTWARE",
    "GALLIUM_DRIVER",
    "MESA_LOADER_DRIVER_OVERRIDE",
    "DRI_PRIME",
    "__EGL_VENDOR_LIBRARY_FILENAMES",
    "__EGL_VENDOR_LIBRARY_DIRS",
)
"""The environment variables that choose a driver."""

DRIVERS = tuple(
    f"/usr/{folder}/{files}"
    for folder in ("lib", "lib64", "lib/*-linux-gnu")
    for files in ("libEGL_*.so.*", "libgallium*.so*", "dri/*_dri.so")
)
"""Where they are installed: Mesa's have the same names in every version, NVIDIA's have it in their names."""

DEVICES = ("/dev/dri/*", "/dev/nvidia[0-9]*")

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
    """What decides which OpenGL driver draws, for keys of cached images: settings, what is installed, the devices."""
    chosen = {name: os.environ[name] for name in CHOOSING if name in os.environ}
    return chosen | {"installed": _installed(DRIVERS, DEVICES)}


@cache
def _installed(drivers: tuple[str, ...], devices: tuple[str, ...]) -> str:
    """Digest of the files of drivers, by name and size, and of the names of devices; nothing is loaded or opened."""
    files = sorted(path for pattern in drivers for path in glob(pattern))  # noqa: PTH207  # patterns of absolute paths
    present = sorted(path for pattern in devices for path in glob(pattern))  # noqa: PTH207
    return digest_of([[path, Path(path).stat().st_size] for path in files if Path(path).exists()], present)
