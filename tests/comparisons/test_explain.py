"""What would run and what would not, in words; and the scenes that are shipped."""

import re
from collections.abc import Callable
from typing import Any

import pytest

from comparisons.explain import explanation
from comparisons.parity import checks_of
from comparisons.request import request_of
from comparisons.validate import validate
from realtime.techniques import technique
from scenes.errors import InputError
from scenes.load import library_scenes, load_scene
from scenes.model import Scene

Make = Callable[..., Scene]

CHECKS = [
    {
        "quantity": "indirect_radiance",
        "technique": "indirect.irradiance",
        "criteria": [{"metric": "nrmse", "max": 0.5, "reason": "far above what is reached"}],
    }
]


@pytest.fixture(params=library_scenes())
def shipped(request: pytest.FixtureRequest) -> Scene:
    return load_scene(library_scenes()[request.param])


def section(scene: Scene, check: str) -> list[str]:
    """The lines of an explanation that are about one check."""
    paragraphs = "\n".join(explanation(scene)).split("\n\n")
    (found,) = [p for p in paragraphs if p.startswith(f"  {check} approximates")]
    return found.splitlines()


def skips(scene: Scene, check: str = "indirect.irradiance") -> dict[str, str]:
    lines = [line.partition("skipped")[2].strip() for line in section(scene, check) if " skipped " in line]
    return dict(line.split(": ", 1) for line in lines)


def test_a_shipped_scene_can_be_explained(shipped: Scene) -> None:
    text = "\n".join(explanation(shipped))
    assert text.startswith(f"{shipped.name}: {shipped.title}\n  {shipped.description}\n")
    checks = len(checks_of(shipped))
    assert len(re.findall(r"^  \S+ approximates \w+$", text, flags=re.MULTILINE)) == checks
    for label in ("truth", "passes", "budget"):
        assert len(re.findall(rf"^    {label} +\S", text, flags=re.MULTILINE)) >= checks, label


def test_a_shipped_scene_says_what_it_is_for(shipped: Scene) -> None:
    assert len(shipped.title) > 8
    assert len(shipped.description) > 20


def test_the_checks_of_a_shipped_scene_are_valid(shipped: Scene) -> None:
    request = request_of(shipped, shipped.name)
    validate([request])
    assert all(check in request.checks for check in shipped.checks)


def test_every_budget_of_a_shipped_scene_has_a_reason(shipped: Scene) -> None:
    reasons = [criterion.reason for check in shipped.checks for criterion in check.criteria]
    assert all(len(reason.split()) >= 3 for reason in reasons)
    assert not any(re.search(r"\b(to be set|tbd|todo|fixme)\b", reason, flags=re.IGNORECASE) for reason in reasons)


def test_the_library_judges_the_technique_of_the_talk_beside_a_better_one() -> None:
    """Its hair is lit as Kajiya and Kay did it; scenes without checks are there to be fitted to."""
    for name, path in library_scenes().items():
        effects = [check.technique for check in load_scene(path).checks if not check.technique.startswith("raster.")]
        as_published = [used for used in effects if technique(used).source in ("nvidia-2005", "kajiya-1989")]
        if effects and name != "suit-lamp":  # its truth is too noisy to tell one look from another
            assert 0 < len(as_published) < len(effects), name
        else:
            assert re.match(r"parity-|suit-\w+-light\d$|suit-lamp$", name), name


def test_parity_compares_the_colours_that_a_scene_has(make_scene: Make) -> None:
    def colours(reflectance: float, emitters: list[dict[str, Any]]) -> set[str]:
        grey = {"type": "diffuse", "reflectance": [reflectance] * 3}
        scene = make_scene(checks=CHECKS, materials=dict.fromkeys(["white", "red", "skin"], grey), emitters=emitters)
        return {check.quantity for check in checks_of(scene)} & {"albedo", "emission"}

    glow = {"type": "area", "shape": "ball", "radiance": [1.0, 1.0, 1.0]}
    lamp = {"type": "point", "position": [0.0, 1.0, 0.0], "intensity": [1.0, 1.0, 1.0]}
    assert colours(0.5, [glow]) == {"albedo"}
    assert colours(0.0, [glow]) == {"emission"}
    assert colours(0.0, [lamp]) == set()


def test_a_convex_subject_needs_no_visibility_of_itself(make_scene: Make) -> None:
    found = skips(make_scene(checks=CHECKS))
    assert found["self-visibility"] == "the subject is convex: no point of it sees another"
    assert "shadow atlas" not in found


def test_a_subject_that_is_not_convex_needs_it(make_scene: Make) -> None:
    scene = make_scene(checks=CHECKS)
    knot = {"name": "ball", "type": "torus_knot", "radius": 0.2, "tube": 0.05, "material": "skin"}
    shapes = [scene.shapes[0].model_dump(mode="json"), knot]
    assert "self-visibility" not in skips(make_scene(checks=CHECKS, shapes=shapes))


def test_without_local_lights_there_are_no_shadows_to_draw(make_scene: Make) -> None:
    sky = [{"type": "constant", "radiance": [1.0, 1.0, 1.0]}]
    found = skips(make_scene(checks=CHECKS, emitters=sky))
    assert found["shadow atlas"] == "no emitter but the sky: nothing casts a shadow map"


def test_a_setting_that_does_not_fit_is_refused_before_anything_is_explained(make_scene: Make) -> None:
    scene = make_scene(checks=[CHECKS[0] | {"settings": {"bounces": 3}}])
    with pytest.raises(InputError, match="no setting 'bounces'"):
        list(explanation(scene))


def test_nothing_is_rendered_to_explain(make_scene: Make, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*arguments: Any) -> None:
        raise AssertionError("a renderer was started")

    monkeypatch.setattr("realtime.render.make_context", refuse)
    monkeypatch.setattr("reference.studio.mitsuba", refuse)
    assert list(explanation(make_scene(checks=CHECKS)))
