"""Faults planted in the real-time side: the standard parity checks must refuse every one of them."""

from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from comparisons.gate import Verdict, judge, worst
from comparisons.metrics import Samples, evaluate
from comparisons.parity import QUANTITIES, checks_of
from realtime.camera import Camera, sensor_camera
from realtime.frame import Frame
from reference.estimator import Reference, Truth
from reference.store import Store
from scenes import srgb
from scenes.checks import Check
from scenes.errors import ImageError
from scenes.geometry import texture_of
from scenes.image import Float32, Float64
from scenes.load import find_scene, load_scene
from scenes.materials import Texture
from scenes.model import Perspective, Scene

Draw = Callable[..., Float32]
Plant = Callable[[pytest.MonkeyPatch], None]

SIZES = {"parity-wide": (120, 66), "parity-tall": (48, 74)}


def small(name: str) -> Scene:
    """A scene of the library at a low resolution."""
    scene = load_scene(find_scene(name))
    width, height = SIZES[name]
    sensor = scene.sensor.model_copy(update={"width": width, "height": height})
    return scene.model_copy(update={"sensor": sensor})


def parity_of(scene: Scene) -> list[Check]:
    return [check for check in checks_of(scene) if check.quantity in QUANTITIES]


def passes(scene: Scene) -> dict[str, Verdict]:
    return {check.quantity: Verdict.PASS for check in parity_of(scene)}


def truths_of(scene: Scene, folder: Path) -> dict[str, Truth]:
    reference = Reference(scene, Store(folder), lambda what, part: None)
    return {check.quantity: reference.truth(check.quantity, 0) for check in parity_of(scene)}


@pytest.fixture(scope="module", params=SIZES)
def judged(
    request: pytest.FixtureRequest, mi: ModuleType, tmp_path_factory: pytest.TempPathFactory
) -> tuple[Scene, dict[str, Truth]]:
    """A scene with its truths: a wide field of view along x in a wide image, a narrow one along y in a tall image."""
    scene = small(request.param)
    return scene, truths_of(scene, tmp_path_factory.mktemp("store"))


def verdict_of(check: Check, image: Float32, truth: Truth) -> Verdict:
    """The check's verdict; an image that cannot be judged is an ERROR, as it is in a run."""
    samples = Samples(truth.accumulators, truth.mask)
    try:
        return worst(judge(c, evaluate(c.metric, image, samples)).verdict for c in check.criteria)
    except ImageError:
        return Verdict.ERROR


def verdicts(scene: Scene, truths: dict[str, Truth], draw: Draw) -> dict[str, Verdict]:
    return {c.quantity: verdict_of(c, draw(scene, c.technique), truths[c.quantity]) for c in parity_of(scene)}


def camera_with(in_clip_space: Callable[[Perspective], Float64]) -> Plant:
    """A camera whose picture is transformed by a matrix, in clip space."""

    def fault(sensor: Perspective, near: float, far: float) -> Camera:
        camera = sensor_camera(sensor, near, far)
        return Camera(camera.eye, in_clip_space(sensor) @ camera.matrix, camera.forward)

    return lambda patch: patch.setattr("realtime.frame.sensor_camera", fault)


def moved(x_px: float, y_px: float) -> Plant:
    def matrix(sensor: Perspective) -> Float64:
        shift = np.eye(4)
        shift[:2, 3] = 2 * x_px / sensor.width, 2 * y_px / sensor.height
        return shift

    return camera_with(matrix)


def texture_with(change: Callable[[Float32], NDArray[Any]]) -> Plant:
    def fault(scene: Scene, texture: Texture) -> Float32:
        return change(texture_of(scene, texture)).astype(np.float32)

    return lambda patch: patch.setattr("realtime.frame.texture_of", fault)


