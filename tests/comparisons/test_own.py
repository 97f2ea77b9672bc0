"""Techniques of a user on the command line: which scenes judge them, by which budgets; the docs' examples are run."""

import json
import re
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from comparisons.budgets import GIVEN, parse_budgets
from comparisons.metrics import METRICS
from comparisons.own import Own, lender, load_techniques, origins_of
from comparisons.places import places_of
from realtime.shader import GLSL
from realtime.techniques import MODULES
from scenes.checks import Bounds, Check, Criterion, RendererBounds
from scenes.errors import InputError
from scenes.load import library_scenes, load_scene
from scenes.model import Scene

Run = Callable[..., Any]
Write = Callable[..., Path]

DOCS = Path(__file__).parents[2] / "docs"
EXAMPLES = DOCS / "examples"
HEMISPHERE = EXAMPLES / "hemisphere.frag"
CUBE = EXAMPLES / "ambient_cube.py"
WHY = "a reason of some length"


pytestmark = pytest.mark.usefixtures("techniques_forgotten")


def check(technique: str, *criteria: Criterion, quantity: str = "indirect_radiance", **more: Any) -> Check:
    return Check(quantity=quantity, technique=technique, criteria=criteria, **more)


def at_most(most: float, metric: str = "nrmse", least: float | None = None) -> Criterion:
    return Criterion(metric=metric, min=least, max=most, reason=WHY)


def scene_with(*checks: Check, path: str = "small-room-ellipsoid") -> Scene:
    return load_scene(library_scenes()[path]).model_copy(update={"checks": checks})


def bounds_of(criterion: Bounds) -> tuple[float | None, float | None]:
    return criterion.min, criterion.max


def results_of(folder: Path, report: str = "report") -> dict[str, dict[str, Any]]:
    content = json.loads((folder / report / "results.json").read_text(encoding="utf-8"))
    return {result["id"]: result for result in content["checks"]}


def test_budgets_are_borrowed_from_the_shipped_technique_with_the_tightest_first_one() -> None:
    scene = scene_with(
        check("indirect.probe", at_most(0.2), at_most(0.01, "flip")),
        check("indirect.grid", at_most(0.03), at_most(0.06, "flip")),
        check("indirect.talk", at_most(0.01), fit_exposure=True),
        check("mine.other", at_most(0.001)),
        check("raster.depth", at_most(0.0001), quantity="depth"),
    )
    best = lender(scene, "indirect_radiance")
    assert best is not None
    assert best.technique == "indirect.grid"
    own = load_techniques([HEMISPHERE])
    added = own.added_to(scene).checks[-1]
    assert (added.technique, added.quantity, added.settings) == ("mine.hemisphere", "indirect_radiance", {})
    assert [(c.metric, *bounds_of(c)) for c in added.criteria] == [("nrmse", None, 0.03), ("flip", None, 0.06)]
    assert {c.reason for c in added.criteria} == {"borrowed from indirect.grid: as good as the best that ships"}


def test_only_what_says_how_bad_a_technique_may_be_is_borrowed() -> None:
    elsewhere = RendererBounds(renderer="NVIDIA", min=0.1, max=0.3, reason=WHY)
    criteria = (
        Criterion(metric="nrmse", min=0.08, max=0.2, reason=WHY, by_renderer=(elsewhere,)),
        at_most(-0.03, "energy_bias", least=-0.08),
        Criterion(metric="flip", min=0.1, reason=WHY),
    )
    own = load_techniques([HEMISPHERE])
    nrmse, bias = own.added_to(scene_with(check("indirect.probe", *criteria))).checks[-1].criteria
    assert bounds_of(nrmse) == (None, 0.2)
    assert [bounds_of(other) for other in nrmse.by_renderer] == [(None, 0.3)]
    assert bounds_of(bias) == (-0.08, 0.08), "an image without any bias is as good"


def test_every_metric_that_may_be_negative_is_known_to_be() -> None:
    used = {c.metric: c for p in library_scenes().values() for check in load_scene(p).checks for c in check.criteria}
    signed = {name for name, c in used.items() if (c.min or 0.0) < 0}
    assert signed
    assert all(METRICS[name].is_signed for name in signed)


@pytest.mark.parametrize("name", library_scenes())
def test_every_library_scene_can_lend_a_budget_for_what_it_judges(name: str) -> None:
    scene = load_scene(library_scenes()[name])
    for quantity in {c.quantity for c in scene.checks}:
        best = lender(scene, quantity)
        assert best is not None
        assert best.technique in MODULES


