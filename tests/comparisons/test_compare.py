"""`lightgauge export` and `lightgauge compare` as a user runs them; the engine is played by a shipped technique."""

import json
import re
import shlex
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from realtime.render import Renderer
from realtime.techniques import technique
from scenes import srgb
from scenes.exr import read_exr
from scenes.load import load_scene

DOCS = Path(__file__).parents[2] / "docs" / "your-engine.md"
ASK = ("--scene", "tiny.toml", "--quantity", "indirect_radiance")


def write_exr_of_another(path: Path, pixels: Any, names: tuple[str, ...] = ("R", "G", "B")) -> None:
    import OpenEXR

    planes = {name: np.ascontiguousarray(pixels[..., i], dtype=np.float32) for i, name in enumerate(names)}
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    OpenEXR.File(header, planes).write(str(path))


@pytest.fixture(scope="session")
def frames(finished: Path) -> tuple[Any, Any]:
    """What the engine renders of TINY: indirect radiance (12, 16, 3), and depth (12, 16, 1)."""
    (drawn,) = (finished / "report" / "images").glob("*indirect.irradiance*-linear.exr")
    depth = Renderer(load_scene(finished / "tiny.toml")).render(technique("raster.depth"), {}, timed=False)
    return read_exr(drawn).pixels, depth.image.pixels


@pytest.fixture
def engine(after_a_run: Path, frames: tuple[Any, Any]) -> tuple[Any, Any]:
    """The current folder has mine.exr and depth.exr of TINY, and its truth."""
    radiance, depth = frames
    write_exr_of_another(Path("mine.exr"), radiance)
    write_exr_of_another(Path("depth.exr"), depth, ("Z",))
    return frames


def test_an_image_is_measured(engine: tuple[Any, Any], lightgauge: Callable[..., Any]) -> None:
    outcome = lightgauge("compare", "mine.exr", *ASK)
    assert (outcome.status, outcome.err) == (0, "")
    assert "mine.exr: EXR, channels R, G, B, linear; 16 x 12 pixels" in outcome.out
    assert "parity was not checked" in outcome.out
    assert "nothing is passed or failed" in outcome.out
    measured = json.loads(Path("comparison/measured.json").read_text(encoding="utf-8"))
    nrmse = measured["metrics"]["nrmse"]
    assert 0 <= nrmse["low"] <= nrmse["value"] <= nrmse["high"] < 0.5
    assert set(measured["metrics"]) == {"nrmse", "rel_mse_eps1e-2", "energy_bias", "flip"}
    assert all((Path("comparison") / path).exists() for path in measured["images"].values())
    assert not Path("comparison/results.json").exists()


def test_with_budgets_it_is_the_gate_that_run_is(engine: tuple[Any, Any], lightgauge: Callable[..., Any]) -> None:
    """You should see the numbers of the technique whose image it is."""
    outcome = lightgauge("compare", "mine.exr", *ASK, "--budget", "nrmse=0.5", "-o", "gate")
    assert outcome.status == 0, outcome.err
    (check,) = json.loads(Path("gate/results.json").read_text(encoding="utf-8"))["checks"]
    every = json.loads(Path("report/results.json").read_text(encoding="utf-8"))["checks"]
    drawn = next(c for c in every if c["technique"] == "indirect.irradiance")
    assert check["id"] == "tiny/image:mine.exr"
    assert check["verdict"] == "PASS"
    assert [check["criteria"][0][key] for key in ("value", "low", "high", "max")] == [
        drawn["criteria"][0][key] for key in ("value", "low", "high", "max")
    ]
    assert Path("gate/index.html").exists()
    again = shlex.split(check["rerun"])
    assert lightgauge(*again[1:]).status == 0


def test_a_budget_that_is_exceeded_fails(engine: tuple[Any, Any], lightgauge: Callable[..., Any]) -> None:
    radiance, _ = engine
    write_exr_of_another(Path("mine.exr"), 3 * radiance)
    outcome = lightgauge("compare", "mine.exr", *ASK, "--budget", "nrmse=0.5", "-o", "gate")
    assert outcome.status == 1
    assert "FAIL tiny/image:mine.exr" in outcome.out
    assert "times too large" in outcome.out
    fitted = lightgauge("compare", "mine.exr", *ASK, "--budget", "nrmse=0.5", "--fit-exposure", "-o", "gate")
    assert fitted.status == 0
    assert "times 0.3" in fitted.out


def test_a_changed_image_is_judged_again(engine: tuple[Any, Any], lightgauge: Callable[..., Any]) -> None:
    radiance, _ = engine
    ask = ("compare", "mine.exr", *ASK, "--budget", "energy_bias=0.5", "-o", "gate")
    assert lightgauge(*ask).status == 0
    write_exr_of_another(Path("mine.exr"), 0.2 * radiance)
    outcome = lightgauge(*ask)
    assert outcome.status == 1, "a budget of a metric that has a sign holds in either direction"


def test_parity_is_seen_by_depth(engine: tuple[Any, Any], lightgauge: Callable[..., Any]) -> None:
    outcome = lightgauge("compare", "mine.exr", *ASK, "--depth", "depth.exr")
    assert outcome.status == 0, outcome.err
    assert "parity of the subject holds: distance along the viewing axis" in outcome.out


def test_distance_along_the_ray_is_converted(engine: tuple[Any, Any], lightgauge: Callable[..., Any]) -> None:
    """The cosines come from the camera's rays, not from the code under test: 30 degrees over 16 pixels."""
    _, depth = engine
    tangent = np.tan(np.radians(15)) / 8
    y, x = np.mgrid[:12, :16]
    length = np.sqrt(1 + ((x - 7.5) * tangent) ** 2 + ((y - 5.5) * tangent) ** 2)
    write_exr_of_another(Path("depth.exr"), depth * length[..., None], ("Z",))
    outcome = lightgauge("compare", "mine.exr", *ASK, "--depth", "depth.exr")
    assert outcome.status == 0, outcome.err
    assert "along the ray, which was converted" in outcome.out


