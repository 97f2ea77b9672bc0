from pathlib import Path

import pytest

from scenes.errors import SceneError
from scenes.load import find_scene, library_scenes, load_scene
from scenes.materials import Diffuse, Texture
from scenes.media import MEDIA
from scenes.shapes import Room

GOOD = """\
title = "A ball in a room"
subject = ["ball"]

[sensor]
type = "perspective"
origin = [0, 1, 3]
target = [0, 0, 0]
fov_deg = 40

[materials]
red = { type = "diffuse", reflectance = [0.6, 0.1, 0.1] }
wood = { type = "diffuse", reflectance = { path = "wood.png" } }

[[shapes]]
type = "sphere"
name = "ball"
material = "red"

[[shapes]]
type = "room"
name = "room"
material = "red"
size = [4, 4, 4]
walls = { left = "wood" }

[[emitters]]
type = "point"
position = [0, 1, 0]
intensity = [1, 1, 1]

[[checks]]
quantity = "depth"
technique = "gbuffer"
settings = { samples = 4, quality = 0.5, fast = true, mode = "a" }
criteria = [{ metric = "nrmse", max = 0.1, reason = "the budget of the game" }]
"""


def written(folder: Path, text: str) -> Path:
    (folder / "wood.png").write_bytes(b"not looked into")
    path = folder / "scene.toml"
    path.write_text(text, encoding="utf-8")
    return path


def complaints(folder: Path, text: str) -> list[str]:
    """What is said about a scene, one line a problem, without the file's path."""
    path = written(folder, text)
    with pytest.raises(SceneError) as caught:
        load_scene(path)
    lines = str(caught.value).splitlines()
    assert all(line.startswith(f"{path}:") for line in lines)
    return [line.removeprefix(f"{path}:") for line in lines]


def test_a_good_scene_loads_with_the_name_and_folder_of_its_file(tmp_path: Path) -> None:
    scene = load_scene(written(tmp_path, GOOD))
    assert (scene.name, scene.folder, scene.title) == ("scene", tmp_path, "A ball in a room")
    assert scene.sensor.origin == (0.0, 1.0, 3.0)
    assert scene.materials["wood"] == Diffuse(type="diffuse", reflectance=Texture(path="wood.png"))
    assert isinstance(scene.shapes[1], Room)
    assert scene.shapes[1].walls == {"left": "wood"}
    assert scene.checks[0].settings == {"samples": 4, "quality": 0.5, "fast": True, "mode": "a"}


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("fov_deg = 40", "fov_deg = 200", "8: sensor.fov_deg: found 200; allowed: a finite number > 0 and < 180"),
        ("fov_deg = 40", "fov_deg = nan", "8: sensor.fov_deg: found nan; allowed: a finite number > 0 and < 180"),
        ("fov_deg = 40", "", "4: sensor.fov_deg: found nothing; allowed: a finite number > 0 and < 180"),
        ("fov_deg = 40", 'fov_deg = "wide"', '8: sensor.fov_deg: found "wide"; allowed: a finite number > 0 and < 180'),
        (
            "fov_deg = 40",
            "fov_deg = 40\nwidth = 12.5",
            "9: sensor.width: found 12.5; allowed: an integer >= 1 and <= 8192",
        ),
        (
            "target = [0, 0, 0]",
            "target = [0, 0]",
            "7: sensor.target: found [0, 0]; allowed: an array of 3, each a finite number",
        ),
        (
            "target = [0, 0, 0]",
            "target = [0, 1, 3]",
            "4: sensor: found values that do not go together; allowed: target must differ from origin, and up must "
            "not be "
            "parallel to the view direction",
        ),
        (
            'type = "perspective"',
            'type = "perspektive"',
            '5: sensor.type: found "perspektive" (did you mean "perspective"?); allowed: "perspective", "thin_lens"',
        ),
        ('type = "perspective"\n', "", '4: sensor.type: found nothing; allowed: "perspective", "thin_lens"'),
        (
            'material = "red"\n\n[[shapes]]',
            'material = "red"\nradious = 2\n\n[[shapes]]',
            '18: shapes[0].radious: found an unknown key (did you mean "radius"?); allowed: name, material, position, '
            "rotation_deg, scale, type, radius, detail",
        ),
        (
            "[0.6, 0.1, 0.1]",
            "[0.6, 1.5, 0.1]",
            "11: materials.red.reflectance[1]: found 1.5; allowed: a finite number >= 0 and <= 1",
        ),
        (
            "[0.6, 0.1, 0.1]",
            '"red"',
            '11: materials.red.reflectance: found "red"; allowed: an array of 3, each a finite number >= 0 and <= 1 '
            "or a "
            "table with path, color_space",
        ),
        (
            'path = "wood.png"',
            'path = "wood.png", color_space = "adobe"',
            '12: materials.wood.reflectance.color_space: found "adobe"; allowed: "srgb", "linear"',
        ),
        (
            "red = {",
            '"dark red" = { type = "diffuse", reflectance = [0, 0, 0] }\nred = {',
            '11: materials."dark red": found the key "dark red"; allowed: a name of letters, digits, - and _ that '
            "begins "
            "with a letter or a digit",
        ),
        (
            'left = "wood"',
            'lefft = "wood"',
            '24: shapes[1].walls.lefft: found the key "lefft" (did you mean "left"?); allowed: "left", "right", '
            '"floor", '
            '"ceiling", "back", "front"',
        ),
        (
            'reason = "the budget of the game"',
            'reason = "because"',
            '35: checks[0].criteria[0].reason: found "because"; allowed: a text of at least 8 characters',
        ),
        (
            "max = 0.1, ",
            "",
            "35: checks[0].criteria[0]: found values that do not go together; allowed: give max, min or both",
        ),
        (
            'mode = "a"',
            "mode = [1]",
            "34: checks[0].settings.mode: found [1]; allowed: true or false or an integer or a finite number or a text",
        ),
        ('mode = "a"', "mode = inf", "34: checks[0].settings.mode: found inf; allowed: a finite number"),
        (
            'mode = "a"',
            "mode = 1979-05-27",
            "34: checks[0].settings.mode: found 1979-05-27; allowed: true or false or an integer or a finite number "
            "or a text",
        ),
        (
            'criteria = [{ metric = "nrmse", max = 0.1, reason = "the budget of the game" }]',
            "criteria = []",
            "35: checks[0].criteria: found []; allowed: an array of at least 1, each a table with max, min, reason, "
            "metric, by_renderer",
        ),
        (
            "[sensor]",
            "[truth]\nmax_spp = 1\n[sensor]",
            "5: truth.max_spp: found 1; allowed: an integer >= 64 and <= 4194304",
        ),
    ],
)
def test_what_the_schema_refuses_is_said_in_words(tmp_path: Path, old: str, new: str, said: str) -> None:
    assert GOOD.count(old) == 1
    assert complaints(tmp_path, GOOD.replace(old, new)) == [said]


