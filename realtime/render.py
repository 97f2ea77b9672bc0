"""Run a technique on a scene."""

import time
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

from realtime.context import make_context, renderer_name
from realtime.frame import Frame
from realtime.graph import Plan, Skip, plan
from realtime.instrument import NO_INSTRUMENT, Instrument
from realtime.technique import Technique
from scenes.checks import SettingValue
from scenes.errors import InputError
from scenes.features import Features, features_of
from scenes.geometry import geometry_of
from scenes.image import Image, require_finite
from scenes.mesh import Mesh
from scenes.model import Scene

if TYPE_CHECKING:
    import moderngl


LONG_FRAME = 5.0
"""Seconds. A frame that takes longer is not drawn twice to be timed: compiling its shaders is a small part of it."""


@dataclass(frozen=True)
class Rendering:
    """`seconds` is a frame's time once everything is compiled, by the wall clock, with reading back left out."""

    image: Image
    skipped: tuple[Skip, ...]
    seconds: float
    pass_seconds: dict[str, float]


def plan_of(technique: Technique, scene: Scene, features: Features, settings: dict[str, SettingValue]) -> Plan:
    """What would run; needs no GPU."""
    return plan(technique.passes(scene, features, technique.settings(settings)), "image")


class Renderer:
    """Draws one scene with any technique, watched by an `instrument`. The OpenGL context is made at the first frame."""

    def __init__(self, scene: Scene, instrument: Instrument = NO_INSTRUMENT) -> None:
        self.scene = scene
        self.instrument = instrument

    @cached_property
    def _context(self) -> "moderngl.Context":
        return make_context()

    @cached_property
    def _contents(self) -> tuple[tuple[Mesh, ...], Features]:
        meshes = geometry_of(self.scene)
        return meshes, features_of(self.scene, meshes)

    def render(self, technique: Technique, given: dict[str, SettingValue], timed: bool = True) -> Rendering:
        """One image of the technique, and the time that a frame takes.

        Raises
        ------
        RenderError
            A shader does not compile, or the image holds NaNs or infinities.
        """
        meshes, features = self._contents
        settings = technique.settings(given)
        width, height = self.scene.sensor.width * technique.grid, self.scene.sensor.height * technique.grid
        largest = int(self._context.info["GL_MAX_TEXTURE_SIZE"])
        if max(width, height) > largest:
            raise InputError(
                f"Scene '{self.scene.name}' at {technique.grid} x {technique.grid} samples a pixel needs a texture of "
                f"{width} x {height}; this GPU allows {largest}. Lower the sensor's width and height."
            )
        todo = plan(technique.passes(self.scene, features, settings), "image")
        frame = Frame(
            self._context,
            self.scene,
            meshes,
            features,
            settings,
            technique.grid,
            technique.shaders,
            self.instrument,
        )
        seconds = self._run(frame, todo)
        if timed and sum(seconds.values()) < LONG_FRAME:
            frame.resources.clear()
            frame.skipped.clear()
            seconds = self._run(frame, todo)
        pixels = require_finite(
            frame.read("image", 4)[..., list(technique.channels)], f"image of {self.scene.name}, {technique.name}"
        )
        provenance: dict[str, Any] = {
            "scene": self.scene.name,
            "technique": technique.name,
            "settings": settings,
            "renderer": renderer_name(self._context),
        }
        return Rendering(Image(pixels, provenance), (*todo.skipped, *frame.skipped), sum(seconds.values()), seconds)

    def _run(self, frame: Frame, todo: Plan) -> dict[str, float]:
        seconds = {}
        self.instrument.begin(frame)
        for step in todo.passes:
            start = time.perf_counter()
            step.run(frame)
            frame.context.finish()
            seconds[step.name] = time.perf_counter() - start
            self.instrument.after_pass(step, frame)
        return seconds
