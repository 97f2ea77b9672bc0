from pathlib import Path

import flip_evaluator  # noqa: TID253  # the reference for magma
import numpy as np
import pytest
from PIL import Image as Picture

from comparisons.report.pictures import MAGMA, NOT_JUDGED, VIRIDIS, flip_picture, write_pictures


def rgb(colour: str) -> tuple[int, int, int]:
    return int(colour[1:3], 16), int(colour[3:5], 16), int(colour[5:7], 16)


def test_flip_goes_from_black_to_light_yellow_on_a_scale_of_its_own() -> None:
    shown = flip_picture(np.array([[0.0, 1.0, 0.5]], np.float32), np.array([[True, True, False]]))
    assert [tuple(pixel) for pixel in shown[0]] == [rgb(MAGMA[0]), rgb(MAGMA[-1]), rgb(NOT_JUDGED)]


def test_magma_is_that_of_the_authors_of_flip() -> None:
    """Their map is a table of 256 colours; straight lines between every 15th of them come close."""
    black, grey = np.zeros((4, 256, 3), np.float32), np.zeros((4, 256, 3), np.float32)
    grey[:] = np.linspace(0, 1, 256, dtype=np.float32)[:, None]
    errors, _, _ = flip_evaluator.evaluate(black, grey, "LDR", inputsRGB=True, applyMagma=False)
    theirs, _, _ = flip_evaluator.evaluate(black, grey, "LDR", inputsRGB=True, applyMagma=True)
    ours = flip_picture(errors[..., 0], np.ones((4, 256), bool))
    assert np.ptp(errors) > 0.8
    assert np.abs(ours - 255 * theirs).max() < 6


@pytest.mark.parametrize("colours", [MAGMA, VIRIDIS])
def test_the_colours_of_a_scale_grow_lighter_throughout(colours: tuple[str, ...]) -> None:
    lightness = [float(np.dot(rgb(colour), (0.2126, 0.7152, 0.0722))) for colour in colours]
    assert lightness == sorted(lightness)
    assert len(set(colours)) == 18


def test_flip_is_written_beside_the_other_pictures(tmp_path: Path) -> None:
    image, mask = np.ones((2, 3, 3), np.float32), np.ones((2, 3), bool)
    flip = np.linspace(0, 1, 6, dtype=np.float32).reshape(2, 3)
    paths = write_pictures(tmp_path, "room", image, image, mask, 1.0, 1.0, flip=flip)
    assert paths["flip"] == "images/room-flip.png"
    np.testing.assert_array_equal(np.asarray(Picture.open(tmp_path / paths["flip"])), flip_picture(flip, mask))
