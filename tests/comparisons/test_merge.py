"""Shards of a run, put together: what the run in one piece would have given."""

import json
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from comparisons.merge import merge, read_part
from scenes.errors import InputError

Run = Callable[..., Any]
Shards = Callable[..., list[Path]]

SHARDS = 2
TIMES = {"started": None, "seconds": None}


def results_of(folder: Path) -> dict[str, Any]:
    found: dict[str, Any] = json.loads((folder / "results.json").read_text(encoding="utf-8"))
    return found


def pictures_of(folder: Path) -> dict[str, bytes]:
    paths = [path for part in ("images", "pixels") for path in (folder / part).iterdir()]
    return {str(path.relative_to(folder)): path.read_bytes() for path in paths}


@pytest.fixture
def judged(here: Path, trio: Path) -> Path:
    """The current folder, which holds the scenes of the trio and a store in which they are finished."""
    shutil.copytree(trio / "scenes", here / "scenes")
    shutil.copytree(trio / ".lightgauge", here / ".lightgauge")
    return here


@pytest.fixture
def run_shards(judged: Path, lightgauge: Run) -> Shards:
    """Runs the scenes in one piece, as `whole`, and in shards; the folders of these."""

    def run(*options: str, count: int = SHARDS) -> list[Path]:
        lightgauge("run", "scenes", "-o", "whole", *options)
        for index in range(1, count + 1):
            lightgauge("run", "scenes", "-o", f"shard-{index}", "--shard", f"{index}/{count}", *options)
        return [judged / f"shard-{index}" for index in range(1, count + 1)]

    return run


@pytest.mark.parametrize("count", [2, 3])
def test_merged_shards_equal_the_run_in_one_piece(
    judged: Path, run_shards: Shards, lightgauge: Run, count: int
) -> None:
    shards = run_shards(count=count)
    outcome = lightgauge("merge", *map(str, reversed(shards)), "-o", "merged")
    assert outcome.status == 0
    whole, merged = results_of(judged / "whole"), results_of(judged / "merged")
    assert merged | TIMES == whole | TIMES
    assert list(merged) == list(whole)
    assert pictures_of(judged / "merged") == pictures_of(judged / "whole")
    assert merged["seconds"] == pytest.approx(sum(results_of(shard)["seconds"] for shard in shards))
    assert merged["started"] == min(results_of(shard)["started"] for shard in shards)
    assert {check["scene"] for check in results_of(shards[0])["checks"]} < {"large", "middle", "small"}
    assert results_of(shards[0])["shard"] == f"1/{count}"
    assert (judged / "merged" / "index.html").exists()
    assert "15 PASS in" in outcome.out


def test_what_fails_and_what_is_broken_comes_through(judged: Path, run_shards: Shards, lightgauge: Run) -> None:
    large, middle = (judged / "scenes" / f"{name}.toml" for name in ("large", "middle"))
    large.write_text(large.read_text(encoding="utf-8").replace("radius = 0.32", "radius = -1"), encoding="utf-8")
    budget = '"energy_bias", min = 0.5'
    text = middle.read_text(encoding="utf-8").replace('"nrmse", max = 0.5', budget)
    assert budget in text
    middle.write_text(text, encoding="utf-8")
    assert lightgauge("run", "scenes").status == 3
    shards = run_shards(count=3)  # whose checks are in the store by now, as those of the whole run are
    outcome = lightgauge("merge", *map(str, shards), "-o", "merged")
    assert outcome.status == 3
    assert results_of(judged / "merged") | TIMES == results_of(judged / "whole") | TIMES
    assert [broken["scene"] for broken in results_of(judged / "merged")["broken"]] == ["large"]
    assert "FAIL middle/indirect.irradiance[side=24]" in outcome.out
    assert "9 PASS, 1 FAIL, 1 broken scene in" in outcome.out


def test_the_status_is_that_of_the_run_in_one_piece(judged: Path, run_shards: Shards, lightgauge: Run) -> None:
    shards = run_shards("-k", "depth")
    assert lightgauge("merge", *map(str, shards), "-o", "merged", "--min-checks", "1").status == 1
    for shard in shards:
        change(shard, lambda found: found["checks"][0].update(verdict="INCONCLUSIVE"))
    assert lightgauge("merge", *map(str, shards), "-o", "merged").status == 2


def change(shard: Path, edit: Callable[[dict[str, Any]], Any]) -> None:
    found = results_of(shard)
    edit(found)
    (shard / "results.json").write_text(json.dumps(found), encoding="utf-8")


