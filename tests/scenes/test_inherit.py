from pathlib import Path

import pytest

from scenes.errors import SceneError
from scenes.load import load_scene

ROOM = """\
title = "A ball in a room"
subject = ["ball"]

[sensor]
type = "perspective"
origin = [0, 1, 3]
target = [0, 0, 0]
fov_deg = 40

[materials]
red = { type = "diffuse", reflectance = [0.6, 0.1, 0.1] }

[[shapes]]
type = "sphere"
name = "ball"
material = "red"

[[emitters]]
type = "point"
position = [0, 1, 0]
intensity = [1, 1, 1]

[[checks]]
quantity = "depth"
technique = "gbuffer"
criteria = [{ metric = "nrmse", max = 0.1, reason = "the budget of the game" }]
"""
LAMP = """\
extends = "room.toml"
title = "The same under a wide lamp"

[sensor]
fov_deg = 20

[materials]
grey = { type = "diffuse", reflectance = [0.5, 0.5, 0.5] }

[[emitters]]
type = "sphere"
position = [0, 1, 0]
radius = 0.1
radiance = [1, 1, 1]
"""


def write(folder: Path, **files: str) -> Path:
    for name, text in files.items():
        (folder / f"{name}.toml").write_text(text, encoding="utf-8")
    return folder / "lamp.toml"


def message(path: Path) -> str:
    with pytest.raises(SceneError) as caught:
        load_scene(path)
    return str(caught.value)


def test_a_scene_takes_what_it_does_not_say(tmp_path: Path) -> None:
    room = load_scene(write(tmp_path, room=ROOM, lamp=LAMP).with_name("room.toml"))
    lamp = load_scene(tmp_path / "lamp.toml")
    assert lamp.name == "lamp"
    assert lamp.shapes == room.shapes
    assert (lamp.sensor.origin, lamp.sensor.fov_deg) == (room.sensor.origin, 20)
    assert set(lamp.materials) == {"red", "grey"}
    assert [emitter.type for emitter in lamp.emitters] == ["sphere"]


def test_checks_and_words_are_its_own(tmp_path: Path) -> None:
    lamp = load_scene(write(tmp_path, room='description = "With a ball"\n' + ROOM, lamp=LAMP))
    assert (lamp.checks, lamp.description) == ((), "")
    untitled = write(tmp_path, lamp=LAMP.replace('title = "The same under a wide lamp"\n', ""))
    assert f"{untitled}:1: title: found nothing" in message(untitled)


def test_scenes_extend_one_another_in_a_row(tmp_path: Path) -> None:
    night = 'extends = "lamp.toml"\ntitle = "Without any light"\nemitters = []\n'
    scene = load_scene(write(tmp_path, room=ROOM, lamp=LAMP, night=night).with_name("night.toml"))
    assert (scene.emitters, scene.sensor.fov_deg) == ((), 20)


def test_a_problem_is_told_where_it_was_written(tmp_path: Path) -> None:
    path = write(tmp_path, room=ROOM.replace("[0, 1, 3]", "[0, 1]"), lamp=LAMP.replace("radius = 0.1", "radius = -1"))
    own, inherited = message(path).splitlines()
    assert own.startswith(f"{path}:13: emitters[0].radius: found -1")
    assert inherited.startswith(f"{tmp_path / 'room.toml'}:6: sensor.origin: found")


def test_what_is_missing_in_a_list_is_told_where_the_list_is(tmp_path: Path) -> None:
    path = write(tmp_path, room=ROOM, lamp=LAMP.replace("radius = 0.1\n", ""))
    assert message(path).startswith(f"{path}:10: emitters[0].radius: found nothing")


@pytest.mark.parametrize(
    ("extends", "said"),
    [
        ('"attic.toml"', "found 'attic.toml'; allowed: the name of a TOML file in the same folder"),
        ('"../room.toml"', "found '../room.toml'; allowed: the name of a TOML file in the same folder"),
        ('"."', "found '.'; allowed: the name of a TOML file in the same folder"),
        (f'"{"x" * 300}"', f"found '{'x' * 300}'; allowed: the name of a TOML file in the same folder"),
        ("3", "found 3; allowed: the name of a TOML file in the same folder"),
        ('"lamp.toml"', "found 'lamp.toml', which extends this scene in turn; allowed: files that do not"),
    ],
)
def test_what_cannot_be_extended_is_said(tmp_path: Path, extends: str, said: str) -> None:
    path = write(tmp_path, room=ROOM, lamp=LAMP.replace('"room.toml"', extends))
    assert message(path) == f"{path}:1: extends: {said}"


def test_a_circle_over_two_files_is_said_where_it_closes(tmp_path: Path) -> None:
    path = write(tmp_path, room='extends = "lamp.toml"\n' + ROOM, lamp=LAMP)
    assert message(path).startswith(f"{tmp_path / 'room.toml'}:1: extends: found 'lamp.toml', which extends")


def test_a_file_that_is_not_toml_is_named(tmp_path: Path) -> None:
    path = write(tmp_path, room="title = \n", lamp=LAMP)
    assert message(path).startswith(f"{tmp_path / 'room.toml'}:1: this is not TOML")


def test_a_file_that_is_not_utf_8_is_named(tmp_path: Path) -> None:
    path = write(tmp_path, room=ROOM, lamp=LAMP)
    path.with_name("room.toml").write_bytes(b'title = "\xff\xfe"\n')
    assert message(path).startswith(f"{tmp_path / 'room.toml'}: found bytes that are not UTF-8")
