from collections.abc import Callable
from typing import Any

import pytest

from comparisons.report.view import MOST_URGENT, keys_of, overview_of
from scenes.errors import InputError

Make = Callable[..., dict[str, Any]]


def test_all_passing_names_the_check_closest_to_its_budget(
    make_results: Make, make_check: Make, make_criterion: Make
) -> None:
    close = make_check(scene="close", criteria=[make_criterion(value=0.079)])
    far = make_check(scene="far", criteria=[make_criterion(value=0.01)])
    page = overview_of(make_results(far, close))
    assert page.sentence.startswith("All 2 checks hold their budgets; closest to its budget: close with")
    assert (page.verdict, page.urgent) == ("PASS", ())


def test_the_worst_failure_is_the_one_furthest_beyond_its_budget(
    make_results: Make, make_check: Make, make_criterion: Make
) -> None:
    bad = make_criterion(value=0.1, verdict="FAIL")
    worse = make_criterion("flip", 0.5, max=0.1, verdict="FAIL")
    page = overview_of(
        make_results(
            make_check(),
            make_check(scene="bad", verdict="FAIL", criteria=[bad]),
            make_check(scene="worse", settings={"c": 2.5}, verdict="FAIL", criteria=[make_criterion(), worse]),
            make_check(verdict="ERROR", criteria=[]),
            make_check(verdict="INCONCLUSIVE"),
        )
    )
    assert page.sentence == (
        "2 of 5 checks exceed their budget: worst is worse with indirect.irradiance "
        "(c\u00a0=\u00a02.5, exposure fitted), flip 0.500 against ≤ 0.1."
    )
    assert page.rest.startswith("1 is undecided")
    assert page.rest.endswith("1 could not be judged.")
    assert page.counts == (("ERROR", 1), ("FAIL", 2), ("INCONCLUSIVE", 1), ("PASS", 1))
    assert [(view.verdict, view.raw["scene"]) for view in page.urgent] == [
        ("ERROR", "room"),
        ("FAIL", "worse"),
        ("FAIL", "bad"),
        ("INCONCLUSIVE", "room"),
    ]


def test_of_many_that_do_not_pass_the_worst_stand_above(make_results: Make, make_check: Make) -> None:
    page = overview_of(make_results(*(make_check(verdict="FAIL") for _ in range(MOST_URGENT + 2)), make_check()))
    assert (len(page.urgent), page.more_urgent) == (MOST_URGENT, 2)


def test_a_regression_is_told_after_failures_and_before_what_is_undecided(
    make_results: Make, make_check: Make, make_criterion: Make
) -> None:
    risen = make_criterion(value=0.05, verdict="REGRESSED")
    regressed = make_check(scene="risen", verdict="REGRESSED", criteria=[make_criterion("flip", 0.0799), risen])
    page = overview_of(make_results(make_check(), make_check(verdict="INCONCLUSIVE"), regressed))
    assert page.verdict == "REGRESSED"
    assert page.sentence.startswith("1 of 3 checks has regressed within the budget: worst is risen with")
    assert page.sentence.endswith("nrmse 5.00\u202f% against ≤ 8\u202f%.")
    failed = make_check(verdict="FAIL", criteria=[make_criterion(value=0.1, verdict="FAIL")])
    page = overview_of(make_results(failed, regressed, regressed))
    assert page.verdict == "FAIL"
    assert page.sentence.startswith("1 of 3 checks exceeds its budget")
    assert page.rest == "2 have regressed within the budget."


def test_scenes_that_could_not_be_read_are_told(make_results: Make, make_check: Make) -> None:
    broken = [{"argument": "kitchen.toml", "scene": "kitchen", "message": "kitchen.toml:3: no such key"}]
    page = overview_of(make_results(make_check(), broken=broken))
    assert page.broken == (("kitchen.toml", "kitchen.toml:3: no such key"),)
    assert page.rest == "1 scene could not be read, and is not judged."


