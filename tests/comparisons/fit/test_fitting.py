"""Techniques whose best constants are known, fitted on some scenes and tested on others."""

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import pytest

from comparisons.fit.example import Draw, Example, best_factor
from comparisons.fit.fitting import Task, fit_examples, require_apart
from comparisons.fit.result import CARRIES_OVER, NO_GAIN, NOT_TESTED, UNDECIDED, WORSE, Fit
from comparisons.fit.space import parts_of
from realtime.technique import Parameter, Technique
from scenes.errors import ImageError, InputError, RenderError
from scenes.image import Float64
from scenes.load import find_scene, load_scene

ExampleOf = Callable[..., Example]

TOY = Technique(
    name="made.toy",
    approximates="radiance",
    summary="none",
    source="none",
    limits="none",
    passes=lambda scene, features, settings: [],
    parameters=(
        Parameter("strength", 0.5, (0.0, 0.5, 1.0), "of a pattern that is not there", (-9, 9), tuned=(-2, 2)),
        Parameter("level", 1.0, (0.5, 1.0), "brightness", (0, 100), tuned=(0.05, 20)),
        Parameter("idle", 3.0, (3.0,), "without effect", (0, 9), tuned=(0, 9)),
    ),
)


def task(*names: str, with_exposure: bool = False, **pinned: float) -> Task:
    return Task(TOY, pinned, parts_of(TOY, names, pinned), "nrmse", with_exposure, 64, 80)


def fitted(todo: Task, train: Sequence[Example], test: Sequence[Example] = ()) -> Fit:
    return fit_examples(todo, train, test, lambda what, fraction: None)


def values(found: Fit) -> dict[str, Any]:
    return {p.name: p.fitted for p in found.parameters}


@pytest.fixture
def drawn(truth: Float64, pattern: Float64) -> Callable[..., Draw]:
    """Draws level * (truth + (strength - best) * pattern) / bright: right at strength = best, level = bright."""

    def make(best: float = 0.0, bright: float = 1.0) -> Draw:
        def draw(settings: Mapping[str, Any]) -> Float64:
            strength, level = settings.get("strength", 0.5), settings.get("level", 1.0)
            image: Float64 = level * (truth + (strength - best) * pattern) / bright
            return image

        return draw

    return make


def test_the_best_constants_are_found(example_of: ExampleOf, truth: Float64, drawn: Callable[..., Draw]) -> None:
    found = fitted(task("strength", "level"), [example_of(truth, drawn(best=-0.4, bright=3.0))])
    assert values(found) == {"strength": pytest.approx(-0.4, abs=0.01), "level": pytest.approx(3.0, rel=0.01)}
    assert [p.published for p in found.parameters] == [0.5, 1.0]
    assert found.train[0].fitted.value < 0.02 < found.train[0].published.value
    assert found.train_gain is not None
    assert found.train_gain.value > 0.99
    assert found.verdict == NOT_TESTED


def test_noise_moves_no_minimum(example_of: ExampleOf, truth: Float64, drawn: Callable[..., Draw]) -> None:
    """Scenes with accumulators as noisy as bright: 0.01 is what their mean, over 576 values each, leaves open."""
    train = [example_of(truth, drawn(best=0.2), name, noise=1.0) for name in ("a", "bb", "ccc", "dddd")]
    assert values(fitted(task("strength"), train))["strength"] == pytest.approx(0.2, abs=0.03)


def test_a_gain_carries_over_to_a_scene_that_wants_the_same(
    example_of: ExampleOf, truth: Float64, drawn: Callable[..., Draw]
) -> None:
    train, test = example_of(truth, drawn(0.0), "a", noise=0.5), example_of(0.7 * truth, drawn(0.0, 1 / 0.7), "bb", 0.5)
    found = fitted(task("strength"), [train], [test])
    assert found.verdict == CARRIES_OVER
    assert found.held_out[0].gain == found.held_out_gain
    assert not found.in_turn


