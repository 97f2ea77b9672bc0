"""The command line as an impatient user meets it: one clear paragraph and the right exit status for every mistake."""

import json
import os
import re
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from comparisons import cli
from scenes.errors import NoGraphics

Run = Callable[..., Any]
Write = Callable[..., Path]

CHECK = '"indirect.irradiance"\nsettings = { side = 24 }'
CONTROL = re.compile(r"[\x00-\x09\x0b-\x1f\x7f]")


def is_one_paragraph(text: str) -> bool:
    return text.startswith("lightgauge: ") and text.count("\n") == 1 and "Traceback" not in text


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["run", "smal-room-knot"], ["unknown scene", "small-room-knot"]),
        (["explain", "smal-room-knot"], ["unknown scene", "small-room-knot"]),
        (["run", "small-room-knott.toml"], ["No such file", "Close to it: small-room-knot"]),
        (["run", "gone/scene.toml"], ["gone/scene.toml", "No such file", "a name from the library"]),
        (["run", ""], ["unknown scene"]),
        (["run", "tiny.toml", "-k", "nothing"], ["No check of tiny.toml matches 'nothing'", "lightgauge list"]),
        (["run", "tiny.toml", "-o", "tiny.toml/report"], ["output folder 'tiny.toml/report'", "-o FOLDER"]),
        (["run", "tiny.toml", "-o", "tiny.toml"], ["output folder 'tiny.toml'", "-o FOLDER"]),
        (["run", "tiny.toml", "--store", "tiny.toml/store"], ["store 'tiny.toml/store'", "--store FOLDER"]),
        (["report", "gone"], ["'gone' does not exist", "lightgauge run -o FOLDER"]),
        (["report", "folder.toml"], ["'folder.toml/results.json' does not exist"]),
        (["report", "tiny.toml"], ["cannot be read as the results of a run"]),
    ],
)
def test_a_mistaken_argument_is_said_in_one_paragraph(
    here: Path, lightgauge: Run, write_scene: Write, arguments: list[str], said: list[str]
) -> None:
    write_scene()
    (here / "folder.toml").mkdir()
    write_scene(name="folder.toml/tiny")
    outcome = lightgauge(*arguments)
    assert (outcome.status, outcome.out) == (3, "")
    assert is_one_paragraph(outcome.err)
    assert all(part in outcome.err for part in said), outcome.err
    assert not (here / ".lightgauge").exists() or not any((here / ".lightgauge").iterdir()), "nothing was rendered"


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ([], "required: COMMAND"),
        (["frobnicate"], "invalid choice: 'frobnicate'"),
        (["run", "--frobnicate"], "unrecognized arguments: --frobnicate"),
        (["run", "-k"], "expected one argument"),
        (["explain"], "required: scene"),
        (["explain", "a", "b"], "unrecognized arguments: b"),
        (["report"], "required: RUN"),
    ],
)
def test_a_wrong_option_has_the_status_of_bad_input(lightgauge: Run, arguments: list[str], said: str) -> None:
    outcome = lightgauge(*arguments)
    assert (outcome.status, outcome.out) == (3, "")
    assert said in outcome.err
    assert "--help" in outcome.err


COMMANDS = ["list", "explain", "run", "report", "accept", "diff", "selftest", "calibrate", "store", "doctor"]


@pytest.mark.parametrize("command", COMMANDS)
def test_the_help_of_each_command_shows_an_example(lightgauge: Run, command: str) -> None:
    outcome = lightgauge(command, "--help")
    assert outcome.status == 0
    assert re.search(rf"examples?:\n  lightgauge {command}\b", outcome.out)


def test_the_help_tells_the_exit_statuses_and_every_command(lightgauge: Run) -> None:
    outcome = lightgauge("--help")
    assert outcome.status == 0
    assert "0 all checks pass, 1 a budget is exceeded or an error has regressed, 2 inconclusive" in outcome.out
    assert all(f"lightgauge {name}" in outcome.out for name in COMMANDS)


