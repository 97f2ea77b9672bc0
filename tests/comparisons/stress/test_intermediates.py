"""Techniques whose shaders are watched, and those that compute in fewer bits."""

from dataclasses import replace
from pathlib import Path

import pytest

from comparisons.stress.intermediates import STRESSES, Watched, outcomes, subjects
from comparisons.stress.laws import Case
from comparisons.stress.slivers import with_meshes
from comparisons.stress.techniques import outcome, small, subject_of
from realtime.techniques import MODULES
from scenes.load import library_scenes, load_scene

pytestmark = pytest.mark.usefixtures("gl")


def test_outcomes_are_those_of_the_subjects_asked_for() -> None:
    asked = list(outcomes(["raster.depth"], lambda what, done: None, at=16, stresses=["significand"]))
    assert [(o.subject, o.stress) for o in asked] == [("raster.depth", "significand")]
    assert asked[0].trials[0].error == pytest.approx(4e-5, rel=0.5)
    assert set(MODULES) <= set(subjects())


def test_fewer_bits_are_harsher() -> None:
    made = outcome(subject_of("cornea.talk_uv"), "significand", STRESSES["significand"])
    errors = [trial.error for trial in made.trials if trial.error is not None]
    assert errors == sorted(errors)
    assert made.first_failing == 10
    assert not made.is_rising
    assert made.reproduce == "lightgauge stress cornea.talk_uv --stress significand --at 10"


def test_half_precision_is_judged_by_pixels() -> None:
    """float16 tells depths 2^-11 apart from one another: no pixel of a depth is off by more than a few such steps."""
    made = outcome(subject_of("raster.depth"), "fp16", STRESSES["fp16"])
    median, most = (trial.error for trial in made.trials)
    assert median is not None
    assert most is not None
    assert 2**-13 < median < most < 2**-6


def test_a_fault_names_the_place() -> None:
    subject = subject_of("cornea.talk")
    scene = small(load_scene(library_scenes()["eye-talk-view75"]))
    watched = replace(subject, case=Case(scene, {"branching": False}))
    made = outcome(watched, "intermediates", STRESSES["intermediates"], 1)
    assert made.first_failing == 1
    assert made.trials[0].fault.startswith("lib/sphere.glsl:7: sqrt(disc) is NaN, made in ")


def test_settings_of_the_sweep_are_watched_too() -> None:
    """Magnitude 2 goes through them: the eye computes both its surfaces only where it does not branch."""
    subject = subject_of("cornea.talk")
    scene = small(load_scene(library_scenes()["eye-talk-view75"]))
    made = outcome(replace(subject, case=Case(scene, {})), "intermediates", STRESSES["intermediates"])
    assert [trial.magnitude for trial in made.trials] == [1, 2]
    assert [trial.error for trial in made.trials] == [0, None]


@pytest.mark.parametrize(
    ("name", "scene"),
    [
        ("translucency.additive_thickness", "skin-fingers"),
        ("shadow.vcm_analytic", "shadow-odd-angles"),
    ],
)
def test_faces_that_are_hardly_there_hide_no_nan(name: str, scene: str, tmp_path: Path) -> None:
    """Slivers have no normal, and rasterisers interpolate NaN on them, which max(x, 0) made into nothing."""
    subject = subject_of(name)
    cut = with_meshes(small(load_scene(library_scenes()[scene])), tmp_path, 1e-6)
    watched = Watched(subject.technique, subject.case, subject.unit)
    watched.draw(Case(cut, {}))
    assert watched.found == []


@pytest.mark.slow
@pytest.mark.parametrize("name", [name for name in MODULES if "talk" not in name])
def test_our_own_shaders_hold_no_number_that_is_not_finite(name: str) -> None:
    """On the technique's own scene; `lightgauge stress` looks at all settings, scenes and stresses, for minutes."""
    made = outcome(subject_of(name), "intermediates", STRESSES["intermediates"], at=1)
    assert made.first_failing is None, made.trials[-1].fault
