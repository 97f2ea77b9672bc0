"""Which code the image of a technique depends on: all that is really used, and little else."""

import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from realtime import code, shader
from realtime.code import drawing_code, modules_of, shader_code, shaders_of
from realtime.render import Renderer
from realtime.techniques import MODULES, technique
from scenes.load import library_scenes, load_scene

if TYPE_CHECKING:
    import moderngl

ROOT = Path(shader.__file__).parents[1]

FAST = ("raster.depth", "shadow.vcm", "indirect.probe")
CASES = [pytest.param(name, marks=() if name in FAST else pytest.mark.slow) for name in MODULES]


@pytest.fixture
def compiled(monkeypatch: pytest.MonkeyPatch) -> set[str]:
    """The files of all shaders that are compiled, from now on."""
    found: set[str] = set()
    load = shader.load

    def recorded(*arguments: object, **options: object) -> shader.Source:
        source: shader.Source = load(*arguments, **options)  # type: ignore[arg-type]
        found.update(file for file, _ in source.lines if file != "defines")
        return source

    monkeypatch.setattr(shader, "load", recorded)
    return found


@pytest.mark.parametrize("name", CASES)
def test_every_shader_that_is_compiled_counts(name: str, gl: "moderngl.Context", compiled: set[str]) -> None:
    scenes = (load_scene(path) for path in library_scenes().values())
    asked = ((scene, check) for scene in scenes for check in scene.checks if check.technique == name)
    quick = {"width": 12, "height": 10}
    if name.startswith("raster."):
        scene, settings = load_scene(library_scenes()["small-room-knot"]), {}
    else:
        scene, check = next(asked)
        settings = dict(check.settings)
    small = scene.model_copy(update={"sensor": scene.sensor.model_copy(update=quick)})
    Renderer(small).render(technique(name), settings, timed=False)
    assert compiled
    assert compiled <= shaders_of(name)


def test_every_shader_belongs_to_a_technique() -> None:
    """But for those that are there for techniques of users alone."""
    used = {name for technique_name in MODULES for name in shaders_of(technique_name)}
    there = {path.relative_to(shader.GLSL).as_posix() for path in shader.GLSL.rglob("*") if path.is_file()}
    assert used <= there
    assert all(name.startswith("own/") for name in there - used)


@pytest.mark.parametrize("name", ["raster.depth", "cornea.talk", "translucency.ordinates"])
def test_every_module_that_is_imported_counts(name: str) -> None:
    program = (
        f"import importlib, sys; [importlib.import_module(name) for name in ('realtime.render', {MODULES[name]!r})];"
        "print(*(m.__file__ for n, m in sys.modules.items() if n.split('.')[0] in ('realtime', 'scenes')))"
    )
    said = subprocess.run([sys.executable, "-c", program], cwd=ROOT, capture_output=True, text=True, check=True).stdout
    packages = {ROOT / "realtime" / "__init__.py", ROOT / "realtime" / "techniques" / "__init__.py"}
    assert {Path(path) for path in said.split()} - packages <= modules_of(name)


def test_a_technique_depends_on_its_own_files_and_not_on_those_of_others() -> None:
    assert any("vcm" in name for name in shaders_of("shadow.vcm"))
    assert not any(name.startswith(("indirect/gather", "defocus", "cornea")) for name in shaders_of("shadow.vcm"))
    assert ROOT / "realtime" / "techniques" / "shadow_vcm.py" in modules_of("shadow.vcm")
    assert ROOT / "realtime" / "techniques" / "defocus_talk.py" not in modules_of("shadow.vcm")


def test_a_name_that_is_put_together_stands_for_all_that_it_fits() -> None:
    """`f"defocus_talk/{name}.frag"` is all that the technique says."""
    fitting = {path.relative_to(shader.GLSL).as_posix() for path in shader.GLSL.glob("defocus_talk/*.frag")}
    assert len(fitting) > 3
    assert fitting <= shaders_of("defocus.talk")


def test_a_technique_of_a_user_depends_on_everything() -> None:
    every = {name for technique_name in MODULES for name in shaders_of(technique_name)}
    assert shaders_of("mine") >= every
    assert modules_of("mine") >= set((ROOT / "realtime").rglob("*.py"))


@pytest.fixture
def changed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[[str, str], set[str]]:
    """changed(file, text): the techniques whose code is another one with that text at the end of a shader."""

    def techniques(file: str, text: str) -> set[str]:
        before = {name: drawing_code(name) for name in MODULES}
        original = code.shader_code
        other = tmp_path / "shader.glsl"
        other.write_text((shader.GLSL / file).read_text(encoding="utf-8") + text, encoding="utf-8")
        monkeypatch.setattr(code, "shader_code", lambda path: original(other if path == shader.GLSL / file else path))
        drawing_code.cache_clear()
        after = {name: drawing_code(name) for name in MODULES}
        drawing_code.cache_clear()
        return {name for name in MODULES if before[name] != after[name]}

    return techniques


@pytest.mark.parametrize(
    ("file", "techniques"),
    [
        ("lib/sh.glsl", {name for name in MODULES if "lib/sh.glsl" in shaders_of(name)}),
        ("raster/mesh.vert", set(MODULES)),
        ("own/sky.glsl", set()),
    ],
)
def test_a_changed_shader_changes_the_code_of_those_that_use_it(
    changed: Callable[[str, str], set[str]], file: str, techniques: set[str]
) -> None:
    assert changed(file, "\nfloat more() { return 1.0; }\n") == techniques
    assert len(techniques) in (0, len(MODULES)) or 0 < len(techniques) < 10


def test_comments_change_nothing(changed: Callable[[str, str], set[str]]) -> None:
    assert changed("raster/mesh.vert", "\n   // more\n/* and\nmore */\n") == set()


@pytest.mark.parametrize(
    ("one", "other", "is_same"),
    [
        ("float a = 1.0;", "float a = 1.0; // one", True),
        ("float a = 1.0;", "float a = /* one */ 1.0;", False),  # the blanks differ: a change too many harms nobody
        ("float a = 1.0;", "\n  float a = 1.0;\n\n", True),
        ("float a = 1.0;", "float a = 2.0;", False),
        ("a;\nb;", "a; b;", False),
        ("#define A 1 // one\nb;", "#define A 1\nb;", True),
        ("/* a; */ b;", "/* a; */ c;", False),
        ("a; // b\nc;", "a; // b c;", False),
    ],
)
def test_the_code_of_a_shader_is_what_it_does(tmp_path: Path, one: str, other: str, is_same: bool) -> None:
    paths = tmp_path / "one.frag", tmp_path / "other.frag"
    for path, text in zip(paths, (one, other), strict=True):
        path.write_text(text, encoding="utf-8")
    assert (shader_code(paths[0]) == shader_code(paths[1])) is is_same
