"""Whether this machine has what lightgauge needs."""

import importlib.metadata
import os
import platform
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from scenes.errors import InputError, LightgaugeError

PACKAGES = (
    "lightgauge",
    "mitsuba",
    "drjit",
    "moderngl",
    "numpy",
    "openexr",
    "scikit-image",
    "colour-science",
    "trimesh",
)


@dataclass(frozen=True)
class Finding:
    what: str
    detail: str
    is_fine: bool


def version_of(package: str) -> str:
    """The installed version of a package, in words."""
    try:
        return importlib.metadata.version(package)
    except importlib.metadata.PackageNotFoundError:
        return "not installed"


def findings(store: Path) -> Iterator[Finding]:
    """One finding a subject; each renderer is really started."""
    yield Finding("platform", f"{platform.platform()}, Python {platform.python_version()}", True)
    yield Finding("packages", ", ".join(f"{name} {version_of(name)}" for name in PACKAGES), True)
    for what, look in (("OpenGL", _graphics), ("LLVM, Mitsuba", _mitsuba), ("store", lambda: _store(store))):
        try:
            yield Finding(what, look(), True)
        except LightgaugeError as error:
            yield Finding(what, str(error), False)


def _graphics() -> str:
    from realtime.context import make_context, renderer_name

    return renderer_name(make_context())


def _mitsuba() -> str:
    from reference.start import choose_llvm, mitsuba

    mi = mitsuba()
    mi.Float([1.0, 2.0]).numpy()
    variant = str(mi.variant())
    return f"{variant} with {choose_llvm().name}" if variant.startswith("llvm") else variant


def require_writable(folder: Path, what: str, option: str) -> None:
    """Make a folder and try to write to it, before anything is rendered for it.

    Raises
    ------
    InputError
        It cannot be written to; `option` names another.
    """
    probe = folder / f".writable.{os.getpid()}"
    try:
        folder.mkdir(parents=True, exist_ok=True)
        probe.touch()
        probe.unlink()
    except OSError as error:
        raise InputError(
            f"The {what} '{folder}' cannot be written to ({error.strerror}). It needs a folder that this user may "
            f"write to: name another with {option} FOLDER."
        ) from error


def _store(root: Path) -> str:
    require_writable(root, "store", "--store")
    size = sum(path.stat().st_size for path in root.rglob("*") if path.is_file())
    return f"{root}, {size / 1e6:.0f} MB"
