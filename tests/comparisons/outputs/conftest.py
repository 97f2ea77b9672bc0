"""A run in which everything went wrong that can."""

from collections.abc import Callable
from typing import Any

import pytest

Make = Callable[..., dict[str, Any]]

WORST = {"x": 3, "y": 5, "realtime": [0.5, 0.4, 0.3], "truth": [0.25, 0.2, 0.1], "sigma": [0.01, 0.01, 0.02]}
IMAGES = {"realtime": "images/a-realtime.png", "truth": "images/a-truth.png", "error": "images/a-error.png"}


@pytest.fixture(scope="session")
def bad_run(make_judged: Make, make_run: Make) -> dict[str, Any]:
    """Six checks, one of each verdict, one slack, and one of parity; and a scene that could not be read."""
    accepted = {"criteria": {"nrmse": [0.1, 0.09, 0.11]}, "date": "2026-01-01", "reason": "as in 2005", "renderer": ""}
    return make_run(
        make_judged(0.001, metric="rms", quantity="depth", technique="raster.depth"),
        make_judged(0.1, 0.08, 0.12, slack="budget slack: nrmse fell, tighten it"),
        make_judged(
            0.3,
            0.28,
            0.32,
            "FAIL",
            scene="hall",
            place="scenes/hall.toml:40",
            reason="100 % <b> | no",
            worst=WORST,
            images=IMAGES,
            accepted=accepted,
        ),
        make_judged(0.15, 0.14, 0.16, "REGRESSED", scene="attic", accepted=accepted, message="The error has risen."),
        make_judged(0.2, 0.1, 0.3, "INCONCLUSIVE", scene="cellar", message="about 692 spp would decide it"),
        make_judged(verdict="ERROR", scene="shed", message="side must divide 96.\nChange it."),
        broken=[{"argument": "scenes/ruin.toml", "message": "line 3: no such key"}],
    )
