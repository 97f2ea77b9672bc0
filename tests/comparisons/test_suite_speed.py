"""The command that measures runs: what it changes, and that it changes nothing of the user's."""

import hashlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from comparisons import suite_speed
from comparisons.answers.profile import BEGIN, END, duration, with_block
from comparisons.selection import choose
from comparisons.suite_speed import copy_store
from realtime.code import shaders_of
from scenes.digest import PACKAGES_FOLDER
from scenes.errors import InputError
from scenes.load import LIBRARY, load_scene
from scenes.model import Scene

Run = Callable[..., Any]


@pytest.fixture(scope="module")
def chosen() -> Any:
    return choose(["small-room-knot", "shadow-*"])


def loaded(folder: Path, change: tuple[str, tuple[Path, str]]) -> tuple[Scene, Scene]:
    """A shipped scene as it is and as it is changed."""
    _, (path, text) = change
    copy = folder / path.name
    copy.write_text(text, encoding="utf-8")
    for other in LIBRARY.iterdir():
        if other.name != path.name and other.is_file():
            (folder / other.name).symlink_to(other)
    return load_scene(path), load_scene(copy)


def test_one_budget_is_changed_and_nothing_else(chosen: Any, tmp_path: Path) -> None:
    before, after = loaded(tmp_path, suite_speed._one_budget(chosen))
    pairs = [(a, b) for a, b in zip(before.checks, after.checks, strict=True) if a != b]
    ((was, now),) = pairs
    assert was.criteria[0].max is not None
    assert now.criteria[0].max == pytest.approx(was.criteria[0].max * 1.001, rel=1e-12)
    assert was.criteria[1:] == now.criteria[1:]
    same = {"checks": (), "folder": LIBRARY}
    assert before.model_copy(update=same) == after.model_copy(update=same)


def test_one_scene_is_changed(chosen: Any, tmp_path: Path) -> None:
    before, after = loaded(tmp_path, suite_speed._one_scene(chosen))
    assert after.sensor.fov_deg == pytest.approx(before.sensor.fov_deg * 1.001, rel=1e-12)
    assert after.shapes == before.shapes


def test_a_shader_of_the_technique_with_the_most_checks_is_changed(chosen: Any) -> None:
    what, (path, text) = suite_speed._one_shader(chosen)
    assert text.startswith(path.read_text(encoding="utf-8"))
    users = {check.technique for check in chosen.every_check if path.name in "".join(shaders_of(check.technique))}
    assert what.endswith(path.relative_to(PACKAGES_FOLDER / "realtime" / "glsl").as_posix())
    assert 0 < len(users) < len({check.technique for check in chosen.every_check})


def test_a_copied_store_shares_images_but_no_times(tmp_path: Path) -> None:
    shelf = tmp_path / "store" / "ab" / ("ab" * 32)
    shelf.mkdir(parents=True)
    for name in ("key.json", "exact.exr", ".exact.exr.0a.tmp"):
        (shelf / name).write_text(name, encoding="utf-8")
    (tmp_path / "store" / "runs").mkdir()
    copy_store(tmp_path / "store", tmp_path / "copy")
    copied = tmp_path / "copy" / "ab" / ("ab" * 32)
    assert sorted(path.name for path in copied.iterdir()) == ["exact.exr", "key.json"]
    assert (copied / "exact.exr").samefile(shelf / "exact.exr")
    assert not (copied / "key.json").samefile(shelf / "key.json")
    assert not (tmp_path / "copy" / "runs").exists()
    copy_store(tmp_path / "none", tmp_path / "empty")
    assert not (tmp_path / "empty").exists()


@pytest.mark.parametrize(
    ("seconds", "text"),
    [(0.254, "0.25 s"), (1.46, "1.5 s"), (75.2, "75 s"), (703.0, "11 min 43 s"), (120.0, "2 min 0 s")],
)
def test_durations(seconds: float, text: str) -> None:
    assert duration(seconds) == text


def test_the_table_stands_between_its_marks() -> None:
    text = f"# Speed\n{BEGIN}\nold\n{END}\nmore\n"
    assert with_block(text, ["a", "b\\1"], Path("x.md")) == f"# Speed\n{BEGIN}\na\nb\\1\n{END}\nmore\n"
    with pytest.raises(InputError, match="has no place for the table"):
        with_block("# Speed\n", [], Path("x.md"))


def test_a_file_without_marks_is_refused_before_anything_is_measured(lightgauge: Run, here: Path) -> None:
    (here / "speed.md").write_text("# Speed\n", encoding="utf-8")
    outcome = lightgauge("profile", "small-room-knot", "--write", "speed.md")
    assert outcome.status == 3
    assert "has no place for the table" in outcome.err
    assert "cannot be read" in lightgauge("profile", "--write", "none.md").err


def test_only_shipped_scenes_are_measured(lightgauge: Run, write_scene: Callable[..., Path], here: Path) -> None:
    write_scene()
    outcome = lightgauge("profile", "tiny.toml")
    assert outcome.status == 3
    assert "Only shipped scenes are measured" in outcome.err


def state(folder: Path) -> dict[str, tuple[int, str]]:
    files = (path for path in folder.rglob("*") if path.is_file() and "__pycache__" not in path.parts)
    return {str(path): (path.stat().st_mtime_ns, hashlib.sha256(path.read_bytes()).hexdigest()) for path in files}


@pytest.mark.slow
def test_a_profile_tells_what_was_done_anew_and_touches_nothing(
    lightgauge: Run, lightgauge_apart: Run, here: Path
) -> None:
    (here / "speed.md").write_text(f"{BEGIN}\n{END}\n", encoding="utf-8")
    assert lightgauge_apart("run", "small-room-knot", "-k", "irradiance").status == 0
    store = state(here / ".lightgauge")
    library = state(LIBRARY)
    outcome = lightgauge("profile", "small-room-knot", "-k", "irradiance", "--write", "speed.md")
    assert outcome.status == 0, outcome.err
    assert {name for name, found in state(here / ".lightgauge").items() if store.get(name) != found} == set()
    assert (state(here / ".lightgauge").keys(), state(LIBRARY)) == (store.keys(), library)
    rows = [line.split("|")[1:-1] for line in (here / "speed.md").read_text(encoding="utf-8").splitlines()]
    counts = [(row[2].strip(), row[3].strip()) for row in rows if len(row) == 4][2:]
    assert counts == [("", ""), ("0 of 5", "0"), ("1 of 5", "0"), ("1 of 5", "0"), ("5 of 5", "5")]
