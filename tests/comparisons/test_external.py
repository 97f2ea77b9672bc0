"""What is wrong with an image of another program, found by its error alone."""

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter, shift

from comparisons.diagnosis import diagnose, factor_says
from comparisons.external import hints, measure, require_judgeable
from comparisons.image_files import ImageFile
from comparisons.metrics import Samples
from reference.estimator import Truth
from reference.quantities import quantity
from reference.quantity import Integrator
from scenes import srgb
from scenes.errors import ImageError
from scenes.image import Float64
from scenes.load import library_scenes, load_scene
from scenes.model import Scene

SIDE = 48


@pytest.fixture(scope="module")
def picture() -> Float64:
    """(48, 48, 3), smooth, in (0, 1), without any symmetry."""
    noise = np.random.default_rng(1).normal(size=(SIDE, SIDE, 3))
    smooth = gaussian_filter(noise, (3, 3, 0))
    picture: Float64 = 0.3 + 0.2 * smooth / np.abs(smooth).max()
    return picture


@pytest.fixture(scope="module")
def samples(picture: Float64) -> Samples:
    """Its truth: 16 accumulators, each 10 % noisy, judged within a circle that is not in the middle."""
    y, x = np.mgrid[:SIDE, :SIDE]
    noise = np.random.default_rng(2).normal(size=(16, SIDE, SIDE, 3))
    return Samples(picture * (1 + 0.1 * noise), (y - 22) ** 2 + (x - 26) ** 2 < 19**2)


def by_two_percent(picture: Float64) -> Float64:
    """What a decent technique makes of it."""
    x = np.arange(SIDE)[:, None]
    return picture * (1 + 0.02 * np.sin(x / 7))[None]


