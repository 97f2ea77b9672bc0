"""The truth of a quantity for a scene, as independent blocks with their samples counted.

A sampled truth is ACCUMULATORS independent images of equally many samples. They are never averaged here: their spread
is what every error bar is made of. Blocks are of 1, 1, 2, 4, ... samples a pixel and accumulator, LARGEST_BLOCK at
most, so that more samples only add blocks, and none is rendered twice. Every path of a launch draws from a stream of
its own, but where it starts: there the samples of a pixel and accumulator within a block are stratified, and shifted at
random against all others (`reference.sampling.film_and_lens`). Every launch has its own seed, hashed to 32 bits:
consecutive seeds of Mitsuba's samplers repeat each other's noise, shifted by a pixel.
"""

import hashlib
import importlib
import importlib.metadata
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cache, cached_property, partial
from itertools import chain, pairwise, takewhile
from pathlib import Path
from typing import Any

import numpy as np

from reference.quantities import MODULES, quantity
from reference.quantity import Integrator, Quantity
from reference.start import CHOICE, VARIANTS, variant
from reference.store import Shelf, Store
from reference.studio import Launch, Progress, Studio
from scenes import geometry, relief
from scenes.digest import code_digest, scene_parts, with_imports
from scenes.errors import InputError, SceneError
from scenes.features import Features
from scenes.image import Bool, Float32, Image, require_finite
from scenes.model import MOST_SPP, PIXEL_GRID, Scene
from scenes.shapes import FieldName, Relief

ACCUMULATORS = 16
"""Independent images: enough for a variance that is itself known to about 18 %."""

TWO_SCENES = {("thickness", True), ("visibility", False)}
"""Quantities, and whether the truth is exact, whose rays need two scenes in one kernel: that of a body by itself, or of
what hides a light. On CUDA, Dr.Jit 1.5 leaves one out with no more than a warning, and all light is visible."""

DIM_HAIR = ("hair_radiance", "full_radiance")
"""Quantities whose light goes from hair to hair. On CUDA a part of it is lost in OptiX' curves: a white furnace of 400
hairs is 1.8 % too dark, and light hair in thousands 10 to 35 %."""

LARGEST_BLOCK = 256
"""Samples a pixel of the largest block: float32 sums of more than 1024 are biased."""

MOST_BYTES_KEPT = 1 << 28
"""Of the blocks of a scene that were read, in memory for its other verdicts."""

PATHS_A_LAUNCH = 1 << 21
"""Bounds the memory of a launch: about 1 KiB a path."""


@dataclass(frozen=True)
class Truth:
    """What a quantity really is.

    accumulators : (K, H, W, C) independent estimates, K = 1 when exact
    mask         : (H, W) pixels at which the quantity is defined
    spp          : samples a pixel over all accumulators, 0 when exact
    seconds      : rendering time, whenever it was spent
    removed      : (K, H, W, C) what clamping took away from the accumulators, None where the truth is not clamped
    """

    quantity: str
    key: str
    accumulators: Float32
    mask: Bool
    spp: int
    seconds: float
    integrator: Integrator
    removed: Float32 | None = None

    @property
    def is_exact(self) -> bool:
        return len(self.accumulators) == 1


SHAPE_MODULES = (
    "bodies",
    "distances",
    "eyes",
    "features",
    "geometry",
    "grooming",
    "heads",
    "limbs",
    "media",
    "mesh_files",
    "metals",
    "procedural",
    "relief",
    "srgb",
    "topology",
)
"""The modules of `scenes` that decide what a renderer gets."""


@cache
def _code(name: str) -> str:
    """Digest of the code that decides what the truth of a quantity is: its module and what that imports here."""
    folder = Path(geometry.__file__).parent
    shared = [Path(__file__).parent / "stage.py", *(folder / f"{module}.py" for module in SHAPE_MODULES)]
    own = Path(str(importlib.import_module(MODULES[name]).__file__))
    closure = {*shared, *with_imports(own), *with_imports(shared[0])} - {Path(__file__).parent / "quantity.py"}
    return code_digest(*sorted(closure))


@cache
def versions() -> dict[str, str]:
    """What renders the truth, without importing it."""
    return {"variant": variant()} | {name: importlib.metadata.version(name) for name in ("mitsuba", "drjit")}


@cache
def _field_digest(name: FieldName, resolution: int, seed: int) -> str:
    """What a height field by name is here: numpy, scipy, Pillow and scikit-image make it, which do not promise it."""
    return hashlib.sha256(relief.field(name, resolution, seed).tobytes()).hexdigest()


def _fields(scene: Scene) -> list[str]:
    reliefs = [shape for shape in scene.shapes if isinstance(shape, Relief)]
    named = [(shape.heights, shape.resolution, shape.seed) for shape in reliefs if isinstance(shape.heights, str)]
    return [_field_digest(*field) for field in named]


