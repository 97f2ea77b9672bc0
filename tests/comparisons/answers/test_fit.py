"""What `lightgauge fit` says, and what it refuses."""

import json
import tomllib
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from comparisons.answers.fit import Asked, lines_of, task_of, toml_of
from comparisons.cli import main
from comparisons.fit.gain import Gain
from comparisons.fit.result import Fit, Fitted, Score
from comparisons.metrics import Estimate
from scenes.errors import InputError

GREY = """\
/*
name = "mine.grey"
approximates = "albedo"
summary = "one grey for everything"
source = "none"
limits = "knows no colour"
draws = "everything"
grid = 1

[parameters.level]
default = 0.2
bounds = [0.0, 1.0]
tuned = [0.0, 1.0]
summary = "reflectance"
*/
#version 430
#include "own/interface.glsl"
uniform float level;
void main() { color = vec4(vec3(level), 1.0); }
"""

TRAINED = Score(
    "room", 64, {"c_height": 1.5}, 1.0, Estimate(0.4, 0.39, 0.41), Estimate(0.2, 0.19, 0.21), Gain(0.75, 0.74, 0.76), ""
)
FIT = Fit(
    technique="indirect.talk",
    quantity="indirect_radiance",
    metric="nrmse",
    pinned={"side": 64},
    parameters=(Fitted("c_height", 2.5, 1.5, 0.0, 10.0, "", has_effect=True),),
    exposure=None,
    train=(TRAINED,),
    held_out=(replace(TRAINED, scene="hall", gain=Gain(0.12, 0.11, 0.13)),),
    in_turn=False,
    train_gain=Gain(0.75, 0.74, 0.76),
    held_out_gain=Gain(0.12, 0.11, 0.13),
    exposure_gain=None,
    drawings=40,
    seconds=12.0,
    failed=(0, ""),
    gl_renderer="llvmpipe",
)


def asked(subject: str, *parameters: str, **others: Any) -> Asked:
    given: dict[str, Any] = {"with_exposure": False, "metric": "nrmse", "spp": 64, "evaluations": None}
    return Asked(subject, ("a",), (), parameters, file=Path("fit.json"), **(given | others))


def text(fit: Fit) -> str:
    return "\n".join(lines_of(fit)).replace("\u202f", " ").replace("−", "-")


def test_published_and_fitted_values_stand_beside_their_range() -> None:
    assert "  c_height  2.5        1.5     0 to 10" in text(FIT).splitlines()


def test_a_gain_that_carries_over_is_told_with_its_interval() -> None:
    assert "The gain carries over to held-out scenes: squared nrmse 12.0 % [11.0, 13.0] lower." in text(FIT)


def test_a_loss_is_told_as_one() -> None:
    loss = Gain(-0.12, -0.13, -0.11)
    said = text(replace(FIT, held_out_gain=loss))
    assert "Over-fitted to room: on held-out scenes, squared nrmse 12.0 % [11.0, 13.0] higher." in said


def test_a_small_gain_is_called_none_and_an_open_one_open() -> None:
    assert "No gain on held-out scenes that matters" in text(replace(FIT, held_out_gain=Gain(0.0, -0.01, 0.009)))
    assert "Undecided on held-out scenes" in text(replace(FIT, held_out_gain=Gain(0.02, -0.03, 0.07)))
    assert "not told: as published, it may be 0" in text(replace(FIT, held_out_gain=None))


def test_scenes_that_disagree_are_named() -> None:
    worse = replace(TRAINED, scene="cave", gain=Gain(-0.3, -0.4, -0.2))
    said = text(replace(FIT, held_out=(*FIT.held_out, worse)))
    assert "The error falls on hall and rises on cave." in said
    assert "rises on" not in text(FIT)


def test_without_held_out_scenes_that_is_said() -> None:
    assert "was not tested: name some with --test" in text(replace(FIT, held_out=(), held_out_gain=None))
    assert "scenes held out in their turn" in text(replace(FIT, in_turn=True))


