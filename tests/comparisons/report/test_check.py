from collections.abc import Callable
from typing import Any

import pytest

from comparisons.gate import Verdict
from comparisons.report.check import GLYPHS, SEVERITY, Change, check_of
from comparisons.report.names import different, stem_of
from scenes.errors import InputError

Make = Callable[..., dict[str, Any]]


def test_every_verdict_has_a_rank_and_a_glyph() -> None:
    assert list(SEVERITY) == [str(verdict) for verdict in reversed(Verdict)]
    assert set(GLYPHS) == set(SEVERITY)


def test_the_headline_is_the_criterion_that_decides(make_check: Make, make_criterion: Make) -> None:
    failed = [make_criterion("flip", 0.09), make_criterion(value=0.2, verdict="FAIL")]
    view = check_of(1, make_check(verdict="FAIL", criteria=failed), "a")
    assert view.headline is not None
    assert view.headline.metric == "nrmse"


def test_the_effect_is_that_of_the_quantity_unless_the_results_tell_it(make_check: Make) -> None:
    assert check_of(1, make_check(), "a").effect == "indirect light"
    assert check_of(1, make_check(quantity="depth"), "a").is_parity
    assert check_of(1, make_check(effect="fog"), "a").effect == "fog"


@pytest.mark.parametrize(
    ("changes", "change"),
    [
        ({}, Change(0.0731 / 0.0725, "×\u00a01.01", "→", "")),
        ({"slack": "budget slack"}, Change(0.0731 / 0.0725, "×\u00a01.01", "→", "slack")),
        ({"verdict": "REGRESSED"}, Change(0.0731 / 0.0725, "×\u00a01.01", "→", "regressed")),
        ({"accepted": None}, None),
        ({"gl_renderer": "NVIDIA H200/PCIe"}, Change(None, "", "", "other renderer")),
    ],
)
def test_the_change_since_the_error_was_accepted(
    make_check: Make, make_criterion: Make, changes: dict[str, Any], change: Change | None
) -> None:
    accepted = make_check()["accepted"] | {"renderer": "llvmpipe"}
    found = check_of(1, make_check(criteria=[make_criterion()], accepted=accepted, slack="") | changes, "a").change
    assert found == change


@pytest.mark.parametrize(("value", "arrow"), [(0.08, "↗"), (0.0725, "→"), (0.06, "↘")])
def test_an_arrow_tells_the_direction(make_check: Make, make_criterion: Make, value: float, arrow: str) -> None:
    change = check_of(1, make_check(criteria=[make_criterion(value=value)]), "a").change
    assert change is not None
    assert change.arrow == arrow


def test_passes_are_as_long_as_their_share_of_the_longest(make_check: Make) -> None:
    passes = check_of(1, make_check(), "a").passes
    assert [(one.name, one.seconds, one.share) for one in passes] == [
        ("capture", "1.20\u202fms", 1.0),
        ("gather", "600\u202fµs", 0.5),
    ]


def test_saved_samples_are_those_of_a_truth_of_fixed_size(make_check: Make) -> None:
    view = check_of(1, make_check(), "a")
    assert view.saved == 4
    assert view.samples.endswith("a truth of fixed size, as certain, takes 16\u202f384: 4 times as many")
    exact = check_of(1, make_check(spp=0, spp_fixed=0), "a")
    assert (exact.saved, exact.samples) == (None, "")


@pytest.mark.parametrize("verdict", ["INCONCLUSIVE", "ERROR"])
def test_where_nothing_was_decided_nothing_was_saved(make_check: Make, verdict: str) -> None:
    view = check_of(1, make_check(verdict=verdict), "a")
    assert view.saved is None
    assert view.samples.startswith("4\u202f096 spp without a verdict")
    assert "fixed size" not in view.samples


def test_pictures_of_more_samples_than_the_verdict_took_say_so(make_check: Make) -> None:
    told = "pictures and the worst pixel show all 9\u202f000 spp that the store holds"
    assert check_of(1, make_check(spp_shown=9000), "a").samples.endswith(told)
    assert "pictures" not in check_of(1, make_check(spp_shown=4096), "a").samples


def test_the_worst_pixel_in_numbers(make_check: Make) -> None:
    pixel = check_of(1, make_check(), "a").worst
    assert pixel is not None
    assert (pixel.x, pixel.y) == (12, 7)
    red, green, blue = pixel.channels
    assert (red.name, red.realtime, red.truth, red.sigma) == ("red", "0.500", "0.250", "0.0500")
    assert (red.error, red.sigmas) == ("+0.250", "5.00")
    assert (green.error, green.sigma, green.sigmas) == ("−0.250", "", "–")
    assert (blue.error, blue.sigmas) == ("0", "0")
    assert check_of(1, make_check(worst=None), "a").worst is None


def test_channels_are_named_for_what_they_hold(make_check: Make) -> None:
    def names(count: int, display: str) -> list[str]:
        worst = {"x": 0, "y": 0} | {key: [0.5] * count for key in ("realtime", "truth", "sigma")}
        pixel = check_of(1, make_check(worst=worst, display=display), "a").worst
        assert pixel is not None
        return [channel.name for channel in pixel.channels]

    assert names(1, "unit") == ["value"]
    assert names(2, "uv") == ["u", "v"]
    assert names(3, "normal") == ["x", "y", "z"]


@pytest.mark.parametrize("lost", ["id", "scene", "technique", "quantity", "verdict"])
def test_a_check_without_its_identity_is_refused(make_check: Make, lost: str) -> None:
    with pytest.raises(InputError, match=f"Check 3 of these results lacks {lost}"):
        check_of(3, {key: value for key, value in make_check().items() if key != lost}, "a")


def test_an_unknown_verdict_is_refused(make_check: Make) -> None:
    with pytest.raises(InputError, match="lacks a known verdict"):
        check_of(1, make_check(verdict="FINE"), "a")


def test_names_of_pages_differ_on_every_file_system() -> None:
    assert stem_of("room/indirect.talk[c=7.0,fitted]") == "room-indirect.talk-c-7.0-fitted-"
    assert list(different(["a", "b", "a", "A", "a-2"])) == ["a", "b", "a-2", "A-3", "a-2-2"]
