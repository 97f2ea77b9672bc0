from collections.abc import Callable
from pathlib import Path

from comparisons.bench.measure import Measured
from comparisons.bench.plan import Ablated, Scaled
from comparisons.bench.result import Point, Traced
from comparisons.bench.traced import slope_of
from comparisons.partial import Partial


def test_what_is_kept_is_found_again_as_it_was(
    tmp_path: Path, make_point: Callable[..., Point], ladder: list[Traced]
) -> None:
    slope = slope_of(ladder)
    assert slope is not None
    part = Measured(
        [make_point(0.1, 0.02, settings={"side": 24, "facets": True, "boost": 2.0, "method": "pcss"}, swept="side")],
        ladder,
        [slope],
        [{"what": "x", "why": "y"}],
        "llvmpipe",
    )
    path = tmp_path / "partial.json"
    Partial(path).keep("key", part)
    found = Partial(path).found("key", Measured)
    assert found == part
    assert isinstance(found, Measured)
    assert [type(value) for value in found.points[0].settings.values()] == [int, bool, float, str]


def test_what_is_not_there_or_of_another_kind_is_not_found(tmp_path: Path) -> None:
    path = tmp_path / "partial.json"
    kept = Partial(path)
    kept.keep("key", Scaled(skipped=[{"what": "x", "why": "y"}]))
    assert kept.found("other", Scaled) is None
    assert kept.found("key", Scaled) == Scaled(skipped=[{"what": "x", "why": "y"}])
    kept.keep("list", Ablated())
    assert Partial(path).found("list", Ablated) == Ablated()
    kept.remove()
    assert not path.exists()
    assert Partial(path).found("key", Scaled) is None


def test_a_broken_file_holds_nothing(tmp_path: Path) -> None:
    path = tmp_path / "partial.json"
    for text in ("{", "[]", '{"key": {"points": 3}}'):
        path.write_text(text, encoding="utf-8")
        assert Partial(path).found("key", Measured) is None