@pytest.mark.parametrize("key", ["name", "folder"])
def test_name_and_folder_come_from_the_file_alone(tmp_path: Path, key: str) -> None:
    (said,) = complaints(tmp_path, f'{key} = "mine"\n' + GOOD)
    assert said.startswith(f"1: {key}: found an unknown key; allowed: extends, title, description,")


LIGHT = '\n[[emitters]]\ntype = "area"\nshape = "{}"\nradiance = [1, 1, 1]\n'
SHAPE = '\n[[shapes]]\ntype = "{}"\nname = "{}"\nmaterial = "red"\n'
EYE = SHAPE.format("eye", "eye") + "sclera_radius = 12\ncornea_radius = 7.8\nlimbus_radius = 5.9\nior = 1.376\n"
SKIN = '[materials]\nskin = { type = "translucent", medium = "skin1" }'
FROM = GOOD.count("\n")


@pytest.mark.parametrize(
    ("material", "said"),
    [
        ('type = "translucend"', 'skin.type: found "translucend" (did you mean "translucent"?); allowed: "diffuse", '),
        ('medium = "skin1"', 'skin.type: found nothing; allowed: "diffuse", '),
        (
            'type = "layered", reflectance = [1, 1, 1]',
            "skin: found values that do not go together; allowed: give film or metals; a base by itself is",
        ),
        (
            'type = "layered", reflectance = [1, 1, 1], metals = [{ metal = "Fe", alpha = 0.1, weight = 1.0 }]',
            'skin.metals[0].metal: found "Fe"; allowed: "Ag", "Al", "Au", "Cr", "Cu", "W"',
        ),
        (
            'type = "layered", reflectance = [1, 1, 1], film = { alpha = 0.0 }',
            "skin.film.alpha: found 0.0; allowed: a finite number >= 0.001",
        ),
        (
            'type = "layered", reflectance = [1, 1, 1], metals = [{ metal = "Cr", alpha = 0.1, weight = 1.1 }]',
            "skin.metals[0].weight: found",
        ),
        (
            'type = "layered", reflectance = [1, 1, 1], metals = ['
            + ", ".join(5 * ['{ metal = "Cr", alpha = 0.1, weight = 0.1 }'])
            + "]",
            "skin.metals: found [a table, a table, a table, a table, a table]; allowed: an array of at most 4, each a",
        ),
        ('type = "translucent"', "skin: found values that do not go together; allowed: give medium, or both"),
        ('type = "translucent", medium = 3', "skin.medium: found 3; allowed: a text"),
        (
            'type = "translucent", medium = "skin1", sigma_s = [1, 1, 1]',
            "skin: found values that do not go together; allowed: give either medium, or",
        ),
        (
            'type = "translucent", sigma_a = [1, 1, -1], sigma_s = [1, 1, 1]',
            "skin.sigma_a[2]: found -1; allowed: a finite number >= 0",
        ),
        (
            'type = "diffuse", reflectance = [0, 0, 0], medium = "skin1"',
            "skin.medium: found an unknown key; allowed: type, reflectance",
        ),
    ],
)
def test_faults_of_one_kind_of_material_are_told_in_its_own_words(tmp_path: Path, material: str, said: str) -> None:
    lines = complaints(tmp_path, GOOD.replace("[materials]", f"[materials]\nskin = {{ {material} }}"))
    assert [line.partition(": materials.")[2].startswith(said) for line in lines] == [True]