def test_what_fits_the_training_scenes_alone_is_called_over_fitted(
    example_of: ExampleOf, truth: Float64, drawn: Callable[..., Draw]
) -> None:
    train, test = example_of(truth, drawn(-1.5), "a"), example_of(truth, drawn(0.6), "b")
    found = fitted(task("strength"), [train], [test])
    assert found.verdict == WORSE
    assert found.train_gain is not None
    assert found.train_gain.low > 0.9


def test_no_gain_is_told_from_an_open_question(
    example_of: ExampleOf, truth: Float64, drawn: Callable[..., Draw]
) -> None:
    """Constants that are best as published leave the held-out scene as it is; noise may hide what others do."""
    train, test = example_of(truth, drawn(0.5), "a"), example_of(truth, drawn(0.1), "b")
    assert fitted(task("strength"), [train], [test]).verdict == NO_GAIN
    blurred = example_of(truth, drawn(0.5, 1.0), "c", noise=1.0)
    assert fitted(task("strength"), [example_of(truth, drawn(0.4), "a")], [blurred]).verdict == UNDECIDED


def test_without_held_out_scenes_each_is_held_out_in_its_turn(
    example_of: ExampleOf, truth: Float64, drawn: Callable[..., Draw]
) -> None:
    train = [example_of(truth, drawn(best), name) for best, name in ((0.0, "a"), (0.1, "b"), (0.2, "c"))]
    found = fitted(task("strength"), train)
    assert found.in_turn
    assert values(found)["strength"] == pytest.approx(0.1, abs=0.01)
    in_turn = {score.scene: score.settings["strength"] for score in found.held_out}
    assert in_turn == {
        "a": pytest.approx(0.15, abs=0.01),
        "b": pytest.approx(0.1, abs=0.01),
        "c": pytest.approx(0.05, abs=0.01),
    }
    assert found.verdict == CARRIES_OVER


def test_one_exposure_is_fitted_to_all_scenes(
    example_of: ExampleOf, truth: Float64, drawn: Callable[..., Draw]
) -> None:
    """Two scenes that want factors of 2 and 4 get one between; that of one alone is the closed form's."""
    both = [example_of(truth, drawn(0.5, bright), name) for bright, name in ((2.0, "a"), (4.0, "b"))]
    alone = fitted(task("strength", with_exposure=True), both[:1])
    assert alone.exposure == pytest.approx(2.0)
    found = fitted(task("strength", with_exposure=True), both)
    assert found.exposure == pytest.approx((1 / 2 + 1 / 4) / (1 / 2**2 + 1 / 4**2))


def test_the_exposure_can_be_fitted_alone(example_of: ExampleOf, truth: Float64, drawn: Callable[..., Draw]) -> None:
    todo = replace(task("strength", with_exposure=True), parts=())
    found = fitted(todo, [example_of(truth, drawn(0.5, 2.0), "a")], [example_of(truth, drawn(0.5, 2.5), "b")])
    assert found.exposure == pytest.approx(2.0)
    assert found.parameters == ()
    assert found.exposure_gain is None


def test_what_the_exposure_alone_gains_is_told_apart(
    example_of: ExampleOf, truth: Float64, drawn: Callable[..., Draw]
) -> None:
    train, test = example_of(truth, drawn(-1.0, 2.0), "a"), example_of(truth, drawn(-1.0, 2.0), "b")
    found = fitted(task("strength", with_exposure=True), [train], [test])
    assert found.exposure == pytest.approx(2.0, rel=0.01)
    assert found.exposure_gain is not None
    assert found.held_out_gain is not None
    assert found.exposure_gain.value < found.held_out_gain.value - 0.1


def test_what_has_no_effect_stays_as_published(
    example_of: ExampleOf, truth: Float64, drawn: Callable[..., Draw]
) -> None:
    found = fitted(task("strength", "idle"), [example_of(truth, drawn(0.0))])
    assert [(p.name, p.has_effect) for p in found.parameters] == [("strength", True), ("idle", False)]
    assert values(found)["idle"] == 3.0