def test_a_value_at_the_edge_and_one_without_effect_are_remarked() -> None:
    edge = Fitted("c_height", 2.5, 10.0, 0.0, 10.0, "high", has_effect=True)
    limit = Fitted("far_brightness", 0.2, 1.0, 0.0, 1.0, "high", has_effect=True)
    idle = Fitted("step_rad", 0.2, 0.2, 0.0, 1.0, "", has_effect=False)
    said = text(replace(FIT, parameters=(edge, limit, idle)))
    assert "c_height ended at the high end of its range, 10: a better value may lie beyond." in said
    assert "far_brightness ended at the high end of its range, 1, which is as far as is allowed." in said
    assert "step_rad has no effect on the training scenes and was left at 0.2." in said


def test_what_could_not_be_drawn_or_trusted_is_told() -> None:
    said = text(replace(FIT, failed=(3, "planes out of order"), train=(replace(TRAINED, note="fireflies: few"),)))
    assert "3 settings could not be drawn and were passed over; the last: planes out of order" in said
    assert "room: fireflies: few." in said


def test_the_settings_are_toml_to_paste_into_a_check() -> None:
    parts = (
        *FIT.parameters,
        Fitted("way", "a", "b", None, None, "", True),
        Fitted("on", True, False, None, None, "", True),
    )
    found = tomllib.loads(toml_of(replace(FIT, parameters=parts, exposure=2.83)))
    assert found == {"settings": {"side": 64, "c_height": 1.5, "way": "b", "on": False}}
    assert "image times 2.83" in toml_of(replace(FIT, exposure=2.83))


@pytest.mark.parametrize(
    ("given", "message"),
    [
        (asked("indirect.talkk"), "Unknown technique 'indirect.talkk'"),
        (asked("indirect.talk[fitted]"), "--exposure fits one for all scenes"),
        (asked("indirect.talk", metric="flip"), "compared by nrmse or rel_mse_eps1e-2"),
        (asked("indirect.talk", spp=0), "at least 1 is allowed"),
        (asked("indirect.talk", evaluations=0), "at least 1 is allowed"),
        (asked("indirect.probe"), r"declares no constant as tuned by eye.*--parameters \(it has: side, block"),
        (asked("indirect.talk", "c_hight"), "Did you mean 'c_height'"),
    ],
)
def test_what_cannot_be_asked_is_refused(given: Asked, message: str) -> None:
    with pytest.raises(InputError, match=message):
        task_of(given)


def test_a_folder_is_no_place_for_the_result(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["fit", "indirect.talk", "--on", "small-room-ellipsoid", "-o", str(tmp_path)]) == 3
    assert "is a folder" in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


def test_the_exposure_alone_can_be_asked_for() -> None:
    assert task_of(asked("indirect.probe", with_exposure=True)).parts == ()


@pytest.mark.usefixtures("techniques_forgotten")
def test_a_shader_s_constant_is_fitted_to_what_the_scene_is_made_of(
    after_a_run: Path, write_scene: Callable[..., Path], lightgauge: Callable[..., Any]
) -> None:
    """All reflects 0.7 in all channels in one room, 0.5 in the other."""
    (after_a_run / "grey.frag").write_text(GREY, encoding="utf-8")
    plain, darker = ('walls = { left = "red" }\n', ""), ("[0.7, 0.7, 0.7]", "[0.5, 0.5, 0.5]")
    write_scene(plain, name="light")
    write_scene(plain, darker, name="dark")
    made = lightgauge("fit", "mine.grey", "--technique", "grey.frag", "--on", "light.toml", "--test", "dark.toml")
    assert made.status == 0, made.err
    assert "The gain carries over to held-out scenes" in made.out
    found = json.loads((after_a_run / "fit.json").read_text(encoding="utf-8"))
    assert found["settings"] == {"level": pytest.approx(0.7, abs=0.002)}
    assert found["train"][0]["fitted"]["value"] < 0.003
    assert found["held_out"][0]["gain"]["value"] == pytest.approx(1 - (0.2 / 0.3) ** 2, abs=0.01)
    assert found["gl_renderer"]


def test_scenes_that_overlap_or_lack_the_quantity_are_refused(
    after_a_run: Path, lightgauge: Callable[..., Any]
) -> None:
    overlap = lightgauge("fit", "indirect.talk", "--on", "tiny.toml", "--test", "tiny.toml")
    assert (overlap.status, "is the same scene" in overlap.err) == (3, True)
    lacking = lightgauge("fit", "translucency.talk", "--on", "tiny.toml")
    assert (lacking.status, "transmitted_radiance is not defined here" in lacking.err) == (3, True)
    assert not (after_a_run / "fit.json").exists()