def truth_parts(scene: Scene, name: str) -> dict[str, Any]:
    """Everything that the truth of a quantity depends on, and nothing else."""
    found, fields = quantity(name), _fields(scene)
    blocks = {
        "accumulators": ACCUMULATORS,
        "largest_block": LARGEST_BLOCK,
        "mask_code": _code(found.judged_where) if found.judged_where else "",
        "clamp": scene.truth.clamp,
    }
    return {
        "quantity": found.name,
        "code": _code(name),
        "pixel_grid": PIXEL_GRID,
        "scene": scene_parts(scene),
        "renderer": versions(),
        **({"height_fields": fields} if fields else {}),
        **(blocks if found.is_sampled else {}),
    }


def block_sizes(spp_each: int) -> Iterator[int]:
    """Samples a pixel of the successive blocks that add up to `spp_each`.

    >>> list(block_sizes(32))
    [1, 1, 2, 4, 8, 16]
    """
    done = 0
    while done < spp_each:
        size = min(max(done, 1), LARGEST_BLOCK)
        yield size
        done += size


def seed_of(key: str, *launch: int) -> int:
    """A 32-bit seed for a launch (block, part) that no other launch shares but by chance."""
    digest = hashlib.sha256("/".join([key, *map(str, launch)]).encode()).digest()
    return int.from_bytes(digest[:4], "big")


def _block_name(index: int) -> str:
    return f"block-{index:03d}"


