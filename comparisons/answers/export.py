"""A scene for another engine, and what that engine is to render."""

from collections.abc import Iterator
from pathlib import Path

from reference.quantities import MODULES, quantity
from scenes.features import features_of
from scenes.geometry import geometry_of
from scenes.gltf import gltf_of, write_gltf
from scenes.load import find_scene, load_scene
from scenes.model import ConstantLight, EnvironmentLight, Scene


def export(name: str, file: Path | None) -> Iterator[str]:
    """Write a scene as glTF; lines about the file, about what it cannot say, and about the image that is wanted.

    Raises
    ------
    InputError
        There is no such scene, or the file cannot be written.
    """
    scene = load_scene(find_scene(name))
    path = file or Path(f"{scene.name}.glb")
    gltf = gltf_of(scene)
    write_gltf(path, gltf)
    counts = (f"{what} {len(gltf.document[what])}" for what in ("meshes", "materials"))
    lights = len(gltf.document.get("extensions", {}).get("KHR_lights_punctual", {}).get("lights", []))
    yield f"{path}: {', '.join(counts)}, lights without extent {lights}"
    yield from gltf.notes
    yield from _wanted(scene, name)


def _wanted(scene: Scene, name: str) -> Iterator[str]:
    sensor = scene.sensor
    has_sky = any(isinstance(emitter, ConstantLight | EnvironmentLight) for emitter in scene.emitters)
    background = "that of the extras" if has_sky else "black"
    yield (
        f"Render {sensor.width} x {sensor.height} pixels, row 0 at the top, each the mean over its square with the "
        f"centre at +0.5 (box filter); the background is {background}; no tone mapping, no alpha. Save linear "
        "values as EXR:"
    )
    for unit, summary, found in _quantities(scene):
        yield f"  {found} [{unit}]: {summary}"
    yield f"Then: lightgauge compare IMAGE.exr --scene {name} --quantity QUANTITY --depth DEPTH.exr"


def _quantities(scene: Scene) -> Iterator[tuple[str, str, str]]:
    """Unit, summary and name of each quantity that has a truth here."""
    features = features_of(scene, geometry_of(scene))
    for name in MODULES:
        found = quantity(name)
        if not found.refuses(features):
            yield found.unit_in(scene), found.summary, name