@pytest.mark.parametrize("command", ["run", "explain"])
@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("fov_deg = 30.0", "fov = 30.0", ["tiny.toml:9", "sensor.fov", "unknown key"]),
        ("fov_deg = 30.0", "fov_deg = 300.0", ["tiny.toml:9", "sensor.fov_deg", "300", "< 180"]),
        ("title =", "title", ["tiny.toml:1", "not TOML"]),
        (
            'type = "sphere"\nradius = 0.3\ndetail = 3',
            'type = "mesh"\npath = "gone.obj"',
            ["tiny.toml:27", "shapes[1].path", '"gone.obj"', "no file"],
        ),
        ("side = 24", "side = nan", ["checks[0].settings.side", "nan", "a finite number"]),
        (
            CHECK,
            '"indirect.irradience"',
            ["tiny.toml:39: checks[0].technique", "technique 'indirect.irradience'", "Did you mean"],
        ),
        (
            'quantity = "indirect_radiance"',
            'quantity = "indirect"',
            ["tiny.toml:38: checks[0].quantity", "quantity 'indirect'"],
        ),
        ('"nrmse"', '"nmse"', ["tiny.toml:41: checks[0].criteria[0].metric", "metric 'nmse'", "nrmse"]),
        ("side = 24", "sides = 24", ["tiny.toml:40: checks[0].settings", "no setting 'sides'", "side"]),
        ("side = 24", 'side = "24"', ["tiny.toml:40: checks[0].settings", "Setting 'side'", "'24'", "int"]),
        (
            CHECK,
            '"raster.normal"',
            ["tiny.toml:39: checks[0].technique", "approximates 'normal'", "'indirect_radiance'"],
        ),
        (', reason = "far above what is reached"', "", ["checks[0].criteria[0].reason"]),
        ("max = 0.5", "min = 0.5", ["tiny.toml:41: checks[0].criteria[0].metric", "only min", "Give max"]),
    ],
)
def test_a_mistake_in_a_scene_is_said_with_its_file(
    here: Path, lightgauge: Run, write_scene: Write, command: str, old: str, new: str, said: list[str]
) -> None:
    write_scene((old, new))
    outcome = lightgauge(command, "tiny.toml")
    assert (outcome.status, outcome.out) == (3, "")
    assert all(part in outcome.err for part in said), outcome.err
    assert "Traceback" not in outcome.err
    assert not (here / "report").exists()


def test_all_mistakes_in_checks_are_said_at_once(lightgauge: Run, write_scene: Write) -> None:
    write_scene(("side = 24", "sides = 24"), ('"nrmse"', '"nmse"'))
    said = lightgauge("run", "tiny.toml").err
    assert "no setting 'sides'" in said
    assert "metric 'nmse'" in said


def test_a_mesh_that_cannot_be_used_is_an_error_of_its_scene(here: Path, lightgauge: Run, write_scene: Write) -> None:
    (here / "empty.obj").write_text("v 0 0 0\n")
    write_scene(('type = "sphere"\nradius = 0.3\ndetail = 3', 'type = "mesh"\npath = "empty.obj"'))
    outcome = lightgauge("run", "tiny.toml")
    assert outcome.status == 3
    assert "empty.obj" in outcome.out
    assert outcome.out.count("(for the same reason)") == 3
    assert lightgauge("explain", "tiny.toml").status == 3


@pytest.mark.usefixtures("after_a_run")
def test_a_scene_that_is_named_twice_is_run_once(here: Path, lightgauge: Run) -> None:
    outcome = lightgauge("run", "tiny.toml", "tiny.toml", "./tiny.toml", str(here / "tiny.toml"))
    assert outcome.status == 0
    assert outcome.out.count("[5/5]") == 1


def test_a_path_with_a_space_is_quoted_in_the_command_to_repeat(
    after_a_run: Path, lightgauge: Run, write_scene: Write
) -> None:
    write_scene(name="my scene")
    assert lightgauge("run", "my scene.toml").status == 0
    checks = json.loads((after_a_run / "report" / "results.json").read_text())["checks"]
    assert checks[0]["rerun"] == "lightgauge run 'my scene.toml' -k '/raster.normal$'"


def test_a_report_is_written_again_from_its_results(after_a_run: Path, lightgauge: Run) -> None:
    page = after_a_run / "report" / "index.html"
    before = page.read_text(encoding="utf-8")
    for argument in ("report", "report/results.json"):
        page.unlink()
        outcome = lightgauge("report", argument)
        assert (outcome.status, outcome.out) == (0, "report/index.html\n")
        assert page.read_text(encoding="utf-8") == before


@pytest.mark.parametrize(
    ("content", "said"),
    [
        ("", "cannot be read"),
        ("[]", "not the results of a run"),
        ("{}", "not the results of a run"),
        ('{"schema": 1, "checks": 5}', "not the results of a run"),
        ('{"schema": 1, "checks": [5]}', "not the results of a run"),
        ('{"schema": 1, "checks": [{}]}', "Check 1 of these results lacks id"),
        ('{"schema": 2, "checks": []}', "schema 2"),
        ("\xff", "cannot be read"),
    ],
)
def test_results_that_are_none_are_refused(here: Path, lightgauge: Run, content: str, said: str) -> None:
    (here / "results.json").write_text(content, encoding="latin-1")
    outcome = lightgauge("report", ".")
    assert (outcome.status, outcome.out) == (3, "")
    assert is_one_paragraph(outcome.err)
    assert said in outcome.err
    assert not (here / "index.html").exists()


def test_the_list_names_everything_there_is(lightgauge: Run) -> None:
    outcome = lightgauge("list")
    assert outcome.status == 0
    sections = re.findall(r"^(\w+):$", outcome.out, flags=re.MULTILINE)
    assert sections == ["scenes", "techniques", "quantities", "metrics"]
    for name in ("small-room-knot", "indirect.talk", "indirect_radiance", "nrmse"):
        assert re.search(rf"^  {re.escape(name)}  +\S", outcome.out, flags=re.MULTILINE)


