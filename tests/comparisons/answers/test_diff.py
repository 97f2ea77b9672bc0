"""A against B on a tiny scene: techniques by name, and what two runs drew."""

import json
import re
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from comparisons.answers.diff import Outcome, diff_lines, is_run, parse_variant
from comparisons.difference import difference
from comparisons.linear import write_linear
from comparisons.metrics import Samples
from comparisons.result import check_id
from realtime.render import Renderer
from realtime.techniques import technique
from reference.estimator import Reference
from reference.store import Store
from scenes.checks import SettingValue
from scenes.errors import InputError
from scenes.image import Float32, Image
from scenes.load import load_scene
from scenes.model import Scene

if TYPE_CHECKING:
    import moderngl

Diff = Callable[..., Outcome]
MakeRun = Callable[..., str]

IRRADIANCE = "indirect.irradiance[side=24]"


@pytest.fixture(scope="module")
def store(tmp_path_factory: pytest.TempPathFactory, gl: "moderngl.Context", mi: ModuleType) -> Store:
    """Where all tests keep the truth of TINY."""
    return Store(tmp_path_factory.mktemp("store"))


@pytest.fixture
def tiny(write_scene: Callable[..., Path]) -> Scene:
    """TINY, written into the current folder."""
    return load_scene(write_scene())


@pytest.fixture
def diff(store: Store, tiny: Scene) -> Diff:
    """Compares on TINY."""

    def run(a: str, b: str, scene: str | None = "tiny.toml", metric: str = "nrmse") -> Outcome:
        return diff_lines(a, b, scene, metric, store, lambda what, fraction: None)

    return run


@pytest.fixture
def drawn(tiny: Scene) -> Float32:
    """What `indirect.irradiance` draws of TINY."""
    return Renderer(tiny).render(technique("indirect.irradiance"), {"side": 24}, timed=False).image.pixels


@pytest.fixture
def make_run(here: Path, tiny: Scene) -> MakeRun:
    """Writes the folder of a finished run with the linear images of its checks."""

    def make(name: str, checks: dict[str, Float32 | None], scene: Scene = tiny, **changes: Any) -> str:
        folder = here / name
        listed = []
        for index, (check, pixels) in enumerate(checks.items()):
            images = {} if pixels is None else {"linear": write_linear(folder, str(index), Image(pixels), scene)}
            listed.append(
                {
                    "id": f"tiny/{check}",
                    "scene": "tiny",
                    "quantity": "indirect_radiance",
                    "fit_exposure": "fitted" in check,
                    "images": images,
                    "seconds": {"realtime": 0.002},
                }
                | changes
            )
        folder.mkdir(exist_ok=True)
        results = {"checks": listed, "environment": {"commit": f"commit-of-{name}"}}
        (folder / "results.json").write_text(json.dumps(results), encoding="utf-8")
        return name

    return make


NAMES = st.sampled_from(["side", "c_height", "block"])
VALUES = st.one_of(
    st.booleans(),
    st.integers(-(10**6), 10**6),
    st.floats(allow_nan=False, allow_infinity=False),
    st.text("abcdefghijklmnopqrstuvwxyz", min_size=1, max_size=8).filter(
        lambda word: word not in ("nan", "inf", "infinity")
    ),
)


