from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from reference import estimator, studio
from reference import store as store_module
from reference.estimator import ACCUMULATORS, LARGEST_BLOCK, Reference, block_sizes, seed_of, truth_parts
from reference.quantities import quantity
from reference.quantities.radiance import indirect_block
from reference.quantity import BlockRender, Integrator
from reference.stage import Stage, build_stage
from reference.start import CHOICE
from reference.store import Store
from scenes import relief
from scenes.digest import digest_of
from scenes.errors import InputError, RenderError
from scenes.geometry import geometry_of
from scenes.image import Float64
from scenes.load import find_scene, load_scene
from scenes.model import Scene

MakeScene = Callable[..., Scene]
MakeReference = Callable[..., Reference]
INDIRECT = "indirect_radiance"


def refuse(stage: Stage, pixels: NDArray[Any], seed: int, spp: int, clamp: float | None) -> Float64:
    raise AssertionError("a block was rendered")


def rendered_by(block: BlockRender, patch: pytest.MonkeyPatch) -> None:
    """Let `block` render the indirect light."""
    sampled = replace(quantity(INDIRECT), integrator=lambda features: Integrator("fake", "a test", block=block))
    for module in (estimator, studio):
        patch.setattr(module, "quantity", lambda name: sampled if name == INDIRECT else quantity(name))


class Counting:
    """Renders as ever and remembers the seeds; `fail_at` breaks the launch of that number off."""

    def __init__(self, fail_at: int = -1) -> None:
        self.seeds: list[int] = []
        self.fail_at = fail_at

    def __call__(self, stage: Stage, pixels: NDArray[Any], seed: int, spp: int, clamp: float | None) -> Float64:
        if len(self.seeds) == self.fail_at:
            raise KeyboardInterrupt
        self.seeds.append(seed)
        return indirect_block(stage, pixels, seed, spp, clamp)


@given(st.integers(1, 5000))
def test_blocks_reach_the_samples_asked_for_and_no_block_is_in_vain(spp: int) -> None:
    sizes = list(block_sizes(spp))
    assert sum(sizes) >= spp
    assert sum(sizes[:-1]) < spp


@given(st.integers(1, 5000))
def test_blocks_are_powers_of_two_of_a_bounded_size(spp: int) -> None:
    for size in block_sizes(spp):
        assert 1 <= size <= LARGEST_BLOCK
        assert size & (size - 1) == 0


@given(st.integers(1, 5000), st.integers(1, 5000))
def test_more_samples_only_add_blocks(some: int, more: int) -> None:
    few, many = sorted((list(block_sizes(some)), list(block_sizes(some + more))), key=len)
    assert many[: len(few)] == few


@pytest.mark.parametrize("doublings", range(7))
def test_doubling_the_samples_adds_one_block(doublings: int) -> None:
    spp = 2**doublings
    assert sum(block_sizes(spp)) == spp
    assert len(list(block_sizes(2 * spp))) == len(list(block_sizes(spp))) + 1


def test_the_examples_of_the_docstrings_hold() -> None:
    import doctest

    assert doctest.testmod(estimator) == (0, 1)


def test_seeds_fill_32_bits_and_differ_from_launch_to_launch() -> None:
    launches = [(block, part) for block in range(12) for part in range(64)]
    seeds = [seed_of("key", *launch) for launch in launches]
    assert len(set(seeds)) == len(seeds)
    assert max(seeds) < 2**32
    assert np.mean(seeds) == pytest.approx(2**31, rel=0.1)
    assert seed_of("key", 1, 11) != seed_of("key", 11, 1) != seed_of("yek", 11, 1)


