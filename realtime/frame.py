"""A scene on the GPU, and what the passes of a frame hand to each other."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np

from realtime.camera import Camera, sensor_camera
from realtime.graph import Skip
from realtime.instrument import NO_INSTRUMENT, Instrument
from realtime.shader import NO_SHADERS, OwnShaders, program, set_uniforms
from scenes.checks import SettingValue
from scenes.errors import InputError
from scenes.features import Features
from scenes.geometry import diffuse_reflectance, texture_of
from scenes.image import Float32, Float64
from scenes.mesh import Interface, Mesh
from scenes.model import Albedo, Diffuse, Scene, Texture, Translucent
from scenes.topology import is_watertight, signed_volume

if TYPE_CHECKING:
    import moderngl

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
    before it is compiled.
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
    _programs: dict[Any, Any] = field(default_factory=dict)

    @property
    def size(self) -> tuple[int, int]:
        """Width and height of the supersampled image."""
        return self.scene.sensor.width * self.grid, self.scene.sensor.height * self.grid

    def program(self, *names: str, **defines: int | float) -> Any:
        """The program of some shader files, compiled once for each set of defines."""
        key = (names, tuple(sorted(defines.items())))
        if key not in self._programs:
            self._programs[key] = program(
                self.context, *names, defines=defines, own=self.shaders, rewrite=self.instrument.rewrite
            )
        return self._programs[key]

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

    def reflectance_texture(self, material: Diffuse | Translucent | Interface) -> moderngl.Texture:
        """What a material's surface reflects diffusely over (u, v); one texel if that is constant."""
        return self._surface_texture(diffuse_reflectance(material))

    def _surface_texture(self, values: Albedo | Texture) -> moderngl.Texture:
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
        shader.run(*groups, 1)
        self.context.memory_barrier()

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
    def clip_planes(self) -> tuple[float, float]:
        """Nearest and farthest planar depth that the sensor may see: the whole scene lies between."""
        centre, radius = self.bounds
        distance = float(np.linalg.norm(centre - np.array(self.scene.sensor.origin)))
        return max(1e-3 * radius, distance - 1.01 * radius), distance + 1.01 * radius

    @cached_property
    def camera(self) -> Camera:
        """The sensor's camera."""
        return sensor_camera(self.scene.sensor, *self.clip_planes)

    @cached_property
    def closed(self) -> frozenset[str]:
        """Names of the meshes that are watertight and face outward: found once, as meshes are uploaded once."""
        solid = (m for m in self.meshes if is_watertight(m.surface) and signed_volume(m.surface) > 0)
        return frozenset(mesh.name for mesh in solid)

    @cached_property
    def drawables(self) -> tuple[Drawable, ...]:
        return tuple(self._upload(mesh) for mesh in self.meshes)

    def _upload(self, mesh: Mesh) -> Drawable:
        surface = mesh.surface
        vertices = np.hstack([surface.positions, surface.normals, surface.uvs]).astype(np.float32)
        return Drawable(
            mesh,
            self.context.buffer(vertices.tobytes()),
            self.context.buffer(np.ascontiguousarray(surface.faces, dtype=np.uint32).tobytes()),
            self.reflectance_texture(mesh.material),
            self._surface_texture(mesh.pattern or (1.0, 1.0, 1.0)),
        )

    def draw(
        self,
        shader: Any,
        camera: Camera,
        which: Callable[[Mesh], bool] = lambda mesh: True,
        received: Mapping[str, moderngl.Buffer] = MappingProxyType({}),
    ) -> None:
        """Draw the meshes for which `which` holds into the framebuffer in use.

        `received` gives some meshes, by name, one more vec4 for each vertex: `in_received`.
        """
        set_uniforms(shader, world_to_clip=columns(camera.matrix), eye=tuple(camera.eye), forward=tuple(camera.forward))
        for drawable in self.drawables:
            mesh = drawable.mesh
            if not which(mesh):
                continue
            layout: list[tuple[Any, ...]] = [(drawable.vertices, "3f4 3f4 2f4", "in_position", "in_normal", "in_uv")]
            if mesh.name in received:
                layout.append((received[mesh.name], "4f4", "in_received"))
            drawable.texture.use(TEXTURE_UNIT)
            drawable.pattern.use(PATTERN_UNIT)
            set_uniforms(
                shader,
                reflectance_map=TEXTURE_UNIT,
                is_subject=float(mesh.is_subject),
                emission=mesh.radiance or (0.0, 0.0, 0.0),
                emission_map=PATTERN_UNIT,
            )
            array = self.context.vertex_array(shader, layout, drawable.indices, skip_errors=True)
            array.render()
            array.release()

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
