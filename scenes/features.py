"""What a scene contains, derived from it: the reasons for which passes and integrators are chosen or skipped."""

from dataclasses import dataclass

from scenes.geometry import diffuse_reflectance, is_convex, texture_of
from scenes.mesh import Mesh
from scenes.model import (
    AreaLight,
    ConstantLight,
    Diffuse,
    DirectionalLight,
    DiskLight,
    EnvironmentLight,
    Eye,
    LineLight,
    PointLight,
    Scene,
    Slab,
    SphereLight,
    Texture,
    ThinLens,
    Translucent,
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
    is_lit_by_directional_lights_alone: bool
    has_textures: bool
    has_thin_lens: bool
    has_media: bool
    has_eye: bool
    subject_is_convex: bool
    subject_is_alone: bool
    subject_is_translucent: bool
    subject_is_slab: bool
    """The subject is one translucent slab and nothing else."""

    is_body_alone: bool
    """Nothing but emitters that reflect nothing is beside the subject."""

    brightest_reflectance: float
    """Highest diffuse reflectance of the surroundings: bounds how fast the light that bounces among them dies out."""

    nothing_reflects: bool
    """Every surface is black: what is seen is emitted."""

    has_one_omni_light: bool
    """One point or sphere light, whatever else there is."""

    has_sphere_light: bool

    @property
    def has_local_or_directional_lights(self) -> bool:
        return self.has_point_lights or self.has_directional_lights or self.has_surface_lights


def features_of(scene: Scene, meshes: tuple[Mesh, ...]) -> Features:
    """Derive the features from the scene and its geometry."""
    kinds = {type(e) for e in scene.emitters}
    surroundings = [m for m in meshes if not m.is_subject]
    subjects = [m for m in meshes if m.is_subject]
    is_translucent = bool(subjects) and all(isinstance(m.material, Translucent) for m in subjects)
    brightest = max((_brightest(scene, m) for m in surroundings), default=0.0)
    return Features(
        is_dark=not kinds,
        has_point_lights=PointLight in kinds,
        has_directional_lights=DirectionalLight in kinds,
        has_surface_lights=bool(kinds & {AreaLight, DiskLight, LineLight, SphereLight}),
        has_sky=bool(kinds & {ConstantLight, EnvironmentLight}),
        is_lit_by_constant_sky_alone=[type(e) for e in scene.emitters] == [ConstantLight],
        is_lit_by_directional_lights_alone=kinds == {DirectionalLight},
        has_textures=any(isinstance(diffuse_reflectance(m), Texture) for m in scene.materials.values()),
        has_thin_lens=isinstance(scene.sensor, ThinLens),
        has_media=any(isinstance(m.material, Translucent) for m in meshes),
        has_eye=any(isinstance(shape, Eye) for shape in scene.shapes),
        subject_is_convex=len(subjects) == 1 and is_convex(subjects[0].surface),
        subject_is_alone=not surroundings,
        subject_is_translucent=is_translucent,
        subject_is_slab=is_translucent and _subject_types(scene) == [Slab],
        is_body_alone=all(m.radiance is not None for m in surroundings) and brightest == 0,
        brightest_reflectance=brightest,
        nothing_reflects=all(_reflects_nothing(scene, m) for m in meshes),
        has_one_omni_light=sum(isinstance(e, PointLight | SphereLight) for e in scene.emitters) == 1,
        has_sphere_light=SphereLight in kinds,
    )


def _subject_types(scene: Scene) -> list[type]:
    return [type(shape) for shape in scene.shapes if shape.name in scene.subject]


def _reflects_nothing(scene: Scene, mesh: Mesh) -> bool:
    return isinstance(mesh.material, Diffuse) and _brightest(scene, mesh) == 0


def _brightest(scene: Scene, mesh: Mesh) -> float:
    reflectance = diffuse_reflectance(mesh.material)
    if isinstance(reflectance, Texture):
        return float(texture_of(scene, reflectance).max())
    return max(reflectance)
