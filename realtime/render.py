"""Run a technique on a scene."""

from collections.abc import Collection
from dataclasses import replace
from functools import cached_property
from typing import TYPE_CHECKING

from realtime.clock import clock_for
from realtime.context import make_context
from realtime.frame import Frame
from realtime.graph import Plan, plan
from realtime.instrument import NO_INSTRUMENT, Instrument
from realtime.origin import near_origin
from realtime.shader import NO_SHADERS
from realtime.technique import Technique
from realtime.timing import Prepared, Rendering
from scenes.checks import SettingValue
from scenes.errors import InputError, RenderError
from scenes.features import Features, features_of
from scenes.geometry import geometry_of
from scenes.mesh import Mesh
from scenes.model import Scene

if TYPE_CHECKING:
    import moderngl

__all__ = ["Renderer", "Rendering", "plan_of"]

LONG_FRAME = 5.0
"""Seconds. A frame that takes longer is not drawn twice to be timed: what it does once is a small part of it."""


def plan_of(technique: Technique, scene: Scene, features: Features, settings: dict[str, SettingValue]) -> Plan:
    """What would run; needs no GPU."""
    return plan(technique.passes(scene, features, technique.settings(settings)), "image")


class Renderer:
    """Draws one scene with any technique. The OpenGL context is made at the first frame.

    An `instrument` watches the first frame of each rendering; with one, no other frame is drawn to be timed.
    """

    def __init__(self, scene: Scene, instrument: Instrument = NO_INSTRUMENT) -> None:
        self.scene = near_origin(scene)
        self.instrument = instrument

    @cached_property
    def _context(self) -> "moderngl.Context":
        return make_context()

    @cached_property
    def _contents(self) -> tuple[tuple[Mesh, ...], Features]:
        meshes = geometry_of(self.scene)
        return meshes, features_of(self.scene, meshes)

    def render(self, technique: Technique, given: dict[str, SettingValue], timed: bool = True) -> Rendering:
        """One image of the technique, and the time that a frame takes: if `timed` that of a later one.

        Raises
        ------
        RenderError
            A shader does not compile, or the image holds NaNs or infinities.
        """
        prepared = self.prepared(technique, given)
        rendering = prepared.rendering
        if not timed or rendering.seconds >= LONG_FRAME or self.instrument is not NO_INSTRUMENT:
            return rendering
        sample = prepared.frame()
        return replace(rendering, seconds=sample.seconds, pass_seconds=dict(sample.passes))

    def prepared(self, technique: Technique, given: dict[str, SettingValue], without: Collection[str] = ()) -> Prepared:
        """A technique ready to draw frame after frame, its first frame drawn; `without` names passes to leave out.

        Raises
        ------
        InputError
            The technique has no pass of such a name, or the image is too large for this GPU.
        RenderError
            A shader does not compile, the image holds NaNs or infinities, or a pass needs what is left out.
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
        passes = technique.passes(self.scene, features, settings)
        known = [step.name for step in passes]
        for name in without:
            if name not in known:
                raise InputError(f"Technique '{technique.name}' has no pass '{name}'. It has: {', '.join(known)}.")
        try:
            todo = plan(passes, "image", without)
        except ValueError as error:
            raise RenderError(
                f"'{technique.name}' cannot draw '{self.scene.name}' without {' and '.join(without)}: {error}."
            ) from error
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
        is_own = technique.shaders is not NO_SHADERS
        return Prepared(technique, frame, todo, clock_for(self._context, whole_steps=is_own))