def test_a_technique_is_explained_by_the_command(lightgauge: Run) -> None:
    outcome = lightgauge("explain", "small-room-knot")
    assert outcome.status == 0
    assert outcome.out.startswith("small-room-knot: ")


def test_where_there_is_no_terminal_every_finished_check_is_a_numbered_line(
    here: Path, lightgauge_apart: Run, write_scene: Write
) -> None:
    write_scene()
    outcome = lightgauge_apart("run", "tiny.toml")
    assert (outcome.status, outcome.err) == (0, "")
    lines = outcome.out.splitlines()
    assert [line[:5] for line in lines if line.startswith("[")] == [f"[{i}/5]" for i in range(1, 6)]
    assert lines[-1].startswith("5 PASS in ")
    assert lines[-1].endswith("Report: report/index.html")
    assert not CONTROL.search(outcome.out)


@pytest.fixture
def terminal() -> Iterator[tuple[int, int]]:
    """Both ends of a pseudo-terminal: ours, and that of the process."""
    try:
        ends = os.openpty()
    except OSError:
        pytest.skip("this machine has no pseudo-terminals")
    yield ends
    for end in ends:
        os.close(end)


def test_on_a_terminal_a_bar_leaves_the_same_lines(after_a_run: Path, start: Run, terminal: tuple[int, int]) -> None:
    ours, theirs = terminal
    process = start("run", "tiny.toml", environment={"TERM": "xterm", "COLUMNS": "200"}, stderr=theirs)
    out, _ = process.communicate(timeout=60)
    shown = os.read(ours, 1 << 16).decode(errors="replace")
    assert process.returncode == 0
    assert "\x1b[" in shown
    assert "[5/5] PASS" in shown
    assert "Traceback" not in shown
    assert out.startswith("5 of 5 checks found finished in .lightgauge\nVerdicts took")
    assert "\n5 PASS" in out


def test_without_a_device_for_opengl_the_packages_to_install_are_named(
    lightgauge_apart: Run, write_scene: Write
) -> None:
    write_scene()
    outcome = lightgauge_apart(
        "run", "tiny.toml", before="import moderngl\ndel moderngl.create_context  # as good as none: it raises"
    )
    assert outcome.status == 4
    assert is_one_paragraph(outcome.err)
    assert "No OpenGL context" in outcome.err
    assert "libegl1" in outcome.err


def test_without_a_compiler_it_is_said_how_to_get_one(lightgauge_apart: Run, write_scene: Write) -> None:
    write_scene()
    outcome = lightgauge_apart("run", "tiny.toml", environment={"DRJIT_LIBLLVM_PATH": "gone/libLLVM.so"})
    assert outcome.status == 4
    assert is_one_paragraph(outcome.err)
    assert "'gone/libLLVM.so', which is not a file" in outcome.err
    assert "make setup" in outcome.err


def test_a_reader_that_leaves_early_is_no_success(start: Run) -> None:
    process = start("list")
    process.stdout.close()
    err = process.stderr.read()
    process.stderr.close()
    assert process.wait(timeout=60) == cli.BROKEN_PIPE
    assert err == ""


def test_an_encoding_without_the_signs_of_mathematics_does_not_end_a_run(
    after_a_run: Path, lightgauge_apart: Run
) -> None:
    outcome = lightgauge_apart("run", "tiny.toml", environment={"PYTHONIOENCODING": "ascii"})
    assert (outcome.status, outcome.err) == (0, "")
    assert "budget ? 50" in outcome.out


def raising(error: BaseException) -> Callable[..., Any]:
    def refuse(*arguments: Any, **options: Any) -> Any:
        raise error

    return refuse


@pytest.mark.parametrize(
    ("error", "status", "said"),
    [
        (OSError(28, "No space left on device", "report"), 4, "No space left on device: 'report'"),
        (NoGraphics("nothing to draw with"), 4, "nothing to draw with"),
        (KeyboardInterrupt(), 130, "interrupted"),
    ],
)
def test_what_goes_wrong_on_the_way_is_one_line(
    after_a_run: Path, lightgauge: Run, monkeypatch: pytest.MonkeyPatch, error: BaseException, status: int, said: str
) -> None:
    monkeypatch.setattr("comparisons.results.write_run", raising(error))
    outcome = lightgauge("run", "tiny.toml")
    assert outcome.status == status
    assert is_one_paragraph(outcome.err)
    assert said in outcome.err


def test_a_fault_of_the_program_is_not_the_status_of_a_failed_check(
    after_a_run: Path, lightgauge: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("comparisons.results.write_run", raising(ZeroDivisionError("oops")))
    outcome = lightgauge("run", "tiny.toml")
    assert outcome.status == 4
    assert "ZeroDivisionError: oops" in outcome.err
    assert outcome.err.splitlines()[-1].startswith("lightgauge: this is a fault of lightgauge itself")
