from collections.abc import Callable
from pathlib import Path

import numpy as np
import PIL.Image
import pytest
from numpy.typing import NDArray

import scenes.load
from scenes.geometry import is_convex
from scenes.library.assets import figurine, groom, iris, tiles, weave
from scenes.mesh import Surface
from scenes.mesh_files import load_mesh
from scenes.topology import signed_volume

ASSETS = scenes.load.LIBRARY / "assets"


@pytest.fixture(scope="module")
def figure() -> Surface:
    return load_mesh(ASSETS / "figurine.ply", "smooth", closed=True)


def test_the_figurine_is_what_its_script_makes(tmp_path: Path) -> None:
    figurine.write(tmp_path / "figurine.ply")
    made, kept = (load_mesh(folder / "figurine.ply", "smooth", closed=True) for folder in (tmp_path, ASSETS))
    assert made.positions.shape == kept.positions.shape
    assert made.faces.shape == kept.faces.shape
    np.testing.assert_allclose(made.positions[made.faces], kept.positions[kept.faces], atol=1e-5)


def test_the_figurine_is_a_small_solid_of_height_1_about_the_origin(figure: Surface) -> None:
    assert (ASSETS / "figurine.ply").stat().st_size < 200_000
    assert 3000 <= len(figure.faces) <= 5000
    low, high = figure.positions.min(axis=0), figure.positions.max(axis=0)
    np.testing.assert_allclose(high - low, [high[0] - low[0], 1, high[2] - low[2]], atol=1e-6)
    np.testing.assert_allclose(low + high, 0, atol=1e-6)
    assert signed_volume(figure) > 0
    assert not is_convex(figure)


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_no_mirror_image_of_the_figurine_looks_like_itself(figure: Surface, axis: int) -> None:
    mirrored = figure.positions.copy()
    mirrored[:, axis] *= -1
    distances = np.linalg.norm(mirrored[:, None] - figure.positions[None], axis=2).min(axis=1)
    assert distances.max() > 0.05


@pytest.mark.parametrize(
    ("name", "made"), [("tiles", tiles.tiles), ("iris", iris.iris), ("weave", weave.weave), *groom.MAPS.items()]
)
def test_a_texture_is_what_its_script_makes(name: str, made: Callable[[], NDArray[np.uint8]]) -> None:
    with PIL.Image.open(ASSETS / f"{name}.png") as file:
        kept = np.asarray(file)
    np.testing.assert_array_equal(kept, made())


@pytest.mark.parametrize(("made", "least"), [(tiles.tiles, 10), (iris.iris, 3), (weave.weave, 2)])
def test_no_mirroring_or_turning_of_a_texture_looks_like_it(made: Callable[[], NDArray[np.uint8]], least: int) -> None:
    image = made().astype(int)
    turned = [np.rot90(image, k) for k in (1, 2, 3)]
    mirrored = [np.rot90(image[:, ::-1], k) for k in (0, 1, 2, 3)]
    for other in (*turned, *mirrored):
        assert np.abs(other - image).mean() > least
