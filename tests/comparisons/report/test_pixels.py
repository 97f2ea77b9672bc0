import base64
import json
import math
import zlib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from comparisons.metrics import Samples
from comparisons.report.pixels import SIGMA_BITS, VALUE_BITS, rounded, write_pixels
from comparisons.significance import Significance

NORMAL = st.floats(2.0**-126, 2.0**127, width=32) | st.floats(-(2.0**127), -(2.0**-126), width=32)


def read(path: Path) -> dict[str, Any]:
    """What the script hands to the viewer."""
    head, _, rest = path.read_text(encoding="utf-8").partition("(")
    assert (head, rest[-3:]) == ("lightgauge.show", ");\n")
    content: dict[str, Any] = json.loads(rest[:-3])
    return content


def judged_of(content: dict[str, Any]) -> NDArray[np.bool_]:
    bits = np.frombuffer(zlib.decompress(base64.b64decode(content["judged"])), np.uint8)
    shape = (content["height"], content["width"])
    return np.unpackbits(bits, count=math.prod(shape), bitorder="little").astype(bool).reshape(shape)


def values_of(content: dict[str, Any], name: str) -> NDArray[np.float32]:
    """(H, W, C), NaN where nothing is stored."""
    stored = content["images"][name]
    planes = np.frombuffer(zlib.decompress(base64.b64decode(stored["data"])), np.uint8).reshape(4, -1)
    values = np.ascontiguousarray(planes.T).view("<f4").reshape(-1, stored["channels"])
    image = np.full((content["height"], content["width"], stored["channels"]), np.nan, np.float32)
    where = judged_of(content) if stored["where"] == "judged" else np.ones(image.shape[:2], bool)
    image[where] = values
    return image


def write(folder: Path, test: NDArray[Any], samples: Samples, **more: Any) -> dict[str, Any]:
    given: dict[str, Any] = {
        "quantity": "q",
        "unit": "1",
        "display": "radiance",
        "exposure": 1.0,
        "error_scale": 0.5,
    } | more
    path = write_pixels(folder, "room", test.astype(np.float32), samples, **given)
    assert path == "pixels/room.js"
    return read(folder / path)


@pytest.fixture
def noisy() -> tuple[NDArray[np.float32], Samples]:
    """An image (5, 7, 3) over many magnitudes, and a truth of 16 accumulators for most of its pixels."""
    random = np.random.default_rng(3)
    truth = 10 ** random.uniform(-6, 6, (5, 7, 3))
    accumulators = (truth * random.gamma(25, 1 / 25, (16, 5, 7, 3))).astype(np.float32)
    mask = random.random((5, 7)) < 0.8
    return (truth * random.uniform(0.9, 1.1, truth.shape)).astype(np.float32), Samples(accumulators, mask)


@given(NORMAL, st.integers(2, 23))
def test_rounding_keeps_a_value_to_its_significant_bits(value: float, bits: int) -> None:
    exact = np.float32(value)
    kept = rounded(np.array([exact]), bits)
    assert abs(float(kept[0]) - float(exact)) <= 2.0**-bits * abs(float(exact))
    assert kept.view(np.uint32)[0] % (1 << (24 - bits)) == 0


def test_rounding_goes_to_the_nearest_value_and_to_even_between_two() -> None:
    values = np.array([1.0, 1.01, 1.24, 1.26, 1.25, 1.75, -1.25])
    assert rounded(values, 2).tolist() == [1.0, 1.0, 1.0, 1.5, 1.0, 2.0, -1.0]


def test_what_is_no_number_stays_so() -> None:
    kept = rounded(np.array([np.nan, np.inf, -np.inf, 0.0]), VALUE_BITS)
    np.testing.assert_array_equal(kept, [np.nan, np.inf, -np.inf, 0.0])


def test_values_of_twelve_decades_keep_their_relative_precision(
    tmp_path: Path, noisy: tuple[NDArray[np.float32], Samples]
) -> None:
    test, samples = noisy
    content = write(tmp_path, test, samples)
    precision = 2.0**-VALUE_BITS
    np.testing.assert_array_equal(judged_of(content), samples.mask)
    np.testing.assert_allclose(values_of(content, "realtime"), test, rtol=precision)
    for name, image in [("truth", samples.mean), ("error", test - samples.mean)]:
        stored = values_of(content, name)
        np.testing.assert_allclose(stored[samples.mask], image[samples.mask], rtol=precision * 1.001)
        assert np.isnan(stored[~samples.mask]).all(), "no truth is told where none is known"
    sigma = values_of(content, "sigma")[samples.mask]
    np.testing.assert_allclose(sigma, samples.standard_error[samples.mask], rtol=2.0**-SIGMA_BITS * 1.001)


