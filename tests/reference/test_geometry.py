"""The exact quantities on scenes whose image is known in closed form."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from reference.estimator import Reference
from reference.quantities import MODULES, quantity
from scenes.errors import InputError
from scenes.exr import write_exr
from scenes.features import features_of
from scenes.geometry import geometry_of
from scenes.image import Float32, Image
from scenes.model import Scene

MakeScene = Callable[..., Scene]
MakeReference = Callable[..., Reference]
SQUARE = {"name": "ball", "type": "rectangle", "size": [9.0, 9.0], "material": "skin"}


def image(reference: Reference, name: str) -> Float32:
    truth = reference.truth(name, 64)
    assert truth.is_exact
    assert truth.spp == 0
    assert truth.mask.all()
    found: Float32 = truth.accumulators[0]
    return found


def test_depth_is_along_the_axis_of_view_not_along_the_ray(
    make_scene: MakeScene, reference: MakeReference, facing: dict[str, Any]
) -> None:
    depth = image(reference(make_scene(sensor=facing, shapes=[SQUARE], emitters=[])), "depth")
    np.testing.assert_allclose(depth, 2.0, rtol=1e-6)


@pytest.mark.parametrize("turn", [[0.0, 0.0, 0.0], [0.0, 50.0, 0.0], [40.0, 0.0, 0.0]])
def test_normals_are_in_world_space(
    make_scene: MakeScene, reference: MakeReference, facing: dict[str, Any], turn: list[float]
) -> None:
    shapes = [SQUARE | {"size": [40.0, 40.0], "rotation_deg": turn}]
    normals = image(reference(make_scene(sensor=facing, shapes=shapes, emitters=[])), "normal")
    x, y = np.radians(turn[:2])
    expected = [np.sin(y) * np.cos(x), -np.sin(x), np.cos(x) * np.cos(y)]
    np.testing.assert_allclose(normals, np.broadcast_to(expected, (8, 8, 3)), atol=1e-6)


@pytest.mark.parametrize(("axis", "width", "height"), [("x", 12, 8), ("y", 12, 8), ("x", 6, 10), ("y", 6, 10)])
def test_coverage_is_the_part_of_each_pixel_that_the_subject_fills(
    make_scene: MakeScene, reference: MakeReference, facing: dict[str, Any], axis: str, width: int, height: int
) -> None:
    """A rectangle whose edges lie at 1/4 and 3/8 of a pixel: both are multiples of the grid of 8."""
    size = 2 * 2 * np.tan(np.radians(30)) / (width if axis == "x" else height)
    left, right, bottom, top = -1.25, 2.625, -2.0, 1.75
    rectangle = SQUARE | {
        "size": [size * (right - left), size * (top - bottom)],
        "position": [size * (left + right) / 2, size * (bottom + top) / 2, 0.0],
    }
    sensor = facing | {"fov_axis": axis, "width": width, "height": height}
    coverage = image(reference(make_scene(sensor=sensor, shapes=[rectangle], emitters=[])), "coverage")[..., 0]

    def filled(low: float, high: float, count: int) -> Any:
        start = np.arange(count) - count / 2
        return np.clip(np.minimum(start + 1, high) - np.maximum(start, low), 0, 1)

    expected = np.outer(filled(-top, -bottom, height), filled(left, right, width))
    np.testing.assert_allclose(coverage, expected, atol=1e-6)


def test_a_texture_is_seen_upright(
    make_scene: MakeScene, reference: MakeReference, facing: dict[str, Any], tmp_path: Path
) -> None:
    """Four texels: red above green on the left, blue above white on the right. Read in the middles of the quarters."""
    texels = np.array([[[1, 0, 0], [0, 0, 1]], [[0, 1, 0], [1, 1, 1]]], dtype=np.float32)
    write_exr(tmp_path / "four.exr", Image(np.repeat(np.repeat(texels, 8, axis=0), 8, axis=1)))
    side = 2 * 2 * np.tan(np.radians(30))
    texture = {"path": "four.exr", "color_space": "linear"}
    scene = make_scene(
        sensor=facing,
        materials={"skin": {"type": "diffuse", "reflectance": texture}},
        shapes=[SQUARE | {"size": [side, side]}],
        emitters=[],
    )
    np.testing.assert_allclose(image(reference(scene), "albedo")[2::4, 2::4], texels, atol=1e-5)


def test_what_sees_nothing_is_zero(make_scene: MakeScene, reference: MakeReference, facing: dict[str, Any]) -> None:
    made = reference(make_scene(sensor=facing, shapes=[SQUARE | {"size": [0.1, 0.1]}], emitters=[]))
    for name in ("depth", "normal", "coverage", "albedo"):
        assert not image(made, name)[[0, 0, -1, -1], [0, -1, 0, -1]].any()


@pytest.mark.parametrize("name", MODULES)
def test_every_registered_quantity_is_described(name: str, make_scene: MakeScene) -> None:
    found = quantity(name)
    assert found.name == name
    assert all((found.unit, found.summary))
    scene = make_scene()
    integrator = found.integrator(features_of(scene, geometry_of(scene)))
    assert (integrator.exact is None) is not (integrator.block is None)
    assert found.is_sampled or integrator.exact is not None
    assert integrator.why


def test_an_unknown_quantity_lists_the_known_ones_and_the_closest() -> None:
    with pytest.raises(InputError, match=r"Unknown quantity 'dpeth'.*normal.*Did you mean 'depth'\?"):
        quantity("dpeth")


@pytest.mark.parametrize(
    ("name", "length", "unit"), [("depth", "mm", "mm"), ("radiance", "m", "W/(m² sr)"), ("normal", "mm", "1")]
)
def test_a_unit_goes_by_the_length_of_the_scene(make_scene: MakeScene, name: str, length: str, unit: str) -> None:
    assert quantity(name).unit_in(make_scene(length_unit=length)) == unit
