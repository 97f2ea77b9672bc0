"""A real browser without a window: Chromium, driven over pipes by the DevTools protocol."""

import base64
import io
import json
import os
import shutil
import subprocess
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image as Picture

NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
FLAGS = (
    *("--headless", "--no-sandbox", "--disable-dev-shm-usage", "--no-first-run", "--disable-sync", "--disable-quic"),
    *("--disable-background-networking", "--disable-component-update", "--hide-scrollbars"),
    *("--force-color-profile=srgb", "--remote-debugging-pipe"),
)
WEBGL = ("--disable-gpu", "--enable-unsafe-swiftshader")  # in software
NO_WEBGL = ("--disable-gpu", "--disable-3d-apis")
KEYS = {"ArrowLeft": 37, "ArrowUp": 38, "ArrowRight": 39, "ArrowDown": 40, "Tab": 9, "Escape": 27, "Enter": 13}
SHIFT = 8
PATIENCE_S = 30.0


class Browser:
    """A running Chromium. `page` opens what it is given in a tab of its own."""

    def __init__(self, executable: str, *flags: str) -> None:
        self.profile = tempfile.TemporaryDirectory(ignore_cleanup_errors=True)
        browser_reads, we_write = os.pipe()
        we_read, browser_writes = os.pipe()
        # The protocol wants its pipes as descriptors 3 and 4.
        command = f'exec "$0" "$@" 3<&{browser_reads} 4>&{browser_writes}'
        profile = f"--user-data-dir={self.profile.name}"
        self.process = subprocess.Popen(
            ["bash", "-c", command, executable, *FLAGS, *flags, profile, "about:blank"],
            pass_fds=(browser_reads, browser_writes),
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        os.close(browser_reads)
        os.close(browser_writes)
        self._to = os.fdopen(we_write, "wb")
        self._from = os.fdopen(we_read, "rb")
        self._sent = 0
        self._unread = b""
        self.events: list[dict[str, Any]] = []

    def send(self, method: str, session: str = "", **parameters: Any) -> dict[str, Any]:
        """Call a method of the protocol and return its result."""
        self._sent += 1
        message = {"id": self._sent, "method": method, "params": parameters} | (
            {"sessionId": session} if session else {}
        )
        self._to.write(json.dumps(message).encode() + b"\0")
        self._to.flush()
        while True:
            answer = self._receive()
            if answer.get("id") == self._sent:
                assert "error" not in answer, f"{method}: {answer['error']}"
                result: dict[str, Any] = answer["result"]
                return result
            self.events.append(answer)

    def _receive(self) -> dict[str, Any]:
        while b"\0" not in self._unread:
            data = os.read(self._from.fileno(), 1 << 16)
            assert data, "the browser has ended"
            self._unread += data
        message, _, self._unread = self._unread.partition(b"\0")
        answer: dict[str, Any] = json.loads(message)
        return answer

    def page(self, url: str, width: int = 1400, height: int = 1000, *, dark: bool = False, scale: float = 1) -> "Page":
        target = self.send("Target.createTarget", url="about:blank")["targetId"]
        session = self.send("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        page = Page(self, target, session)
        page.resize(width, height, scale)
        features = [{"name": "prefers-color-scheme", "value": "dark" if dark else "light"}]
        page.send("Emulation.setEmulatedMedia", features=features)
        page.send("Emulation.setFocusEmulationEnabled", enabled=True)
        page.send("Page.enable")
        page.send("Runtime.enable")
        page.go(url)
        return page

    def close(self) -> None:
        self._to.close()
        self._from.close()
        try:
            self.process.wait(timeout=5)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()
        self.profile.cleanup()


class Page:
    """A tab. Only the newest one is in front; the others draw late.

    Input is what the operating system would send, so that events are trusted and have default actions.
    """

    def __init__(self, browser: Browser, target: str, session: str) -> None:
        self.browser = browser
        self.target = target
        self.session = session

    def send(self, method: str, **parameters: Any) -> dict[str, Any]:
        return self.browser.send(method, self.session, **parameters)

    def go(self, url: str) -> None:
        """Load an address anew, even if it is the present one, and wait until it has loaded."""
        self.mouse("Moved", 0, 0)
        self.send("Page.navigate", url="about:blank")
        self.browser.events.clear()
        self.send("Page.navigate", url=url)
        self.wait_for(
            f"document.readyState === 'complete' && {json.dumps(url)}.startsWith(location.href.split('#')[0])"
        )

    def evaluate(self, script: str) -> Any:
        """The value of an expression, awaited if it is a promise; what it throws fails the test."""
        answer = self.send("Runtime.evaluate", expression=script, awaitPromise=True, returnByValue=True)
        assert "exceptionDetails" not in answer, answer["exceptionDetails"]
        return answer["result"].get("value")

    def wait_for(self, condition: str) -> None:
        """Wait until an expression is true."""
        end = time.monotonic() + PATIENCE_S
        while not self.evaluate(condition):
            assert time.monotonic() < end, f"waited {PATIENCE_S:g} s for {condition}"
            time.sleep(0.02)

    def key(self, key: str, *, shift: bool = False) -> None:
        """Press and release a key, named as in `KeyboardEvent.key`."""
        printed = {"text": "\r" if key == "Enter" else key} if len(key) == 1 or key == "Enter" else {}
        code = KEYS.get(key) or ord(key.upper())
        common = {"key": key, "windowsVirtualKeyCode": code, "modifiers": SHIFT if shift else 0}
        self.send("Input.dispatchKeyEvent", type="keyDown", **common, **printed)
        self.send("Input.dispatchKeyEvent", type="keyUp", **common)

    def mouse(self, kind: str, x: float, y: float, *, clicks: int = 0, **more: Any) -> None:
        """Send a mouse event, `Moved`, `Pressed`, `Released` or `Wheel`, at a place of the window in CSS pixels."""
        button = "none" if kind in ("Moved", "Wheel") else "left"
        self.send("Input.dispatchMouseEvent", type=f"mouse{kind}", x=x, y=y, button=button, clickCount=clicks, **more)

    def click(self, selector: str) -> None:
        """Click the middle of an element after it was brought into view."""
        left, top, width, height = self.box(selector)
        for kind in ("Pressed", "Released"):
            self.mouse(kind, left + width / 2, top + height / 2, clicks=1)

    def drag(self, start: tuple[float, float], end: tuple[float, float]) -> None:
        """Press the button at one place of the window and release it at another."""
        self.mouse("Moved", *start)
        self.mouse("Pressed", *start, clicks=1)
        self.mouse("Moved", *end, buttons=1)
        self.mouse("Released", *end, clicks=1)

    def box(self, selector: str) -> tuple[float, float, float, float]:
        """Left, top, width and height of an element within the window, into which it is scrolled if need be."""
        found = self.evaluate(
            f"(() => {{ const element = document.querySelector({json.dumps(selector)}); if (!element) return null;"
            "element.scrollIntoView({block: 'nearest', behavior: 'instant'});"
            "const box = element.getBoundingClientRect(); return [box.left, box.top, box.width, box.height]; })()"
        )
        assert found, f"the page has no {selector}"
        left, top, width, height = found
        return left, top, width, height

    def text(self, selector: str) -> str:
        """The visible text of an element."""
        return str(self.evaluate(f"document.querySelector({json.dumps(selector)}).innerText"))

    def screenshot(
        self, path: Path | None = None, *, whole: bool = False, part: tuple[float, float, float, float] | None = None
    ) -> NDArray[np.uint8]:
        """What the window shows, (H, W, 3) display pixels; saved to `path` as well if that is given.

        Or the whole page, or a `part` of the window: left, top, width and height in CSS pixels.
        """
        clip = {}
        if part is not None:
            scrolled = self.evaluate("[scrollX, scrollY]")
            corner = {"x": part[0] + scrolled[0], "y": part[1] + scrolled[1]}
            clip = {"clip": corner | {"width": part[2], "height": part[3], "scale": 1}}
        answer = self.send(
            "Page.captureScreenshot", format="png", captureBeyondViewport=whole, optimizeForSpeed=True, **clip
        )
        data = base64.b64decode(answer["data"])
        if path is not None:
            path.write_bytes(data)
        return np.asarray(Picture.open(io.BytesIO(data)).convert("RGB"))

    def problems(self) -> list[dict[str, Any]]:
        """Exceptions and errors on the console since the page was opened."""
        self.evaluate("0")
        mine = [event for event in self.browser.events if event.get("sessionId") == self.session]
        return [
            event["params"]
            for event in mine
            if event["method"] == "Runtime.exceptionThrown"
            or (event["method"] == "Runtime.consoleAPICalled" and event["params"]["type"] == "error")
        ]

    def resize(self, width: int, height: int, scale: float = 1) -> None:
        """The window's size in CSS pixels, and how many of the display's pixels one of them has."""
        self.send(
            "Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=scale, mobile=False
        )

    def close(self) -> None:
        self.browser.send("Target.closeTarget", targetId=self.target)


def _started(*flags: str) -> Iterator[Browser]:
    executable = next((found for name in NAMES if (found := shutil.which(name))), None)
    if executable is None:
        pytest.skip(f"no browser is installed to open the report with: {', '.join(NAMES)}")
    browser = Browser(executable, *flags)
    try:
        yield browser
    finally:
        browser.close()


@pytest.fixture(scope="session")
def chromium() -> Iterator[Browser]:
    """Chromium with WebGL2 in software, started once."""
    yield from _started(*WEBGL)


@pytest.fixture(scope="session")
def chromium_without_webgl() -> Iterator[Browser]:
    """Chromium that refuses WebGL."""
    yield from _started(*NO_WEBGL)


@pytest.fixture(scope="module")
def tab(chromium: Browser) -> Iterator[Page]:
    """One tab for the tests of a module that each open their page in it: tab.go(address)."""
    page = chromium.page("about:blank", 1000, 900)
    yield page
    page.close()


@pytest.fixture
def open_page(chromium: Browser) -> Iterator[Callable[..., Page]]:
    """Opens a file in a tab of its own: open_page(path, width, height, fragment="#view", dark=True)."""
    pages: list[Page] = []

    def opened(path: Path, width: int = 1400, height: int = 1000, *, fragment: str = "", **more: Any) -> Page:
        pages.append(chromium.page(path.resolve().as_uri() + fragment, width, height, **more))
        return pages[-1]

    yield opened
    for page in pages:
        page.close()


@pytest.fixture(scope="session")
def make_criterion() -> Callable[..., dict[str, Any]]:
    """Makes a criterion of results.json: make_criterion("flip", 0.03, max=0.06)."""
    return _criterion


@pytest.fixture(scope="session")
def make_check() -> Callable[..., dict[str, Any]]:
    """Makes a check of results.json that says something of everything: make_check(verdict="FAIL")."""
    return _check


@pytest.fixture(scope="session")
def make_results() -> Callable[..., dict[str, Any]]:
    """Makes the content of results.json: make_results(check, ..., jobs=2)."""
    return _results


def _criterion(metric: str = "nrmse", value: float | None = 0.0731, **changes: Any) -> dict[str, Any]:
    return {
        "metric": metric,
        "value": value,
        "low": None if value is None else value - 0.004,
        "high": None if value is None else value + 0.004,
        "min": None,
        "max": 0.08,
        "bound": 0.08,
        "verdict": "PASS",
        "reason": f"The reason for the budget of {metric}.",
        "note": "",
        "place": f"scenes/room.toml:{len(metric)}",
        "renderer": "",
    } | changes


def _check(**changes: Any) -> dict[str, Any]:
    scene, technique = changes.get("scene", "room"), changes.get("technique", "indirect.irradiance")
    return {
        "id": f"{scene}/{technique}[bounces=3,shadows=True,fitted]",
        "scene": "room",
        "scene_title": "Small coloured room",
        "quantity": "indirect_radiance",
        "technique": "indirect.irradiance",
        "settings": {"bounces": 3, "shadows": True},
        "fit_exposure": True,
        "exposure": 1.374,
        "verdict": "PASS",
        "message": "",
        "criteria": [
            _criterion(),
            _criterion("energy_bias", -0.012, min=-0.04, max=0.04),
            _criterion("flip", 0.0312, max=0.06, note="raw; extrapolated to 0.028", renderer="llvmpipe"),
        ],
        "spp": 4096,
        "spp_fixed": 16384,
        "seconds": {"realtime": 0.00184, "reference": 12.41},
        "pass_seconds": {"capture": 0.0012, "gather": 0.0006},
        "skipped": [{"what": "visibility pass", "why": "the character is convex"}],
        "integrator": {"name": "indirect_only", "why": "direct light would add noise"},
        "truth_key": "ab12cd34",
        "images": {name: f"images/room-{name}.png" for name in ("realtime", "truth", "error", "significance")},
        "error_scale": 0.024,
        "significance": {"share": 0.62, "false_discovery_rate": 0.05, "tiles": 120},
        "worst": {"x": 12, "y": 7, "realtime": [0.5, 0.25, 1.0], "truth": [0.25, 0.5, 1.0], "sigma": [0.05, 0.0, 0.1]},
        "unit": "W/(m² sr)",
        "exposure_display": 1.52,
        "gl_renderer": "llvmpipe (LLVM 15.0.6, 256 bits), OpenGL 4.5",
        "card": {
            "name": "Irradiance",
            "source": "Ramamoorthi 2001",
            "summary": "Nine coefficients.",
            "limits": "One position.",
        },
        "cached": True,
        "rerun": "lightgauge run room -k irradiance",
        "accepted": {
            "date": "2026-01-02",
            "reason": "Measured with the first release.",
            "criteria": {"nrmse": [0.0725, 0.07, 0.075], "energy_bias": [0.01, 0.005, 0.015], "flip": [0.0, 0.0, 0.0]},
        },
        "slack": "budget slack: flip fell far.",
        "variants": [
            {
                "quantity": "one_bounce",
                "summary": "without the others",
                "nrmse": 0.211,
                "low": 0.2,
                "high": 0.222,
                "energy_bias": -0.153,
            }
        ],
    } | changes


def _results(*checks: dict[str, Any], **changes: Any) -> dict[str, Any]:
    return {
        "schema": 1,
        "environment": {"lightgauge": "0.1.0", "gl_renderer": "llvmpipe", "cpu_count": 2, "commit": "3f9c1ab27d0e"},
        "started": "2026-01-14 09:12:44",
        "seconds": 192.3,
        "counts": {},
        "store_note": None,
        "checks": list(checks),
    } | changes