def test_given_budgets_take_the_place_of_borrowed_ones() -> None:
    own = load_techniques([HEMISPHERE], ["nrmse=0.6", "energy_bias=-0.5..0.5"])
    criteria = own.added_to(scene_with(check("indirect.probe", at_most(0.2)))).checks[-1].criteria
    assert [(c.metric, *bounds_of(c), c.reason) for c in criteria] == [
        ("nrmse", None, 0.6, GIVEN),
        ("energy_bias", -0.5, 0.5, GIVEN),
    ]


def test_a_scene_that_has_a_check_of_the_technique_keeps_it() -> None:
    scene = scene_with(check("mine.hemisphere", at_most(0.6)), check("indirect.probe", at_most(0.2)))
    assert load_techniques([HEMISPHERE]).added_to(scene) is scene


def test_a_scene_that_judges_something_else_gets_no_check() -> None:
    scene = load_scene(library_scenes()["skin-ear"])
    assert load_techniques([HEMISPHERE], ["nrmse=0.6"]).added_to(scene) is scene
    shipped = scene_with(path="parity-tall")
    assert load_techniques([HEMISPHERE], ["nrmse=0.6"]).added_to(shipped) is shipped


def test_without_techniques_nothing_changes() -> None:
    scene = load_scene(library_scenes()["small-room-knot"])
    assert Own().added_to(scene) is scene
    assert Own().keep == ""
    assert list(Own().notes([], [], [])) == []


def test_a_scene_that_lends_nothing_needs_a_budget() -> None:
    scene = scene_with(check("indirect.talk", at_most(0.3), fit_exposure=True))
    with pytest.raises(InputError, match=r"no budget for indirect_radiance that 'mine\.hemisphere' could borrow"):
        load_techniques([HEMISPHERE]).added_to(scene)


def test_budgets_without_a_technique_are_refused() -> None:
    with pytest.raises(InputError, match=r"--budget holds for techniques of your own only"):
        load_techniques([], ["nrmse=0.1"])


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (("indirect_radiance", "indirect_light"), r"approximates 'indirect_light'\. Unknown quantity"),
        (
            ("indirect_radiance", "visibility"),
            r"gives 3 of the channels of its image; visibility has 1\. Set channels to 1",
        ),
    ],
)
def test_a_quantity_that_it_cannot_approximate_is_refused(tmp_path: Path, change: tuple[str, str], said: str) -> None:
    text = HEMISPHERE.read_text(encoding="utf-8").replace(*change)
    (tmp_path / "mine.frag").write_text(text, encoding="utf-8")
    with pytest.raises(InputError, match=said):
        load_techniques([tmp_path / "mine.frag"])


def test_a_borrowed_budget_stands_where_it_was_borrowed_and_a_given_one_nowhere() -> None:
    scene = load_scene(library_scenes()["small-room-ellipsoid"])
    best = lender(scene, "indirect_radiance")
    assert best is not None
    borrowed = load_techniques([HEMISPHERE]).added_to(scene)
    assert places_of(borrowed, borrowed.checks[-1]) == places_of(scene, best)
    given = load_techniques([HEMISPHERE], ["nrmse=0.6"]).added_to(scene)
    assert places_of(given, given.checks[-1]) == ("",)
    assert origins_of(scene, best) == tuple((best, number) for number in range(len(best.criteria)))


def test_the_shader_of_the_docs_is_run_alone_and_with_others(after_a_run: Path, lightgauge: Run) -> None:
    shutil.copy(HEMISPHERE, after_a_run)
    outcome = lightgauge("run", "tiny.toml", "--technique", "hemisphere.frag", "--budget", "nrmse=0.9")
    assert (outcome.status, outcome.err) == (0, "")
    results = results_of(after_a_run)
    assert [result["technique"] for result in results.values() if not result["technique"].startswith("raster.")] == [
        "mine.hemisphere"
    ]
    mine = results["tiny/mine.hemisphere"]
    assert mine["criteria"][0]["reason"] == GIVEN
    assert mine["card"]["source"].startswith("Box: the integrating sphere")
    assert mine["rerun"] == (
        "lightgauge run tiny.toml -k '/mine.hemisphere$' --technique hemisphere.frag --budget nrmse=0.9"
    )
    outcome = lightgauge("run", "tiny.toml", "--technique", "hemisphere.frag", "-k", "indirect_radiance", "-o", "both")
    assert {"tiny/mine.hemisphere", "tiny/indirect.irradiance[side=24]"} <= set(results_of(after_a_run, "both"))


def test_the_python_technique_of_the_docs_is_run(after_a_run: Path, lightgauge: Run) -> None:
    """Six directions are coarser than what a budget of a shipped technique here allows, but no nonsense."""
    outcome = lightgauge("run", "tiny.toml", "--technique", str(CUBE))
    assert (outcome.status, outcome.err) == (0, "")
    mine = results_of(after_a_run)["tiny/mine.ambient_cube"]
    assert mine["criteria"][0]["reason"].startswith("borrowed from indirect.irradiance[side=24]")
    line = next(n for n, text in enumerate((after_a_run / "tiny.toml").read_text().splitlines(), 1) if "nrmse" in text)
    assert mine["criteria"][0]["place"] == f"tiny.toml:{line}"
    assert mine["criteria"][0]["high"] < 0.4


