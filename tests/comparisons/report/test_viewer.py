"""Every control of the viewer, used in a real browser as a person would; what it does is read off the display."""

import json
import math
import shutil
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from jinja2 import Environment, FileSystemLoader
from numpy.typing import NDArray
from PIL import Image as Picture

import comparisons.report
from comparisons.metrics import Samples
from comparisons.metrics.flip import flip_image
from comparisons.report.page import controls_script
from comparisons.report.pictures import DIVERGING, MAGMA, NOT_A_NUMBER, NOT_JUDGED, VIRIDIS, write_pictures
from comparisons.report.pixels import write_pixels
from comparisons.significance import significance
from comparisons.tonemap import exposure_for, to_display
from reference.quantity import Display

TEMPLATES = Path(comparisons.report.__file__).parent / "templates"
IMAGES = ["realtime", "truth", "error", "flip", "significance"]
WIDTH, HEIGHT = 24, 16
SCALE, SMOOTHING = 0.2, 1.5
PAGE = """<!doctype html>
<html lang="en"><head><meta charset="utf-8"><title>A check</title><meta name="color-scheme" content="light dark">
<link rel="icon" href="data:,"><link rel="stylesheet" href="assets/viewer.css">
<style>body { margin: 1rem; background: Canvas; color: CanvasText; }</style></head><body>
{% from "viewer.html" import viewer %}
{% call viewer("radiance of room") %}<img src="images/room-truth.png" alt="The truth">{% endcall %}
<script src="assets/viewer.js"></script><script src="assets/controls.js"></script><script src="pixels/room.js"></script>
</body></html>"""

Array = NDArray[Any]


class Case:
    """A check without a scene: an image, a noisy truth, and what the pictures show of them."""

    def __init__(self) -> None:
        random = np.random.default_rng(5)
        rows, columns = np.mgrid[:HEIGHT, :WIDTH]
        truth = (0.6 + 0.4 * np.sin(columns / 4) * np.cos(rows / 3))[..., None] * np.array([1.0, 0.7, 0.4])
        error = np.where(columns >= 16, 0.0, np.where(rows < 8, 0.12, -0.1))
        self.test = (truth + error[..., None]).astype(np.float32)
        self.mask = np.hypot(rows - 8, columns - 12) < 11
        noise = random.normal(0, 0.2, (16, HEIGHT, WIDTH, 3)) * np.linspace(0.2, 1.0, HEIGHT)[:, None, None]
        self.samples = Samples((truth + noise).astype(np.float32), self.mask)
        self.truth = self.samples.mean
        self.exposure = exposure_for(self.truth, self.mask)
        self.flip = flip_image(self.test, self.samples)
        self.found = significance(self.test, self.samples)
        assert self.found is not None
        assert 0 < self.found.share < 1

    def write(self, folder: Path, **more: Any) -> None:
        test = more.pop("test", self.test)
        write_page(folder)
        given = {"exposure": self.exposure, "error_scale": SCALE, "smoothing": SMOOTHING} | more
        given |= {"significance": self.found, "flip": self.flip, "display": "radiance"}
        write_pixels(folder, "room", test, self.samples, quantity="radiance", unit="W/(m² sr)", worst=(5, 12), **given)
        write_pictures(folder, "room", test, self.truth.astype(np.float32), self.mask, **given)


def write_page(folder: Path) -> None:
    """A page with the viewer, and the scripts and styles that it names."""
    (folder / "assets").mkdir(parents=True)
    for name in ("viewer.js", "viewer.css"):
        shutil.copy(TEMPLATES / name, folder / "assets" / name)
    (folder / "assets" / "controls.js").write_text(controls_script(), encoding="utf-8")
    environment = Environment(loader=FileSystemLoader(TEMPLATES), autoescape=True)
    (folder / "check.html").write_text(environment.from_string(PAGE).render(), encoding="utf-8")


class Viewer:
    """A page with a viewer that is ready."""

    def __init__(self, page: Any) -> None:
        self.page = page
        page.wait_for("typeof lightgauge === 'object' && lightgauge.ready !== null")
        page.evaluate("lightgauge.ready")

    def state(self, key: str) -> Any:
        return self.page.evaluate(f"lightgauge.viewer.state.{key}")

    def focus(self) -> None:
        self.page.evaluate("document.querySelector('.viewer-stage').focus({preventScroll: true})")

    def press(self, *keys: str, shift: bool = False) -> None:
        """Press keys while the images have the focus."""
        self.focus()
        for key in keys:
            self.page.key(key, shift=shift)

    def centre(self, image: str) -> tuple[float, float]:
        """The middle of a pane in the window."""
        left, top, width, height = self.page.box(f"[data-pane={image}] .viewer-image")
        return left + width / 2, top + height / 2

    def zoom(self) -> float:
        """CSS pixels for an image pixel, as the page says it."""
        scale = self.page.evaluate("devicePixelRatio")
        return float(self.page.text(".viewer-zoom").split()[1]) / float(scale)

    def place(self, image: str, x: float, y: float) -> tuple[float, float]:
        """Where the middle of an image's pixel lies in the window."""
        left, top = self.centre(image)
        zoom = self.zoom()
        return left + (x + 0.5 - self.state("x")) * zoom, top + (y + 0.5 - self.state("y")) * zoom

    def seen(self, image: str) -> NDArray[np.int64]:
        """(H, W, 3), the colour at the middle of each pixel of an image, as the display shows it."""
        box = self.page.box(f"[data-pane={image}] .viewer-image")
        zoom, centre, scale = self.zoom(), (self.state("x"), self.state("y")), self.page.evaluate("devicePixelRatio")
        columns = (box[2] / 2 + (np.arange(WIDTH) + 0.5 - centre[0]) * zoom) * scale
        rows = (box[3] / 2 + (np.arange(HEIGHT) + 0.5 - centre[1]) * zoom) * scale
        shot = self.page.screenshot(part=box)
        assert min(columns[0], rows[0]) >= 0, "the image lies within its pane"
        colours: NDArray[np.int64] = shot[rows.astype(int)][:, columns.astype(int)].astype(np.int64)
        return colours

    def colour_at(self, x: float, y: float) -> NDArray[np.int64]:
        """The colour of the display at a place of the window."""
        colour: NDArray[np.int64] = self.page.screenshot(part=(int(x), int(y), 1, 1))[0, 0].astype(np.int64)
        return colour

    def read_out(self) -> list[list[str]]:
        """The texts of the table of values, row by row."""
        rows = "[...document.querySelectorAll('.viewer-inspector tr')].map(row => [...row.cells].map(c => c.innerText))"
        found: list[list[str]] = self.page.evaluate(rows)
        return found

    def choose(self, name: str, *keys: str) -> None:
        """Change a control by its keys."""
        self.page.evaluate(f"document.querySelector('[name={name}]').focus()")
        for key in keys:
            self.page.key(key)


