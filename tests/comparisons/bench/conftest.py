"""Points and traced images with few words."""

from collections.abc import Callable
from typing import Any

import pytest

from comparisons.bench.result import FrameCost, Interval, Point, Traced

SAME: dict[str, Any] = {
    "scene": "room",
    "effect": "indirect light",
    "quantity": "indirect_radiance",
    "width": 16,
    "height": 12,
    "metric": "nrmse",
}


def around(value: float, share: float) -> Interval:
    return Interval(value, value * (1 - share), value * (1 + share))


@pytest.fixture
def make_point() -> Callable[..., Point]:
    """Makes a point: make_point(error=0.1, seconds=0.01, technique="indirect.probe", share=0.1)."""

    def make(error: float, seconds: float, share: float = 0.0, **others: Any) -> Point:
        cost = FrameCost(around(seconds, share), seconds, 31, "wall clock around finish()", {}, {}, 1000)
        known: dict[str, Any] = {"technique": "indirect.probe", "settings": {}, "swept": ""}
        return Point(**(SAME | known | others), error=around(error, share), cost=cost)

    return make


@pytest.fixture
def make_traced() -> Callable[..., Traced]:
    """Makes an image of the path tracer: make_traced(spp=4, error=0.5, seconds=0.02)."""

    def make(spp: int, error: float, seconds: float, share: float = 0.0, **others: Any) -> Traced:
        known: dict[str, Any] = {"integrator": "path tracing", "variant": "llvm_ad_rgb", "peak_bytes": 1000}
        return Traced(**(SAME | known | others), spp=spp, error=around(error, share), seconds=around(seconds, share))

    return make


@pytest.fixture
def ladder(make_traced: Callable[..., Traced]) -> list[Traced]:
    """Images of 1 to 16 spp, with an error of spp^-1/2 that takes 10 ms a sample."""
    return [make_traced(spp, spp**-0.5, 0.01 * spp) for spp in (1, 2, 4, 8, 16)]
