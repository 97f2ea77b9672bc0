"""The commands around a run, from the command line, on the tiny scene."""

import json
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from comparisons.calibration import pool
from realtime.camera import Camera, sensor_camera
from scenes.model import Perspective

Run = Callable[..., Any]
Write = Callable[..., Path]

JUDGED = "tiny/indirect.irradiance[side=24]"
TALK = ('"indirect.irradiance"\nsettings = { side = 24 }', '"indirect.talk"')
REASON = "as it was when this test was written"


def check_of(folder: Path, name: str = JUDGED) -> dict[str, Any]:
    checks = json.loads((folder / "report" / "results.json").read_text(encoding="utf-8"))["checks"]
    found: dict[str, Any] = next(check for check in checks if check["id"] == name)
    return found


@pytest.fixture
def accepted(after_a_run: Path, lightgauge: Run) -> Path:
    """The current folder after a run whose errors were accepted."""
    outcome = lightgauge("accept", "--reason", REASON)
    assert outcome.status == 0
    assert JUDGED in outcome.out
    return after_a_run


def test_what_was_accepted_stands_in_a_small_file_and_holds(accepted: Path, lightgauge: Run) -> None:
    entry = json.loads((accepted / "accepted.json").read_text())[JUDGED]
    assert entry["reason"] == REASON
    assert lightgauge("run", "tiny.toml").status == 0
    assert check_of(accepted)["accepted"]["reason"] == REASON
    assert check_of(accepted)["cached"] is True


def test_an_error_beyond_the_accepted_one_is_a_regression_within_the_budget(
    with_truth: Path, lightgauge: Run, write_scene: Write
) -> None:
    write_scene(TALK, ("max = 0.5", "max = 0.99"))
    assert lightgauge("run", "tiny.toml").status == 0
    assert lightgauge("accept", "--reason", REASON).status == 0
    path = with_truth / "accepted.json"
    entries = json.loads(path.read_text())
    (criterion,) = check_of(with_truth, "tiny/indirect.talk")["criteria"]
    entries["tiny/indirect.talk"]["criteria"]["nrmse"] = [0.8 * criterion["low"]] * 2 + [0.9 * criterion["low"]]
    path.write_text(json.dumps(entries))
    outcome = lightgauge("run", "tiny.toml")
    assert outcome.status == 1
    check = check_of(with_truth, "tiny/indirect.talk")
    assert (check["verdict"], check["cached"]) == ("REGRESSED", True)
    assert "REGRESSED tiny/indirect.talk" in outcome.out
    assert lightgauge("accept", "--reason", "the new one is as good").status == 0
    assert lightgauge("run", "tiny.toml").status == 0


def test_a_damaged_file_of_accepted_errors_is_refused_before_anything_is_rendered(
    accepted: Path, lightgauge: Run
) -> None:
    (accepted / "accepted.json").write_text("{")
    outcome = lightgauge("run", "tiny.toml")
    assert outcome.status == 3
    assert "accepted.json" in outcome.err
    assert "Traceback" not in outcome.err


def test_a_run_says_what_the_sequential_verdicts_spared(after_a_run: Path, lightgauge: Run) -> None:
    outcome = lightgauge("run", "tiny.toml")
    spp, fixed = (check_of(after_a_run)[key] for key in ("spp", "spp_fixed"))
    assert f"Verdicts took {spp} samples a pixel over 1 truth" in outcome.out
    assert f"{fixed / spp:.1f} times as many" in outcome.out


def test_the_store_is_listed_pruned_and_merged(after_a_run: Path, lightgauge: Run) -> None:
    listed = lightgauge("store").out
    assert "tiny/indirect_radiance" in listed
    shutil.copytree(".lightgauge", "other")
    assert lightgauge("store", "--prune", "0").status == 0
    assert "tiny/" not in lightgauge("store").out
    assert lightgauge("store", "--merge", "other").status == 0
    assert lightgauge("store").out.count("tiny/") == listed.count("tiny/")
    assert lightgauge("run", "tiny.toml").status == 0
    assert check_of(after_a_run)["cached"] is True


@pytest.mark.usefixtures("after_a_run")
@pytest.mark.parametrize("arguments", [("store", "--prune", "much"), ("run", "tiny.toml", "--store-limit", "-1")])
def test_a_size_that_is_none_is_refused(lightgauge: Run, arguments: tuple[str, ...]) -> None:
    outcome = lightgauge(*arguments)
    assert outcome.status == 3
    assert "500M" in outcome.err


def test_what_a_run_uses_stays_however_small_the_limit(after_a_run: Path, lightgauge: Run) -> None:
    assert lightgauge("run", "tiny.toml", "--store-limit", "1").status == 0
    assert lightgauge("run", "tiny.toml").status == 0
    assert check_of(after_a_run)["cached"] is True


