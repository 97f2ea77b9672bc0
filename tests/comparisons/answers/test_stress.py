"""`lightgauge stress` as a user sees it: a table, what is new about it, files, an exit status."""

import json
import math
import shlex
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, ClassVar

import pytest

from comparisons.answers.stress import PARTIAL, Part, chosen, content_of, run_stress, stress_lines
from comparisons.report.stress_page import write_stress_page
from comparisons.stress.result import Outcome, Trial
from comparisons.stress.tables import table_lines, tables
from scenes.errors import InputError, RenderError

Run = Callable[..., Any]


def outcome(subject: str, stress: str, *errors: float, **others: Any) -> Outcome:
    """Magnitudes 1, 10, 100, ... with these errors, the last of which may exceed the tolerance of 0.1."""
    trials = tuple(Trial(10.0**n, error) for n, error in enumerate(errors))
    failing = trials[-1].magnitude if errors and errors[-1] > 0.1 else None
    again = "" if failing is None else f"lightgauge stress {subject} --stress {stress} --at {failing:g}"
    return Outcome(subject, stress, "rms", 0.1, trials, failing, again, **others)


FOUND = [
    outcome("shadow.soft", "offset", 0.0, 0.0),
    outcome("shadow.soft", "rotation", 0.0, 0.2, limit=10.0, why="Texels turn with the world."),
    outcome("shadow.soft", "aperture", unfit="the camera is a pinhole"),
    outcome("shadow.vcm", "offset", 0.0, 0.3),
    outcome("shadow.vcm", "rotation", 0.0, 0.0, limit=10.0, why="Texels turn with the world."),
    outcome("shadow.vcm", "aperture", 0.0, unfit="refused at 10"),
    outcome("lib/refract.glsl:refract_talk", "fp16", 0.5),
]

MEANINGS = {"offset": "moved away [viewing distances]", "rotation": "turned", "aperture": "closed", "fp16": "rounded"}


def test_techniques_and_functions_have_tables_of_their_own() -> None:
    techniques, functions = tables(FOUND)
    assert techniques.subjects == ("shadow.soft", "shadow.vcm")
    assert functions.subjects == ("lib/refract.glsl:refract_talk",)
    assert [line.split() for line in table_lines(techniques)] == [
        ["offset", "rotation", "aperture"],
        ["shadow.soft", "-", "10", "n/a"],
        ["shadow.vcm", "10*", "-+", "(1)"],
    ]


def test_a_wide_table_is_cut_into_blocks() -> None:
    """You should see every column once, each with the names of the subjects beside it."""
    (table,) = tables(FOUND[:6])
    lines = list(table_lines(table, width=32))
    assert max(map(len, lines)) <= 32
    assert [line.split() for line in lines if not line.startswith("shadow")] == [
        ["offset", "rotation"],
        [],
        ["aperture"],
    ]
    assert sum(line.startswith("shadow.soft") for line in lines) == 2


def test_what_is_new_is_said_with_the_command_that_shows_it_again() -> None:
    lines = list(stress_lines(FOUND))
    at = lines.index("BROKEN shadow.vcm, offset at 10: 0.3 rms; 0.1 is allowed")
    assert lines[at + 1] == "  again: lightgauge stress shadow.vcm --stress offset --at 10"
    assert any(line.startswith("STALE shadow.vcm, rotation: documented to break from 10 on") for line in lines)
    assert not any("shadow.soft, rotation" in line for line in lines)
    assert (
        lines[-1]
        == "2 holds, 1 breaks where it is documented to, 2 breaks, 1 holds further than is documented, 1 not applicable"
    )


@pytest.mark.usefixtures("gl")
def test_the_page_shows_each_break_with_its_trials_its_limit_and_its_reproducer(tmp_path: Path) -> None:
    page = write_stress_page(tmp_path, FOUND, content_of(FOUND, MEANINGS, "2026-01-31T12:00:00+00:00", 1.0)).read_text(
        "utf-8"
    )
    assert "2 of 6 break where no limit is documented, 1 break at their documented limit, 3 hold" in page
    for text in (
        "Texels turn with the world.",
        "shadow.vcm --stress offset --at 10",
        "the camera is a pinhole",
        "moved away",
    ):
        assert text in page
    assert 'href="#shadow.vcm-offset"' in page
    assert 'id="shadow.vcm-offset"' in page


def test_names_may_be_patterns_and_unknown_ones_are_refused() -> None:
    (part,) = chosen(["cornea.*_uv"], ["scale-*", "offset"], None)
    assert part.subjects == ("cornea.talk_uv", "cornea.anatomical_uv")
    assert part.stresses == ("scale-up", "scale-down", "offset")
    with pytest.raises(InputError, match=r"Unknown technique or function 'cornea\.uv'.*Did you mean 'cornea\.talk_uv'"):
        chosen(["cornea.uv"], [], None)
    with pytest.raises(InputError, match=r"Unknown stress 'ofset'.*Did you mean 'offset'"):
        chosen([], ["ofset"], None)


def test_a_stress_that_is_for_none_of_the_subjects_is_refused() -> None:
    """You should not be told that all is well where nothing was done."""
    for subjects in (["indirect.talk"], ["indirect.talk", "lib/refract.glsl:refract_talk"]):
        with pytest.raises(InputError, match=r"'indirect\.talk' is under none of these stresses"):
            chosen(subjects, ["random"], None)
    with pytest.raises(InputError, match="'offset' is for none of these subjects"):
        chosen(["lib/refract.glsl:*"], ["offset", "fp16"], None)


