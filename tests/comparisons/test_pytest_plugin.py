"""The pytest plugin, in sessions of pytest within this one, on the tiny scene."""

import json
import shutil
import subprocess
import sys
import xml.etree.ElementTree as ElementTree
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from textwrap import dedent
from typing import Any, Protocol

import numpy as np
import pytest

from comparisons import pytest_judge
from comparisons.pytest_asked import GIVEN, Asked, case_of
from comparisons.result import CheckResult
from comparisons.runner import Runner
from realtime.camera import Camera, sensor_camera
from scenes.errors import InputError
from scenes.model import Perspective

JUDGED = "indirect.irradiance[side=24]"
PARITY = ["raster.normal", "raster.depth", "raster.coverage", "raster.albedo"]
QUIETLY = [f"-pno:{name}" for name in ("cacheprovider", "faulthandler", "hypothesispytest", "xdist")]
TALK = ('"indirect.irradiance"\nsettings = { side = 24 }', '"indirect.talk"')


Run = Callable[..., pytest.RunResult]


class Write(Protocol):
    """Writes the tiny scene into the folder of the session: write((old, new), ..., name="tiny")."""

    def __call__(self, *changes: tuple[str, str], name: str = "tiny") -> Path: ...


def put(name: str, text: str) -> None:
    """Write a file into the current folder."""
    Path(name).parent.mkdir(parents=True, exist_ok=True)
    Path(name).write_text(dedent(text), encoding="utf-8")


@pytest.fixture
def write(here: Path, finished: Path) -> Write:
    """Scenes for a session of pytest in which the truth of the tiny scene is known."""
    shutil.copytree(finished / ".lightgauge", here / ".lightgauge")
    tiny = (finished / "tiny.toml").read_text(encoding="utf-8")

    def written(*changes: tuple[str, str], name: str = "tiny") -> Path:
        text = tiny
        for old, new in changes:
            assert old in text, f"the scene has no {old!r}"
            text = text.replace(old, new)
        path = here / f"{name}.toml"
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
        return path

    return written