DEPTHS: dict[str, tuple[Callable[[Any], Any], str]] = {
    "millimetres": (lambda z: 1000 * z, "1000 times too large (millimetres against metres)"),
    "upside down": (lambda z: z[::-1], "upside down"),
    "a depth buffer": (lambda z: 1 - 0.01 / z, "the linear distance, not what a depth buffer holds"),
    "nothing": (lambda z: np.full_like(z, np.inf), "no pixel of the subject has a depth"),
    "half of it": (lambda z: np.where(np.arange(12)[:, None, None] < 6, z, 1e10), "pixels of the subject have a depth"),
    "another size": (lambda z: z[:6, :8], "found 8 x 6 pixels"),
}


@pytest.mark.parametrize("what", DEPTHS)
def test_another_depth_stops_the_comparison(engine: tuple[Any, Any], lightgauge: Callable[..., Any], what: str) -> None:
    spoil, says = DEPTHS[what]
    write_exr_of_another(Path("depth.exr"), spoil(engine[1]), ("Z",))
    outcome = lightgauge("compare", "mine.exr", *ASK, "--depth", "depth.exr")
    assert outcome.status == 3
    assert says in outcome.err
    assert "nrmse" not in outcome.out


BAD: dict[str, tuple[tuple[str, ...], str]] = {
    "no such metric": (("--budget", "nrms=1"), "unknown metric 'nrms'"),
    "no number": (("--budget", "nrmse"), "has no bound. Write METRIC=MAX"),
    "a budget twice": (("--budget", "nrmse=1", "--budget", "nrmse=2"), "second for nrmse"),
    "the layer of no depth": (("--depth-layer", "Z"), "Name that file, too, with --depth"),
    "a metric for exact truths": (("--budget", "max_abs=1"), "max_abs takes the truth as exact"),
    "no such layer": (("--layer", "Beauty"), "'Beauty' names none of them"),
    "no such color space": (("--color-space", "rec2020"), "invalid choice"),
}


@pytest.mark.parametrize("what", BAD)
def test_a_wrong_option_is_explained(engine: tuple[Any, Any], lightgauge: Callable[..., Any], what: str) -> None:
    options, says = BAD[what]
    outcome = lightgauge("compare", "mine.exr", *ASK, *options)
    assert outcome.status == 3
    assert says in outcome.err


@pytest.mark.parametrize(
    ("quantity", "says"),
    [
        ("visibility", "visibility is no colour"),
        ("normal", "normal goes beyond"),
        ("transmitted_radiance", "transmitted_radiance is not defined here"),
        ("visiblity", "Unknown quantity"),
    ],
)
def test_a_quantity_that_the_file_cannot_show_is_refused(
    engine: tuple[Any, Any], lightgauge: Callable[..., Any], quantity: str, says: str
) -> None:
    from PIL import Image

    shape = (12, 16) if quantity == "visibility" else (12, 16, 3)
    Image.fromarray(np.full(shape, 200, dtype=np.uint8)).save("mine.png")
    outcome = lightgauge("compare", "mine.png", "--scene", "tiny.toml", "--quantity", quantity)
    assert outcome.status == 3
    assert says in outcome.err


def test_an_exact_quantity_is_measured(engine: tuple[Any, Any], lightgauge: Callable[..., Any]) -> None:
    outcome = lightgauge("compare", "depth.exr", "--scene", "tiny.toml", "--quantity", "depth")
    assert outcome.status == 0, outcome.err
    assert "Measured against an exact truth" in outcome.out
    assert json.loads(Path("comparison/measured.json").read_text())["metrics"]["rel_rms"]["value"] < 1e-4


def test_export_says_what_to_render(write_scene: Callable[..., Path], lightgauge: Callable[..., Any]) -> None:
    write_scene()
    outcome = lightgauge("export", "tiny.toml")
    assert (outcome.status, outcome.err) == (0, "")
    assert Path("tiny.glb").read_bytes()[:4] == b"glTF"
    assert "Render 16 x 12 pixels" in outcome.out
    assert "indirect_radiance [W/(m² sr)]" in outcome.out
    assert "transmitted_radiance" not in outcome.out, "it has no truth for a scene without a translucent body"
    assert lightgauge("export", "tiny.toml", "-o", "tiny.obj").status == 3


def test_every_command_of_the_docs_runs(engine: tuple[Any, Any], lightgauge: Callable[..., Any]) -> None:
    from PIL import Image

    radiance, depth = engine
    shutil.copy("tiny.toml", "room.toml")
    write_exr_of_another(Path("flipped.exr"), radiance[::-1])
    Image.fromarray(np.rint(255 * srgb.encode(radiance)).astype(np.uint8)).save("mine.png")
    layers = tuple(f"View.{layer}" for layer in ("Indirect.R", "Indirect.G", "Indirect.B", "Depth.Z"))
    both = np.concatenate([radiance, depth], axis=2)
    more = tuple(f"View.Direct.{channel}" for channel in "RGB")
    write_exr_of_another(Path("all.exr"), np.concatenate([both, 2 * radiance], axis=2), (*layers, *more))
    commands = re.findall(r"^lightgauge (.*)$", DOCS.read_text(encoding="utf-8"), flags=re.MULTILINE)
    said = [lightgauge(*shlex.split(command)) for command in commands]
    assert len(said) == 6
    assert [outcome.status for outcome in said] == [0] * 6, [outcome.err for outcome in said]
    assert "upside down" in next(o.out for o, c in zip(said, commands, strict=True) if "flipped" in c)
