"""A scene on the GPU, and what the passes of a frame hand to each other."""

from __future__ import annotations

import time
from collections.abc import Callable, Hashable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import cached_property
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, TypeVar, cast

import numpy as np

from realtime.camera import Camera, sensor_camera
from realtime.clock import Clock, WallClock
from realtime.device import Device
from realtime.graph import Skip
from realtime.instrument import NO_INSTRUMENT, Instrument
from realtime.nearness import Box, near_plane
from realtime.shader import NO_SHADERS, OwnShaders, program, set_uniforms
from scenes.checks import SettingValue
from scenes.errors import InputError
from scenes.features import Features
from scenes.geometry import diffuse_reflectance, texture_of
from scenes.image import Float32, Float64
from scenes.materials import Material, Texture
from scenes.mesh import Interface, Mesh
from scenes.model import Scene
from scenes.topology import is_watertight, signed_volume
from scenes.units import Albedo

if TYPE_CHECKING:
    import moderngl

T = TypeVar("T")

TEXTURE_UNIT = 15
PATTERN_UNIT = 14
"""Where surface textures and the patterns of emitters are bound while meshes are drawn; passes bind their own from 0
upward.
"""


@dataclass(frozen=True)
class Drawable:
    mesh: Mesh
    vertices: moderngl.Buffer
    indices: moderngl.Buffer
    texture: moderngl.Texture
    pattern: moderngl.Texture


