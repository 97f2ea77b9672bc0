from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from scenes.checks import Criterion
from scenes.digest import code_digest, digest_of, file_digest, scene_parts, with_imports
from scenes.errors import SceneError
from scenes.model import Scene

CODE = """
def area(radius: float) -> float:
    return 3.14 * radius ** 2
"""


def test_digest_is_64_hexadecimal_digits_and_ignores_the_order_of_keys() -> None:
    assert len(digest_of("a")) == 64
    assert int(digest_of("a"), 16) >= 0
    assert digest_of({"a": 1, "b": [2]}) == digest_of({"b": [2], "a": 1})


@pytest.mark.parametrize("other", [("a", "b"), (["a", "b"],), ("b", "a"), ("ab",), ("a", "b", None)])
def test_digest_tells_parts_apart(other: tuple[Any, ...]) -> None:
    parts = [("a", "b"), (["a", "b"],), ("b", "a"), ("ab",), ("a", "b", None)]
    assert [digest_of(*part) == digest_of(*other) for part in parts].count(True) == 1


def test_digest_refuses_what_json_cannot_say() -> None:
    with pytest.raises(ValueError, match="Out of range"):
        digest_of(float("nan"))


def test_file_digest_is_sha256_of_the_bytes(tmp_path: Path) -> None:
    """FIPS 180-2, appendix B.1."""
    (tmp_path / "abc").write_bytes(b"abc")
    assert file_digest(tmp_path / "abc") == "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad"
    with pytest.raises(SceneError, match="cannot be read"):
        file_digest(tmp_path / "none")


def code(folder: Path, text: str) -> str:
    path = folder / "code.py"
    path.write_text(text, encoding="utf-8")
    return code_digest(path)


@pytest.mark.parametrize(
    "same",
    [
        CODE.replace("\n    return", "\n    # the area\n\n    return"),
        CODE.replace("\n    return", '\n    """Area of a disk."""\n    return'),
        '"""A module."""\n' + CODE,
        CODE.replace("radius ** 2", "(radius**2)"),
    ],
)
def test_code_digest_ignores_comments_docstrings_and_layout(tmp_path: Path, same: str) -> None:
    assert code(tmp_path, same) == code(tmp_path, CODE)


@pytest.mark.parametrize(
    "other",
    [
        CODE.replace("3.14", "3.1416"),
        CODE.replace("radius ** 2", "radius ** 2.0"),
        CODE.replace("area", "surface"),
        CODE + "\nprint('loud')\n",
        CODE.replace("    return", "    'no', 'docstring'\n    return"),
    ],
)
def test_code_digest_sees_what_the_code_does(tmp_path: Path, other: str) -> None:
    assert code(tmp_path, other) != code(tmp_path, CODE)


def test_code_digest_depends_on_every_file_and_their_order(tmp_path: Path) -> None:
    one, two = tmp_path / "one.py", tmp_path / "two.py"
    one.write_text("x = 1\n", encoding="utf-8")
    two.write_text("x = 2\n", encoding="utf-8")
    assert len({code_digest(one), code_digest(two), code_digest(one, two), code_digest(two, one)}) == 4


def example(folder: Path) -> Scene:
    (folder / "mesh.ply").write_bytes(b"a mesh")
    (folder / "wood.png").write_bytes(b"wood")
    return Scene.model_validate(
        {
            "name": "example",
            "folder": folder,
            "title": "An example",
            "sensor": {"type": "perspective", "origin": (0.0, 0.0, 3.0), "target": (0.0, 0.0, 0.0), "fov_deg": 40.0},
            "materials": {"wood": {"type": "diffuse", "reflectance": {"path": "wood.png"}}},
            "shapes": ({"type": "mesh", "name": "thing", "material": "wood", "path": "mesh.ply"},),
            "emitters": ({"type": "constant", "radiance": (1.0, 1.0, 1.0)},),
            "subject": ("thing",),
        }
    )


def test_scene_parts_are_plain_and_name_no_place(tmp_path: Path) -> None:
    parts = scene_parts(example(tmp_path))
    assert set(parts) == {"length_unit", "sensor", "materials", "shapes", "hair", "emitters", "subject"}
    assert str(tmp_path) not in str(parts)
    assert "mesh.ply" not in str(parts)
    assert len(digest_of(parts)) == 64


def test_what_no_image_depends_on_changes_no_digest(tmp_path: Path) -> None:
    scene = example(tmp_path)
    check = {
        "quantity": "depth",
        "technique": "gbuffer",
        "criteria": (Criterion(metric="nrmse", max=0.1, reason="as good as it gets"),),
    }
    other_words = {"name": "other", "title": "Other words", "description": "More", "checks": (check,)}
    for change in other_words.items():
        assert scene_parts(scene.model_copy(update=dict([change]))) == scene_parts(scene)


def test_files_count_by_their_content(tmp_path: Path) -> None:
    scene = example(tmp_path)
    before = scene_parts(scene)
    (tmp_path / "elsewhere").mkdir()
    (tmp_path / "mesh.ply").rename(tmp_path / "elsewhere" / "renamed.ply")
    moved = scene.shapes[0].model_copy(update={"path": "elsewhere/renamed.ply"})
    assert scene_parts(scene.model_copy(update={"shapes": (moved,)})) == before
    (tmp_path / "elsewhere" / "renamed.ply").write_bytes(b"another mesh")
    assert scene_parts(scene.model_copy(update={"shapes": (moved,)})) != before


@pytest.mark.parametrize(
    "change",
    [
        lambda s: {"sensor": s.sensor.model_copy(update={"width": 64})},
        lambda s: {"shapes": (s.shapes[0].model_copy(update={"scale": 2.0}),)},
        lambda s: {"emitters": ()},
        lambda s: {"subject": ("other",)},
        lambda s: {"materials": {"wood": s.materials["wood"].model_copy(update={"reflectance": (0.1, 0.1, 0.1)})}},
    ],
)
def test_what_an_image_depends_on_changes_the_digest(tmp_path: Path, change: Callable[[Scene], dict[str, Any]]) -> None:
    scene = example(tmp_path)
    assert digest_of(scene_parts(scene.model_copy(update=change(scene)))) != digest_of(scene_parts(scene))


def test_a_texture_that_changes_its_pixels_changes_the_digest(tmp_path: Path) -> None:
    scene = example(tmp_path)
    before = scene_parts(scene)
    (tmp_path / "wood.png").write_bytes(np.arange(4, dtype=np.uint8).tobytes())
    assert scene_parts(scene) != before


def test_a_module_comes_with_what_it_imports_from_its_own_package_and_nothing_else(tmp_path: Path) -> None:
    files = {
        "top/__init__.py": "",
        "top/main.py": "import json\nfrom top.sub import leaf\ndef f():\n    import top.late\nfrom other import x",
        "top/late.py": "from top.main import f",
        "top/unused.py": "",
        "top/sub/__init__.py": "",
        "top/sub/leaf.py": "from top.sub.root import y",
        "top/sub/root.py": "y = 1",
        "other.py": "x = 1",
    }
    for name, text in files.items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(text, encoding="utf-8")
    found = {path.relative_to(tmp_path).as_posix() for path in with_imports(tmp_path / "top" / "main.py")}
    assert found == {"top/main.py", "top/late.py", "top/sub/leaf.py", "top/sub/root.py"}
