"""What a scene contains, derived from it: the reasons for which passes and integrators are chosen or skipped."""

from dataclasses import dataclass

from scenes.geometry import diffuse_reflectance, is_convex, require_textures, texture_of
from scenes.materials import Diffuse, Layered, Principled, Texture, Translucent
from scenes.mesh import Mesh
from scenes.model import (
    AreaLight,
    ConstantLight,
    DirectionalLight,
    DiskLight,
    EnvironmentLight,
    LineLight,
    PointLight,
    Scene,
    SphereLight,
    ThinLens,
)
from scenes.shapes import Eye, Relief, Slab


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
    has_one_eye: bool
    subject_is_convex: bool
    subject_is_alone: bool
    """Neither another surface, a lamp's included, nor hair is beside the subject."""

    subject_is_translucent: bool
    subject_is_slab: bool
    """The subject is one translucent slab and nothing else."""

    is_body_alone: bool
    """Nothing but emitters that reflect nothing is beside the subject, and no hair."""

    brightest_reflectance: float
    """Highest reflectance of the surroundings: bounds how fast the light that bounces among them dies out.

    Of a layered or principled material it is 1, which is no less; of what light passes, 0.
    """

    nothing_reflects: bool
    """Every surface is black and there is no hair: what is seen is emitted."""

    has_one_omni_light: bool
    """One point or sphere light, whatever else there is."""

    has_sphere_light: bool
    has_layers: bool
    """Something is of a layered or principled material."""

    has_hair: bool
    has_painted_hair: bool
    """Some hair has a colour texture."""

    longest_hair: float
    """The most radii that a guide is long, before a texture shortens it; 0 without hair."""

    subject_is_relief: bool
    """The subject is one carved block and nothing else."""

    has_other_than_diffuse: bool
    """A medium, an eye, a layered material or hair: more than paths between Lambertian surfaces."""

    @property
    def has_local_or_directional_lights(self) -> bool:
        return self.has_point_lights or self.has_directional_lights or self.has_surface_lights


def features_of(scene: Scene, meshes: tuple[Mesh, ...]) -> Features:
    """Derive the features from the scene and its geometry.

    Raises
    ------
    SceneError
        A texture cannot be used, even one that is read only when a truth is rendered.
    """
    require_textures(scene)
    kinds = {type(e) for e in scene.emitters}
    surroundings = [m for m in meshes if not m.is_subject]
    subjects = [m for m in meshes if m.is_subject]
    is_translucent = bool(subjects) and all(isinstance(m.material, Translucent) for m in subjects)
    is_relief = _subject_types(scene) == [Relief]
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
        has_one_eye=sum(isinstance(shape, Eye) for shape in scene.shapes) == 1,
        subject_is_convex=len(subjects) == 1 and not is_relief and is_convex(subjects[0].surface),
        subject_is_alone=not surroundings and not scene.hair,
        subject_is_translucent=is_translucent,
        subject_is_slab=is_translucent and _subject_types(scene) == [Slab],
        is_body_alone=not scene.hair
        and all(m.radiance is not None and _reflects_nothing(scene, m) for m in surroundings),
        brightest_reflectance=max((_brightest(scene, m) for m in surroundings), default=0.0),
        nothing_reflects=not scene.hair and all(_reflects_nothing(scene, m) for m in meshes),
        has_one_omni_light=sum(isinstance(e, PointLight | SphereLight) for e in scene.emitters) == 1,
        has_sphere_light=SphereLight in kinds,
        has_layers=any(isinstance(m.material, Layered | Principled) for m in meshes),
        has_hair=bool(scene.hair),
        has_painted_hair=any(hair.color is not None for hair in scene.hair),
        longest_hair=max((hair.length * (1 + hair.spread) / hair.radius for hair in scene.hair), default=0.0),
        subject_is_relief=is_relief,
        has_other_than_diffuse=bool(scene.hair) or not all(isinstance(m.material, Diffuse) for m in meshes),
    )


def _subject_types(scene: Scene) -> list[type]:
    return [type(shape) for shape in scene.shapes if shape.name in scene.subject]


def _reflects_nothing(scene: Scene, mesh: Mesh) -> bool:
    return isinstance(mesh.material, Diffuse) and _brightest(scene, mesh) == 0


def _brightest(scene: Scene, mesh: Mesh) -> float:
    if isinstance(mesh.material, Layered | Principled):
        return 1.0
    reflectance = diffuse_reflectance(mesh.material)
    if isinstance(reflectance, Texture):
        return float(texture_of(scene, reflectance).max())
    return max(reflectance)
