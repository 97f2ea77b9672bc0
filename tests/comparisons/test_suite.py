"""Verdicts of a tiny scene, with techniques, cameras and truths that go wrong."""

import json
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest

from comparisons import sequential, suite
from comparisons.gate import CriterionResult, Verdict
from comparisons.judgement import error_scale
from comparisons.metrics import Estimate, Samples
from comparisons.parity import PARITY
from comparisons.request import Request, request_of
from comparisons.result import CheckResult, empty_result
from comparisons.suite import SceneRun, exit_status
from realtime.camera import Camera, sensor_camera
from realtime.frame import Frame
from realtime.graph import Pass
from realtime.technique import Technique
from realtime.techniques import MODULES, technique
from reference.quantities import quantity
from reference.store import Store
from scenes.errors import InputError
from scenes.image import Float32
from scenes.load import find_scene, load_scene
from scenes.model import Perspective

Run = Callable[..., Any]
Write = Callable[..., Path]
Pretend = Callable[[Float32 | float], None]

BUDGET = '{ metric = "nrmse", max = 0.5, reason = "far above what is reached" }'
FAKE = ('"indirect.irradiance"\nsettings = { side = 24 }', '"fake"')
JUDGED = "tiny/indirect.irradiance[side=24]"


def results_of(folder: Path) -> dict[str, dict[str, Any]]:
    """The checks of a run by their id."""
    checks = json.loads((folder / "report" / "results.json").read_text(encoding="utf-8"))["checks"]
    return {check["id"]: check for check in checks}


@pytest.fixture
def pretend(monkeypatch: pytest.MonkeyPatch) -> Pretend:
    """Registers a technique `fake` that draws the same value everywhere."""

    def register(value: Float32 | float) -> None:
        def draw(frame: Frame) -> None:
            width, height = frame.size
            image = frame.texture(frame.size, 4)
            image.write(np.broadcast_to(np.float32(value), (height, width, 4)).tobytes())
            frame.resources["image"] = image

        fake = Technique(
            name="fake",
            approximates="indirect_radiance",
            summary="one value everywhere",
            source="opengl-4.6",
            limits="all",
            passes=lambda scene, features, settings: [Pass("fill", draw, writes=("image",))],
            grid=1,
        )
        module = ModuleType("fake_technique")
        vars(module)["TECHNIQUES"] = {"fake": fake}
        monkeypatch.setitem(sys.modules, "fake_technique", module)
        monkeypatch.setitem(MODULES, "fake", "fake_technique")

    return register


def test_a_check_within_its_budget_passes(after_a_run: Path) -> None:
    checks = results_of(after_a_run)
    assert list(checks) == [
        "tiny/raster.normal",
        "tiny/raster.depth",
        "tiny/raster.coverage",
        "tiny/raster.albedo",
        JUDGED,
    ]
    assert {check["verdict"] for check in checks.values()} == {"PASS"}


def test_a_check_beyond_its_budget_fails_with_status_1(with_truth: Path, lightgauge: Run, write_scene: Write) -> None:
    write_scene((BUDGET, '{ metric = "energy_bias", min = 0.5, reason = "no correct image is that bright" }'))
    outcome = lightgauge("run", "tiny.toml")
    assert outcome.status == 1
    assert results_of(with_truth)[JUDGED]["verdict"] == "FAIL"
    assert "no correct image is that bright" in outcome.out


def test_an_undecided_check_has_status_2_and_says_how_many_samples_it_takes(
    with_truth: Path, lightgauge: Run, write_scene: Write, monkeypatch: pytest.MonkeyPatch
) -> None:
    def evaluate(metric: str, image: Float32, samples: Samples) -> Estimate:
        return Estimate(0.375, 0.25, 0.75) if metric == "nrmse" else Estimate.exact(0.0)

    monkeypatch.setattr(sequential, "evaluate", evaluate)
    write_scene(("max_spp = 4096", "max_spp = 64"))
    outcome = lightgauge("run", "tiny.toml")
    assert outcome.status == 2
    check = results_of(with_truth)[JUDGED]
    assert check["verdict"] == "INCONCLUSIVE"
    assert check["spp"] == 64, "the scene's limit holds for the first look too"
    assert check["message"] == (
        "Undecided after 64 spp (the scene allows 64): about 576 spp would decide it. "
        "Set max_spp = 1024 or more under [truth] in the scene."
    )
    assert check["message"] in outcome.out