def test_shards_that_do_not_make_up_a_run_are_refused(judged: Path, run_shards: Shards, lightgauge: Run) -> None:
    first, second = map(str, run_shards())
    for runs, said in (
        ((first,), "Shard 2/2 is missing. Name the folders of all 2 runs"),
        ((first, second, first), "Shard 1/2 is there more than once"),
        (("whole", second), "'whole' is a run, but none of its shards"),
        (("gone", second), "'gone' does not exist"),
    ):
        outcome = lightgauge("merge", *runs, "-o", "merged")
        assert outcome.status == 3
        assert said in outcome.err
    assert not (judged / "merged").exists()
    assert lightgauge("merge", first, second, "-o", first).status == 3
    assert results_of(Path(first))["shard"] == "1/2", "no shard is overwritten"
    next((judged / "shard-2" / "images").iterdir()).unlink()
    outcome = lightgauge("merge", first, second, "-o", "merged")
    assert outcome.status == 3
    assert "lacks the file images/" in outcome.err


@pytest.mark.parametrize(
    ("edit", "said"),
    [
        (lambda found: found.update(shard="2/3"), "they differ in the number of shards (2; 3)"),
        (lambda found: found.update(keep="normal"), "they differ in the choice of keep ('depth'; 'normal')"),
        (lambda found: found.update(scenes=["large"]), "they differ in the choice of scenes (3 scenes; 1 scenes)"),
        (lambda found: found["environment"].update(commit="abc"), "they differ in the commit ("),
        (lambda found: found["environment"].update(lightgauge="9.9"), "they differ in the version of lightgauge ("),
        (lambda found: found["checks"].clear(), "These scenes are not in exactly one of the shards: "),
        (lambda found: found["checks"][0].update(scene="new"), "These scenes are not in exactly one of the shards: "),
        (lambda found: found["checks"][0].pop("verdict"), "are those of another version, or damaged (KeyError"),
        (lambda found: found.pop("jobs"), "are those of another version, or damaged (KeyError: 'jobs')"),
        (lambda found: found.update(shard="two"), "are those of another version, or damaged (InputError"),
        (lambda found: found.update(broken=[{"why": "?"}]), "are those of another version, or damaged (TypeError"),
    ],
)
def test_shards_of_different_runs_are_refused(
    run_shards: Shards, edit: Callable[[dict[str, Any]], Any], said: str
) -> None:
    shards = run_shards("-k", "depth")
    change(shards[1], edit)
    with pytest.raises(InputError) as caught:
        merge([read_part(shard) for shard in shards])
    assert said in str(caught.value)


def test_machines_that_differ_are_noted(run_shards: Shards) -> None:
    shards = run_shards("-k", "depth")
    change(shards[1], lambda found: found["environment"].update(gl_renderer="NVIDIA H200", numpy="1.0"))
    merged = merge([read_part(shard) for shard in shards])
    environment = merged.content["environment"]
    own = results_of(shards[0])["environment"]
    assert environment["gl_renderer"] == f"NVIDIA H200; {own['gl_renderer']}"
    assert environment["numpy"] == f"1.0; {own['numpy']}"
    assert environment["mitsuba"] == own["mitsuba"]
    assert merged.notes == (
        f"The shards differ in numpy: {own['numpy']} (1/2); 1.0 (2/2).",
        f"The shards differ in gl_renderer: {own['gl_renderer']} (1/2); NVIDIA H200 (2/2).",
    )
    assert merged.content["store_note"] == " ".join(merged.notes)


def test_notes_of_the_shards_are_kept(run_shards: Shards) -> None:
    shards = run_shards("-k", "depth")
    change(shards[1], lambda found: found.update(store_note="Dropped a block."))
    merged = merge([read_part(shard) for shard in shards])
    assert merged.notes == ("Dropped a block.",)
    assert merged.content["store_note"] == "Dropped a block."


def test_shards_that_name_a_picture_alike_keep_both(judged: Path, lightgauge: Run) -> None:
    for name, radius in (("room (1)", 0.32), ("room -1-", 0.3)):
        text = (judged / "scenes" / "middle.toml").read_text(encoding="utf-8")
        (judged / f"{name}.toml").write_text(text.replace("radius = 0.3\n", f"radius = {radius}\n"), encoding="utf-8")
    run = ("run", "room (1).toml", "room -1-.toml", "-k", "depth", "-o")
    for index in (1, 2):
        lightgauge(*run, f"shard-{index}", "--shard", f"{index}/2")
    lightgauge(*run, "whole")
    assert lightgauge("merge", "shard-2", "shard-1", "-o", "merged").status == 0
    assert results_of(judged / "merged") | TIMES == results_of(judged / "whole") | TIMES
    assert pictures_of(judged / "merged") == pictures_of(judged / "whole")
    shown = [path for check in results_of(judged / "merged")["checks"] for path in check["images"].values()]
    assert sorted(shown) == sorted(pictures_of(judged / "merged"))
