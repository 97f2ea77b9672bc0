"""What a second run does again, and what it does not."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from comparisons import cache as cache_module
from comparisons.cache import CheckCache, check_parts
from comparisons.code import library_versions
from comparisons.parity import checks_of
from comparisons.result import CheckResult
from reference.store import Store
from scenes.checks import Check
from scenes.exr import read_exr
from scenes.load import load_scene
from scenes.model import Scene

Run = Callable[..., Any]
Write = Callable[..., Path]


def results_of(folder: Path) -> dict[str, Any]:
    found: dict[str, Any] = json.loads((folder / "report" / "results.json").read_text(encoding="utf-8"))
    return found


def without_origin(folder: Path) -> list[dict[str, Any]]:
    """The checks of a run without saying whether, and how fast, they were rendered this time."""
    timing = dict.fromkeys(("cached", "seconds", "pass_seconds", "baked_seconds"))
    return [check | timing for check in results_of(folder)["checks"]]


def exr_times(folder: Path) -> dict[Path, int]:
    return {path: path.stat().st_mtime_ns for path in (folder / ".lightgauge").rglob("[be]*.exr")}


def is_cached(folder: Path) -> list[bool]:
    return [check["cached"] for check in results_of(folder)["checks"]]


def test_a_second_run_renders_nothing_and_imports_no_renderer(after_a_run: Path, lightgauge_apart: Run) -> None:
    first, times = results_of(after_a_run), exr_times(after_a_run)
    refuse = "for name in ('mitsuba', 'drjit', 'moderngl', 'trimesh', 'colour', 'skimage'): sys.modules[name] = None"
    outcome = lightgauge_apart("run", "tiny.toml", before=refuse)
    assert (outcome.status, outcome.err) == (0, "")
    assert outcome.out.count("(stored)") == 5
    assert exr_times(after_a_run) == times
    second = results_of(after_a_run)
    assert second["checks"] == [check | {"cached": True} for check in first["checks"]]
    assert second["environment"] == first["environment"]
    assert second["counts"] == first["counts"]


def test_a_first_run_does_import_them(here: Path, write_scene: Write, lightgauge_apart: Run) -> None:
    write_scene()
    outcome = lightgauge_apart("run", "tiny.toml", before="sys.modules['moderngl'] = None")
    assert outcome.status == 4
    assert "moderngl" in outcome.out + outcome.err


def test_a_changed_budget_judges_again_without_rendering_truth(
    after_a_run: Path, lightgauge: Run, write_scene: Write
) -> None:
    times = exr_times(after_a_run)
    write_scene(("nrmse", "energy_bias"), ("max = 0.5", "max = -0.9"))
    assert lightgauge("run", "tiny.toml").status == 1
    assert exr_times(after_a_run) == times
    assert is_cached(after_a_run) == [True, True, True, True, False]


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("reflectance = [0.6, 0.15, 0.1]", "reflectance = [0.6, 0.15, 0.2]"),
        ("intensity = [6.0", "intensity = [7.0"),
        ("detail = 3", "detail = 2"),
    ],
)
def test_a_changed_scene_is_rendered_anew(
    after_a_run: Path, lightgauge: Run, write_scene: Write, old: str, new: str
) -> None:
    times = exr_times(after_a_run)
    write_scene((old, new))
    assert lightgauge("run", "tiny.toml").status == 0
    assert exr_times(after_a_run).items() > times.items()
    assert is_cached(after_a_run) == [False] * 5


def test_a_changed_name_and_title_change_no_image(after_a_run: Path, lightgauge: Run, write_scene: Write) -> None:
    write_scene(("A ball in a small room", "Renamed"), name="other")
    assert lightgauge("run", "other.toml").status == 0
    assert is_cached(after_a_run) == [True] * 5
    for check in results_of(after_a_run)["checks"]:
        assert (check["scene"], check["scene_title"]) == ("other", "Renamed")
        assert check["id"].startswith("other/")
        assert "other.toml" in check["rerun"]
        assert all((after_a_run / "report" / path).is_file() for path in check["images"].values())


def damage(path: Path) -> None:
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 0xFF
    path.write_bytes(content)


def test_damaged_truth_is_rendered_anew_and_said(after_a_run: Path, lightgauge: Run) -> None:
    before = without_origin(after_a_run)
    (block,) = (after_a_run / ".lightgauge").rglob("block-000.exr")
    content = read_exr(block).pixels
    damage(block)
    outcome = lightgauge("run", "tiny.toml")
    assert outcome.status == 0
    assert "Dropped from the store and rendered anew" in outcome.out
    assert "block-000.exr" in outcome.out
    assert "block-000.exr" in results_of(after_a_run)["store_note"]
    assert (read_exr(block).pixels == content).all()
    assert without_origin(after_a_run) == before


def test_deleted_truth_is_rendered_anew(after_a_run: Path, lightgauge: Run) -> None:
    (block,) = (after_a_run / ".lightgauge").rglob("block-000.exr")
    block.unlink()
    assert lightgauge("run", "tiny.toml").status == 0
    assert block.is_file()
    assert is_cached(after_a_run)[-1] is False


def test_a_picture_that_is_gone_is_drawn_again(after_a_run: Path, lightgauge: Run) -> None:
    pictures = sorted((after_a_run / ".lightgauge").rglob("*-error.png"))
    pictures[0].unlink()
    assert lightgauge("run", "tiny.toml").status == 0
    assert pictures[0].is_file()
    assert sorted(is_cached(after_a_run)) == [False, True, True, True, True]


def test_pictures_return_to_a_report_that_lost_them(after_a_run: Path, lightgauge: Run) -> None:
    pictures = sorted((after_a_run / "report" / "images").iterdir())
    for picture in pictures:
        picture.unlink()
    assert lightgauge("run", "tiny.toml").status == 0
    assert sorted((after_a_run / "report" / "images").iterdir()) == pictures


@pytest.mark.parametrize(
    "content", ["", "{", "[]", "null", "{}", '{"inputs": [], "result": {}}', '{"inputs": {}, "result": null}', "\xff"]
)
def test_a_damaged_verdict_is_judged_again(after_a_run: Path, lightgauge: Run, content: str) -> None:
    verdict = sorted((after_a_run / ".lightgauge").rglob("check.json"))[0]
    verdict.write_text(content, encoding="latin-1")
    assert lightgauge("run", "tiny.toml").status == 0
    assert sorted(is_cached(after_a_run)) == [False, True, True, True, True]


def test_an_error_is_not_remembered(here: Path, lightgauge: Run, write_scene: Write) -> None:
    write_scene(("width = 16\nheight = 12", "width = 5\nheight = 5"))  # too few pixels for one of the metrics of parity
    for _ in range(2):
        lightgauge("run", "tiny.toml")
        verdicts = {check["technique"]: (check["verdict"], check["cached"]) for check in results_of(here)["checks"]}
        assert verdicts["raster.normal"] == ("ERROR", False)
    assert verdicts["raster.coverage"] == ("PASS", True)


@pytest.fixture
def scene(after_a_run: Path) -> Scene:
    return load_scene(after_a_run / "tiny.toml")


def changed(check: Check, **changes: Any) -> Check:
    return check.model_copy(update=changes)


def test_a_result_depends_on_everything_that_a_check_says(scene: Scene) -> None:
    (check,) = scene.checks
    (criterion,) = check.criteria
    parts = [
        check_parts(check, 4096, "truth"),
        check_parts(changed(check, fit_exposure=True), 4096, "truth"),
        check_parts(changed(check, settings={"side": 48}), 4096, "truth"),
        check_parts(changed(check, criteria=(criterion.model_copy(update={"max": 0.4}),)), 4096, "truth"),
        check_parts(changed(check, criteria=(criterion.model_copy(update={"reason": "another one"}),)), 4096, "truth"),
        check_parts(check, 64, "truth"),
        check_parts(check, 4096, "another truth"),
    ]
    assert len({json.dumps(part, sort_keys=True) for part in parts}) == len(parts)


def found(scene: Scene) -> dict[str, bool]:
    """Which checks are found finished, by their technique, as a new run would find them."""
    cache = CheckCache(Store(scene.folder / ".lightgauge"))
    return {check.technique: cache.read(scene, check) is not None for check in checks_of(scene)}


def test_changed_code_runs_the_checks_that_use_it_and_no_others(scene: Scene, monkeypatch: pytest.MonkeyPatch) -> None:
    every = found(scene)
    assert all(every.values())
    assert "indirect.irradiance" in every
    own = every | {"indirect.irradiance": False}
    for name in ("drawing_code", "judging_code"):
        original = getattr(cache_module, name)

        def other(of: Any, original: Callable[[Any], str] = original) -> str:
            return original(of) + ("x" if of in ("indirect.irradiance", ("nrmse",)) else "")

        with monkeypatch.context() as patch:
            patch.setattr(cache_module, name, other)
            assert found(scene) == own
    assert found(scene) == every


def test_a_result_depends_on_the_graphics_driver_that_is_chosen(scene: Scene, monkeypatch: pytest.MonkeyPatch) -> None:
    cache = CheckCache(Store(scene.folder / ".lightgauge"))
    assert cache.read(scene, scene.checks[0]) is not None
    monkeypatch.setenv("GLCONTEXT_DEVICE_INDEX", "3")
    assert cache.read(scene, scene.checks[0]) is None


def test_a_result_depends_on_the_versions_of_libraries(scene: Scene, monkeypatch: pytest.MonkeyPatch) -> None:
    versions = library_versions()
    assert "flip-evaluator" in versions
    monkeypatch.setattr(cache_module, "library_versions", lambda: versions | {"flip-evaluator": "0"})
    assert not any(found(scene).values())


MESH = ('type = "sphere"\nradius = 0.3\ndetail = 3', 'type = "mesh"\npath = "body.ply"')


def test_a_file_that_is_replaced_amid_a_run_leaves_nothing_under_its_content(
    here: Path, lightgauge: Run, write_scene: Write, monkeypatch: pytest.MonkeyPatch
) -> None:
    import trimesh

    body = here / "body.ply"
    write_scene(MESH)
    trimesh.creation.icosphere(3, 0.3).export(body)
    write = CheckCache.write

    def write_and_replace(self: CheckCache, scene: Scene, check: Check, result: CheckResult) -> None:
        write(self, scene, check, result)
        if check.quantity == "coverage":
            trimesh.creation.icosphere(3, 0.2).export(body)

    with monkeypatch.context() as patch:
        patch.setattr(CheckCache, "write", write_and_replace)
        outcome = lightgauge("run", "tiny.toml")
    assert outcome.status == 3
    assert "one of its files has been changed since the run began" in outcome.out
    lightgauge("run", "tiny.toml")
    assert is_cached(here) == [False] * 5
