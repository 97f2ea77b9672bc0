"""Names, paths, folders and patterns of scenes."""

from pathlib import Path

import pytest

from comparisons.scene_files import find
from scenes.errors import InputError
from scenes.load import library_scenes

FILES = {
    "mine/ball.toml": "shapes = []",
    "mine/deep/cube.toml": 'extends = "ball.toml"',
    "mine/deep/broken.toml": "sensor = ",
    "mine/deep/settings.toml": "[tool.x]",
    "mine/deep/notes.txt": "shapes = []",
    "mine/.hidden/secret.toml": "shapes = []",
    "mine/a[1].toml": "sensor = {}",
    "other.toml": "sensor = {}",
}


@pytest.fixture(autouse=True)
def files(here: Path) -> None:
    for name, text in FILES.items():
        Path(name).parent.mkdir(parents=True, exist_ok=True)
        Path(name).write_text(text, encoding="utf-8")


@pytest.mark.parametrize(
    ("arguments", "scenes"),
    [
        (["mine"], ["mine/a[1].toml", "mine/ball.toml", "mine/deep/broken.toml", "mine/deep/cube.toml"]),
        (["mine/deep"], ["mine/deep/broken.toml", "mine/deep/cube.toml"]),
        (["."], ["other.toml", "mine/a[1].toml", "mine/ball.toml", "mine/deep/broken.toml", "mine/deep/cube.toml"]),
        (["mine/*.toml"], ["mine/a[1].toml", "mine/ball.toml"]),
        (["mine/**/c*.toml"], ["mine/deep/cube.toml"]),
        (["mi*/d*"], ["mine/deep/broken.toml", "mine/deep/cube.toml"]),
        (["*.toml"], ["other.toml"]),
        (["mine/a[1].toml"], ["mine/a[1].toml"]),
        (["gone.toml"], ["gone.toml"]),
        (["shadow-room-?cm"], ["shadow-room-2cm", "shadow-room-5cm"]),
        (["parity-*", "other.toml", "parity-wide"], ["parity-tall", "parity-wide", "other.toml"]),
        (["other.toml", "./other.toml", "mine/../other.toml"], ["other.toml"]),
        (["mine/deep/cube.toml", "mine/deep"], ["mine/deep/cube.toml", "mine/deep/broken.toml"]),
        ([], list(library_scenes())),
    ],
)
def test_arguments_name_scenes_in_their_order_and_each_once(arguments: list[str], scenes: list[str]) -> None:
    assert [scene.argument for scene in find(arguments).scenes] == scenes


def test_a_file_that_holds_no_scene_is_passed_over_unless_it_is_named() -> None:
    assert find(["mine"]).passed_over == (Path("mine/deep/settings.toml"),)
    assert find(["mine/deep/settings.toml"]).passed_over == ()
    assert [scene.argument for scene in find(["mine/deep/settings.toml"]).scenes] == ["mine/deep/settings.toml"]


def test_a_name_of_the_library_comes_before_a_folder_of_that_name(here: Path) -> None:
    (here / "parity-wide").mkdir()
    (here / "parity-wide" / "x.toml").write_text("sensor = {}", encoding="utf-8")
    assert find(["parity-wide"]).scenes[0].path == library_scenes()["parity-wide"]
    assert [scene.argument for scene in find(["./parity-wide"]).scenes] == ["parity-wide/x.toml"]


@pytest.mark.parametrize("argument", ["xyz-*", "gone/*.toml", "empty", "mine/*.txt", "mine/deep/s*.toml"])
def test_what_names_nothing_is_refused(here: Path, argument: str) -> None:
    (here / "empty").mkdir()
    with pytest.raises(InputError, match="names no scene") as caught:
        find([argument])
    assert argument in str(caught.value)


def test_a_misspelt_name_is_refused_with_the_one_that_is_close() -> None:
    with pytest.raises(InputError, match="Close to it: parity-wide"):
        find(["parity-wade"])