def other_fov_axis(patch: pytest.MonkeyPatch) -> None:
    def fault(sensor: Perspective, near: float, far: float) -> Camera:
        other = "y" if sensor.fov_axis == "x" else "x"
        return sensor_camera(sensor.model_copy(update={"fov_axis": other}), near, far)

    patch.setattr("realtime.frame.sensor_camera", fault)


def rows_as_opengl_has_them(patch: pytest.MonkeyPatch) -> None:
    read = Frame.read
    patch.setattr(Frame, "read", lambda frame, name, components: read(frame, name, components)[::-1])


GEOMETRIC: dict[str, Plant] = {
    "mirrored in x": camera_with(lambda sensor: np.diag([-1.0, 1, 1, 1])),
    "flipped in y by the camera": camera_with(lambda sensor: np.diag([1.0, -1, 1, 1])),
    "flipped in y by the reading": rows_as_opengl_has_them,
    "half a pixel to the right": moved(0.5, 0.0),
    "half a pixel up": moved(0.0, 0.5),
    "a fiftieth of a pixel": moved(0.02, 0.0),
    "field of view along the other axis": other_fov_axis,
}
MATERIAL: dict[str, Plant] = {
    "sRGB decoded twice": texture_with(srgb.decode),
    "sRGB never decoded": texture_with(srgb.encode),
    "texture upside down": texture_with(lambda pixels: pixels[::-1]),
    "texture mirrored": texture_with(lambda pixels: pixels[:, ::-1]),
    "red and blue exchanged": texture_with(lambda pixels: pixels[..., ::-1]),
}


def test_without_a_fault_all_parity_checks_pass(judged: tuple[Scene, dict[str, Truth]], draw: Draw) -> None:
    assert verdicts(*judged, draw) == passes(judged[0])


@pytest.mark.parametrize("fault", GEOMETRIC)
def test_a_geometric_fault_is_caught(
    judged: tuple[Scene, dict[str, Truth]], draw: Draw, fault: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    GEOMETRIC[fault](monkeypatch)
    found = verdicts(*judged, draw)
    assert found["normal"] in (Verdict.FAIL, Verdict.ERROR)
    assert found["depth"] in (Verdict.FAIL, Verdict.ERROR)


@pytest.mark.parametrize("fault", MATERIAL)
def test_a_fault_of_the_textures_is_caught_by_what_has_them_alone(
    judged: tuple[Scene, dict[str, Truth]], draw: Draw, fault: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    MATERIAL[fault](monkeypatch)
    textured = {"albedo", "emission"} & passes(judged[0]).keys()
    assert verdicts(*judged, draw) == passes(judged[0]) | dict.fromkeys(textured, Verdict.FAIL)


def test_a_subject_that_is_not_marked_is_caught_by_the_coverage(
    judged: tuple[Scene, dict[str, Truth]], draw: Draw, monkeypatch: pytest.MonkeyPatch
) -> None:
    read = Frame.read
    monkeypatch.setattr(Frame, "read", lambda frame, name, components: 0.5 * read(frame, name, components))
    assert verdicts(*judged, draw)["coverage"] is Verdict.FAIL


def test_in_a_mirrored_world_a_centred_sphere_passes_by_depth_and_fails_by_normal(
    make_scene: Callable[..., Scene], mi: ModuleType, draw: Draw, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Why parity needs more than depth, and an asymmetric object."""
    scene = make_scene(
        sensor={
            "type": "perspective",
            "origin": [0.0, 0.0, 3.0],
            "target": [0.0, 0.0, 0.0],
            "fov_deg": 30.0,
            "width": 48,
            "height": 40,
        },
        shapes=[{"name": "ball", "type": "sphere", "radius": 0.6, "detail": 5, "material": "skin"}],
        emitters=[],
    )
    truths = truths_of(scene, tmp_path / "store")
    GEOMETRIC["mirrored in x"](monkeypatch)
    found = verdicts(scene, truths, draw)
    assert found["depth"] is Verdict.PASS
    assert found["normal"] in (Verdict.FAIL, Verdict.ERROR)