@pytest.mark.usefixtures("with_truth")
def test_a_loose_budget_lets_faults_survive_and_the_self_test_says_which(lightgauge: Run) -> None:
    outcome = lightgauge("selftest", "tiny.toml", "-k", "indirect")
    assert outcome.status == 1
    assert f"SURVIVED {JUDGED}: gain" in outcome.out
    assert "Tighten the max of nrmse" in outcome.out
    assert "nan_pixel" in outcome.out


@pytest.mark.usefixtures("with_truth")
def test_two_techniques_are_told_apart(lightgauge: Run) -> None:
    outcome = lightgauge("diff", "indirect.talk", "indirect.irradiance[side=24]", "--scene", "tiny.toml")
    assert outcome.status == 0
    assert "B is better" in outcome.out


@pytest.mark.usefixtures("after_a_run")
def test_a_run_differs_from_itself_in_nothing(lightgauge: Run) -> None:
    outcome = lightgauge("diff", "report", "report", "--scene", "tiny.toml")
    assert outcome.status == 0
    assert "1 in common: 1 same" in outcome.out


def test_a_clamped_truth_says_so_in_the_results_and_on_the_page(
    with_truth: Path, lightgauge: Run, write_scene: Write
) -> None:
    write_scene(("max_spp = 4096", "max_spp = 4096, clamp = 2.0"))
    assert lightgauge("run", "tiny.toml").status == 0
    assert "no sample counts for more than 2." in check_of(with_truth)["clamp"]
    (page,) = (with_truth / "report" / "checks").glob("tiny-indirect*.html")
    assert "The truth is clamped" in page.read_text(encoding="utf-8")


def test_explain_tells_which_integrator_suffices(lightgauge: Run, write_scene: Write) -> None:
    write_scene()
    assert (
        "indirect-only path tracing: only light that was reflected elsewhere" in lightgauge("explain", "tiny.toml").out
    )


def test_the_calibration_is_a_document(
    here: Path, lightgauge: Run, mi: object, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(pool, "RESOLUTION", 24)
    monkeypatch.setattr(pool, "SAMPLES", 256)
    outcome = lightgauge("calibrate", "--repetitions", "2", "-o", "calibration.md")
    assert outcome.status == 0
    text = (here / "calibration.md").read_text(encoding="utf-8")
    assert text.startswith("# Calibration of the error bars\n")
    for title in ("Coverage", "Verdicts", "Significance map"):
        assert f"## {title}\n" in text
    rows = [line for line in text.splitlines() if line.startswith("|")]
    assert {line.count("|") for line in rows} == {9, 8, 5}, "no row is longer or shorter than its table"


def test_a_calibration_needs_repetitions(here: Path, lightgauge: Run) -> None:
    outcome = lightgauge("calibrate", "--repetitions", "1")
    assert outcome.status == 3
    assert "--repetitions is 1" in outcome.err


@pytest.fixture
def mirrored(monkeypatch: pytest.MonkeyPatch) -> None:
    """The real-time camera looks into a mirror."""

    def camera(sensor: Perspective, near: float, far: float) -> Camera:
        made = sensor_camera(sensor, near, far)
        return Camera(made.eye, np.diag([-1.0, 1, 1, 1]) @ made.matrix, made.forward)

    monkeypatch.setattr("realtime.frame.sensor_camera", camera)


@pytest.mark.usefixtures("with_truth", "mirrored")
def test_techniques_are_not_compared_on_a_scene_without_parity(lightgauge: Run, write_scene: Write) -> None:
    write_scene(("fov_deg = 30.0", "fov_deg = 31.0"))
    outcome = lightgauge("diff", "indirect.talk", "indirect.probe", "--scene", "tiny.toml")
    assert outcome.status == 4
    assert "Parity of this scene does not hold" in outcome.err


@pytest.mark.usefixtures("with_truth", "mirrored")
def test_without_parity_no_check_of_radiance_is_tested(lightgauge: Run, write_scene: Write) -> None:
    write_scene(("fov_deg = 30.0", "fov_deg = 31.0"))
    outcome = lightgauge("selftest", "tiny.toml")
    assert outcome.status == 1
    assert f"UNTESTED {JUDGED}: parity of this scene does not hold" in outcome.out


@pytest.mark.usefixtures("after_a_run")
def test_a_run_that_does_not_exist_is_named(lightgauge: Run) -> None:
    outcome = lightgauge("diff", "report", "there/is/none")
    assert outcome.status == 3
    assert "there/is/none" in outcome.err
    assert "does not exist" in outcome.err


def test_results_of_another_schema_are_refused(after_a_run: Path, lightgauge: Run) -> None:
    path = after_a_run / "report" / "results.json"
    path.write_text(json.dumps(json.loads(path.read_text()) | {"schema": 99}))
    for arguments in (("accept", "--reason", REASON), ("diff", "report", "report"), ("report", "report")):
        outcome = lightgauge(*arguments)
        assert outcome.status == 3
        assert "schema 99" in outcome.err


def test_a_document_is_not_written_over_a_folder(here: Path, lightgauge: Run) -> None:
    outcome = lightgauge("calibrate", "-o", str(here))
    assert outcome.status == 3
    assert "is a folder" in outcome.err