@pytest.mark.parametrize(
    ("subject", "stress", "at"),
    [
        ("cornea.talk", "rotation", math.nan),
        ("cornea.talk", "scale-up", math.inf),
        ("cornea.talk", "scale-down", 0.0),
        ("cornea.talk", "few-pixels", 0),
        ("cornea.talk", "significand", 23),
        ("defocus.layers", "aperture", -1),
        ("lib/refract.glsl:refract_talk", "fp16", 2),
    ],
)
def test_a_magnitude_beyond_the_range_of_a_stress_is_refused(subject: str, stress: str, at: float) -> None:
    with pytest.raises(InputError, match=f"--at {at:g} is no magnitude of {stress}, which goes from"):
        chosen([subject], [stress], at)


def test_a_fault_is_told_though_the_error_is_small() -> None:
    """You should see why an input fails whose error is allowed: a decision that falls otherwise."""
    trial = Trial(2, 0.0, "3 % of inputs decide otherwise")
    found = Outcome("lib/disk.glsl:disk_hit", "extremes", "of 1", 0.0, (trial,), 2, "lightgauge stress ...")
    assert "BROKEN lib/disk.glsl:disk_hit, extremes at 2: 3 % of inputs decide otherwise" in stress_lines([found])


@pytest.mark.usefixtures("here", "gl")
def test_the_command_writes_its_files_and_passes(lightgauge: Run) -> None:
    ran = lightgauge("stress", "raster.normal", "--stress", "scale-*", "-o", "out")
    assert ran.status == 0, ran.err
    assert [line.split() for line in ran.out.splitlines()[:2]] == [
        ["scale-up", "scale-down"],
        ["raster.normal", "-", "-"],
    ]
    found = json.loads(Path("out/stress.json").read_text("utf-8"))
    assert [(o["stress"], o["standing"]) for o in found["outcomes"]] == [("scale-up", "HOLDS"), ("scale-down", "HOLDS")]
    assert found["environment"]["gl_renderer"]
    assert Path("out/index.html").is_file()
    assert Path("out/assets/style.css").is_file()


@pytest.mark.usefixtures("here", "gl")
def test_one_magnitude_alone_shows_a_failure_again(lightgauge: Run) -> None:
    """Positions in half floats, as published: the talk's thickness breaks where the subject is off the origin."""
    ran = lightgauge("stress", "translucency.talk_thickness", "--stress", "offset", "--at", "10")
    (found,) = json.loads(Path("stress/stress.json").read_text("utf-8"))["outcomes"]
    assert [trial["magnitude"] for trial in found["trials"]] == [10]
    assert found["first_failing"] == 10
    assert ran.status == 0, "it is documented"
    assert found["why"]


@pytest.mark.usefixtures("here", "gl", "techniques_forgotten")
def test_a_failure_of_ones_own_technique_is_shown_again_by_its_command(lightgauge: Run) -> None:
    """You should see the same first failure when the command is run that the first run gave."""
    file = Path(__file__).parents[3] / "docs" / "examples" / "ambient_cube.py"
    lightgauge("stress", "--technique", str(file), "--stress", "rotation")
    (first,) = json.loads(Path("stress/stress.json").read_text("utf-8"))["outcomes"]
    ran = lightgauge(*shlex.split(first["reproduce"])[1:], "-o", "again")
    (again,) = json.loads(Path("again/stress.json").read_text("utf-8"))["outcomes"]
    assert (ran.status, again["first_failing"]) == (1, first["first_failing"])
    assert again["trials"] == first["trials"]


class Module:
    """Stands for one of `comparisons.stress`: its subjects hold, but for what `faults` has for them."""

    __name__ = "module"
    STRESSES: ClassVar = {"offset": "moved"}

    def __init__(self, **faults: BaseException) -> None:
        self.faults = faults
        self.drawn: list[str] = []

    def outcomes(self, subjects: list[str], step: Any, stresses: Any, at: float | None) -> Iterator[Outcome]:
        for name in subjects:
            if name in self.faults:
                raise self.faults[name]
            self.drawn.append(name)
            yield outcome(name, "offset", 0.0, 0.05)


def run(module: Module, folder: Path) -> tuple[list[str], int]:
    return run_stress([Part(module, ("first", "second", "third"), ("offset",), None)], folder, lambda what, done: None)


def test_one_that_is_cut_off_goes_on_where_it_was(tmp_path: Path, gl: object) -> None:
    with pytest.raises(KeyboardInterrupt):
        run(Module(second=KeyboardInterrupt()), tmp_path)
    assert (tmp_path / PARTIAL).exists()
    again = Module()
    _, status = run(again, tmp_path)
    assert again.drawn == ["second", "third"]
    assert status == 0
    assert not (tmp_path / PARTIAL).exists()
    kept = json.loads((tmp_path / "stress.json").read_text(encoding="utf-8"))["outcomes"]
    assert [one["subject"] for one in kept] == ["first", "second", "third"]


def test_one_that_cannot_be_drawn_stops_no_other(tmp_path: Path, gl: object) -> None:
    module = Module(second=RenderError("The shader does not compile."))
    lines, status = run(module, tmp_path)
    assert module.drawn == ["first", "third"]
    assert status == RenderError.exit_status
    assert "left out: second. The shader does not compile." in lines