def test_a_run_with_a_scene_that_could_not_be_read_is_no_pass(make_results: Make, make_check: Make) -> None:
    broken = [{"argument": "kitchen.toml", "scene": "kitchen", "message": "kitchen.toml:3: no such key"}]
    page = overview_of(make_results(make_check(), make_check(scene="hall"), broken=broken))
    assert page.verdict == "ERROR"
    assert page.sentence == "2 checks hold their budget, but not all scenes could be read."


def test_parity_checks_are_apart(make_results: Make, make_check: Make) -> None:
    page = overview_of(make_results(make_check(quantity="depth"), make_check(), make_check(quantity="emission")))
    assert [view.raw["quantity"] for view in page.checks] == ["indirect_radiance"]
    assert [view.raw["quantity"] for view in page.parity] == ["depth", "emission"]
    assert [view.raw["quantity"] for view in page.all] == ["indirect_radiance", "depth", "emission"]


def test_facets_count_the_checks_of_each_value_and_effects_stand_in_the_order_of_the_registry(
    make_results: Make, make_check: Make
) -> None:
    defocus = make_check(quantity="defocus_radiance", technique="defocus.talk", scene="row", verdict="FAIL")
    page = overview_of(make_results(make_check(quantity="depth"), defocus, make_check(), make_check()))
    facets = {facet.name: facet.options for facet in page.facets}
    assert facets["effect"] == (("indirect light", 2), ("defocus", 1), ("parity", 1))
    assert facets["scene"] == (("room", 3), ("row", 1))
    assert facets["technique"] == (("defocus.talk", 1), ("indirect.irradiance", 3))
    assert facets["verdict"] == (("FAIL", 1), ("PASS", 3))


def test_each_check_has_a_page_of_its_own(make_results: Make, make_check: Make) -> None:
    page = overview_of(make_results(make_check(), make_check(), make_check(scene="other")))
    names = {view.name for view in page.all}
    assert len(names) == 3
    assert "room-indirect.irradiance-bounces-3-shadows-True-fitted-" in names


def test_keys_tell_the_browser_what_to_sort_and_to_find(make_results: Make, make_check: Make) -> None:
    (view,) = overview_of(make_results(make_check())).checks
    keys = keys_of(view)
    assert (keys["error"], keys["budget"], keys["spp"], keys["saved"]) == (0.0731, 0.08, 4096, 4)
    assert (keys["realtime"], keys["truth"]) == (0.00184, 12.41)
    assert keys["use"] == pytest.approx(0.0731 / 0.08)
    for found in ("room/indirect.irradiance", "small coloured room", "indirect light", "fitted", "pass"):
        assert found in keys["text"]


def test_keys_of_what_was_not_measured_are_empty(make_results: Make, make_check: Make) -> None:
    bare = make_check(verdict="ERROR", criteria=[], seconds={}, spp=0, spp_fixed=0, accepted=None, message="No Light")
    keys = keys_of(overview_of(make_results(bare)).checks[0])
    unknown = ("error", "budget", "use", "realtime", "truth", "saved", "change")
    assert [keys[key] for key in unknown] == [None] * len(unknown)
    assert "no light" in keys["text"]


def test_results_of_another_schema_are_refused(make_results: Make) -> None:
    with pytest.raises(InputError, match="schema 2"):
        overview_of(make_results(schema=2))


def test_a_check_without_its_scene_is_refused(make_results: Make, make_check: Make) -> None:
    with pytest.raises(InputError, match="Check 2 of these results lacks scene"):
        overview_of(make_results(make_check(), make_check() | {"scene": None}))


def test_the_footer_tells_shards_and_jobs(make_results: Make) -> None:
    assert {"shard 2/5", "4 jobs at a time"} <= set(overview_of(make_results(shard="2/5", jobs=4)).summary)
    alone = overview_of(make_results(shard=None, jobs=1)).summary
    assert not [part for part in alone if "shard" in part or "jobs" in part]