def test_if_nothing_has_an_effect_nothing_is_fitted(
    example_of: ExampleOf, truth: Float64, drawn: Callable[..., Draw]
) -> None:
    with pytest.raises(InputError, match=r"has an effect on the error of made\.toy on a: idle"):
        fitted(task("idle"), [example_of(truth, drawn(0.0))])


def test_a_best_value_at_the_edge_of_its_range_is_named(
    example_of: ExampleOf, truth: Float64, drawn: Callable[..., Draw]
) -> None:
    found = fitted(task("strength=0.2..1"), [example_of(truth, drawn(-0.7))])
    assert [(p.fitted, p.edge) for p in found.parameters] == [(0.2, "low")]


def test_settings_that_cannot_be_drawn_are_passed_over_and_counted(
    example_of: ExampleOf, truth: Float64, drawn: Callable[..., Draw]
) -> None:
    def draw(settings: Mapping[str, Any]) -> Float64:
        if settings["strength"] < 0.1:
            raise RenderError("it is too weak")
        return drawn(-1.0)(settings)

    found = fitted(task("strength"), [example_of(truth, draw)])
    assert values(found)["strength"] == pytest.approx(0.1, abs=0.05)
    count, why = found.failed
    assert count > 0
    assert why == "it is too weak"


def test_a_scene_that_cannot_be_drawn_as_published_stops_the_fit(example_of: ExampleOf, truth: Float64) -> None:
    def draw(settings: Mapping[str, Any]) -> Float64:
        raise RenderError("the shader does not compile")

    with pytest.raises(RenderError, match="the shader does not compile"):
        fitted(task("strength"), [example_of(truth, draw)])


def test_settings_that_the_user_set_are_drawn_and_told(
    example_of: ExampleOf, truth: Float64, drawn: Callable[..., Draw]
) -> None:
    found = fitted(task("strength", level=2.0), [example_of(truth, drawn(0.0, 2.0))])
    assert found.settings == {"level": 2.0, "strength": pytest.approx(0.0, abs=0.01)}
    assert found.train[0].fitted.value < 0.01


def test_the_error_for_any_exposure_is_that_of_the_image_times_it(
    example_of: ExampleOf, truth: Float64, pattern: Float64
) -> None:
    image = truth + 0.2 * pattern
    brighter, plain = example_of(truth, lambda s: 1.7 * image, "a", 0.5), example_of(truth, lambda s: image, "a", 0.5)
    assert plain.parabola({}).at(1.7) == pytest.approx(brighter.parabola({}).at(1.0), rel=1e-9)
    best = best_factor([plain.parabola({})])
    assert plain.parabola({}).at(best) < min(plain.parabola({}).at(best * f) for f in (0.99, 1.01))


def test_a_black_image_has_no_exposure(example_of: ExampleOf, truth: Float64) -> None:
    with pytest.raises(ImageError, match="No exposure can be fitted"):
        best_factor([example_of(truth, lambda s: 0 * truth).parabola({})])


def test_what_was_found_is_json(example_of: ExampleOf, truth: Float64, drawn: Callable[..., Draw]) -> None:
    found = fitted(task("strength", with_exposure=True), [example_of(truth, drawn(0.0), "a", 0.5)])
    plain = json.loads(json.dumps(found.to_json(), allow_nan=False))
    assert plain["schema"] == 1
    assert plain["parameters"][0]["name"] == "strength"
    assert plain["train"][0]["gain"]["low"] <= plain["train"][0]["gain"]["value"]
    assert plain["verdict"] == NOT_TESTED


def test_a_scene_under_two_names_is_refused() -> None:
    scene = load_scene(find_scene("small-room-ellipsoid"))
    twin = scene.model_copy(update={"name": "twin", "title": "another title", "checks": ()})
    with pytest.raises(InputError, match="'twin' of --test is the same scene as 'small-room-ellipsoid' of --on"):
        require_apart([scene], [twin])
    with pytest.raises(InputError, match="'twin' of --on is the same scene"):
        require_apart([scene, twin], [])