FAULTS: dict[str, tuple[Callable[[Float64], Float64], str]] = {
    "flipped": (lambda x: x[::-1], "upside down"),
    "mirrored": (lambda x: x[:, ::-1], "mirrored"),
    "turned": (lambda x: x[::-1, ::-1], "turned by 180 degrees"),
    "transposed": (lambda x: x.swapaxes(0, 1), "rows and columns are swapped"),
    "a pixel to the right": (partial(np.roll, shift=1, axis=1), "moved by about 1 px right"),
    "half a pixel up": (lambda x: shift(x, (-0.5, 0, 0), mode="nearest"), "moved by about 0.5 px up"),
    "encoded": (srgb.encode, "sRGB-encoded"),
    "decoded": (srgb.decode, "decoded from sRGB although"),
    "photometric": (lambda x: 683 * x, "683 lm/W"),
    "a third": (lambda x: x / 3, "times too small"),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_a_fault_is_named_and_undone(picture: Float64, samples: Samples, fault: str) -> None:
    spoil, says = FAULTS[fault]
    image = by_two_percent(picture)
    found = diagnose(spoil(image), samples, read_as="linear")
    assert len(found.sentences) == 1
    assert says in found.sentences[0]
    assert np.sqrt(np.mean((found.mended - picture)[samples.mask] ** 2)) < 0.04 * picture.mean()


def test_two_faults_are_told_apart(picture: Float64, samples: Samples) -> None:
    found = diagnose(100 * picture[:, ::-1], samples, read_as="linear")
    assert len(found.causes) == 1
    assert "mirrored" in found.causes[0]
    assert found.factor == pytest.approx(100, rel=0.01)


@pytest.mark.parametrize("seed", range(3))
def test_noise_and_blur_and_bias_raise_no_alarm(picture: Float64, samples: Samples, seed: int) -> None:
    """Interpolation takes noise away, so that a move would help if it was not held against its opposite."""
    noisy = picture * (1 + 0.3 * np.random.default_rng(10 + seed).normal(size=picture.shape))
    blurred = gaussian_filter(picture, (1.5, 1.5, 0))
    for image in (
        picture,
        by_two_percent(picture),
        noisy,
        blurred,
        picture + 0.02 * np.sin(np.arange(SIDE))[:, None],
    ):
        assert diagnose(image, samples, read_as="linear").sentences == ()


def test_well_known_factors_are_named() -> None:
    assert "π" in factor_says(3.14)
    assert "millimetres" in factor_says(1 / 1000)
    assert factor_says(2.5) == "all its values are about 2.5 times too large"


@pytest.fixture
def scene() -> Scene:
    return load_scene(library_scenes()["small-room-knot"])


@pytest.fixture
def make_file(tmp_path: Path) -> Callable[..., ImageFile]:
    def make(pixels: Any, alpha: Any = None, most: float = np.inf) -> ImageFile:
        return ImageFile(
            tmp_path / "mine.exr", np.asarray(pixels, dtype=np.float32), alpha, "linear", most, "EXR", "0" * 64
        )

    return make


@pytest.mark.parametrize(
    ("shape", "says"),
    [
        ((64, 64, 3), "found 64 x 64 pixels; the scene has 128 x 128. The aspect fits"),
        ((128, 64, 3), "found 64 x 128 pixels.*aspect; `lightgauge export`"),
    ],
)
def test_another_size_is_refused(
    scene: Scene, make_file: Callable[..., ImageFile], shape: tuple[int, ...], says: str
) -> None:
    with pytest.raises(ImageError, match=says):
        require_judgeable(make_file(np.ones(shape)), scene, np.ones((128, 128), dtype=bool))


def test_a_swapped_size_is_named(scene: Scene, make_file: Callable[..., ImageFile]) -> None:
    wide = scene.model_copy(update={"sensor": scene.sensor.model_copy(update={"width": 200})})
    with pytest.raises(ImageError, match="Width and height are swapped"):
        require_judgeable(make_file(np.ones((200, 128, 3))), wide, np.ones((128, 200), dtype=bool))


def test_what_is_not_finite_is_counted(scene: Scene, make_file: Callable[..., ImageFile]) -> None:
    pixels, mask = np.ones((128, 128, 3)), np.ones((128, 128), dtype=bool)
    pixels[5, 7, 1], pixels[9, 2] = np.inf, np.nan
    with pytest.raises(ImageError, match=r"2 of 16384 judged pixels are NaN or infinite, the first at x 7, y 5"):
        require_judgeable(make_file(pixels), scene, mask)
    mask[5, 7] = mask[9, 2] = False
    require_judgeable(make_file(pixels), scene, mask)


def test_black_is_refused(scene: Scene, make_file: Callable[..., ImageFile]) -> None:
    with pytest.raises(ImageError, match="all 16384 judged pixels are black"):
        require_judgeable(make_file(np.zeros((128, 128, 3))), scene, np.ones((128, 128), dtype=bool))


@pytest.mark.parametrize(("level", "says"), [(0.4, "look premultiplied"), (0.9, "look straight")])
def test_a_judged_pixel_that_is_see_through_is_refused(
    scene: Scene, make_file: Callable[..., ImageFile], level: float, says: str
) -> None:
    mask = np.ones((128, 128), dtype=bool)
    alpha = np.ones((128, 128), dtype=np.float32)
    alpha[3, 4] = 0.5
    file = make_file(np.full((128, 128, 3), level), alpha)
    with pytest.raises(ImageError, match=rf"not 1 at 1 of 16384 judged pixels, the first at x 4, y 3 with 0.5.*{says}"):
        require_judgeable(file, scene, mask)
    mask[3, 4] = False
    require_judgeable(file, scene, mask)


def truth_of(samples: Samples) -> Truth:
    return Truth("frame_radiance", "", samples.accumulators, samples.mask, 16, 0.0, Integrator("none", "a test"))


def test_clipped_highlights_are_noticed(
    picture: Float64, samples: Samples, make_file: Callable[..., ImageFile]
) -> None:
    bright = Samples(samples.accumulators * 4, samples.mask)
    file = make_file(np.minimum(4 * picture, 1))
    found = list(hints(file, file.pixels, truth_of(bright), quantity("frame_radiance")))
    assert any("no value exceeds 1, but the truth does at" in hint for hint in found)
    unclipped = make_file(4 * picture)
    assert not list(hints(unclipped, unclipped.pixels, truth_of(bright), quantity("frame_radiance")))


def test_truth_is_sampled_until_the_error_is_known(picture: Float64) -> None:
    """The error of 10 % needs more than the first look at a truth this noisy, but not all that is allowed."""
    mask = np.ones((SIDE, SIDE), dtype=bool)
    asked: list[int] = []

    def truth_at(spp: int) -> Truth:
        asked.append(spp)
        noise = np.random.default_rng(spp).normal(size=(16, SIDE, SIDE, 3)) * (16 / spp) ** 0.5
        return truth_of(Samples(picture * (1 + 2 * noise), mask))

    image = (picture * 1.1).astype(np.float32)
    found = measure(image, ("nrmse", "energy_bias"), truth_at, 1 << 16, fitted=False)
    estimate = found.estimates["nrmse"]
    assert 1 < len(asked) < 13
    assert (estimate.high - estimate.low) / 2 <= max(0.05 * estimate.value, 0.005)
    assert estimate.low <= 0.1 * np.sqrt(np.mean(picture**2)) / picture.mean() <= estimate.high
    assert found.estimates["energy_bias"].value == pytest.approx(0.1, abs=0.01)
    fitted = measure(image, ("nrmse",), truth_at, 1 << 16, fitted=True)
    assert fitted.decision.exposure == pytest.approx(1 / 1.1, rel=0.01)
    assert fitted.estimates["nrmse"].value < 0.01
