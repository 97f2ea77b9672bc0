"""What the workers of a Dask cluster do: launches, exact truths and drawings, each a function of its arguments alone.

The scheduler imports this module too, since it unpacks the tasks that it hands on: nothing slow at its top.
"""

import importlib.metadata
import sys
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import cache, lru_cache
from pathlib import Path
from typing import ParamSpec, TypeVar

import numpy as np

from comparisons.code import rendering_code
from realtime.own import Parcel as OwnParcel
from realtime.own import load_packed
from realtime.render import Renderer, Rendering
from realtime.techniques import technique
from reference.estimator import truth_parts
from reference.start import variant
from reference.studio import Launch, Rendered, Studio
from scenes.checks import SettingValue
from scenes.digest import digest_of
from scenes.errors import NoCluster
from scenes.image import Bool
from scenes.parcel import Parcel, unpacked

P = ParamSpec("P")
R = TypeVar("R")

Versions = dict[str, str]

PACKAGES = ("dask", "distributed", "drjit", "lightgauge", "mitsuba", "moderngl", "numpy", "scipy", "trimesh")

SCENES_KEPT = 4
"""How many scenes a worker holds in memory for each side; tasks of other scenes load them anew."""

_RENDERING = ThreadPoolExecutor(1, "rendering")
"""A worker renders one thing at a time: Mitsuba uses all its cores, and an OpenGL context belongs to one thread."""


@dataclass(frozen=True)
class PackedMask:
    """A mask (H, W) in a bit a pixel."""

    bits: bytes
    shape: tuple[int, int]

    @classmethod
    def of(cls, mask: Bool) -> "PackedMask":
        return cls(np.packbits(mask).tobytes(), (mask.shape[0], mask.shape[1]))

    @property
    def mask(self) -> Bool:
        bits = np.unpackbits(np.frombuffer(self.bits, np.uint8), count=self.shape[0] * self.shape[1])
        return bits.reshape(self.shape).astype(bool)


@cache
def versions() -> Versions:
    """What must be the same on both ends, so that a task gives the same bits."""
    found = {name: importlib.metadata.version(name) for name in PACKAGES}
    code = rendering_code()[:12]
    return found | {"python": "{}.{}".format(*sys.version_info), "variant": variant(), "code of lightgauge": code}


def same(parcel: Parcel) -> Parcel:
    """The scene itself: as a task, it is sent to the cluster once and goes from worker to worker."""
    return parcel


def launch(parcel: Parcel, sender: Versions, wanted: Launch, packed: PackedMask) -> Rendered:
    """Some rows of a block of a sampled truth."""
    return _alone(
        sender, lambda folder: _studio(parcel, folder, wanted.quantity, wanted.key).launch(wanted, packed.mask)
    )


def exact(parcel: Parcel, sender: Versions, name: str, key: str) -> Rendered:
    """A whole image of a quantity that has an exact truth."""
    return _alone(sender, lambda folder: _studio(parcel, folder, name, key).exact(name, key))


def draw(
    parcel: Parcel,
    sender: Versions,
    name: str,
    given: dict[str, SettingValue],
    timed: bool,
    own: OwnParcel | None = None,
) -> Rendering:
    """The image of a technique, which a user's `own` file may bring."""

    def drawn(folder: Path) -> Rendering:
        if own is not None:
            load_packed(own, folder / "techniques")
        return _renderer(parcel, folder).render(technique(name), given, timed)

    return _alone(sender, drawn)


def _alone(sender: Versions, render: Callable[[Path], R]) -> R:
    """Render, with a folder for files, while this worker renders nothing else."""
    from distributed import get_worker

    worker = get_worker()
    _require_same(sender, worker.address)
    return _RENDERING.submit(render, Path(worker.local_directory) / "lightgauge-files").result()


def _require_same(sender: Versions, worker: str) -> None:
    own = versions()
    differing = [name for name in sender if sender[name] != own.get(name)]
    if differing:
        here = ", ".join(f"{name} {own.get(name, 'none')}" for name in differing)
        there = ", ".join(f"{name} {sender[name]}" for name in differing)
        raise NoCluster(
            f"The worker {worker} has {here}, but the run was started with {there}: it would not render the same bits. "
            "Install the same version of lightgauge and its lock file on both, then start the worker anew."
        )


@lru_cache(maxsize=SCENES_KEPT)
def _renderer(parcel: Parcel, folder: Path) -> Renderer:
    return Renderer(unpacked(parcel, folder))


@lru_cache(maxsize=SCENES_KEPT)
def _any_studio(parcel: Parcel, folder: Path) -> Studio:
    return Studio(unpacked(parcel, folder), None, lambda what, fraction: None)


@lru_cache(maxsize=64)
def _key_here(parcel: Parcel, folder: Path, name: str) -> str:
    return digest_of(truth_parts(_any_studio(parcel, folder).scene, name))


def _studio(parcel: Parcel, folder: Path, name: str, key: str) -> Studio:
    """What renders a quantity here, once it is proved to be the truth that is asked for."""
    if (own := _key_here(parcel, folder, name)) != key:
        raise NoCluster(
            f"A worker knows {name} of this scene as truth {own[:12]}, the run asks for {key[:12]}: it would render "
            "another one. Install the same version of lightgauge and its lock file on both, then start the worker anew."
        )
    return _any_studio(parcel, folder)