@given(st.dictionaries(NAMES, VALUES), st.booleans())
def test_the_id_of_a_check_names_it(settings: dict[str, SettingValue], fitted: bool) -> None:
    """Whatever a technique's settings may be: here, one that takes any."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("realtime.technique.Technique.settings", lambda self, given: dict(given))
        found = parse_variant(check_id("indirect.talk", settings, fitted))
    assert found.settings == settings
    assert [type(v) for _, v in sorted(found.settings.items())] == [type(v) for _, v in sorted(settings.items())]
    assert found.fit_exposure is fitted
    assert found.id == check_id("indirect.talk", settings, fitted)


@pytest.mark.parametrize(
    ("text", "settings", "fitted"),
    [
        ("indirect.talk", {}, False),
        ("indirect.talk[fitted]", {}, True),
        ("indirect.talk[c_height=7.0]", {"c_height": 7.0}, False),
        (" indirect.talk[ fitted, side = 64 , c_height=7 ] ", {"side": 64, "c_height": 7}, True),
    ],
)
def test_a_variant_is_a_technique_with_settings(text: str, settings: dict[str, SettingValue], fitted: bool) -> None:
    found = parse_variant(text)
    assert (found.technique.name, found.settings, found.fit_exposure) == ("indirect.talk", settings, fitted)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("indirect.tale", "Unknown technique 'indirect.tale'.*Did you mean 'indirect.talk'"),
        ("indirect.talk[height=7.0]", "has no setting 'height'. It has: c_height"),
        ("indirect.talk[c_height=high]", "'high'; a float such as"),
        ("indirect.talk[c_height=nan]", "'nan'; a float such as"),
        ("indirect.talk[side=0]", "1 to 4096 is allowed"),
        ("indirect.talk[]", "NAME or NAME"),
        ("indirect.talk[side=64", "NAME or NAME"),
        ("", "NAME or NAME"),
        ("indirect.talk[side]", "SETTING=VALUE and `fitted`"),
        ("indirect.talk[side=64,]", "SETTING=VALUE and `fitted`"),
        ("indirect.talk[side=64,side=96]", "at most once"),
        ("indirect.talk[fitted,fitted]", "at most once"),
    ],
)
def test_what_names_no_variant_is_refused(text: str, said: str) -> None:
    with pytest.raises(InputError, match=said):
        parse_variant(text)


def test_arguments_that_do_not_go_together_are_refused(diff: Diff, make_run: MakeRun, drawn: Float32) -> None:
    run = make_run("run", {IRRADIANCE: drawn})
    with pytest.raises(InputError, match=r"'run' is a finished run and 'indirect\.probe' is not"):
        diff("indirect.probe", run)
    with pytest.raises(InputError, match=r"approximates depth.*approximates indirect_radiance"):
        diff("raster.depth", "indirect.probe")
    with pytest.raises(InputError, match="--scene"):
        diff("indirect.probe", "indirect.probe", scene=None)
    with pytest.raises(InputError, match="unknown scene"):
        diff("indirect.probe", "indirect.probe", scene="tin")
    with pytest.raises(InputError, match="nrmse or rel_mse_eps1e-2"):
        diff("indirect.probe", "indirect.probe", metric="flip")


def test_techniques_are_compared_from_their_names(diff: Diff) -> None:
    lines, status = diff("indirect.talk[c_height=7.0]", IRRADIANCE)
    title, a, b, verdict, numbers = lines
    assert status == 0
    assert title == "tiny, indirect_radiance, 16 spp"
    assert a.startswith("  A  indirect.talk[c_height=7.0]   nrmse  ")
    assert b.startswith("  B  indirect.irradiance[side=24]  nrmse  ")
    assert a.endswith("s")
    assert re.match(r"B is better: its squared nrmse is (9\d\.\d|100)\u202f% \[", verdict)
    assert verdict.endswith((" times as long as A.", " times as long as B."))
    assert numbers.startswith("A's squared nrmse minus B's: ")
    assert " times the variance." in numbers


def test_a_technique_is_not_better_than_itself(diff: Diff) -> None:
    lines, status = diff(IRRADIANCE, IRRADIANCE)
    assert status == 0
    assert lines[3].startswith("No difference that matters.")
    assert lines[4].startswith("A's squared nrmse minus B's: 0 [0, 0]; ")
    assert "variance" not in lines[4]


def test_what_stays_open_has_status_2_and_says_what_would_close_it(
    diff: Diff, write_scene: Callable[..., Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("comparisons.difference.ALPHA_PER_SIDE", 1e-15)
    write_scene(("max_spp = 4096", "max_spp = 64"), name="short")
    lines, status = diff("indirect.irradiance[side=30]", IRRADIANCE, scene="short.toml")
    assert status == 2
    assert lines[3].startswith("Undecided after 64 spp (the scene allows 64): about ")
    assert "Set max_spp = " in lines[3]


def test_real_noise_nearly_vanishes_between_settings_that_are_close(store: Store, tiny: Scene) -> None:
    """On the shipped scenes, 400 to 30,000 at 16 samples a pixel, and less with more of them.

    Each error contains products of noise, which fall faster than what is left of the noise in their difference.
    """
    renderer, used = Renderer(tiny), technique("indirect.probe")
    a, b = (renderer.render(used, {"side": side}, timed=False).image.pixels for side in (48, 96))
    truth = Reference(tiny, store, lambda what, fraction: None).truth("indirect_radiance", 16)
    found = difference("nrmse", a, b, Samples(truth.accumulators, truth.mask))
    assert found.variance_reduction > 600


def test_runs_are_compared_check_by_check(diff: Diff, make_run: MakeRun, drawn: Float32) -> None:
    a = make_run("a", {IRRADIANCE: drawn, "indirect.talk": 0.2 * drawn, "indirect.talk[fitted]": 0.2 * drawn})
    b = make_run("b", {IRRADIANCE: drawn, "indirect.talk": 0.8 * drawn, "indirect.talk[fitted]": 0.8 * drawn})
    lines, status = diff(a, b)
    assert status == 0
    assert lines[:2] == ["A: a (commit-of-a)", "B: b (commit-of-b)"]
    assert lines[2].startswith("same      tiny/indirect.irradiance[side=24]  nrmse ")
    assert lines[3].startswith("B better  tiny/indirect.talk ")
    assert "squared nrmse 9" in lines[3]
    assert "2.00\u202fms -> 2.00\u202fms" in lines[3]
    assert lines[3].endswith("16 spp")
    assert lines[4].startswith("same      tiny/indirect.talk[fitted]"), "each run's image has its own exposure"
    assert lines[5] == "3 in common: 1 B better, 2 same"


def test_checks_that_only_one_run_has_are_named(diff: Diff, make_run: MakeRun, drawn: Float32) -> None:
    a = make_run("a", {IRRADIANCE: drawn, "indirect.talk": drawn})
    b = make_run("b", {"indirect.probe": drawn, IRRADIANCE: drawn})
    lines, status = diff(a, b)
    assert status == 0
    assert lines[-3:] == ["only in A: tiny/indirect.talk", "only in B: tiny/indirect.probe", "1 in common: 1 same"]


def test_what_cannot_be_compared_says_why_and_stops_nothing(
    diff: Diff, make_run: MakeRun, drawn: Float32, tiny: Scene
) -> None:
    checks: dict[str, Float32 | None] = {"indirect.probe": None, "indirect.talk": drawn[1:], IRRADIANCE: drawn}
    lines, status = diff(make_run("a", checks), make_run("b", checks))
    assert status == 2
    assert "not compared  tiny/indirect.probe" in lines
    assert "tiny/indirect.probe: the run in 'a' kept no linear image of it. Run it again." in lines
    assert any(line.startswith("tiny/indirect.talk: the image has shape (11, 16, 3)") for line in lines)
    assert lines[-1] == "3 in common: 2 not compared, 1 same"
    other = tiny.model_copy(update={"emitters": ()})
    lines, status = diff(make_run("a", {IRRADIANCE: drawn}), make_run("b", {IRRADIANCE: drawn}, other))
    assert status == 2
    assert "does not show the scene 'tiny' as it is now" in lines[3]


def test_runs_without_a_common_check_are_refused(diff: Diff, make_run: MakeRun, drawn: Float32) -> None:
    a, b = make_run("a", {IRRADIANCE: drawn}), make_run("b", {"indirect.talk": drawn})
    with pytest.raises(InputError, match="no radiance check of scene 'tiny' in common"):
        diff(a, b)
    parity = make_run("c", {IRRADIANCE: drawn}, quantity="depth")
    with pytest.raises(InputError, match="no radiance check in common"):
        diff(parity, parity, scene=None)
    assert diff(a, a, scene="tiny.toml")[1] == 0
    with pytest.raises(InputError, match="no radiance check of scene 'small-room-knot' in common"):
        diff(a, a, scene="small-room-knot")


def test_a_scene_outside_the_library_must_be_named(diff: Diff, make_run: MakeRun, drawn: Float32) -> None:
    run = make_run("a", {IRRADIANCE: drawn})
    with pytest.raises(InputError, match=r"'tiny', which is not in the library\. Name its file with --scene"):
        diff(run, run, scene=None)


def test_a_run_is_a_folder_with_results_or_the_results_themselves(make_run: MakeRun, here: Path) -> None:
    run = make_run("a", {})
    (here / "empty").mkdir()
    assert is_run(run)
    assert is_run("a/results.json")
    assert not any(is_run(name) for name in ("", "empty", "nowhere", "no.json", "indirect.talk[side=64]"))