@pytest.mark.parametrize(
    ("keys", "said"),
    [
        ("endothelium = 3", "endothelium: found 3; allowed: a table with radius, thickness, ior"),
        (
            "endothelium = { radius = 6.5, ior = 1.3 }",
            "endothelium.thickness: found nothing; allowed: a finite number > 0",
        ),
        ("iris_depth = -1", "iris_depth: found -1; allowed: a finite number > 0"),
        ("pupil_radius = 7", ": found values that do not go together; allowed: pupil_radius must be smaller"),
    ],
)
def test_faults_of_an_eye_are_told_at_their_keys(tmp_path: Path, keys: str, said: str) -> None:
    (line,) = complaints(tmp_path, GOOD + EYE + f'iris = "red"\n{keys}\n')
    assert line.partition(": shapes[2]")[2].removeprefix(".").startswith(said)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (
            GOOD.replace('name = "ball"\nmaterial = "red"', 'name = "ball"\nmaterial = "rad"'),
            ['17: shapes[0].material: found the unknown material "rad" (did you mean "red"?); allowed: red, wood'],
        ),
        (
            GOOD.replace('left = "wood"', 'left = "stone"'),
            ['24: shapes[1].walls.left: found the unknown material "stone"; allowed: red, wood'],
        ),
        (
            GOOD.replace('name = "room"', 'name = "ball"'),
            ['21: shapes[1].name: found the name "ball" a second time; allowed: each only once'],
        ),
        (
            GOOD.replace('subject = ["ball"]', 'subject = ["ball", "bal", "ball"]'),
            [
                '2: subject[1]: found the unknown shape "bal" (did you mean "ball"?); allowed: ball, room',
                '2: subject[2]: found the shape "ball" a second time; allowed: each only once',
            ],
        ),
        (
            GOOD + SHAPE.format("sphere", "emitter-1"),
            [
                f'{FROM + 4}: shapes[2].name: found the name "emitter-1"; allowed: names that do not begin with '
                '"emitter-", as disk and line lights do'
            ],
        ),
        (
            GOOD + LIGHT.format("lamp"),
            [f'{FROM + 4}: emitters[1].shape: found the unknown shape "lamp"; allowed: ball, room'],
        ),
        (
            GOOD + LIGHT.format("room") + LIGHT.format("room"),
            [f'{FROM + 9}: emitters[2].shape: found an area light on "room" a second time; allowed: each only once'],
        ),
        (
            GOOD + SHAPE.format("torus_knot", "knot") + "p = 2\nq = 4\n",
            [
                f"{FROM + 2}: shapes[2]: found p = 2 and q = 4; allowed: numbers without a common divisor, as others "
                "make "
                "several curves"
            ],
        ),
        (
            GOOD + SHAPE.format("mesh", "mesh") + 'path = "none.ply"\n',
            [
                f'{FROM + 6}: shapes[2].path: found the path "none.ply", where there is no file; allowed: files that '
                "exist, "
                "relative to {folder}"
            ],
        ),
        (
            GOOD + SHAPE.format("mesh", "mesh") + 'path = "wood.png"\n',
            [
                f'{FROM + 6}: shapes[2].path: found the file "wood.png"; allowed: files that end in .ply, .obj, '
                ".stl, .glb"
            ],
        ),
        (
            GOOD + '\n[[emitters]]\ntype = "environment"\npath = "/sky.exr"\n',
            [
                f'{FROM + 4}: emitters[1].path: found the absolute path "/sky.exr"; allowed: paths relative to the '
                "scene's folder"
            ],
        ),
        (
            GOOD.replace("wood.png", "wood.exr"),
            [
                '12: materials.wood.reflectance.color_space: found "srgb" for the EXR "wood.exr"; allowed: "linear", '
                "as an EXR "
                "holds linear values",
                '12: materials.wood.reflectance.path: found the path "wood.exr", where there is no file; allowed: '
                "files that "
                "exist, relative to {folder}",
            ],
        ),
        (
            GOOD + GOOD[GOOD.index("\n[[checks]]") :].replace("settings = {", "settings = {  "),
            [
                f"{FROM + 2}: checks[1]: found the quantity, technique, settings and fit_exposure of checks[0]; "
                "allowed: checks "
                "that differ in one of them; put all criteria into one check"
            ],
        ),
        (
            GOOD.replace("[materials]", '[materials]\nskin = { type = "translucent", medium = "skin3" }'),
            [
                '11: materials.skin.medium: found the unknown medium "skin3" (did you mean "skin2"?); allowed: '
                + ", ".join(MEDIA)
            ],
        ),
        (
            GOOD.replace("[materials]", SKIN).replace('left = "wood"', 'left = "skin"')
            + SHAPE.format("rectangle", "pane").replace("red", "skin")
            + "size = [1, 1]\n",
            [
                f'{line}: {key}: found the translucent material "skin" on what is not closed; allowed: a diffuse one, '
                "or a closed shape"
                for line, key in ((25, "shapes[1].walls.left"), (FROM + 6, "shapes[2].material"))
            ],
        ),
        (
            GOOD + EYE + 'iris = "wod"\n',
            [
                f'{FROM + 10}: shapes[2].iris: found the unknown material "wod" (did you mean "wood"?); allowed: '
                "red, wood"
            ],
        ),
        (
            GOOD.replace("[materials]", SKIN) + EYE + 'iris = "skin"\n',
            [
                f'{FROM + 11}: shapes[2].iris: found the translucent material "skin"; allowed: a diffuse one, as parts '
                "of an eye have"
            ],
        ),
        (
            GOOD + EYE + 'iris = "red"\n' + EYE.replace('"eye"\nm', '"other"\nm') + 'iris = "red"\niris_depth = 2\n',
            [
                f"{FROM + 12}: shapes[3]: found iris_depth = 2; allowed: at least 2.69804, where the cornea is as "
                "wide as the iris",
            ],
        ),
        (
            GOOD + EYE + 'iris = "red"\n' + LIGHT.format("eye"),
            [
                f'{FROM + 14}: emitters[1].shape: found an area light on "eye", which is an eye; allowed: shapes of '
                "diffuse material that are no eyes"
            ],
        ),
        (
            GOOD.replace("[materials]", SKIN)
            + SHAPE.format("sphere", "lamp").replace("red", "skin")
            + LIGHT.format("lamp"),
            [
                f'{FROM + 10}: emitters[1].shape: found an area light on "lamp", whose material is translucent; '
                "allowed: shapes of diffuse material that are no eyes"
            ],
        ),
    ],
)
def test_parts_that_do_not_fit_together_are_said(tmp_path: Path, text: str, said: list[str]) -> None:
    assert complaints(tmp_path, text) == [line.replace("{folder}", str(tmp_path)) for line in said]