def test_samples_double_until_the_limit_while_a_verdict_is_open(
    with_truth: Path, lightgauge: Run, write_scene: Write, monkeypatch: pytest.MonkeyPatch
) -> None:
    def evaluate(metric: str, image: Float32, samples: Samples) -> Estimate:
        return Estimate(0.5, 0.4, 0.6) if metric == "nrmse" else Estimate.exact(0.0)

    monkeypatch.setattr(sequential, "evaluate", evaluate)
    write_scene(("max_spp = 4096", "max_spp = 2047"))
    assert lightgauge("run", "tiny.toml").status == 2
    check = results_of(with_truth)[JUDGED]
    assert check["spp"] == 1024
    assert "too close to its bound" in check["message"]


def test_error_bars_that_cannot_be_trusted_are_sampled_further(
    with_truth: Path, lightgauge: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    looks = []

    def evaluate(metric: str, image: Float32, samples: Samples) -> Estimate:
        looks.append(metric)
        return Estimate(0.0, 0.0, 0.001, valid=metric != "nrmse" or looks.count("nrmse") > 1, note="fireflies")

    monkeypatch.setattr(sequential, "evaluate", evaluate)
    assert lightgauge("run", "tiny.toml").status == 0
    assert results_of(with_truth)[JUDGED]["spp"] == 32


@pytest.mark.usefixtures("with_truth")
def test_error_bars_that_stay_untrustworthy_get_no_number_of_samples_as_advice(
    lightgauge: Run, write_scene: Write, monkeypatch: pytest.MonkeyPatch
) -> None:
    def evaluate(metric: str, image: Float32, samples: Samples) -> Estimate:
        return Estimate(0.0, 0.0, 0.001, valid=metric != "nrmse", note="fireflies")

    write_scene(("max_spp = 4096", "max_spp = 256"))
    monkeypatch.setattr(sequential, "evaluate", evaluate)
    outcome = lightgauge("run", "tiny.toml")
    assert outcome.status == 2
    assert "fireflies" in outcome.out
    assert "too noisy to know how noisy" in outcome.out
    assert "max_spp =" not in outcome.out


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_an_image_that_is_not_finite_is_an_error(
    with_truth: Path, lightgauge: Run, write_scene: Write, pretend: Pretend, value: float
) -> None:
    pretend(value)
    write_scene(FAKE, ("max = 0.5", "max = 1e9"))
    outcome = lightgauge("run", "tiny.toml")
    assert outcome.status == 4
    check = results_of(with_truth)["tiny/fake"]
    assert check["verdict"] == "ERROR"
    assert "NaN or infinite" in check["message"]


def test_a_blank_image_is_an_error_whatever_the_budget(
    with_truth: Path, lightgauge: Run, write_scene: Write, pretend: Pretend
) -> None:
    pretend(0.0)
    write_scene(FAKE, ("max = 0.5", "max = 1e9"))
    outcome = lightgauge("run", "tiny.toml")
    assert outcome.status == 4
    check = results_of(with_truth)["tiny/fake"]
    assert check["verdict"] == "ERROR"
    assert "black at every judged pixel, but its truth is not" in check["message"]


def test_an_image_of_one_value_is_judged(
    with_truth: Path, lightgauge: Run, write_scene: Write, pretend: Pretend
) -> None:
    pretend(0.1)
    write_scene(FAKE, ("max = 0.5", "max = 1e9"))
    assert lightgauge("run", "tiny.toml").status == 0


def test_a_metric_that_overflows_is_an_error_and_null_in_the_results(
    with_truth: Path, lightgauge: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sequential, "evaluate", lambda metric, image, samples: Estimate(np.inf, np.nan, np.inf))
    assert lightgauge("run", "tiny.toml").status == 4
    (criterion, _) = results_of(with_truth)["tiny/raster.normal"]["criteria"]
    assert criterion["verdict"] == "ERROR"
    assert (criterion["value"], criterion["low"], criterion["high"]) == (None, None, None)


def test_one_error_stops_no_other_check(
    with_truth: Path, lightgauge: Run, write_scene: Write, pretend: Pretend
) -> None:
    pretend(np.nan)
    path = write_scene()
    section = path.read_text().partition("[[checks]]")[2]
    path.write_text(path.read_text() + "\n[[checks]]" + section.replace(*FAKE))
    assert lightgauge("run", "tiny.toml").status == 4
    verdicts = {name: check["verdict"] for name, check in results_of(with_truth).items()}
    assert verdicts["tiny/fake"] == "ERROR"
    assert verdicts[JUDGED] == "PASS"


def test_an_exception_of_a_technique_is_an_error_that_says_where_it_was_raised(
    with_truth: Path, lightgauge: Run, write_scene: Write, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(frame: object) -> None:
        raise ArithmeticError("the driver gave up")

    monkeypatch.setattr("realtime.techniques.indirect_irradiance._gather", fail)
    write_scene()
    outcome = lightgauge("run", "tiny.toml")
    assert outcome.status == 4
    message = results_of(with_truth)["tiny/indirect.irradiance[side=24]"]["message"]
    assert message.startswith("ArithmeticError at test_suite.py:")
    assert "a setting of the check is out of range" in message


@pytest.mark.parametrize(
    ("error", "status", "said"),
    [
        (ArithmeticError("no such angle"), 4, "ArithmeticError at test_suite.py:"),
        (InputError("accepted.json is gone."), 3, "accepted.json is gone."),
    ],
)
def test_an_error_outside_any_check_is_that_of_all_checks_of_its_scene_alone(
    with_truth: Path,
    lightgauge: Run,
    write_scene: Write,
    monkeypatch: pytest.MonkeyPatch,
    error: Exception,
    status: int,
    said: str,
) -> None:
    def faulty(request: Request, *others: object) -> SceneRun:
        if request.scene.name == "other":
            raise error
        return SceneRun(request, *others)  # type: ignore[arg-type]

    monkeypatch.setattr(suite, "SceneRun", faulty)
    write_scene(name="other")
    assert lightgauge("run", "other.toml", "tiny.toml").status == status
    checks = results_of(with_truth)
    for name, check in checks.items():
        assert check["verdict"] == ("ERROR" if name.startswith("other/") else "PASS")
    assert len(checks) == 10
    assert checks["other/raster.normal"]["message"].startswith(said)


def test_what_was_finished_before_such_an_error_counts(
    with_truth: Path, lightgauge: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(result: CheckResult, accepted: object) -> CheckResult:
        if result.technique == "raster.coverage":
            raise ArithmeticError("no such angle")
        return result

    monkeypatch.setattr(suite, "apply", fail)
    assert lightgauge("run", "tiny.toml").status == 4
    verdicts = [check["verdict"] for check in results_of(with_truth).values()]
    assert verdicts == ["PASS", "PASS", "ERROR", "ERROR", "ERROR"]


@pytest.fixture
def mirrored(monkeypatch: pytest.MonkeyPatch) -> None:
    """The real-time camera looks into a mirror wherever its field of view is 31 degrees."""

    def camera(sensor: Perspective, near: float, far: float) -> Camera:
        made = sensor_camera(sensor, near, far)
        flip = np.diag([-1.0 if sensor.fov_deg == 31.0 else 1.0, 1, 1, 1])
        return Camera(made.eye, flip @ made.matrix, made.forward)

    monkeypatch.setattr("realtime.frame.sensor_camera", camera)


@pytest.mark.usefixtures("mirrored")
def test_without_parity_the_radiance_of_that_scene_alone_is_an_error(
    with_truth: Path, lightgauge: Run, write_scene: Write
) -> None:
    write_scene(("fov_deg = 30.0", "fov_deg = 31.0"), name="mirror")
    outcome = lightgauge("run", "mirror.toml", "tiny.toml")
    assert outcome.status == 4
    checks = results_of(with_truth)
    assert checks["mirror/raster.normal"]["verdict"] == "FAIL"
    assert checks[JUDGED.replace("tiny", "mirror")]["verdict"] == "ERROR"
    assert (
        "Parity of this scene does not hold: normal (shift_px is 20;"
        in (checks[JUDGED.replace("tiny", "mirror")]["message"])
    )
    assert checks[JUDGED.replace("tiny", "mirror")]["criteria"] == []
    assert {check["verdict"] for name, check in checks.items() if name.startswith("tiny/")} == {"PASS"}


@pytest.mark.usefixtures("mirrored")
def test_parity_comes_along_with_a_choice_of_checks(with_truth: Path, lightgauge: Run, write_scene: Write) -> None:
    write_scene(("fov_deg = 30.0", "fov_deg = 31.0"))
    outcome = lightgauge("run", "tiny.toml", "-k", "indirect")
    assert outcome.status == 4
    assert "Parity of this scene does not hold" in outcome.out


def test_a_choice_of_parity_leaves_radiance_out(after_a_run: Path) -> None:
    scene = load_scene(after_a_run / "tiny.toml")
    chosen = request_of(scene, "tiny.toml", lambda name: name == "tiny/raster.depth").checks
    assert [check.quantity for check in chosen] == ["normal", "depth", "coverage", "albedo"]
    assert request_of(scene, "tiny.toml", lambda name: False).checks == ()


def test_parity_that_cannot_be_judged_is_not_said_to_be_broken(here: Path, lightgauge: Run, write_scene: Write) -> None:
    write_scene(("width = 16\nheight = 12", "width = 5\nheight = 5"))
    outcome = lightgauge("run", "tiny.toml")
    assert outcome.status == 3
    message = results_of(here)[JUDGED]["message"]
    assert message.startswith("Parity of this scene could not be judged: normal. shift_px needs 16 pixels")


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("position = [0.1, 0.0, 0.0]", "position = [0.1, 0.0, 1.4]"),  # behind the camera
        ("origin = [0.2, 0.3, 1.2]", "origin = [0.2, 0.3, 9.0]"),  # outside the room
        ("width = 16\nheight = 12", "width = 1\nheight = 1"),
    ],
)
def test_a_subject_that_is_not_seen_is_said_once_for_all_checks(
    here: Path, lightgauge: Run, write_scene: Write, old: str, new: str
) -> None:
    write_scene((old, new))
    outcome = lightgauge("run", "tiny.toml")
    assert outcome.status == 3
    said = "the subject (ball) covers no pixel completely"
    assert all(said in check["message"] for check in results_of(here).values())
    closing = [line for line in outcome.out.splitlines() if not line.startswith("[")]
    assert sum(said in line and "Parity" not in line for line in closing) == 1


def test_darkness_on_both_sides_is_no_agreement(with_truth: Path, lightgauge: Run, write_scene: Write) -> None:
    write_scene(("[6.0, 5.0, 4.0]", "[0.0, 0.0, 0.0]"))
    assert lightgauge("run", "tiny.toml").status == 3
    message = results_of(with_truth)[JUDGED]["message"]
    assert "there is nothing to compare" in message


def result_with(verdict: Verdict, status: int = 0) -> CheckResult:
    scene = load_scene(find_scene("parity-wide"))
    result = empty_result(scene, "parity-wide", PARITY[0], technique("raster.normal"), quantity("normal"))
    return replace(result, verdict=verdict, exit_status=status)


@pytest.mark.parametrize(
    ("results", "status"),
    [
        ([(Verdict.PASS, 0)], 0),
        ([(Verdict.PASS, 0), (Verdict.FAIL, 0)], 1),
        ([(Verdict.INCONCLUSIVE, 0), (Verdict.PASS, 0)], 2),
        ([(Verdict.INCONCLUSIVE, 0), (Verdict.FAIL, 0)], 1),
        ([(Verdict.ERROR, 3), (Verdict.FAIL, 0)], 3),
        ([(Verdict.ERROR, 3), (Verdict.ERROR, 4)], 4),
        ([(Verdict.ERROR, 0)], 4),
        ([], 4),
    ],
)
def test_the_exit_status_is_that_of_the_worst_verdict(results: list[tuple[Verdict, int]], status: int) -> None:
    assert exit_status(result_with(*result) for result in results) == status


@pytest.mark.parametrize(
    ("results", "status"),
    [
        ([(Verdict.PASS, 0)], 3),
        ([(Verdict.FAIL, 0), (Verdict.INCONCLUSIVE, 0)], 3),
        ([(Verdict.ERROR, 4)], 4),
        ([], 3),
    ],
)
def test_a_broken_scene_is_bad_input_unless_something_worse_happened(
    results: list[tuple[Verdict, int]], status: int
) -> None:
    assert exit_status((result_with(*result) for result in results), is_broken=True) == status


def criterion(metric: str, most: float | None, least: float | None = None) -> CriterionResult:
    return CriterionResult(metric, 0.0, 0.0, 0.0, least, most, Verdict.PASS, "because it is", "")


@pytest.mark.parametrize(
    ("criteria", "scale"),
    [
        ([criterion("nrmse", 0.1)], 2 * 0.1 * 3.0),
        ([criterion("flip", 0.1), criterion("rms", 0.25)], 2 * 0.25),
        ([criterion("nrmse", None, 0.1)], 0.1 * 3.0),
        ([criterion("off_by_1", 1e-4)], 2.0),
        ([], 0.1 * 3.0),
    ],
)
def test_the_scale_of_an_error_picture_is_tied_to_the_budget(criteria: list[CriterionResult], scale: float) -> None:
    samples = Samples(np.full((1, 2, 2, 3), 3.0), np.ones((2, 2), dtype=bool))
    assert error_scale(criteria, samples) == pytest.approx(scale)


def test_the_scale_is_positive_for_a_black_truth() -> None:
    samples = Samples(np.zeros((1, 2, 2, 3)), np.ones((2, 2), dtype=bool))
    assert error_scale([criterion("flip", 0.1)], samples) > 0


def test_a_store_is_left_without_half_written_files(after_a_run: Path) -> None:
    store = Store(after_a_run / ".lightgauge")
    assert not [path for path in store.root.rglob("*") if path.name.startswith(".")]
