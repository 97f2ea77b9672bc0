"""Where a budget is written."""

from collections.abc import Callable
from pathlib import Path

import pytest

from comparisons.parity import PARITY
from comparisons.places import file_of, places_of
from scenes.load import load_scene
from scenes.paths import shown_path


def test_each_criterion_has_the_line_it_stands_in(write_scene: Callable[..., Path]) -> None:
    two = (
        'criteria = [{ metric = "nrmse", max = 0.5, reason = "far above what is reached" }]',
        'criteria = [\n    { metric = "nrmse", max = 0.5, reason = "far above what is reached" },\n'
        '    { metric = "flip", max = 0.9, reason = "far above what is reached" },\n]',
    )
    scene = load_scene(write_scene(two))
    lines = file_of(scene).read_text(encoding="utf-8").splitlines()
    places = places_of(scene, scene.checks[0])
    assert [place.rpartition(":")[0] for place in places] == ["tiny.toml", "tiny.toml"]
    found = [lines[int(place.rpartition(":")[2]) - 1] for place in places]
    assert ['"nrmse"' in found[0], '"flip"' in found[1]] == [True, True]


def test_a_standard_check_stands_at_the_top_of_its_scene(write_scene: Callable[..., Path]) -> None:
    assert places_of(load_scene(write_scene()), PARITY[0]) == ("tiny.toml:1", "tiny.toml:1")


def test_a_file_outside_the_current_folder_is_shown_in_full(here: Path, tmp_path_factory: object) -> None:
    assert shown_path(here / "below" / "a.toml") == str(Path("below", "a.toml"))
    assert shown_path(here.parent / "a.toml") == str(here.parent / "a.toml")


@pytest.mark.parametrize("content", [None, "title = [[[ \n x y z", "title = "])
def test_a_file_that_is_gone_or_broken_by_now_is_still_named(
    write_scene: Callable[..., Path], content: str | None
) -> None:
    path = write_scene()
    scene = load_scene(path)
    path.unlink() if content is None else path.write_text(content, encoding="utf-8")
    assert places_of(scene, scene.checks[0]) == ("tiny.toml:1",)
