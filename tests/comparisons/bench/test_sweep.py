from collections.abc import Callable
from typing import Any

import pytest

from comparisons.bench.scenes import SCENES, effects_named, spelt
from comparisons.bench.sweep import SENSOR, at_size, batches, error_metric, variants_of
from comparisons.expression import keep_of
from comparisons.metrics import METRICS
from realtime.techniques import technique
from reference.quantities import EFFECTS, effect_of
from scenes.checks import Check, Criterion
from scenes.errors import InputError
from scenes.load import library_scenes, load_scene
from scenes.model import Scene

REASON = "for the sake of this test"


def check(name: str, *metrics: str, fitted: bool = False, **settings: Any) -> Check:
    criteria = tuple(Criterion(metric=metric, max=1.0, reason=REASON) for metric in metrics or ("nrmse",))
    return Check(
        quantity=technique(name).approximates, technique=name, settings=settings, fit_exposure=fitted, criteria=criteria
    )


def test_each_scene_judges_the_effect_that_it_stands_for() -> None:
    for effect, scenes in SCENES.items():
        assert effect in EFFECTS
        for name in scenes:
            found = load_scene(library_scenes()[name])
            assert effect in {effect_of(check.quantity) for check in found.checks}, (effect, name)


def test_effects_are_named_by_their_beginning() -> None:
    assert effects_named([]) == tuple(SCENES)
    assert effects_named(["indirect-light", "INDIRECT LIGHT", "def"]) == ("indirect light", "defocus")
    assert spelt("whole frame") == "whole-frame"
    for wrong, word in (("", "no effect"), ("x", "no effect")):
        with pytest.raises(InputError, match=f"names {word}; allowed are indirect-light, eye"):
            effects_named([wrong])


def test_every_value_of_every_sweep_is_tried_alone_and_none_twice() -> None:
    used = technique("indirect.probe")
    found = variants_of(used, [])
    tried = [(variant.swept, variant.settings) for variant in found]
    assert tried[0] == ("", {})
    for parameter in used.parameters:
        values = [settings[name] for name, settings in tried if name == parameter.name]
        assert values == [value for value in parameter.sweep if value != parameter.default]
    assert len({variant.name for variant in found}) == len(found)


def test_settings_of_checks_are_tried_and_defaults_among_them_count_as_such() -> None:
    checks = [
        check("indirect.talk", c_height=7.0, side=96),
        check("indirect.talk", c_height=2.5, fitted=True),
        check("indirect.talk", c_height=7.0, side=64),
        check("indirect.probe", side=24),
    ]
    found = {variant.name: variant for variant in variants_of(technique("indirect.talk"), checks)}
    assert found["indirect.talk[c_height=7.0]"].swept == "c_height"
    assert found["indirect.talk[fitted]"].is_fitted
    assert found["indirect.talk[fitted]"].swept == ""
    assert found["indirect.talk[c_height=7.0,side=64]"].swept == "c_height, side"
    assert not any(variant.technique == "indirect.probe" for variant in found.values())


def test_the_metric_is_what_most_checks_judge_errors_by_first() -> None:
    checks = [
        check("indirect.talk", "energy_bias", "nrmse"),
        check("indirect.probe", "nrmse", "flip"),
        check("indirect.grid", "flip"),
    ]
    assert error_metric(checks) == "nrmse"
    assert error_metric([check("indirect.talk", "energy_bias")]) == "rmse"
    assert "rmse" in METRICS


def test_a_batch_is_a_quantity_at_a_resolution_and_other_resolutions_have_the_defaults_alone(
    make_scene: Callable[..., Scene],
) -> None:
    scene = make_scene()
    checks = [check("indirect.probe"), check("shadow.soft", "rmse"), check("raster.normal", "rms")]
    found = batches(scene, checks, "indirect light", keep_of("indirect.probe or shadow"), with_sizes=True)
    assert [(b.quantity, b.scene.sensor.width, b.scene.sensor.height, b.is_traced) for b in found] == [
        ("indirect_radiance", 16, 12, True),
        ("indirect_radiance", 8, 6, False),
        ("indirect_radiance", 32, 24, False),
    ]
    assert {variant.technique for variant in found[0].variants} == {"indirect.probe"}
    assert [(v.swept, v.settings) for v in found[1].variants] == [(SENSOR, {})]
    assert len(batches(scene, checks, "indirect light", keep_of(""), with_sizes=False)) == 1
    assert batches(scene, checks, "defocus", keep_of(""), with_sizes=True) == []


def test_all_techniques_for_a_quantity_are_measured_those_of_checks_first(make_scene: Callable[..., Scene]) -> None:
    found = batches(make_scene(), [check("indirect.grid")], "indirect light", keep_of(""), with_sizes=True)
    names = [variant.technique for variant in found[1].variants]
    assert names == ["indirect.grid", "indirect.talk", "indirect.probe", "indirect.irradiance"]


def test_another_size_has_other_pixels_and_nothing_else(make_scene: Callable[..., Scene]) -> None:
    scene = make_scene()
    other = at_size(scene, 32, 24)
    assert (other.sensor.width, other.sensor.height) == (32, 24)
    assert at_size(other, 16, 12) == scene
