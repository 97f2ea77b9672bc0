import math
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image as Picture

from comparisons.report import write_pictures
from comparisons.report.pictures import (
    DIVERGING,
    NOT_A_NUMBER,
    NOT_JUDGED,
    WITHIN_NOISE,
    error_map,
    significance_map,
)
from comparisons.significance import Significance
from reference.quantity import Display
from scenes.errors import ImageError

SCALE = 0.25


def grey(*values: float) -> NDArray[np.float32]:
    """A row of grey pixels (1, W, 3)."""
    return np.repeat(np.array(values, dtype=np.float32)[None, :, None], 3, axis=2)


def colour(text: str) -> list[int]:
    return [int(text[start : start + 2], 16) for start in (1, 3, 5)]


def test_error_colours_at_the_scale_at_zero_beyond_and_outside_the_mask() -> None:
    test = grey(-SCALE, -SCALE / 2, 0, SCALE / 2, SCALE, 5 * SCALE, -5 * SCALE, SCALE, math.nan)
    mask = np.array([[True] * 7 + [False, True]])
    coloured = error_map(test, np.zeros_like(test), mask, SCALE)[0].tolist()
    ends = [DIVERGING[-1], DIVERGING[0]]
    assert coloured == [colour(text) for text in (*DIVERGING, *ends, NOT_JUDGED, NOT_A_NUMBER)]


def test_too_dark_is_bluer_and_too_bright_is_redder() -> None:
    dark, bright = error_map(grey(0.5, 1.5), grey(1, 1), np.ones((1, 2), bool), 1.0)[0].astype(int)
    assert dark[2] > dark[0]
    assert bright[0] > bright[2]


def significance_of(signed: list[float], wrong: list[bool]) -> Significance:
    return Significance(np.array([wrong]), np.array([signed]), share=0.5, tiles=2)


def test_significant_tiles_have_the_colours_of_the_error_map() -> None:
    """One that is wrong by nothing to speak of is white, and still unlike what shows no error."""
    found = significance_of([-SCALE, -SCALE / 2, 0, SCALE / 2, 5 * SCALE, 0, 0], [True] * 5 + [False] * 2)
    mask = np.array([[True] * 6 + [False]])
    coloured = significance_map(found, mask, SCALE)[0].tolist()
    assert coloured == [colour(text) for text in (*DIVERGING, WITHIN_NOISE, NOT_JUDGED)]
    assert len({*DIVERGING, WITHIN_NOISE, NOT_JUDGED}) == 7


def read(path: Path) -> NDArray[np.uint8]:
    with Picture.open(path) as picture:
        return np.asarray(picture.convert("RGB"))


def test_pictures_are_written_where_their_paths_say(tmp_path: Path) -> None:
    test, truth = grey(0, 1), grey(0, 0.25)
    paths = write_pictures(tmp_path, "room", test, truth, np.ones((1, 2), bool), 1.0, SCALE)
    assert paths == {name: f"images/room-{name}.png" for name in ("realtime", "truth", "error")}
    assert read(tmp_path / paths["realtime"])[0].tolist() == [[0, 0, 0], [255, 255, 255]]
    # IEC 61966-2-1: a linear quarter has the sRGB code 137.
    assert read(tmp_path / paths["truth"])[0].tolist() == [[0, 0, 0], [137, 137, 137]]
    assert read(tmp_path / paths["error"])[0].tolist() == [colour(DIVERGING[2]), colour(DIVERGING[-1])]


def test_the_picture_of_significance_is_written_on_demand(tmp_path: Path) -> None:
    found = significance_of([SCALE, 0], [True, False])
    image, mask = grey(1, 1), np.ones((1, 2), bool)
    paths = write_pictures(tmp_path, "room", image, image, mask, 1.0, SCALE, significance=found)
    assert list(paths) == ["realtime", "truth", "error", "significance"]
    assert paths["significance"] == "images/room-significance.png"
    assert read(tmp_path / paths["significance"])[0].tolist() == [colour(DIVERGING[-1]), colour(WITHIN_NOISE)]


@pytest.mark.parametrize(
    ("display", "pixel", "exposure", "shown"),
    [
        ("normal", [-1, 0, 1], 1.0, [0, 128, 255]),
        ("unit", [0.2], 1.0, [51, 51, 51]),
        ("depth", [2.0], 0.1, [51, 51, 51]),
        ("depth", [20.0], 0.1, [255, 255, 255]),
        ("depth", [math.nan], 0.1, colour(NOT_A_NUMBER)),
        ("radiance", [math.inf, 0, 0], 1.0, colour(NOT_A_NUMBER)),
        ("uv", [0.2, 1.0], 1.0, [51, 255, 0]),
        ("uv", [51.0, 255.0], 1 / 255, [51, 255, 0]),
    ],
)
def test_quantities_are_made_visible(
    tmp_path: Path, display: Display, pixel: list[float], exposure: float, shown: list[int]
) -> None:
    test = np.array([[pixel]], dtype=np.float32)
    truth = np.zeros_like(test)
    paths = write_pictures(tmp_path, "a", test, truth, np.ones((1, 1), bool), exposure, 1.0, display)
    assert read(tmp_path / paths["realtime"])[0, 0].tolist() == shown


def test_pixels_without_a_value_that_are_not_judged_are_grey(tmp_path: Path) -> None:
    test = grey(math.nan)
    paths = write_pictures(tmp_path, "a", test, test, np.zeros((1, 1), bool), 1.0, 1.0)
    assert [read(tmp_path / path)[0, 0].tolist() for path in paths.values()] == [colour(NOT_JUDGED)] * 3


@pytest.mark.parametrize("scale", [0.0, -1.0, math.nan])
def test_a_scale_that_shows_nothing_is_refused(tmp_path: Path, scale: float) -> None:
    with pytest.raises(ImageError, match="must be positive"):
        write_pictures(tmp_path, "a", grey(1), grey(1), np.ones((1, 1), bool), 1.0, scale)


def test_images_of_different_shapes_are_refused(tmp_path: Path) -> None:
    with pytest.raises(ImageError, match=r"\(1, 2, 3\), \(1, 1, 3\)"):
        write_pictures(tmp_path, "a", grey(1, 1), grey(1), np.ones((1, 2), bool), 1.0, 1.0)