class Reference:
    """Truths of one scene. What the store lacks is rendered in `studio`; this process, if none is given.

    Raises
    ------
    SceneError
        A file of the scene cannot be read.
    """

    def __init__(self, scene: Scene, store: Store, progress: Progress, studio: Studio | None = None) -> None:
        self.scene = scene
        self.store = store
        self.studio = studio or Studio(scene, store.root / "kernels", progress)
        self._masks: dict[str, Bool] = {}
        self._blocks: dict[tuple[str, int], Image] = {}
        self._begun_with = scene_parts(scene)

    @property
    def features(self) -> Features:
        """What the choice of an integrator depends on."""
        return self.studio.features

    @cached_property
    def subject_mask(self) -> Bool:
        """Pixels that the subject covers completely.

        Raises
        ------
        SceneError
            There are none.
        """
        return self._mask("coverage")

    def _mask(self, where: str) -> Bool:
        """Pixels that have the value 1 in an exact quantity, such as `coverage`."""
        if not where:
            return np.ones((self.scene.sensor.height, self.scene.sensor.width), dtype=bool)
        if where not in self._masks:
            mask: Bool = self._exact(where).pixels[..., 0] == 1
            if not mask.any():
                what = f"the subject ({', '.join(self.scene.subject)})" if where == "coverage" else "what is judged"
                raise SceneError(
                    f"Scene '{self.scene.name}': {what} covers no pixel completely ({where} is 1 nowhere). At least "
                    "one is needed: look whether the camera sees it, stands inside the room, and has enough resolution."
                )
            self._masks[where] = mask
        return self._masks[where]

    def require_defined(self, name: str) -> None:
        """See that a quantity has a meaning for this scene.

        Raises
        ------
        SceneError
            It has none.
        """
        if why := quantity(name).refuses(self.features):
            raise SceneError(
                f"Scene '{self.scene.name}': {name} is not defined here: {why}. Judge another quantity, or change the "
                "scene."
            )

    def _require_traceable(self, name: str, integrator: Integrator) -> None:
        if variant().startswith("cuda") and (name, integrator.exact is not None) in TWO_SCENES:
            raise InputError(
                f"Scene '{self.scene.name}': the truth of {name} cannot be rendered with {variant()}: its rays need "
                f"two scenes at once, which Dr.Jit does not trace on CUDA. Unset {CHOICE} to render with {VARIANTS[0]}."
            )
        if variant().startswith("cuda") and name in DIM_HAIR and self.features.has_hair:
            raise InputError(
                f"Scene '{self.scene.name}': the truth of {name} cannot be rendered with {variant()}: among hairs it "
                f"loses light, up to a third of it. Unset {CHOICE} to render with {VARIANTS[0]}."
            )

    def require_unchanged(self) -> None:
        """See that the scene's files are those that this began with: what is kept goes by their content.

        Raises
        ------
        SceneError
            One has been replaced, or is gone.
        """
        if scene_parts(self.scene) != self._begun_with:
            raise SceneError(
                f"Scene '{self.scene.name}': one of its files has been changed since the run began, so what was loaded "
                "may be neither the old one nor the new one. Run it again."
            )

    def truth(self, name: str, spp: int) -> Truth:
        """The truth of a quantity with at least `spp` samples a pixel (exact quantities ignore it).

        Raises
        ------
        RenderError
            A block holds NaNs or infinities.
        SceneError
            The quantity is not defined for this scene.
        InputError
            Mitsuba's variant cannot render it.
        """
        self.require_defined(name)
        found = quantity(name)
        integrator = found.integrator(self.features)
        self._require_traceable(name, integrator)
        if integrator.exact is None:
            return self._sampled(found, integrator, max(1, -(-spp // ACCUMULATORS)))
        image = self._exact(name)
        mask = self._mask(found.judged_where)
        return Truth(
            name, image.provenance["key"], image.pixels[None], mask, 0, image.provenance["seconds"], integrator
        )

    def at_hand(self, name: str, spp: int) -> Truth:
        """The truth of a quantity with all samples that are stored already, at least `spp` of them a pixel."""
        shelf = self.store.shelf(truth_parts(self.scene, name))
        sizes = block_sizes(MOST_SPP // ACCUMULATORS)
        stored = list(takewhile(lambda block: shelf.has(_block_name(block[0])), enumerate(sizes)))
        return self.truth(name, max(spp, ACCUMULATORS * sum(size for _, size in stored)))

    def _exact(self, name: str) -> Image:
        shelf = self.store.shelf(truth_parts(self.scene, name))

        def make() -> Image:
            rendered = self.studio.exact(name, shelf.key)
            self.require_unchanged()
            pixels = require_finite(rendered.pixels, f"reference of {self.scene.name}, {name}")
            return Image(pixels, self._provenance(shelf, name, {"seconds": rendered.seconds}))

        return shelf.image("exact", make)

    def _sampled(self, found: Quantity, integrator: Integrator, spp_each: int) -> Truth:
        shelf = self.store.shelf(truth_parts(self.scene, found.name))
        mask = self._mask(found.judged_where)
        rows = ACCUMULATORS * int(np.count_nonzero(mask))
        sizes = list(block_sizes(spp_each))
        launches = [partial(self._launches, found.name, shelf.key, rows, *block) for block in enumerate(sizes)]
        missing = (begin() for index, begin in enumerate(launches) if not shelf.has(_block_name(index)))
        self.studio.ahead(chain.from_iterable(missing), mask)
        is_clamped = self.scene.truth.clamp is not None
        total = np.zeros((ACCUMULATORS, rows // ACCUMULATORS, found.channels * (2 if is_clamped else 1)))
        seconds = 0.0
        for index, size in enumerate(sizes):
            make = partial(self._block, shelf, found, launches[index], mask, size)
            block = self._read_once(shelf, index, make)
            total += size * block.pixels.astype(np.float64)
            seconds += block.provenance["seconds"]
        accumulators = np.zeros((ACCUMULATORS, *mask.shape, total.shape[-1]), dtype=np.float32)
        accumulators[:, mask] = total / sum(sizes)
        kept, removed = accumulators[..., : found.channels], accumulators[..., found.channels :]
        spp = sum(sizes) * ACCUMULATORS
        return Truth(found.name, shelf.key, kept, mask, spp, seconds, integrator, removed if is_clamped else None)

    def _read_once(self, shelf: Shelf, index: int, make: Callable[[], Image]) -> Image:
        """A block, read or rendered once as long as there is room for it: every look at a verdict asks for it again."""
        key = shelf.key, index
        if key in self._blocks:
            shelf.touch(_block_name(index))
            return self._blocks[key]
        block = shelf.image(_block_name(index), make)
        if sum(kept.pixels.nbytes for kept in self._blocks.values()) + block.pixels.nbytes <= MOST_BYTES_KEPT:
            self._blocks[key] = block
        return block

    def _launches(self, name: str, key: str, rows: int, index: int, spp: int) -> list[Launch]:
        """What makes up a block of `spp` samples for each row: each judged pixel of each accumulator."""
        what = f"{self.scene.name}: {name}, {spp * ACCUMULATORS} more spp"
        parts = -(-rows * spp // PATHS_A_LAUNCH)
        bounds = np.cumsum([0, *(rows // parts + (part < rows % parts) for part in range(parts))]).tolist()
        return [
            Launch(name, key, spp, seed_of(key, index, part), first, last, what, part / parts)
            for part, (first, last) in enumerate(pairwise(bounds))
        ]

    def _block(self, shelf: Shelf, found: Quantity, begin: Callable[[], list[Launch]], mask: Bool, spp: int) -> Image:
        """A block as an image whose rows are accumulators and whose columns are the judged pixels."""
        rendered = [self.studio.launch(launch, mask) for launch in begin()]
        self.require_unchanged()
        rows = np.concatenate([launch.pixels for launch in rendered])
        values = rows.reshape(ACCUMULATORS, -1, rows.shape[-1])
        image = require_finite(values, f"reference of {self.scene.name}, {found.name}, a block of {spp} spp")
        seconds = sum(launch.seconds for launch in rendered)
        return Image(image, self._provenance(shelf, found.name, {"seconds": seconds, "spp": spp}))

    def _provenance(self, shelf: Shelf, name: str, more: dict[str, Any]) -> dict[str, Any]:
        return {"key": shelf.key, "scene": self.scene.name, "quantity": name, **versions(), **more}