def test_checks_that_differ_in_settings_or_exposure_are_different(tmp_path: Path) -> None:
    check = GOOD[GOOD.index("\n[[checks]]") :]
    other = check.replace("samples = 4", "samples = 8")
    fitted = check.replace("settings", "fit_exposure = true\nsettings")
    assert len(load_scene(written(tmp_path, GOOD + other + fitted)).checks) == 3


def test_all_problems_are_said_at_once_in_the_order_of_the_lines(tmp_path: Path) -> None:
    text = (
        GOOD.replace("title", "titel")
        .replace("fov_deg = 40", "fov_deg = 0")
        .replace('name = "ball"\nmaterial = "red"', 'name = "ball"\nmaterial = "rad"')
        .replace('left = "wood"', 'lefft = "stone"')
        .replace("[1, 1, 1]", "[1, -1, 1]")
        .replace('"the budget of the game"', '"because"')
    )
    said = complaints(tmp_path, text)
    assert [line.split(": ")[:2] for line in said] == [
        ["1", "title"],
        ["1", "titel"],
        ["8", "sensor.fov_deg"],
        ["17", "shapes[0].material"],
        ["24", "shapes[1].walls.lefft"],
        ["24", "shapes[1].walls.lefft"],
        ["29", "emitters[0].intensity[1]"],
        ["35", "checks[0].criteria[0].reason"],
    ]


