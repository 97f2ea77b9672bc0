from collections.abc import Callable
from pathlib import Path

import numpy as np
import PIL.Image
import pytest

from scenes.digest import scene_parts
from scenes.errors import SceneError
from scenes.exr import write_exr
from scenes.geometry import geometry_of, texture_of
from scenes.image import Image
from scenes.materials import Diffuse, Texture
from scenes.model import Scene
from scenes.parcel import packed, unpacked

CORNER = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n"


@pytest.fixture
def full(make_scene: Callable[..., Scene], tmp_path: Path) -> Scene:
    """A scene with a mesh, a texture and an environment from files."""
    (tmp_path / "parts").mkdir()
    (tmp_path / "parts" / "corner.OBJ").write_text(CORNER, encoding="ascii")
    PIL.Image.fromarray(np.arange(48, dtype=np.uint8).reshape(4, 4, 3)).save(tmp_path / "wood.png")
    write_exr(tmp_path / "sky.exr", Image(np.ones((2, 4, 3), dtype=np.float32)))
    return make_scene(
        materials={"wood": {"type": "diffuse", "reflectance": {"path": "wood.png"}}},
        shapes=[{"name": "ball", "type": "mesh", "path": "parts/corner.OBJ", "material": "wood"}],
        emitters=[{"type": "environment", "path": "sky.exr"}],
    )


def test_a_scene_arrives_as_it_was(full: Scene, tmp_path: Path) -> None:
    arrived = unpacked(packed(full), tmp_path / "far" / "away")
    assert scene_parts(arrived) == scene_parts(full)
    (own,), (theirs,) = geometry_of(full), geometry_of(arrived)
    np.testing.assert_array_equal(own.surface.positions, theirs.surface.positions)
    for scene in (full, arrived):
        material = scene.materials["wood"]
        assert isinstance(material, Diffuse)
        assert isinstance(material.reflectance, Texture)
        assert texture_of(scene, material.reflectance).shape == (4, 4, 3)


def test_files_are_written_once(full: Scene, tmp_path: Path) -> None:
    parcel = packed(full)
    unpacked(parcel, tmp_path / "far")
    before = {path: path.stat().st_mtime_ns for path in (tmp_path / "far").iterdir()}
    unpacked(parcel, tmp_path / "far")
    assert {path: path.stat().st_mtime_ns for path in (tmp_path / "far").iterdir()} == before
    assert len(before) == 3


def test_a_parcel_is_known_by_its_content(full: Scene) -> None:
    first = packed(full)
    assert packed(full).key == first.key
    (full.folder / "wood.png").rename(full.folder / "oak.png")
    oak = Diffuse(type="diffuse", reflectance=Texture(path="oak.png"))
    assert packed(full.model_copy(update={"materials": {"wood": oak}})).key == first.key
    (full.folder / "sky.exr").write_bytes(b"another sky")
    (full.folder / "oak.png").rename(full.folder / "wood.png")
    assert packed(full).key != first.key


def test_a_missing_file(full: Scene) -> None:
    (full.folder / "sky.exr").unlink()
    with pytest.raises(SceneError, match=r"sky\.exr: cannot be read"):
        packed(full)
