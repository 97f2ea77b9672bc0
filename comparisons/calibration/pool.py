"""Truths with the noise of a path tracer and a mean that is known exactly.

A pool holds many real samples of each pixel. Truths are simulated by drawing from it with replacement, so that the mean
of the pool is their expectation to the last digit, and their noise is that of the renderer, its rare bright paths
included as far as the pool holds any.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np

from comparisons.metrics import Samples
from reference.estimator import ACCUMULATORS, Truth, seed_of
from reference.integrators.ray_casts import mean_over_pixels
from reference.quantities import quantity
from reference.quantity import Integrator
from reference.stage import build_stage
from reference.start import mitsuba
from scenes.features import features_of
from scenes.geometry import geometry_of
from scenes.image import Bool, Float32, Float64
from scenes.load import find_scene, load_scene
from scenes.model import PointLight, Scene

QUANTITY = "indirect_radiance"
BASE = "small-room-ellipsoid"
RESOLUTION = 64
SAMPLES = 4096
SAMPLES_A_LAUNCH = 256

DISTANCES_M = {"easy": None, "hard": 0.03, "fireflies": 0.005}
"""The worlds: the shipped room, and the same with its light that close to the left wall.

The spot that such a light makes on the wall is small, bright, and found by few paths.
"""


@dataclass(frozen=True)
class Pool:
    """samples : (P, S, C) of each judged pixel; mask : (H, W) with P judged pixels."""

    name: str
    samples: Float32
    mask: Bool

    @cached_property
    def truth(self) -> Float64:
        """(P, C), exact."""
        mean: Float64 = self.samples.mean(axis=1, dtype=np.float64)
        return mean

    def image(self, pixels: Float64) -> Float32:
        """(H, W, C) with values (P, C) at the judged pixels."""
        image = np.zeros((*self.mask.shape, pixels.shape[-1]), dtype=np.float32)
        image[self.mask] = pixels
        return image

    def accumulators(self, rng: np.random.Generator, spp: int) -> Float64:
        """(K, P, C), the sums of spp / K samples each, drawn anew."""
        pixels, size, _ = self.samples.shape
        drawn = rng.integers(size, size=(ACCUMULATORS, pixels, spp // ACCUMULATORS))
        sums: Float64 = self.samples[np.arange(pixels)[None, :, None], drawn].sum(axis=2, dtype=np.float64)
        return sums

    def truths(self, rng: np.random.Generator) -> Callable[[int], Truth]:
        """A truth that grows: each call with more samples adds to those of the calls before."""
        total, done = np.zeros((ACCUMULATORS, *self.truth.shape)), 0

        def truth_at(spp: int) -> Truth:
            nonlocal total, done
            if spp > done:
                total, done = total + self.accumulators(rng, spp - done), spp
            means = np.stack([self.image(part) for part in total * (ACCUMULATORS / done)])
            return Truth(QUANTITY, self.name, means, self.mask, done, 0.0, Integrator("drawn", "from a pool"))

        return truth_at

    def repetitions(self, count: int, spp: int, alpha: float, seed: int) -> Iterator[Samples]:
        """Independent truths of that many samples."""
        for repetition in range(count):
            truth = self.truths(np.random.default_rng([seed, repetition]))(spp)
            yield Samples(truth.accumulators, truth.mask, alpha)


def world(name: str) -> Scene:
    """The scene of a pool, small enough that thousands of truths can be drawn."""
    scene = load_scene(find_scene(BASE))
    distance = DISTANCES_M[name]
    emitters = scene.emitters
    if distance is not None:
        (light,) = (e for e in emitters if isinstance(e, PointLight))
        wall = -scene.shapes[0].size[0] / 2  # type: ignore[union-attr]  # the first shape of the scene is its room
        emitters = (light.model_copy(update={"position": (wall + distance, 1.0, 0.3)}),)
    sensor = scene.sensor.model_copy(update={"width": RESOLUTION, "height": RESOLUTION})
    return scene.model_copy(update={"sensor": sensor, "emitters": emitters})


def pool_of(name: str, kernels: Path, progress: Callable[[str, float], None]) -> Pool:
    """Render the samples of a pool."""
    scene = world(name)
    meshes = geometry_of(scene)
    stage = build_stage(mitsuba(kernels), scene, meshes)
    block = quantity(QUANTITY).integrator(features_of(scene, meshes)).block
    assert block is not None
    covered = mean_over_pixels(stage, lambda hit: [stage.mi.Float(stage.is_subject(hit.si.shape, hit.valid))])
    mask = covered[..., 0] == 1
    pixels = np.flatnonzero(mask)
    launches = []
    for launch in range(SAMPLES // SAMPLES_A_LAUNCH):
        progress(f"samples of the {name} world", launch * SAMPLES_A_LAUNCH / SAMPLES)
        repeated = np.repeat(pixels, SAMPLES_A_LAUNCH)
        values = block(stage, repeated, seed_of("pool", launch), 1, None).astype(np.float32)
        launches.append(values.reshape(len(pixels), SAMPLES_A_LAUNCH, -1))
    return Pool(name, np.concatenate(launches, axis=1), mask)
