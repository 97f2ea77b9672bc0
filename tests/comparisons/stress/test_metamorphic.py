"""Each stress notices the fault that it is there for, in a technique that keeps every law without it."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from comparisons.stress.laws import Case, Subject
from comparisons.stress.stresses import STRESSES
from comparisons.stress.techniques import outcome
from realtime.frame import Frame
from realtime.graph import Pass
from realtime.technique import Parameter, Technique
from scenes.image import Float64
from scenes.materials import Diffuse
from scenes.model import AreaLight, ConstantLight, PointLight, Scene, SphereLight, ThinLens

MakeScene = Callable[..., Scene]
Fault = Callable[[Frame, Float64], Float64]
PEAK = 1.6


def lawful(frame: Frame) -> Float64:
    """An image (H, W, 3) that keeps all laws: a slope over the picture, as bright as what the target receives."""
    scene = frame.scene
    width, height = scene.sensor.width, scene.sensor.height
    v, u = np.meshgrid((np.arange(height) + 0.5) / height, (np.arange(width) + 0.5) / width, indexing="ij")
    slope = 1 + PEAK * 0.375 * (u - 0.5) + PEAK * 0.125 * (v - 0.5)
    return np.repeat(slope[..., None], 3, axis=2) / PEAK * brightness(scene)


def brightness(scene: Scene) -> float:
    material = scene.materials["skin"]
    assert isinstance(material, Diffuse)
    assert isinstance(material.reflectance, tuple)
    reflectance = max(material.reflectance)
    total = 0.0
    for light in scene.emitters:
        match light:
            case PointLight():
                distance = np.linalg.norm(np.subtract(light.position, scene.sensor.target))
                total += reflectance * max(light.intensity) / float(distance**2)
            case SphereLight():
                distance = np.linalg.norm(np.subtract(light.position, scene.sensor.target))
                total += reflectance * np.pi * light.radius**2 * max(light.radiance) / float(distance**2)
            case AreaLight():
                total += max(light.radiance) * (reflectance**2 / (1 - reflectance) if len(scene.emitters) == 1 else 0.5)
            case ConstantLight():
                total += reflectance * max(light.radiance)
    return total


def subject(scene: Scene, quantity: str, fault: Fault, unit: str = "W/(length² sr)", **parameters: Any) -> Subject:
    def run(frame: Frame) -> None:
        image = fault(frame, lawful(frame))
        pixels = np.concatenate([image, np.zeros((*image.shape[:2], 1))], axis=2).astype(np.float32)
        texture = frame.texture((image.shape[1], image.shape[0]), 4)
        texture.write(np.ascontiguousarray(pixels[::-1]).tobytes())
        frame.resources["image"] = texture

    technique = Technique(
        name="test.planted",
        approximates=quantity,
        summary="for tests",
        source="nobody",
        limits="all",
        passes=lambda scene, features, settings: [Pass("draw", run, writes=("image",))],
        parameters=tuple(Parameter(name, value, (value,), "for tests") for name, value in parameters.items()),
    )
    return Subject(technique, Case(scene, {}), unit)


def nothing_wrong(frame: Frame, image: Float64) -> Float64:
    return image


def size_of(scene: Scene) -> float:
    return float(np.linalg.norm(np.subtract(scene.sensor.target, scene.sensor.origin)))


def has_emitters(scene: Scene) -> bool:
    return bool(scene.emitters)


LENS: dict[str, Any] = {
    "sensor": {
        "type": "thin_lens",
        "origin": [0.2, 0.3, 1.2],
        "target": [0.1, 0.05, 0.0],
        "fov_deg": 40.0,
        "width": 16,
        "height": 12,
        "aperture_radius": 0.05,
        "focus_distance": 1.0,
    }
}
PANELS: dict[str, Any] = LENS | {
    "emitters": [
        {"type": "area", "shape": "ball", "radiance": [1.0, 1.0, 1.0]},
        {"type": "area", "shape": "room", "radiance": [1.0, 1.0, 1.0]},
    ]
}


def lens_radius(frame: Frame) -> float:
    sensor = frame.scene.sensor
    return sensor.aperture_radius if isinstance(sensor, ThinLens) else 0.0


PLANTED: dict[str, tuple[str, dict[str, Any], Fault, float]] = {
    "scale-up": ("indirect_radiance", {}, lambda f, i: i * np.exp(-size_of(f.scene) / 100), 10),
    "scale-down": ("indirect_radiance", {}, lambda f, i: i * size_of(f.scene) / (size_of(f.scene) + 1e-3), 0.01),
    "offset": ("indirect_radiance", {}, lambda f, i: i * (1 + 1e-2 * f.scene.sensor.origin[0]), 10),
    "rotation": ("indirect_radiance", {}, lambda f, i: i * (1 + f.scene.sensor.up[0]), 7),
    "bright": ("indirect_radiance", {}, lambda f, i: np.minimum(i, 65504), 1e6),
    "dim": ("indirect_radiance", {}, lambda f, i: i + 1e-6, 1e-6),
    "aperture": ("defocus_radiance", LENS, lambda f, i: i * (1 + 0.05 * (lens_radius(f) > 0)), 1e-3),
    "small-light": (
        "indirect_radiance",
        {},
        lambda f, i: i * (0.89 if any(isinstance(e, SphereLight) for e in f.scene.emitters) else 1),
        1e-3,
    ),
    "no-emitter": ("indirect_radiance", {}, lambda f, i: i + 1e-3, 0),
    "no-bounce": ("indirect_radiance", {}, lambda f, i: i + 1e-3 * has_emitters(f.scene), 0),
    "white-sky": ("iris_radiance", {}, lambda f, i: 1.3 * i, 1e-3),
    "white-room": ("indirect_radiance", {}, lambda f, i: 1.3 * i, 0.5),
    "wide-lens": ("defocus_radiance", PANELS, lambda f, i: i * (1 + lens_radius(f)), 4),
    "grazing-view": (
        "indirect_radiance",
        {},
        lambda f, i: i * (1 + 0.1 * np.sin(1e9 * f.scene.sensor.origin[0])),
        10,
    ),
    "grazing-light": (
        "indirect_radiance",
        {},
        lambda f, i: (
            i * (1 + 0.1 * np.sin(1e9 * sum(e.position[0] for e in f.scene.emitters if isinstance(e, PointLight))))
        ),
        10,
    ),
    "slivers": (
        "indirect_radiance",
        {},
        lambda f, i: i * sum(len(m.surface.faces) for m in f.meshes),
        1e-2,
    ),
    "far-card": ("indirect_radiance", {}, lambda f, i: i * (1e-3 * f.bounds[1] < size_of(f.scene)), 1e5),
    "depth-bits": (
        "indirect_radiance",
        {},
        lambda f, i: i * (1 + 2.0 ** -int(f.settings["depth_bits"]) * 1e3),
        16,
    ),
    "clip-ratio": (
        "indirect_radiance",
        {},
        lambda f, i: i * (1 + 5e-7 * float(f.settings["far_over_near"])),
        1e5,
    ),
    "few-pixels": ("indirect_radiance", {}, lambda f, i: i / min(1, f.scene.sensor.width - 1), 1),
    "strip": ("indirect_radiance", {}, lambda f, i: i * (f.scene.sensor.width < 2000), 4096),
}
PARAMETERS: dict[str, dict[str, Any]] = {"depth-bits": {"depth_bits": 24}, "clip-ratio": {"far_over_near": 100.0}}


def planted(make_scene: MakeScene, stress: str, fault: Fault) -> Subject:
    quantity, changes, _, _ = PLANTED[stress]
    return subject(make_scene(**changes), quantity, fault, **PARAMETERS.get(stress, {}))


def test_a_fault_is_planted_for_each_stress() -> None:
    assert PLANTED.keys() == STRESSES.keys()


@pytest.mark.usefixtures("gl")
@pytest.mark.parametrize("stress", PLANTED)
def test_what_keeps_the_law_holds(make_scene: MakeScene, stress: str) -> None:
    found = outcome(planted(make_scene, stress, nothing_wrong), stress, STRESSES[stress])
    assert (found.unfit, found.first_failing) == ("", None), found
    assert [trial.magnitude for trial in found.trials] == list(STRESSES[stress].magnitudes)


@pytest.mark.usefixtures("gl")
@pytest.mark.filterwarnings("ignore:divide by zero")
@pytest.mark.parametrize("stress", PLANTED)
def test_what_breaks_it_is_caught(make_scene: MakeScene, stress: str) -> None:
    """You should see the first magnitude at which the planted fault shows, none after it, and how to see it again."""
    _, _, fault, magnitude = PLANTED[stress]
    found = outcome(planted(make_scene, stress, fault), stress, STRESSES[stress])
    assert (found.unfit, found.first_failing) == ("", magnitude), found
    assert found.trials[-1].magnitude == magnitude
    assert found.reproduce == f"lightgauge stress test.planted --stress {stress} --at {magnitude:g}"


@pytest.mark.usefixtures("gl")
def test_nan_and_shares_beyond_one_are_faults(make_scene: MakeScene) -> None:
    def broken(frame: Frame, image: Float64) -> Float64:
        return image * np.nan if size_of(frame.scene) > 100 else image

    found = outcome(subject(make_scene(), "indirect_radiance", broken), "scale-up", STRESSES["scale-up"])
    assert found.first_failing == 100
    assert "NaN" in found.trials[-1].fault

    def lit_twice(frame: Frame, image: Float64) -> Float64:
        return np.full_like(image, 1.0 if size_of(frame.scene) < 100 else 1.01)

    found = outcome(subject(make_scene(), "visibility", lit_twice, "1"), "scale-up", STRESSES["scale-up"])
    assert found.first_failing == 100
    assert "found visibility from 1.01" in found.trials[-1].fault