def test_each_launch_has_a_seed_of_its_own(
    make_scene: MakeScene, reference: MakeReference, monkeypatch: pytest.MonkeyPatch
) -> None:
    counting = Counting()
    rendered_by(counting, monkeypatch)
    monkeypatch.setattr(estimator, "PATHS_A_LAUNCH", 256)
    made = reference(make_scene())
    parts = [-(-np.count_nonzero(made.subject_mask) * ACCUMULATORS * spp // 256) for spp in (1, 1, 2)]
    made.truth(INDIRECT, 64)
    assert len(set(counting.seeds)) == len(counting.seeds) == sum(parts)
    assert parts[0] > 1


def test_how_a_block_is_cut_into_launches_changes_no_pixel_in_the_mean(
    make_scene: MakeScene, reference: MakeReference, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Each accumulator and each pixel gets its own samples, wherever the cuts fall."""
    rendered_by(lambda stage, pixels, seed, spp, clamp: np.repeat(pixels[:, None] + 0.0, 3, axis=1), monkeypatch)
    for paths in (1 << 21, 100):
        monkeypatch.setattr(estimator, "PATHS_A_LAUNCH", paths)
        truth = reference(make_scene(), Store(tmp_path / str(paths))).truth(INDIRECT, 16)
        expected = np.broadcast_to(np.flatnonzero(truth.mask)[:, None], (ACCUMULATORS, truth.mask.sum(), 3))
        np.testing.assert_array_equal(truth.accumulators[:, truth.mask], expected)


def test_the_same_seed_is_the_same_image_and_another_seed_another(make_scene: MakeScene, mi: ModuleType) -> None:
    scene = make_scene()
    stage = build_stage(mi, scene, geometry_of(scene))
    first, again, other = (indirect_block(stage, np.array([100, 101]), seed, 16, None) for seed in (7, 7, 8))
    np.testing.assert_array_equal(first, again)
    assert (first != other).all()


def test_truth_is_defined_where_the_subject_fills_the_pixel(make_scene: MakeScene, reference: MakeReference) -> None:
    made = reference(make_scene())
    truth = made.truth(INDIRECT, 64)
    np.testing.assert_array_equal(truth.mask, made.truth("coverage", 0).accumulators[0, ..., 0] == 1)
    assert truth.accumulators.shape == (ACCUMULATORS, 12, 16, 3)
    assert (truth.accumulators[:, truth.mask].max(axis=(1, 2)) > 0).all()
    assert not truth.accumulators[:, ~truth.mask].any()
    assert (truth.spp, truth.is_exact) == (64, False)


def test_accumulators_do_not_repeat_each_others_noise(make_scene: MakeScene, reference: MakeReference) -> None:
    """Not even shifted by some pixels, as those of consecutive seeds would."""
    sensor = make_scene().sensor.model_dump() | {"width": 40, "height": 40, "fov_deg": 18.0}
    truth = reference(make_scene(sensor=sensor)).truth(INDIRECT, 64)
    assert truth.mask.mean() > 0.9
    noise = truth.accumulators.mean(axis=-1) - truth.accumulators.mean(axis=(0, -1))
    noise[:, ~truth.mask] = 0
    chance = 1 / np.sqrt(ACCUMULATORS * truth.mask.sum())
    for shift in range(-3, 4):
        moved = np.roll(noise, (1, shift), axis=(0, 2))
        correlation = np.sum(noise * moved) / np.sum(noise * noise)
        assert abs(correlation + (shift == 0) / (ACCUMULATORS - 1)) < 5 * chance


def test_samples_merge_to_the_bit(make_scene: MakeScene, reference: MakeReference, tmp_path: Path) -> None:
    scene = make_scene()
    step_by_step = reference(scene, Store(tmp_path / "one"))
    assert [step_by_step.truth(INDIRECT, spp).spp for spp in (64, 256)] == [64, 256]
    grown = step_by_step.truth(INDIRECT, 512)
    at_once = reference(scene, Store(tmp_path / "other")).truth(INDIRECT, 512)
    assert grown.spp == at_once.spp == 512
    np.testing.assert_array_equal(grown.accumulators, at_once.accumulators)


def test_blocks_count_by_their_samples(
    make_scene: MakeScene, reference: MakeReference, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Blocks of 1, 1, 2 and 4 samples whose values are 1, 1, 2 and 4: the mean is (1 + 1 + 4 + 16) / 8."""
    rendered_by(lambda stage, pixels, seed, spp, clamp: np.full((len(pixels), 3), float(spp)), monkeypatch)
    truth = reference(make_scene()).truth(INDIRECT, 128)
    np.testing.assert_array_equal(truth.accumulators[:, truth.mask], 22 / 8)


def test_nothing_is_rendered_twice(
    make_scene: MakeScene, reference: MakeReference, monkeypatch: pytest.MonkeyPatch
) -> None:
    scene = make_scene()
    first = reference(scene).truth(INDIRECT, 128)
    rendered_by(refuse, monkeypatch)
    monkeypatch.setattr(studio, "mitsuba", lambda cache: pytest.fail("Mitsuba was started"))
    again = reference(scene).truth(INDIRECT, 128)
    np.testing.assert_array_equal(first.accumulators, again.accumulators)
    assert again.seconds == first.seconds
    with pytest.raises(pytest.fail.Exception, match="Mitsuba was started"):
        reference(scene).truth(INDIRECT, 256)


def flipped(path: Path, position: float) -> None:
    """Change a byte at a part of the file."""
    content = bytearray(path.read_bytes())
    content[int(position * (len(content) - 1))] ^= 0x5A
    path.write_bytes(bytes(content))


@pytest.mark.parametrize("position", [0.0, 0.3, 0.9, 1.0])
def test_a_damaged_block_is_rendered_again_and_that_is_said(
    make_scene: MakeScene, reference: MakeReference, tmp_path: Path, position: float
) -> None:
    scene = make_scene()
    whole = reference(scene).truth(INDIRECT, 128)
    store = Store(tmp_path / "store")
    block = next((tmp_path / "store").rglob("block-001.exr"))
    flipped(block, position)
    mended = reference(scene, store).truth(INDIRECT, 128)
    np.testing.assert_array_equal(mended.accumulators, whole.accumulators)
    assert len(store.notes) == 1
    assert "block-001.exr" in store.notes[0]
    assert "rendered anew" in store.notes[0]


@pytest.mark.parametrize("fail_at", [0, 1, 4, 6])
def test_an_interrupted_run_is_resumed_to_the_same_result(
    make_scene: MakeScene, reference: MakeReference, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, fail_at: int
) -> None:
    """Blocks of 1, 1 and 2 samples, in 2, 2 and 4 launches: at most the block in flight is lost."""
    scene = make_scene()
    pixels = np.count_nonzero(reference(scene).subject_mask)
    monkeypatch.setattr(estimator, "PATHS_A_LAUNCH", pixels * ACCUMULATORS // 2)
    expected = reference(scene, Store(tmp_path / "undisturbed")).truth(INDIRECT, 64)
    with monkeypatch.context() as patch:
        rendered_by(Counting(fail_at), patch)
        with pytest.raises(KeyboardInterrupt):
            reference(scene).truth(INDIRECT, 64)
    blocks = sorted(p.name for p in (tmp_path / "store").rglob("*block-*"))
    assert blocks == ["block-000.exr", "block-001.exr"][: fail_at // 2]
    counting = Counting()
    rendered_by(counting, monkeypatch)
    resumed = reference(scene).truth(INDIRECT, 64)
    assert len(counting.seeds) == 8 - 2 * len(blocks)
    np.testing.assert_array_equal(resumed.accumulators, expected.accumulators)


def test_a_block_with_nan_is_an_error_and_is_not_kept(
    make_scene: MakeScene, reference: MakeReference, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def broken(stage: Stage, pixels: NDArray[Any], seed: int, spp: int, clamp: float | None) -> Float64:
        values = np.ones((len(pixels), 3))
        values[pixels == pixels[0]] = np.nan
        return values

    rendered_by(broken, monkeypatch)
    with pytest.raises(RenderError, match=f"indirect_radiance, a block of 1 spp has {3 * ACCUMULATORS} values"):
        reference(make_scene()).truth(INDIRECT, 64)
    assert not list((tmp_path / "store").rglob("block-*"))


def key_of(scene: Scene, name: str = INDIRECT) -> str:
    return digest_of(truth_parts(scene, name))


SKIN = {"type": "diffuse", "reflectance": [0.6, 0.5, 0.41]}


@pytest.mark.parametrize(
    "changes",
    [
        lambda plain: {"materials": plain["materials"] | {"skin": SKIN}},
        lambda plain: {"sensor": plain["sensor"] | {"width": 17}},
        lambda plain: {"sensor": plain["sensor"] | {"fov_axis": "y"}},
        lambda plain: {"emitters": []},
        lambda plain: {"shapes": plain["shapes"][::-1]},
        lambda plain: {"subject": ["room"]},
    ],
    ids=["reflectance", "resolution", "fov axis", "lights", "order of shapes", "subject"],
)
def test_a_truth_depends_on_what_can_change_it(
    make_scene: MakeScene, changes: Callable[[dict[str, Any]], dict[str, Any]]
) -> None:
    scene = make_scene()
    plain = scene.model_dump(mode="json", include={"materials", "sensor", "shapes"})
    assert key_of(make_scene(**changes(plain))) != key_of(scene)


CHECK = {
    "quantity": INDIRECT,
    "technique": "indirect.talk",
    "criteria": [{"metric": "nrmse", "max": 0.5, "reason": "only a test of keys"}],
}


@pytest.mark.parametrize(
    "changes",
    [{"title": "Another title"}, {"description": "Words"}, {"truth": {"max_spp": 1 << 20}}, {"checks": [CHECK]}],
    ids=["title", "description", "limit", "checks"],
)
def test_a_truth_does_not_depend_on_words_and_budgets(make_scene: MakeScene, changes: dict[str, Any]) -> None:
    assert key_of(make_scene()) == key_of(make_scene(**changes))


def test_a_truth_depends_on_the_content_of_mesh_files_not_on_their_name(
    make_scene: MakeScene, make_cavity: Callable[..., dict[str, Any]], tmp_path: Path
) -> None:
    ball = {"name": "ball", "type": "sphere", "material": "skin"}
    cavity = make_cavity(3.0, "white", 1)
    first = key_of(make_scene(shapes=[cavity, ball]))
    (tmp_path / "cavity.obj").rename(tmp_path / "other.obj")
    assert key_of(make_scene(shapes=[cavity | {"path": "other.obj"}, ball])) == first
    make_cavity(3.1, "white", 1)
    assert key_of(make_scene(shapes=[cavity, ball])) != first


@pytest.mark.parametrize("heights", ["bumps", "brick", "steps", "spikes", "noise"])
def test_a_height_field_that_a_library_makes_otherwise_has_another_key(
    heights: str, make_scene: MakeScene, monkeypatch: pytest.MonkeyPatch
) -> None:
    """An upgrade of numpy, scipy, Pillow or scikit-image may do that, and the scene's file says nothing of it."""
    block = {"name": "it", "type": "relief", "material": "skin", "size": [1.0, 1.0], "depth": 0.1, "heights": heights}
    scene = make_scene(shapes=[block | {"resolution": 8}], subject=["it"])
    before, field = truth_parts(scene, "displaced_uv"), relief.field
    estimator._field_digest.cache_clear()
    assert truth_parts(scene, "displaced_uv") == before
    monkeypatch.setattr(relief, "field", lambda *which: field(*which) + 2.0**-20)
    estimator._field_digest.cache_clear()
    assert truth_parts(scene, "displaced_uv") != before
    estimator._field_digest.cache_clear()


def test_quantities_have_keys_of_their_own(make_scene: MakeScene) -> None:
    names = ("depth", "normal", "coverage", "albedo", INDIRECT)
    assert len({key_of(make_scene(), name) for name in names}) == len(names)


def test_a_clamped_truth_is_another_truth_and_geometry_is_not(make_scene: MakeScene) -> None:
    clamped = make_scene(truth={"clamp": 0.5})
    assert key_of(clamped) != key_of(make_scene())
    assert key_of(clamped, "depth") == key_of(make_scene(), "depth")


def test_clamping_splits_the_same_samples_into_what_is_kept_and_what_is_removed(
    make_scene: MakeScene, mi: ModuleType
) -> None:
    scene = make_scene()
    stage = build_stage(mi, scene, geometry_of(scene))
    pixels = np.array([90, 100, 101])
    whole, parts = (indirect_block(stage, pixels, 7, 64, clamp) for clamp in (None, 0.3))
    np.testing.assert_allclose(parts[:, :3] + parts[:, 3:], whole, rtol=1e-5)
    assert (parts >= 0).all()
    assert (parts[:, 3:] > 0).any()
    assert parts[:, :3].max() <= 0.3
    untouched = indirect_block(stage, pixels, 7, 64, 1e9)
    np.testing.assert_allclose(untouched, np.hstack([whole, np.zeros_like(whole)]), rtol=1e-6)


def test_a_clamped_truth_carries_what_was_removed(make_scene: MakeScene, reference: MakeReference) -> None:
    truth = reference(make_scene(truth={"clamp": 0.3})).truth(INDIRECT, 256)
    assert truth.removed is not None
    assert truth.removed.shape == truth.accumulators.shape
    assert truth.accumulators[:, truth.mask].max() <= 0.3
    assert truth.removed.sum() > 0


def test_all_samples_at_hand_are_those_that_are_stored_without_a_gap(
    make_scene: MakeScene, reference: MakeReference, tmp_path: Path
) -> None:
    made = reference(make_scene())
    assert made.at_hand(INDIRECT, 16).spp == 16
    made.truth(INDIRECT, 128)
    assert made.at_hand(INDIRECT, 16).spp == 128
    next((tmp_path / "store").rglob("block-002.exr")).unlink()
    assert made.at_hand(INDIRECT, 16).spp == 32
    assert made.at_hand("depth", 0).is_exact


def test_a_block_is_read_once_and_counts_as_used_each_time(
    make_scene: MakeScene, reference: MakeReference, monkeypatch: pytest.MonkeyPatch
) -> None:
    scene = make_scene()
    first = reference(scene).truth(INDIRECT, 128)
    again = reference(scene)
    read: list[Path] = []
    whole_image = store_module.whole_image

    def recorded(path: Path) -> Any:
        read.append(path)
        return whole_image(path)

    monkeypatch.setattr(store_module, "whole_image", recorded)
    used = []
    for _ in range(2):
        again.store.touched.clear()
        truth = again.truth(INDIRECT, 128)
        np.testing.assert_array_equal(truth.accumulators, first.accumulators)
        used.append({path for path in again.store.touched if path.name.startswith("block-")})
    assert used[0] == used[1]
    assert len(used[0]) == len(set(read) & used[0]) == len([path for path in read if path in used[0]]) == 4


def test_blocks_beyond_the_memory_for_them_are_read_again(
    make_scene: MakeScene, reference: MakeReference, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(estimator, "MOST_BYTES_KEPT", 0)
    looked = reference(make_scene())
    first, again = looked.truth(INDIRECT, 64), looked.truth(INDIRECT, 64)
    np.testing.assert_array_equal(first.accumulators, again.accumulators)
    assert looked._blocks == {}


@pytest.mark.parametrize(
    ("scene", "quantity", "why"),
    [
        ("skin-sphere", "thickness", "two scenes"),
        ("shadow-room-5cm", "visibility", "two scenes"),
        ("shadow-room", "visibility", None),
        ("skin-sphere", "transmitted_radiance", None),
        ("hair-groomed", "hair_radiance", "among hairs it loses light"),
        ("hair-width-100", "hair_coverage", None),
        ("character", "full_radiance", "among hairs it loses light"),
        ("character-bust", "full_radiance", None),
    ],
)
def test_what_mitsuba_gets_wrong_on_cuda_is_refused(
    scene: str, quantity: str, why: str | None, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Where they are allowed, the next thing to happen would be rendering."""

    class NotHereError(Exception):
        pass

    def render(self: Any, *given: Any) -> None:
        raise NotHereError

    monkeypatch.setenv(CHOICE, "cuda_ad_rgb")
    monkeypatch.setattr(studio.Studio, "exact", render)
    monkeypatch.setattr(studio.Studio, "launch", render)
    reference = Reference(load_scene(find_scene(scene)), Store(tmp_path), lambda what, part: None)
    with pytest.raises(InputError if why else NotHereError, match=why):
        reference.truth(quantity, 16)
