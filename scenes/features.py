"""What a scene contains, derived from it: the reasons for which passes and integrators are chosen or skipped."""

from dataclasses import dataclass

from scenes.geometry import is_convex, texture_of
from scenes.mesh import Mesh
from scenes.model import (
    AreaLight,
    ConstantLight,
    DirectionalLight,
    DiskLight,
    EnvironmentLight,
    Material,
    PointLight,
    Scene,
    Texture,
    ThinLens,
)


@dataclass(frozen=True)
class Features:
    """All derived; nothing here is ever set by hand."""

    is_dark: bool
    has_point_lights: bool
    has_directional_lights: bool
    has_surface_lights: bool
    has_sky: bool
    is_lit_by_constant_sky_alone: bool
    has_textures: bool
    has_thin_lens: bool
    subject_is_convex: bool
    subject_is_alone: bool
    brightest_reflectance: float
    """Highest reflectance of the surroundings: bounds how fast the light that bounces among them dies out."""

    @property
    def has_local_or_directional_lights(self) -> bool:
        return self.has_point_lights or self.has_directional_lights or self.has_surface_lights


def features_of(scene: Scene, meshes: tuple[Mesh, ...]) -> Features:
    """Derive the features from the scene and its geometry."""
    kinds = [type(e) for e in scene.emitters]
    surroundings = [m.material for m in meshes if not m.is_subject]
    subjects = [m for m in meshes if m.is_subject]
    return Features(
        is_dark=not kinds,
        has_point_lights=PointLight in kinds,
        has_directional_lights=DirectionalLight in kinds,
        has_surface_lights=AreaLight in kinds or DiskLight in kinds,
        has_sky=ConstantLight in kinds or EnvironmentLight in kinds,
        is_lit_by_constant_sky_alone=kinds == [ConstantLight],
        has_textures=any(isinstance(m.reflectance, Texture) for m in scene.materials.values()),
        has_thin_lens=isinstance(scene.sensor, ThinLens),
        subject_is_convex=len(subjects) == 1 and is_convex(subjects[0].surface),
        subject_is_alone=not surroundings,
        brightest_reflectance=max((_brightest(scene, m) for m in surroundings), default=0.0),
    )


def _brightest(scene: Scene, material: Material) -> float:
    reflectance = material.reflectance
    if isinstance(reflectance, Texture):
        return float(texture_of(scene, reflectance).max())
    return max(reflectance)