def test_a_finished_check_is_found_again_until_its_technique_changes(after_a_run: Path, lightgauge: Run) -> None:
    mine = Path(shutil.copy(HEMISPHERE, after_a_run))
    command = ("run", "tiny.toml", "--technique", mine.name, "--budget", "nrmse=0.95")
    lightgauge(*command)
    first = results_of(after_a_run)["tiny/mine.hemisphere"]
    lightgauge(*command)
    again = results_of(after_a_run)["tiny/mine.hemisphere"]
    assert again["cached"]
    assert not first["cached"]
    mine.write_text(mine.read_text(encoding="utf-8").replace("default = 0.5", "default = 0.3"), encoding="utf-8")
    lightgauge(*command)
    changed = results_of(after_a_run)["tiny/mine.hemisphere"]
    assert not changed["cached"]
    assert changed["criteria"][0]["value"] != first["criteria"][0]["value"]


def test_a_check_in_a_scene_may_name_it_if_its_file_is_named_too(
    with_truth: Path, lightgauge: Run, write_scene: Write
) -> None:
    write_scene(("indirect.irradiance", "mine.hemisphere"), ("side = 24", "tilt = 0.1"), ("max = 0.5", "max = 0.9"))
    outcome = lightgauge("run", "tiny.toml")
    assert outcome.status == 3
    assert re.search(r"Unknown technique 'mine\.hemisphere'.*name its file with --technique,", outcome.err)
    outcome = lightgauge("run", "tiny.toml", "--technique", str(HEMISPHERE))
    assert (outcome.status, outcome.err) == (0, "")
    mine = results_of(with_truth)["tiny/mine.hemisphere[tilt=0.1]"]
    assert mine["criteria"][0]["reason"] == "far above what is reached"


def test_a_scene_without_checks_is_judged_by_given_budgets(
    with_truth: Path, lightgauge: Run, write_scene: Write
) -> None:
    text = write_scene().read_text(encoding="utf-8").partition("[[checks]]")[0]
    (with_truth / "tiny.toml").write_text(text, encoding="utf-8")
    outcome = lightgauge("run", "tiny.toml", "--technique", str(HEMISPHERE))
    assert outcome.status == 3
    assert "No check of tiny.toml asks for that. Scenes that have one for indirect_radiance: large-room" in outcome.err
    outcome = lightgauge("run", "tiny.toml", "--technique", str(HEMISPHERE), "--budget", "nrmse=0.9")
    assert (outcome.status, outcome.err) == (0, "")
    assert "tiny/mine.hemisphere" in results_of(with_truth)


def test_scenes_that_judge_something_else_are_passed_over_in_a_line(after_a_run: Path, lightgauge: Run) -> None:
    outcome = lightgauge(
        "run", "parity-tall", "tiny.toml", "--technique", str(HEMISPHERE), "--budget", "nrmse=0.9", "-o", "mine"
    )
    assert (outcome.status, outcome.err) == (0, "")
    assert "not judged, since no check there asks for indirect_radiance: parity-tall\n" in outcome.out
    assert {result["scene"] for result in results_of(after_a_run, "mine").values()} == {"tiny"}
    outcome = lightgauge("explain", "parity-tall", "--technique", str(HEMISPHERE))
    assert outcome.out.endswith("not judged, since no scene of this run asks for indirect_radiance: mine.hemisphere\n")


def test_a_technique_that_no_scene_judges_is_named_and_many_scenes_are_counted(tmp_path: Path) -> None:
    shader = HEMISPHERE.read_text(encoding="utf-8").replace("mine.hemisphere", "mine.direct")
    (tmp_path / "direct.frag").write_text(shader.replace("indirect_radiance", "direct_radiance"), encoding="utf-8")
    own = load_techniques([HEMISPHERE, tmp_path / "direct.frag"])
    knot = own.added_to(load_scene(library_scenes()["small-room-knot"]))
    all_scenes = len(library_scenes())
    assert list(own.notes([], ["small-room-knot"], [knot])) == [
        "not judged, since no check there asks for indirect_radiance or direct_radiance: "
        f"{all_scenes - 1} of {all_scenes} scenes",
        "not judged, since no scene of this run asks for direct_radiance: mine.direct",
    ]


