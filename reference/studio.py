"""Where the truth of one scene is rendered: here, or wherever a subclass says.

A launch is all that a sampled truth is made of. What it renders depends on nothing but the scene and its own fields, so
that launches may be rendered in any order, on any machine, and twice if one is lost.
"""

import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from types import ModuleType

import numpy as np

from reference.quantities import quantity
from reference.stage import Stage, build_stage
from reference.start import mitsuba
from scenes import geometry
from scenes.features import Features, features_of
from scenes.image import Bool, Float32
from scenes.mesh import Mesh
from scenes.model import Scene

Progress = Callable[[str, float], None]
"""Called with what is being done and the fraction of it that is done."""


@dataclass(frozen=True)
class Launch:
    """Some rows of a block. Row r is the judged pixel r mod P, of P, as accumulator r div P sees it.

    key         : of the truth that the block belongs to
    spp         : samples for each row
    seed        : 32 bits
    first, last : the rows from `first` up to, but without, `last`
    what        : in words, for people who wait
    fraction    : of the block that is done before this launch
    """

    quantity: str
    key: str
    spp: int
    seed: int
    first: int
    last: int
    what: str
    fraction: float


@dataclass(frozen=True)
class Rendered:
    """Pixels, and the time that rendering them took. Those of a launch are (rows, C), those of an image (H, W, C)."""

    pixels: Float32
    seconds: float


class Studio:
    """Renders one scene with Mitsuba, which is loaded, like the scene, when the first thing is rendered."""

    def __init__(self, scene: Scene, kernels: Path | None, progress: Progress) -> None:
        self.scene = scene
        self.kernels = kernels
        self.progress = progress

    @cached_property
    def meshes(self) -> tuple[Mesh, ...]:
        return geometry.geometry_of(self.scene)

    @cached_property
    def features(self) -> Features:
        """What the choice of an integrator depends on."""
        return features_of(self.scene, self.meshes)

    @cached_property
    def mitsuba(self) -> ModuleType:
        return mitsuba(self.kernels)

    @cached_property
    def stage(self) -> Stage:
        return build_stage(self.mitsuba, self.scene, self.meshes)

    def ahead(self, launches: Iterable[Launch], mask: Bool) -> None:
        """Hear which launches are going to be asked for. Where others render them, all of them begin now."""

    def launch(self, launch: Launch, mask: Bool) -> Rendered:
        """The rows of a launch, for the pixels of `mask` (H, W)."""
        self.progress(launch.what, launch.fraction)
        render = quantity(launch.quantity).integrator(self.features).block
        assert render is not None
        stage, pixels = self.stage, np.flatnonzero(mask)
        chosen = pixels[np.arange(launch.first, launch.last) % len(pixels)]
        start = time.perf_counter()
        values = render(stage, chosen, launch.seed, launch.spp, self.scene.truth.clamp)
        return Rendered(values.astype(np.float32), time.perf_counter() - start)

    def exact(self, name: str, key: str) -> Rendered:
        """A whole image of a quantity that has an exact truth in this scene; `key` is that truth's."""
        self.progress(f"{self.scene.name}: {name}", 0.0)
        render = quantity(name).integrator(self.features).exact
        assert render is not None
        stage = self.stage
        start = time.perf_counter()
        return Rendered(render(stage), time.perf_counter() - start)
