"""Translucent bodies and eyes from a scene file to the report."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image as Picture

from scenes.procedural import icosphere

Lightgauge = Callable[..., Any]

PARITY = {"normal", "depth", "coverage", "albedo"}

BODY = """\
title = "A translucent ball"
length_unit = "mm"
subject = ["ball"]

[sensor]
type = "perspective"
origin = [20.0, 30.0, 80.0]
target = [0.0, 0.0, 0.0]
fov_deg = 14.0
width = 28
height = 24

[materials]
skin = { type = "translucent", medium = "skin1" }

[[shapes]]
name = "ball"
type = "mesh"
path = "ball.obj"
shading = "smooth"
scale = 8.0
material = "skin"

[[emitters]]
type = "directional"
direction = [0.0, 0.0, 1.0]
irradiance = [1.0, 1.0, 1.0]

[[checks]]
quantity = "thickness"
technique = "translucency.additive_thickness"
criteria = [{ metric = "rms", max = 5.0, reason = "far above what is reached" }]

[[checks]]
quantity = "thickness"
technique = "translucency.additive_thickness"
settings = { allow_open = true }
criteria = [{ metric = "rms", max = 100.0, reason = "what has no front counts from the camera" }]
"""

EYE = """\
title = "An eye and a lamp"
length_unit = "mm"
subject = ["eye"]

[sensor]
type = "perspective"
origin = [0.0, 110.0, 40.0]
target = [0.8, 9.5, 0.0]
up = [0.0, 0.0, -1.0]
fov_deg = 8.0
width = 20
height = 20

[materials]
white = { type = "diffuse", reflectance = [0.78, 0.74, 0.7] }
iris = { type = "diffuse", reflectance = [0.3, 0.4, 0.5] }

[[shapes]]
name = "eye"
type = "eye"
sclera_radius = 12.0
cornea_radius = 7.8
limbus_radius = 5.9
ior = 1.3375
iris_depth = 3.55
pupil_radius = 2.0
rotation_deg = [0.0, 25.0, 0.0]
material = "white"
iris = "iris"

[[emitters]]
type = "disk"
position = [80.0, 150.0, -100.0]
normal = [-0.4, -0.75, 0.5]
radius = 17.5
radiance = [60.0, 58.0, 55.0]

[[checks]]
quantity = "iris_radiance"
technique = "cornea.anatomical_iris"
criteria = [{ metric = "nrmse", max = 0.15, reason = "twice what is thought excellent" }]
"""


def write_ball(folder: Path, *, closed: bool) -> None:
    """A ball of radius 1 as an OBJ file; if it is not closed a tenth of its faces is missing."""
    positions, faces = icosphere(3)
    kept = faces if closed else faces[len(faces) // 10 :]
    lines = [f"v {x} {y} {z}" for x, y, z in positions] + [f"f {a} {b} {c}" for a, b, c in kept + 1]
    (folder / "ball.obj").write_text("\n".join(lines), encoding="ascii")


def results(folder: Path) -> dict[str, dict[str, Any]]:
    checks = json.loads((folder / "report" / "results.json").read_text(encoding="utf-8"))["checks"]
    return {
        check["id"]: check for check in checks if check["quantity"] not in ("normal", "depth", "coverage", "albedo")
    }


def test_an_open_mesh_is_an_error_unless_it_is_allowed(here: Path, lightgauge: Lightgauge) -> None:
    (here / "body.toml").write_text(BODY, encoding="utf-8")
    write_ball(here, closed=False)
    assert lightgauge("run", "body.toml").status == 4
    refused, allowed = (results(here)[f"body/translucency.additive_thickness{s}"] for s in ("", "[allow_open=True]"))
    assert refused["verdict"] == "ERROR"
    assert "front and back faces do not pair up" in refused["message"]
    assert "allow_open = true" in refused["message"]
    with Picture.open(here / "report" / refused["images"]["realtime"]) as picture:
        flagged = np.all(np.asarray(picture) == (255, 0, 255), axis=2)
    assert f"In {np.count_nonzero(flagged)} of the" in refused["message"]
    assert flagged.any(axis=1).sum() > 3
    assert allowed["verdict"] == "PASS"
    assert allowed["criteria"][0]["value"] > 0.01


def test_the_thickness_of_a_closed_mesh_is_exact(here: Path, lightgauge: Lightgauge) -> None:
    (here / "body.toml").write_text(BODY, encoding="utf-8")
    write_ball(here, closed=True)
    assert lightgauge("run", "body.toml").status == 0
    check = results(here)["body/translucency.additive_thickness"]
    assert check["unit"] == "mm"
    assert check["criteria"][0]["value"] < 0.01


def test_what_ignoring_caustics_costs_stands_in_results_and_report(here: Path, lightgauge: Lightgauge) -> None:
    (here / "eye.toml").write_text(EYE, encoding="utf-8")
    assert lightgauge("run", "eye.toml").status == 0
    variants = {v["quantity"]: v for v in results(here)["eye/cornea.anatomical_iris"]["variants"]}
    assert set(variants) == {"iris_radiance_flat", "iris_radiance_straight"}
    assert all(0.05 < v["low"] <= v["nrmse"] <= v["high"] < 1 for v in variants.values())
    page = here / "report" / "checks" / "eye-cornea.anatomical_iris.html"
    assert "What it would lose" in page.read_text(encoding="utf-8")


def test_a_quantity_that_a_scene_does_not_have_is_bad_input(here: Path, lightgauge: Lightgauge) -> None:
    checks = EYE[EYE.index("[[checks]]") :]
    (here / "body.toml").write_text(BODY[: BODY.index("[[checks]]")] + checks, encoding="utf-8")
    write_ball(here, closed=True)
    assert lightgauge("run", "body.toml").status == 3
    (check,) = results(here).values()
    assert "iris_radiance is not defined here: the scene has no eye" in check["message"]


@pytest.mark.parametrize(
    ("new", "said"), [('"skin7"', "skin1, skin2, dermis"), ('"skin1", sigma_a = [1.0, 1.0, 1.0]', "either medium")]
)
def test_a_medium_that_is_unknown_or_twice_is_refused(here: Path, lightgauge: Lightgauge, new: str, said: str) -> None:
    (here / "body.toml").write_text(BODY.replace('"skin1"', new), encoding="utf-8")
    write_ball(here, closed=True)
    outcome = lightgauge("run", "body.toml")
    assert outcome.status == 3
    assert said in outcome.err