@pytest.fixture(scope="module")
def case() -> Case:
    return Case()


@pytest.fixture(scope="module")
def folder(case: Case, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A report of one check."""
    made = tmp_path_factory.mktemp("report")
    case.write(made)
    return made


@pytest.fixture
def opened(open_page: Callable[..., Any]) -> Iterator[Callable[..., Viewer]]:
    """Opens the page of a folder; in the end, none of them has complained."""
    viewers: list[Viewer] = []

    def opener(folder: Path, *size: int, **more: Any) -> Viewer:
        viewers.append(Viewer(open_page(folder / "check.html", *size, **more)))
        return viewers[-1]

    yield opener
    for viewer in viewers:
        assert viewer.page.problems() == []


@pytest.fixture
def viewer(folder: Path, tab: Any) -> Iterator[Viewer]:
    """The viewer of the check, newly loaded."""
    tab.go((folder / "check.html").resolve().as_uri())
    yield Viewer(tab)
    assert tab.problems() == []


def rgb(colour: str) -> list[int]:
    return [int(colour[i : i + 2], 16) for i in (1, 3, 5)]


def coloured(values: Array, low: float, high: float, colours: tuple[str, ...]) -> Array:
    stops = np.array([rgb(colour) for colour in colours])
    positions = np.linspace(low, high, len(stops))
    return np.stack([np.interp(values, positions, stops[:, c]) for c in range(3)], axis=-1)


def assert_shown(seen: Array, expected: Array, where: Array) -> None:
    """Equal to a level of 255: the values came with eleven significant bits."""
    np.testing.assert_allclose(seen[where], expected[where], atol=1.01)


# ---- What is shown at first


def test_the_page_has_the_values_to_a_part_in_2048(viewer: Viewer, case: Case) -> None:
    values = {"realtime": case.test, "truth": case.truth, "error": case.test - case.truth}
    for name, image in values.items():
        list_of = f"[...lightgauge.viewer.check.values.{name}].map(value => isFinite(value) ? value : null)"
        found = np.array(viewer.page.evaluate(list_of), dtype=float).reshape(image.shape)
        np.testing.assert_allclose(found[case.mask], image[case.mask], rtol=2.0**-11 * 1.001)
        assert name == "realtime" or np.isnan(found[~case.mask]).all()


@pytest.mark.parametrize("scale", [1, 2], ids=["plain", "high density"])
def test_each_pane_shows_what_its_picture_shows(
    folder: Path, case: Case, opened: Callable[..., Viewer], scale: int
) -> None:
    """The pictures are made in float64 by other code, which is the evidence for the shaders."""
    viewer = opened(folder, 1400, 1000, scale=scale)
    for name in IMAGES:
        picture = np.asarray(Picture.open(folder / "images" / f"room-{name}.png").convert("RGB")).astype(int)
        seen = viewer.seen(name)
        assert_shown(seen, picture, case.mask)
        assert np.all(seen[~case.mask] == rgb(NOT_JUDGED)), "what is not judged is grey"


def test_pixels_are_squares_of_whole_display_pixels(viewer: Viewer) -> None:
    """Zooms are whole numbers: the colour changes exactly every so many pixels of the display."""
    zoom = viewer.zoom()
    assert zoom == int(zoom) > 8
    left, top = viewer.place("significance", 0, 8)
    row = viewer.page.screenshot()[int(top) + 2, int(left - zoom / 2) + 1 :][: int(WIDTH * zoom)].astype(int)
    steps = np.flatnonzero(np.abs(np.diff(row, axis=0)).sum(axis=1) > 60)
    assert len(steps) >= 2
    assert set(np.diff(steps) % int(zoom)) <= {0, 1, int(zoom) - 1}


def test_the_static_pictures_give_way_to_the_viewer(viewer: Viewer) -> None:
    assert viewer.page.evaluate("document.querySelector('.viewer-static').hidden") is True
    assert viewer.page.evaluate("document.querySelector('.viewer').hidden") is False


def test_unjudged_pixels_can_be_shown(viewer: Viewer, case: Case) -> None:
    viewer.page.click("[name=all]")
    assert_shown(viewer.seen("realtime"), 255 * to_display(case.test, case.exposure), ~case.mask)
    assert np.all(viewer.seen("truth")[~case.mask] == rgb(NOT_JUDGED)), "there is no truth to show"
    viewer.press("a")
    assert np.all(viewer.seen("realtime")[~case.mask] == rgb(NOT_JUDGED))


def test_a_pixel_without_a_number_is_magenta(tmp_path: Path, case: Case, opened: Callable[..., Viewer]) -> None:
    broken = case.test.copy()
    broken[8, 12, 1] = np.nan
    broken[0, 0] = np.inf  # not judged
    case.write(tmp_path / "report", test=broken)
    viewer = opened(tmp_path / "report", fragment="#pixel=12,8")
    viewer.page.evaluate("lightgauge.viewer.set({smooth: false, pixel: null})")
    for name in ("realtime", "error"):
        seen = viewer.seen(name)
        assert seen[8, 12].tolist() == rgb(NOT_A_NUMBER)
        assert np.all(seen == rgb(NOT_A_NUMBER), axis=-1).sum() == 1
        assert seen[0, 0].tolist() == rgb(NOT_JUDGED)
    viewer.page.evaluate("lightgauge.viewer.set({pixel: [12, 8]})")
    assert viewer.read_out()[2][1] == "NaN"


# ---- Light


@pytest.mark.parametrize(("keys", "stops"), [("ee", 1.0), ("eeEE", 0.0), ("EEEE", -2.0)])
def test_exposure_by_key_goes_in_stops(viewer: Viewer, case: Case, keys: str, stops: float) -> None:
    viewer.press(*keys)
    for name, image in [("realtime", case.test), ("truth", case.truth)]:
        assert_shown(viewer.seen(name), 255 * to_display(image, case.exposure * 2**stops), case.mask)
    assert viewer.page.text("[data-of=stops]") == f"{'+' if stops > 0 else ''}{stops:g} EV".replace("-", "−")


def test_exposure_by_slider(viewer: Viewer, case: Case) -> None:
    viewer.choose("stops", *["ArrowRight"] * 4)
    assert viewer.page.text("[data-of=stops]") == "+1 EV"
    assert_shown(viewer.seen("truth"), 255 * to_display(case.truth, case.exposure * 2), case.mask)


def test_tone_curves(viewer: Viewer, case: Case) -> None:
    exposed = np.maximum(case.truth * case.exposure * 4, 0)
    viewer.press("e", "e", "e", "e")
    expected = {
        "srgb": to_display(exposed, 1.0),
        "reinhard": to_display(exposed / (1 + exposed), 1.0),
        "linear": np.clip(exposed, 0, 1),
    }
    for name, shown in expected.items():
        assert viewer.state("tone") == name
        assert_shown(viewer.seen("truth"), 255 * shown, case.mask)
        viewer.choose("tone", "ArrowDown")
    viewer.press("t")
    assert viewer.state("tone") == "srgb"


def test_false_colour_shows_luminance(viewer: Viewer, case: Case) -> None:
    viewer.press("e", "e")
    luminance = case.truth @ [0.2126, 0.7152, 0.0722] * case.exposure * 2
    viewer.choose("colour", "ArrowDown")
    assert_shown(viewer.seen("truth"), coloured(luminance, 0, 1, VIRIDIS), case.mask)
    white = float(viewer.page.text("[data-pane=truth] .viewer-ticks span:last-child").split()[0])
    assert white == pytest.approx(1 / (2 * case.exposure), rel=5e-3)
    viewer.press("f")
    decades = np.log10(np.maximum(luminance, 1e-9))
    assert_shown(viewer.seen("truth"), coloured(decades, -3, 0, VIRIDIS), case.mask)
    black = float(viewer.page.text("[data-pane=truth] .viewer-ticks span").split()[0])
    assert black == pytest.approx(white / 1000, rel=1e-2)
    viewer.press("f")
    assert viewer.state("colour") == "off"


# ---- Errors


def test_smoothing_can_be_taken_off(viewer: Viewer, case: Case) -> None:
    error = (case.test - case.truth).mean(axis=2)
    viewer.page.click("[name=smooth]")
    assert_shown(viewer.seen("error"), coloured(error, -SCALE, SCALE, DIVERGING), case.mask)
    before = viewer.seen("error")
    viewer.press("m")
    assert np.abs(viewer.seen("error") - before).max() > 20


def test_the_error_scale_goes_by_factors_of_two(viewer: Viewer, case: Case) -> None:
    error = (case.test - case.truth).mean(axis=2)
    viewer.press("m", "]")
    assert_shown(viewer.seen("error"), coloured(error, -2 * SCALE, 2 * SCALE, DIVERGING), case.mask)
    assert viewer.page.text("[data-of=scale]") == "× 2"
    assert viewer.page.text("[data-pane=error] .viewer-ticks").split("\n")[-1] == "+0.4 W/(m² sr)"
    viewer.press("[", "[")
    assert viewer.page.text("[data-of=scale]") == "÷ 2"
    assert_shown(viewer.seen("error"), coloured(error, -SCALE / 2, SCALE / 2, DIVERGING), case.mask)
    viewer.choose("scale", "ArrowRight")
    assert viewer.page.text("[data-of=scale]") == "× 1"


def test_the_error_relative_to_the_truth(viewer: Viewer, case: Case) -> None:
    size = np.abs(case.truth).mean(axis=2)
    relative = (case.test - case.truth).mean(axis=2) / np.where(case.mask, size, 1)
    scale = SCALE / size[case.mask].mean()
    viewer.press("m")
    viewer.page.click("[name=relative]")
    assert_shown(viewer.seen("error"), coloured(relative, -scale, scale, DIVERGING), case.mask)
    last = viewer.page.text("[data-pane=error] .viewer-ticks span:last-child")
    assert float(last.split()[0]) == pytest.approx(100 * scale, rel=5e-3)
    viewer.press("d")
    assert viewer.state("relative") is False


def test_reset_brings_all_display_settings_back(viewer: Viewer) -> None:
    before = viewer.seen("realtime")
    viewer.press("e", "t", "f", "]", "d", "m", "a", "+")
    zoomed = viewer.state("zoom")
    viewer.page.click("[data-do=reset]")
    settings = ("stops", "tone", "colour", "scale", "relative", "smooth", "all")
    assert [viewer.state(key) for key in settings] == [0, "srgb", "off", 0, False, True, False]
    assert viewer.state("zoom") == zoomed, "where one looks is no setting of the display"
    viewer.press("0", "e", "r")
    np.testing.assert_array_equal(viewer.seen("realtime"), before)


# ---- Layouts


def test_keys_and_buttons_show_one_image_large(viewer: Viewer) -> None:
    small = viewer.zoom()
    for number, name in enumerate(IMAGES, start=1):
        viewer.press(str(number))
        panes = "[...document.querySelectorAll('.viewer-pane')].filter(p => !p.hidden).map(p => p.dataset.pane)"
        assert viewer.page.evaluate(panes) == [name]
        assert viewer.zoom() > small
    viewer.page.click("button[data-image=truth]")
    assert viewer.page.evaluate(panes) == ["truth"]
    viewer.press("s")
    assert viewer.page.evaluate(panes) == IMAGES
    viewer.page.click("[data-layout=one]")
    assert viewer.page.evaluate(panes) == ["truth"]
    viewer.page.click("[data-layout=side]")
    assert viewer.page.evaluate(panes) == IMAGES


def test_space_flips_between_two_images_in_one_place(viewer: Viewer, case: Case) -> None:
    viewer.press("1")
    own = viewer.seen("realtime")
    viewer.press(" ")
    assert_shown(viewer.seen("truth"), 255 * to_display(case.truth, case.exposure), case.mask)
    viewer.page.click("[data-do=flip]")
    np.testing.assert_array_equal(viewer.seen("realtime"), own)
    viewer.press("3", " ", " ")
    assert (viewer.state("shown"), viewer.state("other")) == ("error", "truth")


def test_space_opens_the_large_image_first(viewer: Viewer) -> None:
    viewer.press(" ")
    assert (viewer.state("layout"), viewer.state("shown")) == ("one", "realtime")


def test_a_wipe_shows_one_image_left_and_another_right_of_its_line(viewer: Viewer, case: Case) -> None:
    viewer.press("w")
    left, right = (255 * to_display(image, case.exposure) for image in (case.test, case.truth))
    columns = np.arange(WIDTH)[None, :]
    for cut in (12, 18):
        if cut == 18:  # drag the line there
            start, end = viewer.place("realtime", 11.5, 4), viewer.place("realtime", 17.5, 4)
            viewer.page.drag(start, end)
            viewer.page.evaluate("lightgauge.viewer.set({pixel: null})")
        seen = viewer.seen("realtime")
        assert_shown(seen, left, case.mask & (columns < cut - 1))
        assert_shown(seen, right, case.mask & (columns > cut))
    before = viewer.state("wipe")
    viewer.choose("wipe", "ArrowLeft")
    assert viewer.state("wipe") == pytest.approx(before - 0.01, abs=0.006)
    viewer.choose("other", "ArrowDown")
    assert viewer.state("other") == "error"
    assert viewer.page.text("[data-pane=realtime] figcaption") == "Real-time | error"
    left_half, right_half = viewer.page.text("[data-pane=realtime] .viewer-legends").split("sRGB")
    assert "0.2" not in left_half
    assert right_half.split() == ["−0.2", "0", "+0.2", "W/(m²", "sr)"]


# ---- Where one looks


def test_the_wheel_zooms_at_the_pointer_in_all_panes(viewer: Viewer) -> None:
    x, y = 15, 5
    colours = {name: viewer.seen(name)[y, x] for name in IMAGES}
    place = viewer.place("truth", x, y)
    offset = np.subtract(place, viewer.centre("truth"))
    zoom = viewer.zoom()
    viewer.page.mouse("Wheel", *place, deltaX=0, deltaY=-120)
    assert viewer.zoom() > zoom
    viewer.page.evaluate("lightgauge.viewer.set({pixel: null})")
    for name, colour in colours.items():
        np.testing.assert_allclose(viewer.colour_at(*np.add(viewer.centre(name), offset)), colour, atol=1)
    viewer.page.mouse("Wheel", *viewer.place("truth", x, y), deltaX=0, deltaY=120)
    assert viewer.zoom() == pytest.approx(zoom, rel=0.3)


def test_dragging_pans_all_panes(viewer: Viewer) -> None:
    viewer.press("+", "+")
    before = {name: viewer.place(name, 12, 8) for name in IMAGES}
    colours = {name: viewer.colour_at(*place) for name, place in before.items()}
    x, y = viewer.centre("error")
    viewer.page.drag((x, y), (x + 40, y - 24))
    viewer.page.evaluate("lightgauge.viewer.set({pixel: null})")
    for name, (left, top) in before.items():
        assert viewer.place(name, 12, 8) == pytest.approx((left + 40, top - 24), abs=0.51)
        np.testing.assert_allclose(viewer.colour_at(left + 40, top - 24), colours[name], atol=1)


def test_zoom_by_buttons_and_keys_and_back_to_fit(viewer: Viewer) -> None:
    fit = viewer.zoom()
    viewer.page.click("[data-do=in]")
    larger = viewer.zoom()
    viewer.press("+")
    assert viewer.zoom() > larger > fit
    viewer.page.click("[data-do=out]")
    assert viewer.zoom() == larger
    viewer.press("-", "-")
    assert viewer.zoom() < larger
    viewer.page.click("[data-do=fit]")
    assert viewer.zoom() == fit
    viewer.press("+", "0")
    assert viewer.zoom() == fit
    viewer.press("+")
    for clicks in (1, 2):
        for kind in ("Pressed", "Released"):
            viewer.page.mouse(kind, *viewer.centre("truth"), clicks=clicks)
    assert (viewer.zoom(), viewer.state("zoom")) == (fit, None)


def test_the_fit_follows_the_window(folder: Path, opened: Callable[..., Viewer]) -> None:
    viewer = opened(folder, 1000, 900)
    before = viewer.zoom()
    viewer.page.resize(1400, 900)
    viewer.page.wait_for("document.querySelector('.viewer-zoom').textContent !== '× " + f"{before:g}'")
    assert viewer.zoom() > before


# ---- Pixels


def test_pointing_at_a_pixel_reads_its_values(viewer: Viewer, case: Case) -> None:
    x, y = 6, 9
    viewer.page.mouse("Moved", *viewer.place("error", x, y))
    assert viewer.page.text(".viewer-where") == f"x {x}, y {y} W/(m² sr)"
    rows = viewer.read_out()
    assert rows[0] == ["", "real-time", "truth", "error", "in σ"]
    for channel, row in enumerate(rows[1:]):
        truth, sigma = case.truth[y, x, channel], case.samples.standard_error[y, x, channel]
        error = case.test[y, x, channel] - truth
        told = [float(text.replace("−", "-")) for text in (row[1], *row[2].split(" ± "), *row[3:])]
        assert row[0] == "RGB"[channel]
        precise, rough = 1e-3, 2.0**-6  # four and three digits; sigma has seven bits
        assert told[0] == pytest.approx(case.test[y, x, channel], rel=precise)
        assert told[1] == pytest.approx(truth, rel=precise)
        assert told[2] == pytest.approx(sigma, rel=0.06), "two digits"
        assert told[3] == pytest.approx(error, rel=6e-3)
        assert told[4] == pytest.approx(error / sigma, rel=rough)
    facts = viewer.page.text(".viewer-inspector dl")
    assert f"{case.flip[y, x]:.3g}"[:4] in facts
    assert case.found is not None
    assert ("no error" in facts) == (not case.found.wrong[y, x])


def test_a_pixel_that_is_not_judged_has_no_truth(viewer: Viewer, case: Case) -> None:
    assert not case.mask[0, 0]
    viewer.page.mouse("Moved", *viewer.place("truth", 0, 0))
    assert viewer.page.text(".viewer-where") == "x 0, y 0 not judged"
    assert [row[2:] for row in viewer.read_out()[1:]] == [["–", "–", "–"]] * 3
    assert viewer.page.text(".viewer-inspector dl") == ""


def test_arrow_keys_move_the_pixel_and_with_shift_the_view(viewer: Viewer) -> None:
    viewer.press("ArrowRight")
    assert viewer.state("pixel") == [12, 8], "the first press shows it in the middle"
    viewer.press("ArrowRight", "ArrowRight", "ArrowDown", "ArrowLeft", "ArrowUp", "ArrowUp")
    assert viewer.state("pixel") == [13, 7]
    assert viewer.page.text(".viewer-where").startswith("x 13, y 7")
    status = viewer.page.evaluate("document.querySelector('.viewer-inspector [role=status]').textContent")
    table = viewer.read_out()
    assert status == "x 13, y 7 W/(m² sr): " + "; ".join(" ".join(row) for row in table[1:])
    viewer.press("+")
    before, zoom = viewer.state("x"), viewer.zoom()
    viewer.press("ArrowRight", shift=True)
    assert viewer.state("x") == pytest.approx(before + 48 / zoom)
    assert viewer.state("pixel") == [13, 7]


def test_the_view_follows_the_pixel_cursor(viewer: Viewer) -> None:
    viewer.press(*"++++++")
    viewer.press(*["ArrowLeft"] * 14)
    x, _ = viewer.place("truth", 0, viewer.state("pixel")[1])
    left, _, width, _ = viewer.page.box("[data-pane=truth] .viewer-image")
    assert viewer.state("pixel")[0] == 0, "and it stops at the edge"
    assert left < x < left + width


def test_the_cursor_is_outlined_in_every_pane(viewer: Viewer) -> None:
    for name in IMAGES:
        x, y = (int(value) for value in viewer.place(name, 12, 8))
        reach = int(viewer.zoom() / 2) + 4
        around = (x - reach, y - reach, 2 * reach, 2 * reach)
        before, after = (
            viewer.page.evaluate(f"lightgauge.viewer.set({{pixel: {pixel}}})")
            or viewer.page.screenshot(part=around).astype(int)
            for pixel in ("null", "[12, 8]")
        )
        assert (np.abs(after - before).sum(axis=-1) > 100).sum() > 40
        np.testing.assert_array_equal(after[reach, reach], before[reach, reach])


def test_the_worst_pixel_is_found(viewer: Viewer) -> None:
    viewer.page.click("[data-do=worst]")
    assert (viewer.state("pixel"), viewer.state("x"), viewer.state("y")) == ([5, 12], 5.5, 12.5)
    viewer.press("0")
    viewer.page.evaluate("lightgauge.viewer.set({pixel: null})")
    viewer.press("g")
    assert viewer.state("pixel") == [5, 12]


def test_large_pixels_carry_their_values(viewer: Viewer, case: Case) -> None:
    """The letters are not compared with anything, only that they stand in each judged pixel and in no other."""
    assert (case.mask[6, 4], case.mask[5, 1]) == (True, False)
    viewer.page.evaluate("lightgauge.viewer.set({layout: 'one', shown: 'flip', zoom: 64, x: 2, y: 6})")
    count = """(() => { const canvas = document.querySelector('.viewer-canvas'), pen = canvas.getContext('2d');
        const box = document.querySelector('[data-pane=flip] .viewer-image').getBoundingClientRect();
        const outer = canvas.getBoundingClientRect();
        return [[4, 6], [1, 5]].map(([x, y]) => {
          const left = box.left - outer.left + box.width / 2 + (x - lightgauge.viewer.state.x) * 64;
          const top = box.top - outer.top + box.height / 2 + (y - lightgauge.viewer.state.y) * 64;
          const { data } = pen.getImageData(left + 6, top + 6, 52, 52);
          return data.filter((red, i) => i % 4 === 0 && Math.min(red, data[i + 1], data[i + 2]) > 240).length;
        }); })()"""
    judged, unjudged = viewer.page.evaluate(count)
    assert judged > 10
    assert unjudged == 0


def test_a_lost_context_comes_back(folder: Path, case: Case, opened: Callable[..., Viewer]) -> None:
    """A driver may take it away at any time; here the page's own extension does."""
    page = opened(folder).page
    remember = """const own = HTMLCanvasElement.prototype.getContext;
        HTMLCanvasElement.prototype.getContext = function (kind, ...more) {
          const made = own.call(this, kind, ...more);
          return kind === 'webgl2' ? (window.context = made) : made;
        };"""
    page.send("Page.addScriptToEvaluateOnNewDocument", source=remember)
    page.go((folder / "check.html").resolve().as_uri())
    viewer = Viewer(page)
    page.evaluate("window.lost = context; window.loser = lost.getExtension('WEBGL_lose_context'); loser.loseContext()")
    page.wait_for("lost.isContextLost()")
    page.evaluate("new Promise(done => { lost.canvas.addEventListener('webglcontextlost', () => done()) || done(); })")
    page.evaluate("loser.restoreContext()")
    page.wait_for("!lost.isContextLost()")
    page.evaluate("new Promise(requestAnimationFrame)")
    viewer.press("e", "e")
    assert_shown(viewer.seen("truth"), 255 * to_display(case.truth, case.exposure * 2), case.mask)


@pytest.mark.parametrize(
    ("value", "digits", "text"),
    [
        (0.25, 4, "0.2500"),
        (-1865.2, 3, "−1870"),
        (123456.0, 3, "123000"),
        (2.5e6, 3, "2.50e6"),
        (0.000123, 2, "0.00012"),
        (-0.0000987, 3, "−9.87e−5"),
        (0.0, 4, "0"),
    ],
)
def test_numbers_are_written_with_their_significant_digits(
    tmp_path: Path, opened: Callable[..., Viewer], value: float, digits: int, text: str
) -> None:
    """Four of the values, two of their standard error, three of the error."""
    write_page(tmp_path / "report")
    spread = math.sqrt(15) * value * np.tile([-1, 1], 8).reshape(16, 1, 1, 1)  # has `value` as its standard error
    truth = {4: np.full((16, 1, 1, 1), value), 3: np.zeros((16, 1, 1, 1)), 2: spread}[digits]
    test = np.full((1, 1, 1), value, np.float32)
    samples = Samples(truth, np.ones((1, 1), bool))
    shown: dict[str, Any] = {"display": "unit", "exposure": 1.0, "error_scale": 1.0}
    write_pixels(tmp_path / "report", "room", test, samples, quantity="q", unit="1", **shown)
    viewer = opened(tmp_path / "report", fragment="#pixel=0,0")
    _, realtime, truth_and_sigma, error, *_ = viewer.read_out()[1]
    assert {4: realtime, 3: error.lstrip("+"), 2: truth_and_sigma.split(" ± ")[1]}[digits] == text


# ---- Links


def test_a_link_restores_the_view(folder: Path, viewer: Viewer, opened: Callable[..., Viewer]) -> None:
    viewer.page.evaluate("lightgauge.viewer.set({smooth: false, scale: -1})")
    viewer.press("3", "e", "t", "d", "+", "g")
    viewer.page.click("[data-do=link]")
    viewer.page.wait_for("document.querySelector('.viewer-note').textContent !== ''")
    assert "address bar" in viewer.page.text(".viewer-note")
    told = "(({x, y, zoom, ...rest}) => JSON.stringify(rest))(lightgauge.viewer.state)"
    fragment, state = viewer.page.evaluate("location.hash"), viewer.page.evaluate(told)
    view = [viewer.state(key) for key in ("x", "y", "zoom")]
    pane = viewer.page.box("[data-pane=error]")
    seen = viewer.page.screenshot(part=pane)
    other = opened(folder, 1000, 900, fragment=fragment)
    assert other.page.evaluate(told) == state
    assert [other.state(key) for key in ("x", "y", "zoom")] == pytest.approx(view, rel=1e-4)
    assert other.page.box("[data-pane=error]") == pane
    assert np.array_equal(other.page.screenshot(part=pane), seen)


def test_a_plain_view_has_a_short_link(viewer: Viewer) -> None:
    viewer.press("c")
    viewer.page.wait_for("document.querySelector('.viewer-note').textContent !== ''")
    assert viewer.page.evaluate("location.hash") == "#view"


def test_a_changed_address_changes_the_view(viewer: Viewer) -> None:
    viewer.page.evaluate("location.hash = '#layout=wipe&wipe=0.25&pixel=3,4&shown=flip'")
    viewer.page.wait_for("lightgauge.viewer.state.layout === 'wipe'")
    assert [viewer.state(key) for key in ("wipe", "pixel", "shown")] == [0.25, [3, 4], "flip"]


def test_a_link_to_a_pixel_has_it_in_the_middle(folder: Path, opened: Callable[..., Viewer]) -> None:
    viewer = opened(folder, fragment="#zoom=32&pixel=3,4")
    assert [viewer.state(key) for key in ("x", "y", "zoom")] == [3.5, 4.5, 32]
    viewer.page.evaluate("location.hash = '#zoom=16'")
    viewer.page.wait_for("lightgauge.viewer.state.zoom === 16")
    assert [viewer.state(key) for key in ("x", "y", "pixel")] == [WIDTH / 2, HEIGHT / 2, None]


def test_a_link_further_down_brings_the_pixel_into_sight_each_time(viewer: Viewer) -> None:
    below = "<p style='height: 3000px'></p><a id='worst' href='#pixel=3,4'>worst</a>"
    viewer.page.evaluate(f"document.body.insertAdjacentHTML('beforeend', {json.dumps(below)})")
    for _ in range(2):
        viewer.page.click("#worst")
        viewer.page.wait_for("Math.abs(document.querySelector('.viewer').getBoundingClientRect().top) < 40")
        assert viewer.state("pixel") == [3, 4]
        viewer.page.evaluate("lightgauge.viewer.set({pixel: [0, 0]})")


@pytest.mark.parametrize(
    "fragment", ["#overview", "#layout=upside&tone=9&zoom=none&at=x,y&pixel=1&stops=&shown=sigma&wipe=NaN", "#%E0%A4%A"]
)
def test_nonsense_in_an_address_is_ignored(folder: Path, opened: Callable[..., Viewer], fragment: str) -> None:
    viewer = opened(folder, fragment=fragment)
    settings = ("layout", "tone", "zoom", "pixel", "stops", "shown", "wipe", "x")
    assert [viewer.state(key) for key in settings] == ["side", "srgb", None, None, 0, "realtime", 0.5, WIDTH / 2]


def test_numbers_out_of_range_in_an_address_are_brought_into_it(folder: Path, opened: Callable[..., Viewer]) -> None:
    viewer = opened(folder, fragment="#stops=900&pixel=900,-3&wipe=-2")
    assert [viewer.state(key) for key in ("stops", "pixel", "wipe")] == [12, [WIDTH - 1, 0], 0]


# ---- For everybody


def test_the_keys_are_listed(viewer: Viewer) -> None:
    for by in ("?", "button"):
        viewer.press("?") if by == "?" else viewer.page.click("[data-do=help]")
        assert viewer.page.evaluate("document.querySelector('.viewer-help').open") is True
        viewer.page.key("e")
        assert viewer.state("stops") == 0, "the list is read, not the images"
        viewer.page.key("Escape")
        viewer.page.wait_for("!document.querySelector('.viewer-help').open")
    viewer.press("?")
    viewer.page.click(".viewer-help form button")
    assert viewer.page.evaluate("document.querySelector('.viewer-help').open") is False


def test_keys_do_nothing_without_the_focus(viewer: Viewer) -> None:
    viewer.page.evaluate("document.activeElement.blur()")
    viewer.page.key("e")
    assert viewer.state("stops") == 0
    viewer.page.mouse("Moved", *viewer.centre("truth"))
    viewer.page.key("e")
    assert viewer.state("stops") == 0.5, "the pointer brings it"


def test_a_control_keeps_its_own_keys(viewer: Viewer) -> None:
    viewer.page.evaluate("document.querySelector('[data-do=in]').focus()")
    viewer.page.key(" ")
    assert (viewer.state("layout"), viewer.state("zoom") is None) == ("side", False)
    viewer.choose("stops", "ArrowRight")
    assert viewer.state("pixel") is None


def test_every_control_has_a_name_and_can_be_reached(viewer: Viewer) -> None:
    viewer.press("w")
    nodes = viewer.page.send("Accessibility.getFullAXTree")["nodes"]
    roles = ("button", "slider", "combobox", "checkbox", "application")
    controls = [node for node in nodes if node.get("role", {}).get("value") in roles]
    assert len(controls) >= 22
    assert all(node["name"]["value"].strip() for node in controls), [n for n in controls if not n["name"]["value"]]
    viewer.page.evaluate("document.activeElement.blur()")
    reached = set()
    for _ in range(40):
        viewer.page.key("Tab")
        active = viewer.page.evaluate(
            "(() => { const e = document.activeElement, s = getComputedStyle(e);"
            "return [e.dataset.layout || e.dataset.image || e.dataset.do || e.name || e.className || e.tagName,"
            "s.outlineStyle, parseFloat(s.outlineWidth)]; })()"
        )
        if active[0] != "BODY":
            reached.add(active[0])
            assert active[1] != "none", f"the focus is seen on {active[0]}"
            assert active[2] >= 1
    wanted = {"side", "one", "wipe", *IMAGES, "in", "out", "fit", "worst", "link", "reset", "help", "flip", "other"}
    assert wanted | {"stops", "tone", "colour", "scale", "relative", "smooth", "all", "viewer-stage"} <= reached


@pytest.mark.parametrize("dark", [False, True], ids=["light", "dark"])
def test_text_stands_out_and_the_surround_is_neutral(folder: Path, opened: Callable[..., Viewer], dark: bool) -> None:
    viewer = opened(folder, dark=dark, fragment="#pixel=8,8")

    def colour(selector: str, what: str) -> list[float]:
        text = viewer.page.evaluate(f"getComputedStyle(document.querySelector('{selector}')).{what}")
        return [float(part) for part in text[text.index("(") + 1 : -1].replace(",", " ").split()[:3]]

    def luminance(value: list[float]) -> float:
        linear = [c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in (v / 255 for v in value)]
        return float(np.dot(linear, (0.2126, 0.7152, 0.0722)))

    pairs = [
        (".viewer-bar button", "color", ".viewer-bar button"),
        (".viewer-second label", "color", ".viewer-bar"),
        (".viewer-inspector td", "color", ".viewer-inspector"),
        (".viewer-inspector dt", "color", ".viewer-inspector"),
        ("button[data-layout=side]", "color", "button[data-layout=side]"),
    ]
    for text, what, ground in pairs:
        high, low = sorted((luminance(colour(text, what)), luminance(colour(ground, "backgroundColor"))), reverse=True)
        assert (high + 0.05) / (low + 0.05) >= 4.5, (text, ground)
    surround = colour(".viewer-image", "backgroundColor")
    assert len(set(surround)) == 1
    assert (surround[0] < 64) == dark


@pytest.mark.parametrize("width", [1400, 700, 380])
def test_nothing_is_wider_than_the_window(folder: Path, opened: Callable[..., Viewer], width: int) -> None:
    viewer = opened(folder, width, 900, fragment="#pixel=8,8")
    for key in "sw1":
        viewer.press(key)
        assert viewer.page.evaluate("document.documentElement.scrollWidth") <= width
        assert viewer.page.evaluate("document.querySelector('.viewer-image').getBoundingClientRect().width") > 250


def test_nothing_comes_from_a_network(folder: Path, opened: Callable[..., Viewer]) -> None:
    page = opened(folder).page
    page.send("Network.enable")
    page.go((folder / "check.html").resolve().as_uri())
    Viewer(page)
    asked = [event["params"] for event in page.browser.events if event["method"] == "Network.requestWillBeSent"]
    addresses = [params["request"]["url"] for params in asked]
    assert [address.rpartition("/")[2] for address in addresses if address.endswith(".js")] == [
        "viewer.js",
        "controls.js",
        "room.js",
    ]
    assert all(address.startswith(("file:", "data:")) for address in addresses)


def test_without_webgl_the_pictures_stay(folder: Path, chromium_without_webgl: Any) -> None:
    page = chromium_without_webgl.page((folder / "check.html").resolve().as_uri())
    page.wait_for("typeof lightgauge === 'object' && lightgauge.ready !== null")
    page.evaluate("lightgauge.ready")
    assert "this browser offers no WebGL2" in page.text(".viewer-failed")
    assert page.evaluate("document.querySelector('.viewer').hidden") is True
    assert page.evaluate("document.querySelector('.viewer-static img').getBoundingClientRect().width") > 0
    assert page.problems() == []
    page.close()


def test_broken_pixels_leave_the_pictures(folder: Path, tmp_path: Path, opened: Callable[..., Viewer]) -> None:
    shutil.copytree(folder, tmp_path / "report")
    script = tmp_path / "report" / "pixels" / "room.js"
    script.write_text(script.read_text(encoding="utf-8").replace('"judged":"', '"judged":"AAAA'), encoding="utf-8")
    viewer = opened(tmp_path / "report")
    assert "The viewer cannot start" in viewer.page.text(".viewer-failed")
    assert viewer.page.evaluate("document.querySelector('.viewer-static').hidden") is False


def test_a_report_without_pixels_shows_its_pictures(
    folder: Path, tmp_path: Path, open_page: Callable[..., Any]
) -> None:
    shutil.copytree(folder, tmp_path / "report")
    (tmp_path / "report" / "pixels" / "room.js").unlink()
    page = open_page(tmp_path / "report" / "check.html")
    assert page.evaluate("document.querySelector('.viewer').hidden") is True
    assert page.evaluate("document.querySelector('.viewer-static img').getBoundingClientRect().width") > 0


# ---- Other quantities


@pytest.mark.parametrize(
    ("display", "channels", "exposure"), [("normal", 3, 1.0), ("unit", 1, 1.0), ("uv", 2, 1.0), ("depth", 1, 0.4)]
)
def test_other_quantities_look_like_their_pictures(
    tmp_path: Path, opened: Callable[..., Viewer], display: Display, channels: int, exposure: float
) -> None:
    rows, columns = np.mgrid[:HEIGHT, :WIDTH]
    truth = np.stack([rows / HEIGHT, columns / WIDTH, -columns / WIDTH], axis=2)[..., :channels].astype(np.float32)
    test = truth + np.float32(0.05) * (columns[..., None] > 12)
    mask = np.ones((HEIGHT, WIDTH), bool)
    write_page(tmp_path / "report")
    shown: dict[str, Any] = {"display": display, "exposure": exposure, "error_scale": SCALE}
    samples = Samples(truth[None], mask)
    write_pixels(tmp_path / "report", "room", test, samples, quantity=display, unit="m", **shown)
    write_pictures(tmp_path / "report", "room", test, truth, mask, **shown)
    viewer = opened(tmp_path / "report")
    for name in ("realtime", "truth", "error"):
        picture = np.asarray(Picture.open(tmp_path / "report" / "images" / f"room-{name}.png").convert("RGB"))
        assert_shown(viewer.seen(name), picture.astype(int), mask)
    has_size = display in ("unit", "depth")
    visible = (
        "[...document.querySelectorAll('.viewer-second label')].filter(l => !l.hidden).map(l => l.innerText.trim())"
    )
    words = " ".join(viewer.page.evaluate(visible))
    assert ("Exposure" in words, "relative" in words, "False colour" in words) == (has_size,) * 3
    assert "Tones" not in words
    ticks = "document.querySelector('[data-pane=error] .viewer-ticks').textContent.includes('%')"
    viewer.page.evaluate("location.hash = '#relative=true'")
    viewer.page.wait_for("lightgauge.viewer.state.relative")
    assert viewer.page.evaluate(ticks) is has_size
    assert "smoothed" not in words
    viewer.press("4", "5")
    assert viewer.state("layout") == "side", "there is no such image"
    viewer.press("ArrowLeft")
    assert len(viewer.read_out()[0]) == 4, "an exact truth has no sigma"
    assert len(viewer.read_out()) == 1 + channels
    if display == "depth":
        viewer.press("e", "e", "f")
        assert_shown(
            viewer.seen("truth"), coloured(truth[..., 0] * exposure * 2, 0, 1, VIRIDIS), mask & (columns != 12)
        )


def test_the_colours_of_flip_are_magma(viewer: Viewer, case: Case) -> None:
    assert_shown(viewer.seen("flip"), coloured(case.flip, 0, 1, MAGMA), case.mask)
    assert math.isclose(case.flip[case.mask].max(), 1, abs_tol=0.95)