def test_the_error_is_that_of_the_exact_values(tmp_path: Path) -> None:
    """Rounded to eleven bits, the two images would not differ at all."""
    truth = np.full((1, 2, 2, 1), 1.0, np.float32)
    test = np.array([[[1.00001], [1.0]], [[1.0], [0.99999]]], np.float32)
    content = write(tmp_path, test, Samples(truth[:, :, :1].repeat(2, axis=2), np.ones((2, 2), bool)))
    assert np.all(values_of(content, "realtime") == 1.0)
    expected = [1e-5, 0, 0, -1e-5]
    np.testing.assert_allclose(values_of(content, "error").ravel(), expected, rtol=0.01)


def test_an_exact_truth_has_no_sigma(tmp_path: Path) -> None:
    content = write(tmp_path, np.ones((2, 3, 1)), Samples(np.ones((1, 2, 3, 1)), np.ones((2, 3), bool)))
    assert set(content["images"]) == {"realtime", "truth", "error"}


def test_flip_and_significance_come_along(tmp_path: Path, noisy: tuple[NDArray[np.float32], Samples]) -> None:
    test, samples = noisy
    wrong = samples.mask & (np.arange(7) < 3)
    found = Significance(wrong, np.where(wrong, -0.25, 0.0), 0.4, 4)
    flip = np.linspace(0, 1, 35, dtype=np.float32).reshape(5, 7)
    content = write(tmp_path, test, samples, significance=found, flip=flip, worst=(4, 2))
    assert content["worst"] == [4, 2]
    np.testing.assert_allclose(
        values_of(content, "flip")[samples.mask][:, 0], flip[samples.mask], rtol=2.0**-VALUE_BITS
    )
    np.testing.assert_array_equal(
        values_of(content, "significance")[..., 0], np.where(wrong, np.float32(-0.25), np.nan)
    )


def test_a_pixel_that_is_no_number_is_kept(tmp_path: Path) -> None:
    test = np.array([[[np.nan], [2.0]]])
    content = write(tmp_path, test, Samples(np.ones((1, 1, 2, 1)), np.ones((1, 2), bool)))
    for name, second in [("realtime", 2.0), ("error", 1.0)]:
        np.testing.assert_array_equal(values_of(content, name).ravel(), np.array([np.nan, second], np.float32))


def test_a_value_costs_what_its_significant_bits_cost(tmp_path: Path) -> None:
    """Noise of 2 % around 1: eight of the bits are random, the others nearly always the same."""
    noise = np.random.default_rng(1).normal(1, 0.02, (64, 64, 3))
    content = write(tmp_path, noise, Samples(np.ones((1, 64, 64, 3)), np.ones((64, 64), bool)))
    assert len(content["images"]["realtime"]["data"]) < noise.size * 4 / 3 * 1.25


def test_a_run_writes_the_pixels_of_each_check_beside_its_pictures(after_a_run: Path) -> None:
    results = json.loads((after_a_run / "report" / "results.json").read_text(encoding="utf-8"))
    (check,) = (check for check in results["checks"] if check["technique"] == "indirect.irradiance")
    assert check["images"]["pixels"] == "pixels/tiny-indirect.irradiance-side-24-.js"
    content = read(after_a_run / "report" / check["images"]["pixels"])
    assert (content["quantity"], content["unit"], content["display"]) == (check["quantity"], check["unit"], "radiance")
    assert (content["exposure"], content["errorScale"]) == (check["exposure_display"], check["error_scale"])
    x, y = content["worst"]
    assert (x, y) == (check["worst"]["x"], check["worst"]["y"])
    for name in ("realtime", "truth", "sigma"):
        np.testing.assert_allclose(values_of(content, name)[y, x], check["worst"][name], rtol=2.0**-SIGMA_BITS)
    assert (after_a_run / "report" / check["images"]["flip"]).is_file()
    assert np.nanmax(values_of(content, "flip")) <= 1


def test_every_check_of_a_run_has_pixels(after_a_run: Path) -> None:
    results = json.loads((after_a_run / "report" / "results.json").read_text(encoding="utf-8"))
    for check in results["checks"]:
        content = read(after_a_run / "report" / check["images"]["pixels"])
        assert content["quantity"] == check["quantity"]
        assert np.all(np.isfinite(values_of(content, "error")[judged_of(content)]))