def test_the_other_commands_know_it(after_a_run: Path, lightgauge: Run) -> None:
    mine = ("--technique", str(HEMISPHERE))
    assert "  mine.hemisphere" in lightgauge("list", *mine).out
    explained = lightgauge("explain", "tiny.toml", *mine).out
    assert "mine.hemisphere approximates indirect_radiance" in explained
    assert "budget   nrmse <= 0.5: borrowed from indirect.irradiance[side=24]" in explained
    outcome = lightgauge("diff", "mine.hemisphere", "indirect.irradiance[side=24]", "--scene", "tiny.toml", *mine)
    assert outcome.status == 0
    assert "B is better" in outcome.out
    outcome = lightgauge("selftest", "tiny.toml", *mine, "--budget", "nrmse=0.9")
    assert "tiny/mine.hemisphere" in outcome.out
    assert "indirect.irradiance" not in outcome.out


def test_a_fault_in_it_is_status_3_and_names_its_line(after_a_run: Path, lightgauge: Run) -> None:
    text = HEMISPHERE.read_text(encoding="utf-8")
    (after_a_run / "mine.frag").write_text(text.replace("albedo()", "albed()"), encoding="utf-8")
    outcome = lightgauge("run", "tiny.toml", "--technique", "mine.frag")
    assert outcome.status == 3
    assert "Traceback" not in outcome.err
    message = results_of(after_a_run)["tiny/mine.hemisphere"]["message"]
    line = text[: text.index("albedo()")].count("\n") + 1
    assert message.startswith(f"The shader raster/mesh.vert + mine.frag does not compile: mine.frag:{line}: error: ")
    outcome = lightgauge("run", "tiny.toml", "--technique", "gone.frag")
    assert (outcome.status, outcome.out) == (3, "")
    assert outcome.err.startswith("lightgauge: 'gone.frag' is no file that may hold a technique.")


@pytest.mark.slow
def test_several_processes_know_it(after_a_run: Path, lightgauge_apart: Run) -> None:
    shutil.copy(after_a_run / "tiny.toml", after_a_run / "twin.toml")
    outcome = lightgauge_apart("run", "tiny.toml", "twin.toml", "--jobs", "2", "--technique", str(CUBE), "-o", "apart")
    assert (outcome.status, outcome.err) == (0, "")
    assert {"tiny/mine.ambient_cube", "twin/mine.ambient_cube"} <= set(results_of(after_a_run, "apart"))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("example", "name", "nrmse"), [(HEMISPHERE, "mine.hemisphere", 0.54), (CUBE, "mine.ambient_cube", 0.32)]
)
def test_the_errors_that_the_docs_quote(here: Path, lightgauge: Run, example: Path, name: str, nrmse: float) -> None:
    lightgauge("run", "small-room-ellipsoid", "--technique", str(example))
    (found,) = (r for r in results_of(here).values() if r["technique"] == name)
    assert found["criteria"][0]["low"] < nrmse < found["criteria"][0]["high"]
    assert f"{100 * nrmse:.0f} % wrong" in (DOCS / "your-technique.md").read_text(encoding="utf-8")


def test_the_docs_show_the_examples_as_they_are() -> None:
    page = (DOCS / "your-technique.md").read_text(encoding="utf-8")
    for example, language in ((HEMISPHERE, "glsl"), (CUBE, "python")):
        assert f"```{language}\n{example.read_text(encoding='utf-8')}```" in page


def test_the_docs_name_all_that_a_shader_is_given() -> None:
    page = (DOCS / "your-technique.md").read_text(encoding="utf-8")
    interface = (GLSL / "own" / "interface.glsl").read_text(encoding="utf-8")
    hidden = {"emission", "reflectance_map", "emission_map"}
    names = {
        name.strip()
        for declared in re.findall(r"^(?:in|uniform|layout.* out) \w+ ([\w, ]+);", interface, re.MULTILINE)
        for name in declared.split(",")
    } | set(re.findall(r"^\w+ (\w+)\(", interface, re.MULTILINE))
    assert {"position", "eye", "color", "albedo", "scene_high"} <= names
    for name in names - hidden:
        assert re.search(rf"`[^`]*\b{name}\b[^`]*`", page), name
    assert parse_budgets(re.findall(r"--budget (\w+=[\d.-]+)", page)[:1])


def test_a_name_that_begins_those_of_others_means_no_other_checks(after_a_run: Path, lightgauge: Run) -> None:
    mine = after_a_run / "mine.frag"
    text = HEMISPHERE.read_text(encoding="utf-8").replace('name = "mine.hemisphere"', 'name = "indirect"')
    mine.write_text(text, encoding="utf-8")
    lightgauge("run", "tiny.toml", "--technique", mine.name, "--budget", "nrmse=0.95")
    assert [name for name in results_of(after_a_run) if "raster" not in name] == ["tiny/indirect"]