def test_a_syntax_error_names_its_line(tmp_path: Path) -> None:
    (said,) = complaints(tmp_path, GOOD.replace("fov_deg = 40", "fov_deg = = 40"))
    assert said == "8: this is not TOML: Invalid value at column 11. Mend the line."


def test_a_document_that_stops_in_the_middle_names_its_last_line(tmp_path: Path) -> None:
    (said,) = complaints(tmp_path, 'title = "x"\nsubject = [')
    assert said.startswith("2: this is not TOML: ")


def test_a_missing_scene_is_said(tmp_path: Path) -> None:
    with pytest.raises(SceneError, match="cannot be read"):
        load_scene(tmp_path / "none.toml")


def test_bytes_that_are_not_utf_8_are_said(tmp_path: Path) -> None:
    path = tmp_path / "scene.toml"
    path.write_bytes(b'title = "caf\xe9"\n')
    with pytest.raises(SceneError, match="not UTF-8"):
        load_scene(path)


def test_a_scene_is_found_by_its_name_or_its_path(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("room_small", "room_large", "knot"):
        (tmp_path / f"{name}.toml").touch()
    monkeypatch.setattr("scenes.load.LIBRARY", tmp_path)
    assert list(library_scenes()) == ["knot", "room_large", "room_small"]
    assert find_scene("knot") == tmp_path / "knot.toml"
    assert find_scene("mine.toml") == Path("mine.toml")
    assert find_scene("folder/mine.toml") == Path("folder/mine.toml")
    with pytest.raises(SceneError, match=r'"room_smal".*one of knot, room_large, room_small\. Close to it: room_small'):
        find_scene("room_smal")


@pytest.mark.parametrize("name", library_scenes())
def test_every_scene_of_the_library_loads(name: str) -> None:
    assert load_scene(find_scene(name)).name == name


@pytest.mark.parametrize("value", ['["skin"]', "{ a = 1 }", "3"])
@pytest.mark.parametrize("key", ["name", "type", "material"])
def test_a_shape_whose_keys_are_no_texts_is_said_in_words(tmp_path: Path, key: str, value: str) -> None:
    lines = {"name": '"ball"', "type": '"sphere"', "material": '"red"'} | {key: value}
    text = GOOD.replace('type = "sphere"\nname = "ball"\nmaterial = "red"', "\n".join(map(" = ".join, lines.items())))
    assert any(f"shapes[0].{key}: found " in line for line in complaints(tmp_path, text))


HAIR = '\n[[hair]]\nname = "fur"\non = "{}"\nmaterial = "{}"\ncount = 5\nlength = 0.1\nradius = 0.001\n'


@pytest.mark.parametrize("kind", ['type = "fibr"\n', 'type = ["fibre"]\n', ""])
def test_of_what_has_no_known_type_only_the_type_is_said(tmp_path: Path, kind: str) -> None:
    """Hair of it, hair on it, an eye of it and a lamp of it may be right once it has one."""
    material = f"[materials.odd]\n{kind}sigma_a = [1, 1, 1]\n\n[[shapes]]"
    odd = GOOD.replace("[[shapes]]", material, 1) + f'\n[[shapes]]\n{kind}name = "thing"\nmaterial = "odd"\n'
    eye = EYE.replace('"red"', '"odd"') + 'iris = "odd"\n'
    said = complaints(tmp_path, odd + eye + LIGHT.format("thing") + HAIR.format("thing", "odd"))
    assert [line.split(": ")[1] for line in said] == ["materials.odd.type", "shapes[2].type"]


@pytest.mark.parametrize("place", ["material", "wall"])
def test_a_lamp_is_diffuse(tmp_path: Path, place: str) -> None:
    suit = '[materials]\nsuit = { type = "principled", base_color = [1, 1, 1] }'
    shape = 'name = "room"\nmaterial = "red"'
    old, new = (shape, shape.replace("red", "suit")) if place == "material" else ('left = "wood"', 'left = "suit"')
    text = GOOD.replace("[materials]", suit).replace(old, new) + LIGHT.format("room")
    [said] = complaints(tmp_path, text)
    assert 'found an area light on "room", whose material is principled; allowed: shapes of diffuse material' in said


def test_a_file_of_heights_is_named_in_a_table(tmp_path: Path) -> None:
    relief = SHAPE.format("relief", "block") + 'size = [1, 1]\ndepth = 0.1\nheights = "wood.png"\n'
    [said] = complaints(tmp_path, GOOD + relief)
    assert 'heights: found "wood.png"' in said
    assert said.endswith('"noise" or a table with path, color_space')
