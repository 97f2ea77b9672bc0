"""The laws of the faults that a check has to notice."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from comparisons.metrics import METRICS, Samples, evaluate
from comparisons.mutants import MUTANTS, is_equivalent
from scenes.image import Bool, Float32

SHAPE = (6, 5, 2)
RAMP = np.linspace(0.2, 1.0, 64 * 48 * 3, dtype=np.float32).reshape(64, 48, 3)
EVERYWHERE = np.ones((64, 48), dtype=bool)

EIGHTHS = hnp.arrays(np.int8, SHAPE)
IMAGES = EIGHTHS.map(lambda eighths: eighths.astype(np.float32) / 8)
LIT_IMAGES = EIGHTHS.map(lambda eighths: (eighths.astype(np.float32) + 129) / 8)
MASKS = hnp.arrays(np.bool_, SHAPE[:2]).filter(lambda mask: bool(mask.any()))


def mutate(name: str, image: Float32, mask: Bool) -> Float32:
    return MUTANTS[name].function(image, mask)


def changed(image: Float32, mutated: Float32) -> Bool:
    """(H, W), where the images differ; a value that is no number differs from everything."""
    different: Bool = (image != mutated).any(axis=2)
    return different


def bumpy() -> Float32:
    """A smooth image without symmetry, whose values spread over a factor of 20."""
    y, x = np.mgrid[0:64, 0:48]
    level = 1.05 + 0.6 * np.sin(x / 9 + 0.3) * np.cos(y / 13) + 0.35 * np.sin(y / 7 + x / 31)
    return np.stack([level, 0.8 * level**1.2, 0.5 * level + 0.02 * x], axis=2).astype(np.float32)


def test_every_mutant_says_what_it_is() -> None:
    assert all(mutant.name == name and mutant.summary for name, mutant in MUTANTS.items())


@pytest.mark.parametrize("name", MUTANTS)
@given(image=IMAGES, mask=MASKS)
def test_a_mutant_is_a_pure_function(name: str, image: Float32, mask: Bool) -> None:
    before = image.copy()
    first, second = mutate(name, image, mask), mutate(name, image, mask)
    np.testing.assert_array_equal(first, second)
    np.testing.assert_array_equal(image, before)
    assert (first.shape, first.dtype) == (image.shape, image.dtype)


@given(IMAGES, MASKS)
def test_a_gain_is_exact(image: Float32, mask: Bool) -> None:
    np.testing.assert_allclose(mutate("gain", image, mask), 1.1 * image.astype(np.float64), rtol=1e-6, atol=1e-30)


@given(IMAGES, MASKS)
def test_a_flip_done_twice_is_none(image: Float32, mask: Bool) -> None:
    once = mutate("flip_y", image, mask)
    np.testing.assert_array_equal(once[0], image[-1])
    np.testing.assert_array_equal(mutate("flip_y", once, mask), image)


@given(IMAGES, MASKS)
def test_a_shift_moves_to_the_right(image: Float32, mask: Bool) -> None:
    moved = mutate("shift", image, mask)
    np.testing.assert_array_equal(moved[:, 1:], image[:, :-1])
    np.testing.assert_array_equal(moved[:, 0], image[:, 0])


@pytest.mark.parametrize("name", ["missing_shadow", "gamma_twice"])
@given(image=IMAGES, other=IMAGES, mask=MASKS)
def test_what_is_not_judged_is_neither_changed_nor_looked_at(
    name: str, image: Float32, other: Float32, mask: Bool
) -> None:
    mutated = mutate(name, image, mask)
    assert not changed(image, mutated)[~mask].any()
    elsewhere = np.where(mask[..., None], image, other)
    np.testing.assert_array_equal(mutate(name, elsewhere, mask)[mask], mutated[mask])


@given(LIT_IMAGES, MASKS)
def test_a_missing_shadow_lights_the_darkest_tenth_to_the_median_and_keeps_its_hue(image: Float32, mask: Bool) -> None:
    before, after = image[mask].astype(np.float64), mutate("missing_shadow", image, mask)[mask].astype(np.float64)
    level = before.mean(axis=1)
    lit = (before != after).any(axis=1)
    assert lit.sum() <= np.ceil(len(level) / 10)
    assert level[lit].max(initial=0.0) <= level[~lit].min(initial=np.inf)
    np.testing.assert_allclose(after[lit].mean(axis=1), np.median(level), rtol=1e-6)
    np.testing.assert_allclose(after / after.sum(axis=1, keepdims=True), before / (2 * level[:, None]), rtol=1e-5)


def test_black_has_no_hue_and_is_lit_grey() -> None:
    image = RAMP.copy()
    image[0, 0] = 0
    lit = mutate("missing_shadow", image, EVERYWHERE)[0, 0]
    np.testing.assert_allclose(lit, np.median(image.mean(axis=2)), rtol=1e-6)


def test_normals_have_shadows_too() -> None:
    """Brightness is the magnitude: the darkest tenth of a negated image is that of the image."""
    np.testing.assert_array_equal(
        mutate("missing_shadow", -RAMP, EVERYWHERE), -mutate("missing_shadow", RAMP, EVERYWHERE)
    )


@given(IMAGES, MASKS, st.sampled_from([0.25, 2.0, 1024.0]))
def test_an_encoding_knows_no_scale_and_keeps_black_white_and_signs(image: Float32, mask: Bool, scale: float) -> None:
    before, after = image[mask], mutate("gamma_twice", image, mask)[mask]
    np.testing.assert_allclose(np.abs(after).max(), np.abs(before).max(), rtol=1e-6)
    np.testing.assert_array_equal(after == 0, before == 0)
    assert (np.sign(after) == np.sign(before)).all()
    assert (np.abs(after) >= np.abs(before) * (1 - 1e-6)).all()
    scaled = mutate("gamma_twice", image * np.float32(scale), mask)[mask]
    np.testing.assert_allclose(scaled, scale * after, rtol=1e-5, atol=1e-30)


def test_an_encoded_value_is_that_of_the_formula() -> None:
    image = np.array([[[0.25, 1.0, 4.0]]], dtype=np.float32)
    encoded = mutate("gamma_twice", image, np.array([[True]]))
    np.testing.assert_allclose(encoded, 4 * (image / 4) ** (1 / 2.2), rtol=1e-6)


@pytest.mark.parametrize(
    ("shape", "tile"), [((64, 64), (16, 16)), ((200, 300), (16, 16)), ((40, 20), (10, 5)), ((3, 1), (1, 1))]
)
def test_a_tile_is_at_most_a_quarter_as_long_as_what_is_judged(shape: tuple[int, int], tile: tuple[int, int]) -> None:
    image = np.ones((*shape, 1), dtype=np.float32)
    rows, columns = np.nonzero(changed(image, mutate("black_tile", image, np.ones(shape, dtype=bool))))
    assert (len(np.unique(rows)), len(np.unique(columns))) == tile
    assert abs(rows.mean() - (shape[0] - 1) / 2) <= 0.5
    assert abs(columns.mean() - (shape[1] - 1) / 2) <= 0.5


def test_a_tile_does_not_fall_into_a_hole() -> None:
    """The centroid of a frame is not part of it."""
    frame = EVERYWHERE.copy()
    frame[16:48, 12:36] = False
    tile = changed(RAMP, mutate("black_tile", RAMP, frame))
    assert tile.sum() == 16 * 12
    assert frame[tile].all()


@given(IMAGES, MASKS)
def test_one_judged_pixel_is_not_a_number(image: Float32, mask: Bool) -> None:
    bad = np.isnan(mutate("nan_pixel", image, mask)).any(axis=2)
    assert bad.sum() == 1
    assert mask[bad].all()


def test_a_symmetric_image_is_the_same_upside_down() -> None:
    image = np.concatenate([RAMP, RAMP[::-1]])
    mask = np.ones((128, 48), dtype=bool)
    assert is_equivalent(image, mutate("flip_y", image, mask), mask)
    assert not is_equivalent(RAMP, mutate("flip_y", RAMP, EVERYWHERE), EVERYWHERE)


@pytest.mark.parametrize(("part", "same"), [(0.9e-4, True), (1.1e-4, False)])
def test_a_change_of_a_tenth_of_a_per_mille_is_none(part: float, same: bool) -> None:
    image = RAMP.astype(np.float64)
    assert is_equivalent(image, (1 + part) * image, EVERYWHERE) is same  # type: ignore[arg-type]


def test_only_judged_pixels_make_a_difference() -> None:
    mask = EVERYWHERE.copy()
    mask[:8] = False
    other = RAMP.copy()
    other[:8] = np.nan
    assert is_equivalent(RAMP, other, mask)


def test_a_pixel_that_is_not_a_number_is_a_difference() -> None:
    assert not is_equivalent(RAMP, mutate("nan_pixel", RAMP, EVERYWHERE), EVERYWHERE)


@pytest.mark.parametrize("name", METRICS)
def test_every_metric_claims_known_mutants_and_what_is_not_a_number(name: str) -> None:
    assert "nan_pixel" in METRICS[name].sees
    assert METRICS[name].sees <= set(MUTANTS)


@pytest.mark.parametrize(
    ("name", "mutant"), [(m.name, mutant) for m in METRICS.values() for mutant in sorted(m.sees - {"nan_pixel"})]
)
def test_a_metric_moves_for_what_it_claims_to_see(name: str, mutant: str) -> None:
    """By the smallest bound that a shipped scene sets for it, with a perfect image of fractions as the start."""
    least = {"shift_px": 0.01, "delta_e_itp": 1.0, "rel_mse_eps1e-2": 0.0025}.get(name, 0.0035)
    image = bumpy() / np.float32(2)
    if name == "off_by_1":  # it counts in the quantity's unit, which is a texel of many
        image *= 256
    reading = evaluate(name, mutate(mutant, image, EVERYWHERE), Samples(image[None], EVERYWHERE)).value
    assert abs(reading) > least


@pytest.mark.parametrize(
    ("name", "mutant", "most"),
    [
        ("energy_bias", "flip_y", 1e-6),
        ("dssim_tonemapped", "gain", 2e-3),
        ("nrmse", "shift", 0.1),
        ("flip", "shift", 0.1),
    ],
)
def test_what_a_metric_does_not_claim_hardly_moves_it(name: str, mutant: str, most: float) -> None:
    image = bumpy()
    assert mutant not in METRICS[name].sees
    assert abs(evaluate(name, mutate(mutant, image, EVERYWHERE), Samples(image[None], EVERYWHERE)).value) < most


def test_a_tile_of_a_large_image_lies_beyond_the_percentile() -> None:
    """256 of 40,000 pixels."""
    image, mask = np.ones((200, 200, 1), dtype=np.float32), np.ones((200, 200), dtype=bool)
    tiled = mutate("black_tile", image, mask)
    assert evaluate("p99_abs", tiled, Samples(image[None], mask)).value == 0
    assert evaluate("max_abs", tiled, Samples(image[None], mask)).value == 1