@pytest.fixture
def run(here: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> Run:
    """Runs pytest in this process and in the current folder.

    Not by pytester: it restores sys.modules, and with a former drjit.auto Dr.Jit breaks down.
    """

    def result(*arguments: str) -> pytest.RunResult:
        monkeypatch.delitem(sys.modules, "test_mine", raising=False)
        capsys.readouterr()
        status = pytest.main([*QUIETLY, f"--rootdir={here}", *arguments])
        written = capsys.readouterr()
        return pytest.RunResult(status, written.out.splitlines(), written.err.splitlines(), 0.0)

    return result


def names_in(folder: Path) -> list[str]:
    """The checks in the report of a session."""
    results = json.loads((folder / ".lightgauge" / "pytest-report" / "results.json").read_text(encoding="utf-8"))
    return [check["id"] for check in results["checks"]]


def test_a_session_without_scenes_is_left_alone(here: Path, run: Run) -> None:
    put("test_mine.py", "def test_one(): pass")
    put("settings.toml", "[tool]\nshapes = 1")
    put("scene.toml", 'sensor = "a"')
    result = run()
    result.assert_outcomes(passed=1)
    assert "lightgauge ==" not in result.stdout.str()
    assert not (here / ".lightgauge").exists()


def test_loading_the_plugin_imports_nothing_slow() -> None:
    code = "import pytest, sys; old = {*sys.modules}; import comparisons.pytest_plugin; print(*{*sys.modules} - old)"
    loaded = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.split()
    assert {"comparisons", "comparisons.pytest_plugin"} == {
        name for name in loaded if "." not in name or "compar" in name
    }


def test_the_checks_of_a_named_scene_are_tests_parity_first(here: Path, write: Write, run: Run) -> None:
    write()
    listed = run("--collect-only", "-q", "tiny.toml")
    assert [line for line in listed.outlines if "::" in line] == [f"tiny.toml::{name}" for name in [*PARITY, JUDGED]]
    result = run("tiny.toml")
    result.assert_outcomes(passed=5)
    result.stdout.fnmatch_lines(["5 PASS. Report: .lightgauge/pytest-report/index.html"])
    assert names_in(here) == [f"tiny/{name}" for name in [*PARITY, JUDGED]]
    assert (here / ".lightgauge" / "pytest-report" / "index.html").exists()


def test_one_check_of_a_scene_brings_its_parity_into_the_report(here: Path, write: Write, run: Run) -> None:
    write()
    run(f"tiny.toml::{JUDGED}").assert_outcomes(passed=1)
    assert names_in(here) == [f"tiny/{name}" for name in [*PARITY, JUDGED]]


def test_all_scenes_of_a_folder_on_demand_and_no_other_file(here: Path, write: Write, run: Run) -> None:
    write(name="scenes/tiny")
    put("pyproject.toml", "[tool.x]\nshapes = 1")
    put("cut_off.toml", 'name = "a')
    put("settings.toml", "title = 'a'\nchecks = 1")
    run().assert_outcomes()
    run("--lightgauge").assert_outcomes(passed=5)


@pytest.mark.parametrize("name", ["scenes", "tests/scenes"])
def test_scenes_of_the_configuration_are_run_with_the_tests(here: Path, write: Write, run: Run, name: str) -> None:
    write(name=f"{name}/tiny")
    put("pytest.ini", f"[pytest]\ntestpaths = tests\nlightgauge_scenes = {name}/*.toml")
    put(f"{name}/settings.toml", "a = 1")
    put("tests/test_mine.py", "def test_one(): pass")
    run().assert_outcomes(passed=6)
    run("tests/test_mine.py").assert_outcomes(passed=1)


@pytest.mark.parametrize("option", ["lightgauge_scenes", "lightgauge_techniques"])
def test_a_pattern_of_the_configuration_that_matches_nothing_is_refused(
    here: Path, write: Write, run: Run, option: str
) -> None:
    write()
    put("pytest.ini", f"[pytest]\n{option} = scnes/*.toml")
    result = run("tiny.toml")
    assert result.ret != 0
    assert f"{option}: found 'scnes/*.toml', which matches nothing in" in result.stdout.str() + result.stderr.str()


def test_a_mistake_in_a_scene_fails_one_test_with_the_place_and_no_traceback(write: Write, run: Run) -> None:
    write(("width = 16", "wdth = 16"), name="schema")
    write(("side = 24", "sde = 24"), name="setting")
    write(("[sensor]", "[sensor"), name="syntax")
    write()
    result = run("--lightgauge")
    result.assert_outcomes(passed=5, failed=3)
    said = result.stdout.str()
    assert "schema.toml:10: sensor.wdth: found an unknown key" in said
    assert "setting.toml:40: checks[0].settings: Technique 'indirect.irradiance' has no setting 'sde'" in said
    assert "syntax.toml:5: this is not TOML" in said
    assert ".py" not in said


def test_a_failure_tells_all_that_is_needed_to_act_on_it(here: Path, write: Write, run: Run) -> None:
    path = write(("max = 0.5", "max = 0.001"))
    line = 1 + path.read_text().splitlines().index(
        'criteria = [{ metric = "nrmse", max = 0.001, reason = "far above what is reached" }]'
    )
    result = run("tiny.toml")
    result.assert_outcomes(passed=4, failed=1)
    pictures = [
        f".lightgauge/pytest-report/images/tiny-indirect.irradiance-side-24--{name}.png"
        for name in ("realtime", "truth", "error")
    ]
    result.stdout.fnmatch_lines(
        [
            "FAIL nrmse *% [[]*, *], budget ≤ 0.1*%",
            f"check         tiny/{JUDGED.replace('[', '[[]')}: A ball in a small room",
            "FAIL          nrmse *% [[]*, *], budget ≤ 0.1*%",
            f"              tiny.toml:{line}: far above what is reached",
            "worst pixel   (*, *) from the top left: real-time *, *, *; truth * ± *, * ± *, * ± * W/(m² sr)",
            f"real-time     {pictures[0]}",
            f"truth         {pictures[1]}",
            f"error         {pictures[2]}",
            "report        .lightgauge/pytest-report/index.html, written at the end of the session",
            f"again         pytest 'tiny.toml::{JUDGED.replace('[', '[[]')}'",
            "again         lightgauge run tiny.toml -k '/indirect.irradiance[[]side=24]$'",
            "4 PASS, 1 FAIL. Report: *",
            "FAILED tiny.toml::* - FAIL nrmse *",
        ],
        consecutive=False,
    )
    assert all((here / picture).stat().st_size > 0 for picture in pictures)
    assert ".py" not in result.stdout.str()


def test_an_undecided_check_fails_and_says_how_many_samples_it_would_take(write: Write, run: Run) -> None:
    write(("max_spp = 4096", "max_spp = 64"), ("max = 0.5", "max = 0.034"))
    result = run("tiny.toml")
    result.assert_outcomes(passed=4, failed=1)
    result.stdout.fnmatch_lines(
        ["INCONCLUSIVE nrmse *", "*Undecided after 64 spp*spp would decide it. Set max_spp = *"]
    )


def test_an_error_that_has_risen_since_it_was_accepted_fails(here: Path, write: Write, run: Run) -> None:
    write(TALK)
    before = {"criteria": {"nrmse": [0.1, 0.09, 0.11]}, "date": "2026-01-01", "reason": "as it was then", "spp": 64}
    (here / "accepted.json").write_text(json.dumps({"tiny/indirect.talk": before}))
    write(TALK, ("max = 0.5", "max = 5.0"))
    result = run("tiny.toml")
    result.assert_outcomes(passed=4, failed=1)
    result.stdout.fnmatch_lines(["REGRESSED nrmse *", "*The error has risen since it was accepted on 2026-01-01*"])


@pytest.fixture
def mirrored(monkeypatch: pytest.MonkeyPatch) -> None:
    """The real-time camera looks into a mirror."""

    def camera(sensor: Perspective, near: float, far: float) -> Camera:
        made = sensor_camera(sensor, near, far)
        return Camera(made.eye, np.diag([-1.0, 1, 1, 1]) @ made.matrix, made.forward)

    monkeypatch.setattr("realtime.frame.sensor_camera", camera)


@pytest.mark.usefixtures("mirrored")
def test_without_parity_the_other_checks_are_errors_that_say_so(here: Path, write: Write, run: Run) -> None:
    write(("fov_deg = 30.0", "fov_deg = 31.0"))
    result = run("tiny.toml", f"--junitxml={here / 'out.xml'}")
    outcomes = result.parseoutcomes()
    assert outcomes["errors"] == 1
    assert outcomes["failed"] >= 2
    result.stdout.fnmatch_lines(
        [f"*ERROR at setup of tiny/{JUDGED.replace('[', '[[]')}*", "ERROR Parity of this scene does not hold: normal*"]
    )
    (error,) = ElementTree.parse(here / "out.xml").iter("error")
    assert "Parity of this scene does not hold" in error.attrib["message"]


def test_the_numbers_reach_the_junit_xml(here: Path, write: Write, run: Run) -> None:
    write()
    run("tiny.toml", f"--junitxml={here / 'out.xml'}")
    properties = {p.attrib["name"]: p.attrib["value"] for p in ElementTree.parse(here / "out.xml").iter("property")}
    name = f"tiny/{JUDGED}"
    value, low, high = (float(properties[f"{name}/nrmse/{key}"]) for key in ("value", "low", "high"))
    assert 0 <= low <= value <= high < 0.5
    assert float(properties[f"{name}/nrmse/max"]) == 0.5
    assert f"{name}/nrmse/min" not in properties
    assert properties[f"{name}/verdict"] == "PASS"


def test_scenes_of_one_name_stand_both_in_the_report(here: Path, write: Write, run: Run) -> None:
    write(name="a/tiny")
    write(("max = 0.5", "max = 0.001"), name="b/tiny")
    run("--lightgauge").assert_outcomes(passed=9, failed=1)
    assert names_in(here) == [f"{scene}/{name}" for scene in ("tiny", "tiny (2)") for name in [*PARITY, JUDGED]]
    pictures = here / ".lightgauge" / "pytest-report" / "images"
    assert {path.name for path in pictures.glob("tiny*irradiance*truth.png")} == {
        "tiny-indirect.irradiance-side-24--truth.png",
        "tiny-2-indirect.irradiance-side-24--truth.png",
    }


def test_an_interruption_ends_the_session_and_keeps_what_is_done(
    here: Path, write: Write, run: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    write()
    result_of = Runner.result

    def interrupted(runner: Runner, check: Any) -> Any:
        if check.technique == "indirect.irradiance":
            raise KeyboardInterrupt
        return result_of(runner, check)

    monkeypatch.setattr(Runner, "result", interrupted)
    assert run("tiny.toml").ret is pytest.ExitCode.INTERRUPTED
    assert names_in(here) == [f"tiny/{name}" for name in PARITY]


def test_a_page_that_cannot_be_written_hides_no_failure(
    write: Write, run: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(folder: Path, results: dict[str, Any]) -> Path:
        raise ArithmeticError("no such template")

    monkeypatch.setattr(pytest_judge, "write_run", fail)
    write(("max = 0.5", "max = 0.001"))
    result = run("tiny.toml")
    result.assert_outcomes(passed=4, failed=1)
    result.stdout.fnmatch_lines(["4 PASS, 1 FAIL. The report could not be written: ArithmeticError: no such template"])


def test_whatever_breaks_outside_the_checks_is_an_error_without_a_traceback(
    write: Write, run: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(*arguments: object) -> None:
        raise ArithmeticError("no such mesh")

    monkeypatch.setattr(pytest_judge, "SceneRun", fail)
    write()
    result = run(f"tiny.toml::{JUDGED}")
    result.assert_outcomes(errors=1)
    result.stdout.fnmatch_lines(["ArithmeticError at test_pytest_plugin.py:*: no such mesh.*"])
    assert "Traceback" not in result.stdout.str()


def test_a_folder_that_cannot_be_written_to_is_an_error_of_each_check(here: Path, write: Write, run: Run) -> None:
    write()
    (here / "file").touch()
    result = run(f"tiny.toml::{JUDGED}", "--lightgauge-report", "file")
    result.assert_outcomes(errors=1)
    result.stdout.fnmatch_lines(["The output folder '*/file' cannot be written to*--lightgauge-report FOLDER."])


def test_a_test_holds_a_technique_against_the_budgets_of_the_scene(here: Path, write: Write, run: Run) -> None:
    write(name="scenes/tiny")
    put(
        "tests/test_mine.py",
        """
def test_passes(lightgauge):
    result = lightgauge.check("../scenes/tiny.toml", "indirect.irradiance")
    assert result.verdict == "PASS"
    assert result.criteria[0].place.startswith("scenes/tiny.toml:")
""",
    )
    run("tests").assert_outcomes(passed=1)
    assert names_in(here) == [f"tiny/{name}" for name in [*PARITY, JUDGED]]


def test_a_budget_of_a_test_replaces_that_of_the_scene_and_fails_with_the_line_of_the_test(
    here: Path, write: Write, run: Run
) -> None:
    write()
    put(
        "test_mine.py",
        """
        import os
        import pytest

        def test_fails(lightgauge, monkeypatch, tmp_path):
            monkeypatch.chdir(tmp_path)
            lightgauge.check("tiny.toml", "indirect.irradiance", max={"nrmse": 0.001})

        def test_is_caught(lightgauge):
            with pytest.raises(AssertionError, match="FAIL nrmse") as caught:
                lightgauge.check("tiny.toml", "indirect.irradiance", max={"nrmse": 0.001})
            assert caught.value.result.criteria[0].max == 0.001

        def test_also_holds(lightgauge):
            lightgauge.check("tiny.toml", "indirect.talk", fit_exposure=True, max={"nrmse": 9.0})
        """,
    )
    result = run(f"--junitxml={here / 'out.xml'}")
    result.assert_outcomes(passed=2, failed=1)
    result.stdout.fnmatch_lines(
        [
            '>       lightgauge.check("tiny.toml", "indirect.irradiance", max={"nrmse": 0.001})',
            "E       CheckFailed: FAIL nrmse *% [[]*, *], budget ≤ 0.1*%",
            f"E                     test_mine.py:7: {GIVEN}",
            "E       real-time     .lightgauge/pytest-report/images/tiny-*.png",
            "E       again         pytest test_mine.py::test_fails",
            "*test_mine.py:7: CheckFailed",
            "FAILED test_mine.py::test_fails - CheckFailed: FAIL nrmse *",
        ]
    )
    assert "pytest_plugin.py" not in result.stdout.str()
    assert "lightgauge run" not in result.stdout.str()
    assert names_in(here)[-1] == "tiny/indirect.talk[fitted]"
    names = {p.attrib["name"] for p in ElementTree.parse(here / "out.xml").iter("property")}
    assert "tiny/indirect.talk[fitted]/nrmse/max" in names


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ('"tiny.toml", "indirect.irradiancy"', "Unknown technique 'indirect.irradiancy'"),
        ('"tiny.toml", "indirect.talk"', "has no check indirect.talk; its checks are raster.normal"),
        ('"tiny.toml", "indirect.irradiance", {"side": 25}', "has no check indirect.irradiance[side=25]"),
        ('"tiny.toml", "indirect.irradiance", {"sides": 25}, max={"nrmse": 1.0}', "has no setting 'sides'"),
        ('"tiny.toml", "indirect.irradiance", max=0.1', "max: found 0.1; allowed is a dict by name"),
        ('"tiny.toml", "indirect.irradiance", max=0.0', "max: found 0.0; allowed is a dict by name"),
        ('"tiny.toml", "indirect.irradiance", "side=24"', "settings: found 'side=24'; allowed is a dict by name"),
        ('"tiny.toml", "indirect.irradiance", max={"nmrse": 1.0}', "unknown metric 'nmrse'"),
        ('"tiny.toml", "indirect.irradiance", max={"nrmse": float("nan")}', "should be a finite number"),
        ('"tiny.toml", "indirect.irradiance", max={"nrmse": 0.1}, min={"nrmse": 0.2}', "must not exceed max"),
        ('"absent.toml", "indirect.irradiance"', "absent.toml: the scene cannot be read"),
        ('"smal-room-knot", "indirect.irradiance"', "unknown scene"),
    ],
)
def test_what_cannot_be_judged_is_no_failed_assertion(
    here: Path, write: Write, run: Run, arguments: str, said: str
) -> None:
    write()
    put(
        "test_mine.py",
        f"""
        import pytest

        def test_one(lightgauge):
            try:
                lightgauge.check({arguments})
            except AssertionError:
                pass
        """,
    )
    result = run()
    result.assert_outcomes(failed=1)
    (line,) = [line for line in result.outlines if line.startswith("E  ")]
    assert "CheckError: " in line
    assert said in line
    assert [line for line in result.outlines if ".py:" in line and "FAILED" not in line] == [
        "test_mine.py:6: CheckError"
    ]


def test_an_error_of_a_check_is_no_failed_assertion(here: Path, write: Write, run: Run) -> None:
    write(("position = [0.1, 0.0, 0.0]", "position = [0.1, 0.0, 1.4]"))  # behind the camera
    put(
        "test_mine.py",
        """
        import pytest

        @pytest.mark.xfail(raises=AssertionError)
        def test_one(lightgauge):
            lightgauge.check("tiny.toml", "indirect.irradiance")
        """,
    )
    result = run()
    result.assert_outcomes(failed=1)
    result.stdout.fnmatch_lines(["E*CheckError: ERROR Parity of this scene could not be judged*"])


def test_own_techniques_are_loaded_before_scenes_are(
    here: Path, write: Write, run: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    loaded: list[Path] = []
    monkeypatch.setattr("realtime.own.load_own", loaded.append)
    write()
    put("mine/one.frag", "")
    put("pytest.ini", "[pytest]\nlightgauge_techniques = mine/*.frag")
    run("--collect-only", "tiny.toml")
    assert loaded == [here / "mine" / "one.frag"]


def test_bounds_that_a_test_does_not_give_stay() -> None:
    case = case_of("small-room-knot", Path(), Asked("indirect.talk", max={"nrmse": 2.0, "flip": 0.5}))
    (nrmse, flip) = [c for c in case.check.criteria if c.reason == GIVEN]
    own = case_of("small-room-knot", Path(), Asked("indirect.talk")).check
    assert (nrmse.metric, nrmse.max, nrmse.min) == ("nrmse", 2.0, own.criteria[0].min)
    assert (flip.metric, flip.max, flip.min) == ("flip", 0.5, None)
    assert case.check.settings == own.settings
    assert case.request.argument == "small-room-knot"


def test_of_several_checks_the_settings_say_which() -> None:
    with pytest.raises(InputError, match=r"several such checks: .* Say which one is meant with settings="):
        case_of("small-room-knot", Path(), Asked("indirect.talk", fit_exposure=True))


@pytest.mark.slow
def test_workers_of_xdist_share_a_store_and_a_report(here: Path, write: Write) -> None:
    write(name="a")
    write(("max = 0.5", "max = 0.001"), name="b")
    command = [sys.executable, "-m", "pytest", "--lightgauge", "-n", "2", "--dist", "loadfile"]
    said = subprocess.run(command, capture_output=True, text=True, check=False).stdout
    assert "9 PASS, 1 FAIL. Report: .lightgauge/pytest-report/index.html" in said
    assert "1 failed, 9 passed" in said
    assert sorted(names_in(here)) == sorted(f"{scene}/{name}" for scene in "ab" for name in [*PARITY, JUDGED])


def test_results_that_several_workers_have_are_shown_once(finished: Path) -> None:
    checks = json.loads((finished / "report" / "results.json").read_text(encoding="utf-8"))["checks"]
    one, other = (CheckResult.from_json(check) for check in checks[:2])
    elsewhere = replace(one, rerun="lightgauge run b/tiny.toml")
    shown = list(pytest_judge.distinct([one, other, replace(one, cached=True), elsewhere]))
    assert [r.id for r in shown] == [one.id, other.id, one.id.replace("tiny/", "tiny (2)/")]
