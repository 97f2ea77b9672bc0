"""Looks that are fitted: the shipped ones hold what is said of them, and a fit finds them again."""

from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest

from comparisons.answers.fit import Asked, fit_lines, require_look, task_of
from comparisons.fit.fitting import fit
from comparisons.fit.result import CARRIES_OVER, Fit
from comparisons.fit.rough import DETAIL, SIDE, rough_scene, rough_technique
from comparisons.metrics import Samples, evaluate
from realtime.own import load_own
from realtime.render import Renderer
from realtime.techniques import technique
from reference.estimator import Reference
from reference.store import Store
from scenes.checks import SettingValue
from scenes.errors import InputError
from scenes.load import find_scene, load_scene
from scenes.model import Scene
from scenes.shapes import Sphere

METRIC = "rel_mse_eps1e-2"
BUDGET = 4e-3
"""Of the relative squared error on lights that took no part in a fit: what is thought good for a look."""

HELD_OUT: dict[str, tuple[float, float, float]] = {
    "blend": (3.14e-3, 1.67e-3, 2.97e-3),
    "plastic": (2.94e-3, 1.66e-3, 3.13e-3),
    "clearcoat": (2.63e-3, 1.4e-3, 1.03e-3),
}
"""The errors of each shipped look with the lights suit-*-held1 to 3, without damping."""

Quiet = Callable[[str, float], None]


def quiet(what: str, fraction: float) -> None:
    """Progress that nobody hears."""


def asked(folder: Path, **changes: Any) -> Asked:
    usual: dict[str, Any] = {
        "subject": "layered.talk[damping=0]",
        "on": ("suit-blend-light1",),
        "test": (),
        "parameters": (),
        "with_exposure": False,
        "metric": METRIC,
        "spp": 1,
        "evaluations": None,
        "file": folder / "fit.json",
    }
    return Asked(**usual | changes)


@pytest.mark.parametrize("light", [1, *(pytest.param(k, marks=pytest.mark.slow) for k in (2, 3))])
@pytest.mark.parametrize("name", HELD_OUT)
def test_a_shipped_look_has_the_error_that_is_said_of_it(mi: ModuleType, tmp_path: Path, name: str, light: int) -> None:
    """Each look with each light that took no part in its fit; none is above what is thought good for a look."""
    scene = load_scene(find_scene(f"suit-{name}-held{light}"))
    truth = Reference(scene, Store(tmp_path), quiet).truth("layered_radiance", 1)
    given: dict[str, SettingValue] = {"look": name, "damping": 0.0}
    image = Renderer(scene).render(technique("layered.talk"), given, timed=False).image.pixels
    found = evaluate(METRIC, image, Samples(truth.accumulators, truth.mask)).value
    assert found == pytest.approx(HELD_OUT[name][light - 1], rel=0.02)
    assert found <= BUDGET


def fitted_on(folder: Path, on: tuple[str, ...], evaluations: int) -> Fit:
    """All sliders fitted to lights on the clear coat, tested on those held out."""
    task = task_of(asked(folder, evaluations=evaluations))
    train, test = (
        [load_scene(find_scene(f"suit-clearcoat-{light}")) for light in lights]
        for lights in (on, ("held1", "held2", "held3"))
    )
    return fit(task, train, test, Store(folder), quiet)


def held_out(found: Fit) -> float:
    return float(np.mean([score.fitted.value for score in found.held_out]))


@pytest.mark.slow
def test_a_fit_finds_the_shipped_look_again(mi: ModuleType, tmp_path: Path) -> None:
    """From the sliders as they are set by eye. Another GPU rounds otherwise, and may end in another minimum."""
    found = fitted_on(tmp_path, tuple(f"light{k}" for k in range(1, 7)), 3000)
    assert found.verdict == CARRIES_OVER
    assert held_out(found) <= 1.05 * np.mean(HELD_OUT["clearcoat"])


@pytest.mark.slow
def test_what_is_fitted_to_one_light_is_wrong_in_others(mi: ModuleType, tmp_path: Path) -> None:
    """Six lights are needed: one is matched three times as well, and the others at least twice as badly."""
    found = fitted_on(tmp_path, ("light3",), 3000)
    assert found.train[0].fitted.value < 1e-3
    assert held_out(found) > 2 * np.mean(HELD_OUT["clearcoat"])


def test_a_fit_writes_a_look_that_draws_what_was_fitted(
    mi: ModuleType, tmp_path: Path, techniques_forgotten: None
) -> None:
    wanted = asked(tmp_path, parameters=("layer1_diffuse", "layer2_alpha"), evaluations=12, look=tmp_path / "suit.toml")
    lines, status = fit_lines(wanted, Store(tmp_path / "store"), quiet)
    assert status == 0
    assert "mine.suit" in lines[-1]
    assert load_own(tmp_path / "suit.toml") == ("mine.suit",)
    settings = {"damping": 0.0}
    made = technique("mine.suit").settings(settings)
    assert made["layer1_diffuse"] != technique("layered.talk").settings({})["layer1_diffuse"]
    assert made["layer2_strength_1"] == technique("layered.talk").settings({})["layer2_strength_1"]
    assert f"layer1_diffuse  0.8        {made['layer1_diffuse']:g}" in "\n".join(lines)


@pytest.mark.parametrize(
    ("subject", "file", "message"),
    [
        ("layered.ggx", "suit.toml", r"'layered\.ggx' has no sliders, so that it has no look"),
        ("layered.talk", "suit.json", r"suit\.json' cannot hold a look.*suffix \.toml"),
        ("layered.talk", "my suit.toml", r"my suit\.toml' cannot hold a look.*such as suit\.toml"),
    ],
)
def test_a_look_that_cannot_be_written_is_refused_before_anything_is_fitted(
    subject: str, file: str, message: str
) -> None:
    with pytest.raises(InputError, match=message):
        require_look(technique(subject), Path(file))


def test_a_fit_starts_from_the_look_that_is_chosen(tmp_path: Path) -> None:
    task = task_of(asked(tmp_path, subject="layered.talk[look=plastic,damping=0]"))
    look = technique("layered.talk").looks["plastic"]
    assert {part.name: part.published for part in task.parts} == {part.name: look[part.name] for part in task.parts}
    assert "damping" not in task.published


def test_an_unknown_slider_is_told_without_a_list_of_all_components(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"Unknown parameter of layered\.talk 'layer2_alfa'.*'layer2_alpha'\?") as told:
        task_of(asked(tmp_path, parameters=("layer2_alfa",)))
    assert "_texture" not in str(told.value)


def test_what_a_texture_adds_can_be_fitted_with_a_range(tmp_path: Path) -> None:
    task = task_of(asked(tmp_path, parameters=("layer2_alpha_texture3=-1..1",)))
    assert [(part.name, part.published) for part in task.parts] == [("layer2_alpha_texture3", 0.0)]


def test_rough_scenes_have_few_pixels_triangles_and_samples(make_scene: Callable[..., Scene]) -> None:
    scene = load_scene(find_scene("suit-blend-light1"))
    rough = rough_scene(scene)
    ball = rough.shapes[0]
    assert isinstance(ball, Sphere)
    assert (rough.sensor.width, rough.sensor.height, ball.detail) == (SIDE, SIDE, DETAIL)
    assert rough.emitters == scene.emitters
    assert rough_technique(technique("layered.talk")).grid == 2
    small = make_scene()
    assert rough_scene(small) == small