@dataclass
class Frame:
    """Everything that a pass may use.

    `resources` holds what earlier passes wrote, by name. `skipped` takes what a pass leaves out, and why, where that
    shows only once it runs. `shaders` are the files that a user's own technique brings. `instrument` sees every shader
    before it is compiled. `spent` holds the seconds that compiling and uploading have taken, `clock` times all that is
    given to the GPU through the methods below: what a technique submits by itself is missed.
    """

    context: moderngl.Context
    scene: Scene
    meshes: tuple[Mesh, ...]
    features: Features
    settings: Mapping[str, SettingValue]
    grid: int
    shaders: OwnShaders = NO_SHADERS
    instrument: Instrument = NO_INSTRUMENT
    resources: dict[str, Any] = field(default_factory=dict)
    skipped: list[Skip] = field(default_factory=list)
    spent: dict[str, float] = field(default_factory=lambda: {"compile": 0.0, "upload": 0.0})
    _programs: dict[Any, Any] = field(default_factory=dict)
    _made_once: dict[Hashable, Any] = field(default_factory=dict)
    _arrays: dict[Any, moderngl.VertexArray] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.device = Device(self.context)
        self.context = cast("moderngl.Context", self.device)
        self.clock: Clock = WallClock(self.context)

    @property
    def size(self) -> tuple[int, int]:
        """Width and height of the supersampled image."""
        return self.scene.sensor.width * self.grid, self.scene.sensor.height * self.grid

    def program(self, *names: str, **defines: int | float) -> Any:
        """The program of some shader files, compiled once for each set of defines."""
        key = (names, tuple(sorted(defines.items())))
        if key not in self._programs:
            with self._starting("compile"):
                self._programs[key] = program(
                    self.context, *names, defines=defines, own=self.shaders, rewrite=self.instrument.rewrite
                )
        return self._programs[key]

    def once(self, key: Hashable, make: Callable[[], T]) -> T:
        """What stays as it is from frame to frame: made when it is first asked for, and kept by its key."""
        if key not in self._made_once:
            with self._starting("upload"):
                self._made_once[key] = make()
        made: T = self._made_once[key]
        return made

    @contextmanager
    def _starting(self, what: str) -> Iterator[None]:
        """Count what is done meanwhile as `what`, but for what is counted within."""
        start, within = time.perf_counter(), sum(self.spent.values())
        yield
        self.spent[what] += time.perf_counter() - start - (sum(self.spent.values()) - within)

    def texture(self, size: tuple[int, int], components: int, dtype: str = "f4") -> moderngl.Texture:
        """A texture read without filtering."""
        made = self.context.texture(size, components, dtype=dtype)
        made.filter = (self.context.NEAREST, self.context.NEAREST)
        return made

    def filtered_texture(self, pixels: Float32) -> moderngl.Texture:
        """Pixels (H, W, C) as a texture that repeats, filtered linearly; row 0 is at v = 0."""
        height, width, components = pixels.shape
        made = self.context.texture((width, height), components, np.ascontiguousarray(pixels).tobytes(), dtype="f4")
        made.filter = (self.context.LINEAR, self.context.LINEAR)
        made.repeat_x = made.repeat_y = True
        return made

    def reflectance_texture(self, material: Material | Interface) -> moderngl.Texture:
        """What a material's surface reflects diffusely over (u, v); one texel if that is constant."""
        return self.surface_texture(diffuse_reflectance(material))

    def surface_texture(self, values: Albedo | Texture) -> moderngl.Texture:
        """Colours over (u, v); one texel if they are constant."""
        if isinstance(values, Texture):
            return self.filtered_texture(texture_of(self.scene, values)[::-1])
        return self.filtered_texture(np.array(values, dtype=np.float32).reshape(1, 1, 3))

    def dispatch(
        self, shader: Any, width: int, height: int = 1, *, group: tuple[int, int] = (8, 8), **uniforms: Any
    ) -> None:
        """Run a compute shader over width x height invocations.

        Raises
        ------
        InputError
            They are more than this GPU runs at once: it would run none, and say nothing.
        """
        groups = -(-width // group[0]), -(-height // group[1])
        most = self.context.info["GL_MAX_COMPUTE_WORK_GROUP_COUNT"][:2]
        if any(wanted > allowed for wanted, allowed in zip(groups, most, strict=True)):
            raise InputError(
                f"Scene '{self.scene.name}' needs {groups[0]} x {groups[1]} groups of a compute shader, one for each "
                f"vertex of the subject or block of pixels; this GPU allows {most[0]} x {most[1]}. Give the subject "
                "fewer vertices, or the technique lower settings."
            )
        set_uniforms(shader, **uniforms)
        with self.clock.submission():
            shader.run(*groups, 1)
            self.context.memory_barrier()

    def submit(self, work: Callable[..., object], *given: Any, **named: Any) -> None:
        """Give one other command to the GPU, such as `target.clear`, or a copy."""
        with self.clock.submission():
            work(*given, **named)

    def build_mipmaps(self, texture: moderngl.Texture) -> None:
        """Fill the smaller levels of a texture from the first one."""
        self.submit(texture.build_mipmaps)
        self.device.count_mipmaps(texture)

    def screen(self, shader: Any) -> None:
        """Draw one triangle that covers the framebuffer in use; `shader` makes its vertices, as raster/screen.vert."""
        if shader not in self._arrays:
            self._arrays[shader] = self.context.vertex_array(shader, [])
        with self.clock.submission():
            self._arrays[shader].render(vertices=3)

    @cached_property
    def bounds(self) -> tuple[Float64, float]:
        """Centre and radius of a ball around everything."""
        points = np.concatenate([m.surface.positions for m in self.meshes]).astype(float)
        low, high = points.min(axis=0), points.max(axis=0)
        return (low + high) / 2, float(np.linalg.norm(high - low) / 2)

    @cached_property
    def subject_box(self) -> tuple[Float64, Float64]:
        """Lowest and highest corner of the subject."""
        points = np.concatenate([m.surface.positions for m in self.meshes if m.is_subject]).astype(float)
        return points.min(axis=0), points.max(axis=0)

    @property
    def subject_centre(self) -> Float64:
        """Where the talk puts its cube: the character's belly."""
        low, high = self.subject_box
        centre: Float64 = (low + high) / 2
        return centre

    @cached_property
    def boxes(self) -> dict[str, Box]:
        """Lowest and highest corner of each mesh, by its name."""
        surfaces = ((mesh.name, mesh.surface.positions.astype(float)) for mesh in self.meshes)
        return {name: (points.min(axis=0), points.max(axis=0)) for name, points in surfaces}

    def near_plane(self, place: Float64, which: Callable[[Mesh], bool] = lambda mesh: True) -> float:
        """Planar depth before which there is nothing to see around a place, of the meshes for which `which` holds."""
        return near_plane((self.boxes[mesh.name] for mesh in self.meshes if which(mesh)), place, self.bounds[1])

    @cached_property
    def clip_planes(self) -> tuple[float, float]:
        """Nearest and farthest planar depth that the sensor may see: the whole scene lies between."""
        centre, radius = self.bounds
        eye = np.array(self.scene.sensor.origin)
        away = centre - eye
        forward = np.array(self.scene.sensor.target) - eye
        depth = float(away @ forward / np.linalg.norm(forward))
        return max(self.near_plane(eye), depth - 1.01 * radius), float(np.linalg.norm(away)) + 1.01 * radius

    @cached_property
    def camera(self) -> Camera:
        """The sensor's camera."""
        return sensor_camera(self.scene.sensor, *self.clip_planes)

    @cached_property
    def closed(self) -> frozenset[str]:
        """Names of the meshes that are watertight and face outward: found once, as meshes are uploaded once."""
        solid = (m for m in self.meshes if is_watertight(m.surface) and signed_volume(m.surface) > 0)
        return frozenset(mesh.name for mesh in solid)

    @property
    def drawables(self) -> tuple[Drawable, ...]:
        """The meshes, uploaded once."""
        return self.once("drawables", lambda: tuple(self._upload(mesh) for mesh in self.meshes))

    def _upload(self, mesh: Mesh) -> Drawable:
        surface = mesh.surface
        vertices = np.hstack([surface.positions, surface.normals, surface.uvs]).astype(np.float32)
        return Drawable(
            mesh,
            self.context.buffer(vertices.tobytes()),
            self.context.buffer(np.ascontiguousarray(surface.faces, dtype=np.uint32).tobytes()),
            self.reflectance_texture(mesh.material),
            self.surface_texture(mesh.pattern or (1.0, 1.0, 1.0)),
        )

    def draw(
        self,
        shader: Any,
        camera: Camera,
        which: Callable[[Mesh], bool] = lambda mesh: True,
        received: Mapping[str, moderngl.Buffer] = MappingProxyType({}),
    ) -> None:
        """Draw the meshes for which `which` holds into the framebuffer in use.

        `received` gives some meshes, by name, one more vec4 for each vertex: `in_received`. Its buffers are kept: give
        the same ones in each frame.
        """
        set_uniforms(shader, world_to_clip=columns(camera.matrix), eye=tuple(camera.eye), forward=tuple(camera.forward))
        for drawable in self.drawables:
            mesh = drawable.mesh
            if not which(mesh):
                continue
            drawable.texture.use(TEXTURE_UNIT)
            drawable.pattern.use(PATTERN_UNIT)
            set_uniforms(
                shader,
                reflectance_map=TEXTURE_UNIT,
                is_subject=float(mesh.is_subject),
                emission=mesh.radiance or (0.0, 0.0, 0.0),
                emission_map=PATTERN_UNIT,
            )
            with self.clock.submission():
                self._vertex_array(shader, drawable, received.get(mesh.name)).render()

    def _vertex_array(self, shader: Any, drawable: Drawable, received: moderngl.Buffer | None) -> moderngl.VertexArray:
        """What feeds a shader with a mesh; it is kept for as long as the frame is, with the buffer `received`."""
        key = (shader, drawable.mesh.name, received)
        if key not in self._arrays:
            layout: list[tuple[Any, ...]] = [(drawable.vertices, "3f4 3f4 2f4", "in_position", "in_normal", "in_uv")]
            if received:
                layout.append((received, "4f4", "in_received"))
            self._arrays[key] = self.context.vertex_array(shader, layout, drawable.indices, skip_errors=True)
        return self._arrays[key]

    def read(self, name: str, components: int) -> Float32:
        """A texture as (H, W, C) float32, row 0 at the top."""
        texture = self.resources[name]
        flat = np.frombuffer(texture.read(), dtype=np.float32)
        return np.ascontiguousarray(flat.reshape(texture.height, texture.width, components)[::-1])


def columns(matrix: Float64) -> tuple[float, ...]:
    """A matrix in the order in which GLSL takes it."""
    return tuple(float(v) for v in matrix.T.ravel())


def is_environment(mesh: Mesh) -> bool:
    """Whether a mesh is part of what surrounds the subject."""
    return not mesh.is_subject
