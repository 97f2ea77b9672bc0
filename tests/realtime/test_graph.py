from collections.abc import Sequence

import pytest
from hypothesis import given
from hypothesis import strategies as st

from realtime.graph import Pass, plan

NAMES = "abcdef"


def step(name: str, writes: str, reads: str = "", uses: str = "", skip: str = "") -> Pass:
    """A pass whose resources have names of one letter."""
    return Pass(name, lambda frame: None, tuple(writes), tuple(reads), tuple(uses), skip)


def names(passes: Sequence[Pass]) -> list[str]:
    return [p.name for p in passes]


@st.composite
def chains(draw: st.DrawFn) -> list[Pass]:
    """Passes in a valid order: each reads and uses only what earlier ones write; the last writes `image`."""
    passes: list[Pass] = []
    written: list[str] = []
    for i in range(draw(st.integers(1, 8))):
        known = st.lists(st.sampled_from(written), unique=True, max_size=3) if written else st.just([])
        writes = draw(st.lists(st.sampled_from(NAMES), unique=True, min_size=1, max_size=2))
        passes.append(Pass(f"pass {i}", lambda frame: None, tuple(writes), tuple(draw(known)), tuple(draw(known))))
        written += writes
    last = st.lists(st.sampled_from(written), unique=True, max_size=3)
    return [*passes, Pass("last", lambda frame: None, ("image",), tuple(draw(last)))]


def test_what_nobody_reads_is_dropped_with_the_reason() -> None:
    made = plan([step("one", "a"), step("two", "bc"), step("three", "i", reads="a")], "i")
    assert names(made.passes) == ["one", "three"]
    assert [(s.what, s.why) for s in made.skipped] == [("two", "nothing reads b or c")]


def test_what_only_a_dropped_pass_reads_is_dropped_too() -> None:
    made = plan([step("one", "a"), step("two", "b", reads="a"), step("three", "i")], "i")
    assert names(made.passes) == ["three"]
    assert [s.what for s in made.skipped] == ["one", "two"]


def test_a_pass_that_is_skipped_is_reported_with_its_own_reason() -> None:
    made = plan([step("one", "a", skip="it is dark"), step("two", "i", uses="a")], "i")
    assert names(made.passes) == ["two"]
    assert [(s.what, s.why) for s in made.skipped] == [("one", "it is dark")]


def test_what_is_merely_used_is_still_written() -> None:
    made = plan([step("one", "a"), step("two", "i", uses="a")], "i")
    assert names(made.passes) == ["one", "two"]


def test_a_skipped_pass_asks_for_nothing() -> None:
    made = plan([step("one", "a"), step("two", "b", reads="a", skip="not needed"), step("three", "i", uses="b")], "i")
    assert names(made.passes) == ["three"]
    assert [s.what for s in made.skipped] == ["one", "two"]


def test_a_pass_may_replace_what_it_reads() -> None:
    made = plan([step("one", "a"), step("two", "a", reads="a"), step("three", "i", reads="a")], "i")
    assert names(made.passes) == ["one", "two", "three"]


def test_an_unsatisfied_input_is_named_with_the_pass_that_wants_it() -> None:
    with pytest.raises(ValueError, match="pass 'two' reads 'a', which no earlier pass"):
        plan([step("two", "i", reads="a"), step("one", "a")], "i")


def test_a_needed_pass_that_is_skipped_leaves_its_reader_unsatisfied() -> None:
    with pytest.raises(ValueError, match="pass 'two' reads 'a'"):
        plan([step("one", "a", skip="not today"), step("two", "i", reads="a")], "i")


def test_a_result_that_nobody_writes_is_named() -> None:
    with pytest.raises(ValueError, match="writes 'i'"):
        plan([step("one", "a")], "i")


@given(chains())
def test_each_pass_runs_in_order_or_is_skipped_with_a_reason(passes: list[Pass]) -> None:
    made = plan(passes, "image")
    kept, skipped = names(made.passes), [s.what for s in made.skipped]
    assert kept == [n for n in names(passes) if n in kept]
    assert skipped == [n for n in names(passes) if n in skipped]
    assert sorted(kept + skipped) == sorted(names(passes))
    assert all(s.why for s in made.skipped)


@given(chains())
def test_planning_a_plan_again_changes_nothing(passes: list[Pass]) -> None:
    made = plan(passes, "image")
    again = plan(made.passes, "image")
    assert again.passes == made.passes
    assert again.skipped == ()


@given(chains())
def test_every_pass_but_the_last_writes_what_a_later_one_wants(passes: list[Pass]) -> None:
    kept = plan(passes, "image").passes
    for i, one in enumerate(kept[:-1]):
        assert any(set(one.writes) & {*later.reads, *later.uses} for later in kept[i + 1 :])
