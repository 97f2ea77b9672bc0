"""Light through the cornea against photon counts, Coddington's equations, furnaces, limits, and Mitsuba's tracer."""

from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from reference import eye_rays
from reference.estimator import Reference, seed_of
from reference.eye_rays import Optics, eye_of, optics_of
from reference.quantities.eye import eye_block
from reference.stage import Stage, build_stage
from reference.to_mitsuba import instantiate, sensor_dict
from scenes import eyes
from scenes.errors import SceneError
from scenes.exr import write_exr
from scenes.geometry import geometry_of
from scenes.image import Float64, Image
from scenes.mesh import Surface
from scenes.model import Scene

if TYPE_CHECKING:
    from reference.integrators.eye_focus import Focus

MakeScene = Callable[..., Scene]
MakeReference = Callable[..., Reference]
Shape = dict[str, Any]

STANDARD_ERRORS = 5
IRIS = np.array([0.3, 0.45, 0.6])
MATERIALS = {
    "white": {"type": "diffuse", "reflectance": [0.8, 0.8, 0.8]},
    "skin": {"type": "diffuse", "reflectance": IRIS.tolist()},
}
TALK: Shape = {
    "name": "eye",
    "type": "eye",
    "material": "white",
    "iris": "skin",
    "sclera_radius": 1.0,
    "cornea_radius": 1.0,
    "limbus_radius": float(np.sqrt(1 - 0.805**2)),
    "ior": 1.376,
    "detail": 64,
}
BOWL = TALK | {"iris_curvature": 2.0}
ONE_SURFACE = TALK | {
    "sclera_radius": 12.0,
    "cornea_radius": 7.8,
    "limbus_radius": 5.9,
    "iris_depth": 3.55,
    "pupil_radius": 2.0,
}
HUMAN = ONE_SURFACE | {"endothelium": {"radius": 6.5, "thickness": 0.55, "ior": 1.336}}
SHAPES = {
    "talk": TALK,
    "bowl": BOWL,
    "one surface": ONE_SURFACE,
    "human": HUMAN,
    "human with a bowl": HUMAN | {"iris_curvature": 10.0},
}
SKY = {"type": "constant", "radiance": [1.0, 1.0, 1.0]}


def towards(angle_deg: float) -> Float64:
    """Unit vector at an angle to the gaze, in no symmetric plane."""
    a = np.radians(angle_deg)
    return np.array([np.sin(a) * np.cos(0.4), np.cos(a), np.sin(a) * np.sin(0.4)])


def sun(angle_deg: float) -> dict[str, Any]:
    return {"type": "directional", "direction": (-towards(angle_deg)).tolist(), "irradiance": [1.0, 1.0, 1.0]}


def camera(shape: Shape, view_deg: float = 30.0, pixels: int = 16, field: float = 0.5) -> dict[str, Any]:
    """Looks at the cornea from 6 sclera radii; the image is 2 `field` sclera radii wide there."""
    size, a = shape["sclera_radius"], np.radians(view_deg)
    direction = np.array([0.0, np.cos(a), np.sin(a)])
    return {
        "type": "perspective",
        "origin": (size * (6 * direction + [0.0, 0.85, 0.0])).tolist(),
        "target": [0.0, 0.85 * size, 0.0],
        "up": [1.0, 0.0, 0.1],
        "fov_deg": float(np.degrees(2 * np.arctan(field / 6))),
        "width": pixels,
        "height": pixels,
    }


@pytest.fixture
def make_eye(make_scene: MakeScene) -> Callable[..., Scene]:
    """Makes the scene of an eye, its lights, and a camera that sees its front; further keys replace those."""

    def make(shape: Shape, *emitters: dict[str, Any], **more: Any) -> Scene:
        base = {"subject": ["eye"], "materials": MATERIALS, "sensor": camera(shape)}
        return make_scene(**(base | {"shapes": [shape], "emitters": list(emitters)} | more))

    return make


def render(mi: ModuleType, scene: Scene, focus: "Focus | None", spp: int, seed: int = 1) -> Float64:
    """(H, W, 3) mean of samples."""
    stage = build_stage(mi, scene, geometry_of(scene))
    size = (scene.sensor.height, scene.sensor.width)
    return eye_block(focus, stage, np.arange(size[0] * size[1]), seed, spp).reshape(*size, -1)


def irradiance_at(mi: ModuleType, scene: Scene, points: Float64, focus: "Focus" = "caustic") -> Float64:
    """Irradiance inside the eye at points (P, 3) of the iris, in the first channel."""
    from reference.integrators.eye_focus import irradiance

    lights = lights_of(build_stage(mi, scene, geometry_of(scene)))
    sampler = mi.load_dict({"type": "independent"})
    sampler.seed(1, len(points))
    made = irradiance(lights, sampler, focus, mi.Point3f(points.T), mi.Bool(True))
    return np.array(made, dtype=float).T[:, 0]


def lights_of(stage: Stage) -> Any:
    from reference.integrators.eye_lights import Lights
    from reference.integrators.eye_surfaces import Surfaces

    return Lights(stage, Surfaces(stage.mi, optics_of(eye_of(stage.description))))


def on_iris(optics: Optics, x: Float64, z: Float64) -> Float64:
    """Points of the iris at places across the axis."""
    y = np.full_like(x, optics.iris_y)
    if optics.bowl is not None:
        y = optics.bowl.y - np.sqrt(optics.bowl.radius**2 - x**2 - z**2)
    return np.stack([x, y, z], axis=-1)


def fresnel(cos_i: Float64, n: float) -> Float64:
    """Unpolarised reflectance by Fresnel's equations, into the refractive index n."""
    cos_t = np.sqrt(1 - (1 - cos_i**2) / n**2)
    s, p = (cos_i - n * cos_t) / (cos_i + n * cos_t), (n * cos_i - cos_t) / (n * cos_i + cos_t)
    reflected: Float64 = (s**2 + p**2) / 2
    return reflected


def entries(optics: Optics, count: int) -> tuple[Float64, Float64]:
    """Points evenly over the cornea's front (N, 3) and their outward normals."""
    k = np.arange(count) + 0.5
    cosine = 1 - k / count * (1 - (optics.limbus_y - optics.cornea.y) / optics.cornea.radius)
    turn, sine = k * np.pi * (3 - np.sqrt(5)), np.sqrt(1 - cosine**2)
    outward = np.stack([sine * np.cos(turn), cosine, sine * np.sin(turn)], axis=-1)
    return outward * optics.cornea.radius + np.array([0.0, optics.cornea.y, 0.0]), outward


def photons(optics: Optics, light: Float64, is_far: bool, count: int, cells: int) -> Float64:
    """Flux (cells, cells) that a light of unit irradiance or intensity brings to each cell of the iris' square.

    Traced forward from the cornea's front, each with the power of its share of that.
    """
    p, outward = entries(optics, count)
    away = np.broadcast_to(light, p.shape) if is_far else light - p
    distance = np.linalg.norm(away, axis=-1)
    to_light = away / distance[:, None]
    cos_i = np.einsum("ij,ij->i", to_light, outward)
    cap = 2 * np.pi * optics.cornea.radius * (optics.cornea.y + optics.cornea.radius - optics.limbus_y)
    power = np.where(cos_i > 0, cos_i, 0) * cap / count / (1 if is_far else distance**2)
    power *= 1 - fresnel(np.maximum(cos_i, 0), optics.cornea.ior)
    hidden, _ = eye_rays.outer_hit(optics, p + 1e-9 * optics.cornea.radius * outward, to_light)
    x, arrives = eye_rays._through_cornea(optics, p, -to_light)
    arrives &= (cos_i > 0) & ~np.isfinite(hidden)
    side = [-optics.limbus_radius, optics.limbus_radius]
    x, power = x[arrives], power[arrives]
    flux: Float64 = np.histogram2d(x[:, 0], x[:, 2], bins=cells, range=[side, side], weights=power)[0]
    return flux


@pytest.mark.parametrize("name", SHAPES)
@pytest.mark.parametrize("angle_deg", [0.0, 40.0, 75.0])
def test_irradiance_is_what_photons_count(
    make_eye: Callable[..., Scene], mi: ModuleType, name: str, angle_deg: float
) -> None:
    assert_photons_agree(make_eye(SHAPES[name], sun(angle_deg)), mi, towards(angle_deg), is_far=True)


@pytest.mark.parametrize("name", ["talk", "human"])
def test_irradiance_of_a_light_nearby_is_what_photons_count(
    make_eye: Callable[..., Scene], mi: ModuleType, name: str
) -> None:
    place = 1.8 * SHAPES[name]["sclera_radius"] * towards(45.0)
    lamp = {"type": "point", "position": place.tolist(), "intensity": [1.0] * 3}
    assert_photons_agree(make_eye(SHAPES[name], lamp), mi, place, is_far=False)


def assert_photons_agree(scene: Scene, mi: ModuleType, light: Float64, is_far: bool) -> None:
    """In 16 x 16 cells: each to the noise of some hundred photons, and all together to 6e-4.

    The endothelium reflects 2e-4 at most of what is not grazing, which the photons here do without.
    """
    optics, cells, points = optics_of(eye_of(scene)), 16, 24
    flux = photons(optics, light, is_far, 400_000, cells)
    side = optics.limbus_radius * (2 * (np.arange(cells * points) + 0.5) / (cells * points) - 1)
    x, z = (d.ravel() for d in np.meshgrid(side, side, indexing="ij"))
    radius = np.hypot(x, z)
    at = on_iris(optics, *(d * np.minimum(1, optics.limbus_radius / radius) for d in (x, z)))
    slant = 1.0 if optics.bowl is None else (optics.bowl.y - at[:, 1]) / optics.bowl.radius
    found = np.where(radius < optics.limbus_radius, irradiance_at(mi, scene, at) / slant, 0.0)
    cell = (2 * optics.limbus_radius / (cells * points)) ** 2
    solved = found.reshape(cells, points, cells, points).sum(axis=(1, 3)) * cell
    np.testing.assert_allclose(solved.sum(), flux.sum(), rtol=6e-4)
    centre = (np.arange(cells) + 0.5) / cells * 2 - 1
    inner = (np.hypot(*np.meshgrid(centre, centre)) < 0.85) & (flux > 0.1 * flux.max())
    assert inner.sum() > 30
    deviation = solved[inner] / flux[inner] - 1
    assert np.sqrt((deviation**2).mean()) < 0.01
    assert np.abs(deviation).max() < 0.06


@pytest.mark.parametrize("name", ["talk", "bowl", "one surface"])
@pytest.mark.parametrize("focus", ["caustic", "flat"])
@pytest.mark.parametrize("angle_deg", [0.0, 50.0, 80.0])
def test_one_surface_focuses_as_in_coddingtons_equations(
    make_eye: Callable[..., Scene], mi: ModuleType, name: str, focus: "Focus", angle_deg: float
) -> None:
    """E = E0 T cos(i) / cos(t) cos(x), without focus, / |(1 - s k)(1 - s k / cos²(t))| with it."""
    scene = make_eye(SHAPES[name], sun(angle_deg))
    optics = optics_of(eye_of(scene))
    p, outward = entries(optics, 2000)
    cos_i = outward @ towards(angle_deg)
    x, arrives = eye_rays._through_cornea(optics, p, np.broadcast_to(-towards(angle_deg), p.shape))
    arrives &= (cos_i > 0.05) & (np.hypot(x[:, 0], x[:, 2]) < 0.98 * optics.limbus_radius)
    t, _ = eye_rays.outer_hit(optics, p + 1e-9 * outward, np.broadcast_to(towards(angle_deg), p.shape))
    arrives &= ~np.isfinite(t)
    x, p, outward, cos_i = x[arrives], p[arrives], outward[arrives], cos_i[arrives]
    n, distance = optics.cornea.ior, np.linalg.norm(x - p, axis=-1)
    inward = (x - p) / distance[:, None]
    cos_t = -np.einsum("ij,ij->i", inward, outward)
    n_x = np.array([0.0, 1.0, 0.0]) if optics.bowl is None else ([0.0, optics.bowl.y, 0.0] - x) / optics.bowl.radius
    exact = (1 - fresnel(cos_i, n)) * cos_i / cos_t * -(inward * n_x).sum(axis=-1)
    k = (n * cos_t - cos_i) / (n * optics.cornea.radius)
    if focus == "caustic":
        exact = exact / np.abs((1 - distance * k) * (1 - distance * k / cos_t**2))
    assert len(x) > 500
    np.testing.assert_allclose(irradiance_at(mi, scene, x, focus), exact, rtol=3e-3, atol=1e-4)
    assert np.median(np.abs(irradiance_at(mi, scene, x, focus) / exact - 1)) < 2e-5


@pytest.mark.parametrize(("angle_deg", "least", "most"), [(0.0, 0.1, 0.3), (60.0, 0.1, 0.4)])
def test_to_ignore_focus_costs_light(
    make_eye: Callable[..., Scene], mi: ModuleType, angle_deg: float, least: float, most: float
) -> None:
    """The expected loss: 12 to 36 % of the direct irradiance, measured before any of this was written."""
    scene = make_eye(ONE_SURFACE, sun(angle_deg))
    optics = optics_of(eye_of(scene))
    side = np.linspace(-0.9, 0.9, 40) * optics.limbus_radius
    x, z = (d.ravel() for d in np.meshgrid(side, side))
    within = np.hypot(x, z) < 0.9 * optics.limbus_radius
    points = on_iris(optics, x[within], z[within])
    loss = 1 - irradiance_at(mi, scene, points, "flat").sum() / irradiance_at(mi, scene, points).sum()
    assert least < loss < most


def test_straight_light_is_lamberts_with_what_the_cornea_lets_through(
    make_eye: Callable[..., Scene], mi: ModuleType
) -> None:
    scene = make_eye(TALK, sun(35.0))
    points = on_iris(optics_of(eye_of(scene)), np.array([0.0, 0.2, -0.3]), np.array([0.1, -0.3, 0.0]))
    along = points @ towards(35.0)
    exits = points + (np.sqrt(along**2 + 1 - (points**2).sum(axis=1)) - along)[:, None] * towards(35.0)
    exact = (1 - fresnel(exits @ towards(35.0), 1.376)) * np.cos(np.radians(35.0))
    np.testing.assert_allclose(irradiance_at(mi, scene, points, "straight"), exact, rtol=1e-5)


@pytest.mark.parametrize("focus", ["caustic", "flat", "straight"])
def test_behind_a_cornea_without_optical_density_the_iris_is_a_plain_disk(
    make_eye: Callable[..., Scene], mi: ModuleType, focus: "Focus"
) -> None:
    """L = rho E cos(l) / pi; nothing is reflected by the cornea, so nothing comes back."""
    scene = make_eye(TALK | {"ior": 1.000001}, sun(20.0), sensor=camera(TALK, field=0.2))
    made = render(mi, scene, focus, spp=4)
    np.testing.assert_allclose(made, np.broadcast_to(IRIS * np.cos(np.radians(20.0)) / np.pi, made.shape), rtol=1e-4)


@pytest.mark.parametrize("shape", [TALK, BOWL, TALK | {"endothelium": {"radius": 0.9, "thickness": 0.05, "ior": 1.3}}])
def test_a_white_eye_vanishes_under_a_white_sky(make_eye: Callable[..., Scene], mi: ModuleType, shape: Shape) -> None:
    """A furnace: iris and cornea enclose the inside, so that all light that enters leaves again."""
    white = {name: {"type": "diffuse", "reflectance": [1.0] * 3} for name in MATERIALS}
    scene = make_eye(shape, SKY, materials=white, sensor=camera(TALK, field=0.4))
    made = render(mi, scene, None, spp=512)[eye_rays.iris_coverage(scene)[..., 0] == 1].mean(axis=1)
    error = made.std(ddof=1) / np.sqrt(len(made))
    assert error < 1e-3
    assert abs(made.mean() - 1) < STANDARD_ERRORS * error


def test_the_white_of_the_eye_vanishes_too(make_eye: Callable[..., Scene], mi: ModuleType) -> None:
    white = {name: {"type": "diffuse", "reflectance": [1.0] * 3} for name in MATERIALS}
    scene = make_eye(TALK, SKY, materials=white, sensor=camera(TALK, view_deg=180.0))
    made = render(mi, scene, None, spp=256).mean(axis=(1, 2))
    error = made.std(ddof=1) / np.sqrt(len(made))
    assert abs(made.mean() - 1) < STANDARD_ERRORS * error < 0.005


@pytest.mark.parametrize("ior", [1.1, 1.376, 2.0])
def test_the_diffuse_reflectance_from_inside_is_that_of_fresnels_equations(ior: float) -> None:
    """Against the integral from inside, where it has a kink at the critical angle, by many thin rings."""
    from reference.integrators.eye_light import fresnel_diffuse_inside

    cos_i = (np.arange(400_000) + 0.5) / 400_000
    sin_t = ior * np.sqrt(1 - cos_i**2)
    cos_t = np.sqrt(np.maximum(0, 1 - sin_t**2))
    reflected = np.where(sin_t >= 1, 1.0, fresnel(cos_t, ior))
    assert fresnel_diffuse_inside(ior) == pytest.approx(2 * (cos_i * reflected).mean(), abs=2e-5)


def test_the_sclera_is_mitsubas_plastic(make_eye: Callable[..., Scene], mi: ModuleType) -> None:
    """To the 1 % that Mitsuba's fit to the diffuse reflectance from inside is off."""
    lamp = {"type": "point", "position": [3.0, -6.0, 4.0], "intensity": [10.0, 20.0, 30.0]}
    scene = make_eye(TALK, lamp, sensor=camera(TALK, view_deg=180.0, pixels=8))
    made = render(mi, scene, None, spp=4)
    plastic = {"type": "plastic", "diffuse_reflectance": 0.8, "int_ior": 1.376, "nonlinear": True}
    ball = {"type": "sphere", "bsdf": plastic}
    point = lamp | {"intensity": {"type": "rgb", "value": lamp["intensity"]}}
    loaded = instantiate(mi, {"type": "scene", "sensor": sensor_dict(scene.sensor), "ball": ball, "lamp": point})
    truth = np.array(mi.render(loaded, integrator=mi.load_dict({"type": "direct"}), spp=256))
    np.testing.assert_allclose(made.mean(axis=(0, 1)), truth.mean(axis=(0, 1)), rtol=0.015)


def mitsubas_eye(mi: ModuleType, scene: Scene, emitter: dict[str, Any]) -> Any:
    """A closed eye of meshes: plastic, dielectric, and two disks for iris and pupil."""
    shape = eye_of(scene)
    optics = optics_of(shape)
    scale = mi.ScalarTransform4f().scale
    flat = mi.ScalarTransform4f().translate([0, optics.iris_y, 0]) @ mi.ScalarTransform4f().rotate([1, 0, 0], -90)
    black = {"type": "diffuse", "reflectance": 0.0}
    iris = {"type": "diffuse", "reflectance": {"type": "rgb", "value": IRIS.tolist()}}
    raised = mi.ScalarTransform4f().translate([0, 1e-4 * optics.limbus_radius, 0])
    plain = {
        "type": "scene",
        "sclera": surface(mi, eyes.sclera(shape), {"type": "plastic", "diffuse_reflectance": 0.8, "nonlinear": True}),
        "cornea": surface(mi, eyes.cornea(shape), {"type": "dielectric", "int_ior": shape.ior, "ext_ior": 1.0}),
        "iris": {"type": "disk", "to_world": flat @ scale(optics.limbus_radius), "bsdf": iris},
        "pupil": {"type": "disk", "to_world": raised @ flat @ scale(optics.pupil_radius), "bsdf": black},
        "light": emitter,
    }
    sensor = instantiate(mi, {"type": "scene", "sensor": sensor_dict(scene.sensor)}).sensors()[0]
    return mi.load_dict(plain | {"sensor": sensor}, optimize=False)


def surface(mi: ModuleType, shape: Surface, bsdf: dict[str, Any]) -> Any:
    properties = mi.Properties()
    properties["mesh_bsdf"] = mi.load_dict(bsdf)
    mesh = mi.Mesh("mesh", len(shape.positions), len(shape.faces), has_vertex_normals=True, props=properties)
    parameters = mi.traverse(mesh)
    parameters["vertex_positions"] = shape.positions.ravel()
    parameters["vertex_normals"] = shape.normals.ravel()
    parameters["faces"] = shape.faces.ravel()
    parameters.update()
    return mesh


WIDE = {
    "type": "disk",
    "position": [30.0, 40.0, -5.0],
    "normal": [-0.7, -0.7, 0.1],
    "radius": 22.0,
    "radiance": [2.0] * 3,
}


@pytest.mark.parametrize("light", ["sky", "disk"])
def test_it_is_what_the_path_tracer_finds_of_a_large_light(
    make_eye: Callable[..., Scene], mi: ModuleType, light: str
) -> None:
    """Both see all ways of light, the path tracer by chance alone; the emitters' mirror images are in it."""
    emitter = SKY if light == "sky" else WIDE
    shape = ONE_SURFACE | {"detail": 512}
    scene = make_eye(shape, emitter, sensor=camera(shape, view_deg=35.0, pixels=12, field=0.35))
    if light == "sky":
        plain: dict[str, Any] = {"type": "constant", "radiance": 1.0}
    else:
        target = (np.array(WIDE["position"]) + WIDE["normal"]).tolist()
        view = mi.ScalarTransform4f().look_at(origin=WIDE["position"], target=target, up=[0, 0, 1])
        placed = view @ mi.ScalarTransform4f().scale(WIDE["radius"])
        glow = {"type": "area", "radiance": 2.0}
        plain = {"type": "disk", "to_world": placed, "emitter": glow, "bsdf": {"type": "diffuse", "reflectance": 0.0}}
    eye = mitsubas_eye(mi, scene, plain)
    tracer = mi.load_dict({"type": "path", "max_depth": 64, "rr_depth": 16})
    seen = eye_rays.iris_coverage(scene)[..., 0] == 1
    assert seen.sum() > 50
    spp, seeds = (64, 256), [seed_of("eye", k) for k in range(8)]
    own = np.array([render(mi, scene, None, spp[0], seed)[seen].mean(axis=0) for seed in seeds])
    path = np.array([np.array(mi.render(eye, integrator=tracer, spp=spp[1], seed=s))[seen].mean(axis=0) for s in seeds])
    error = np.sqrt((own.var(axis=0, ddof=1) + path.var(axis=0, ddof=1)) / len(seeds))
    difference = own.mean(axis=0) - path.mean(axis=0)
    assert (error < 0.01 * own.mean(axis=0)).all()
    assert (np.abs(difference) < STANDARD_ERRORS * error).all(), f"{difference / error} standard errors"


@pytest.mark.parametrize("name", SHAPES)
def test_the_rays_are_those_in_float64(make_eye: Callable[..., Scene], mi: ModuleType, name: str) -> None:
    from reference.integrators.eye_light import look_inside

    scene = make_eye(SHAPES[name], SKY)
    at = lights_of(build_stage(mi, scene, geometry_of(scene))).surfaces
    origin = np.array(scene.sensor.origin)
    p, outward = entries(at.optics, 4000)
    direction = (p - origin) / np.linalg.norm(p - origin, axis=-1, keepdims=True)
    facing = np.einsum("ij,ij->i", direction, outward) < -0.05
    p, direction = p[facing], direction[facing]
    exact, sees = eye_rays._through_cornea(at.optics, p, direction)
    points, transmittance, meets = look_inside(at, mi.Point3f(p.T), mi.Vector3f(direction.T))
    assert (np.array(meets) != sees).mean() < 0.002
    both = sees & np.array(meets)
    assert both.sum() > 1000
    np.testing.assert_allclose(np.array(points).T[both], exact[both], atol=3e-5 * at.optics.limbus_radius)
    cos_o = -np.einsum("ij,ij->i", direction, outward[facing])
    np.testing.assert_allclose(np.array(transmittance)[both], 1 - fresnel(cos_o, 1.376)[both], atol=2e-3)


def test_a_disk_is_mirrored_where_the_law_of_reflection_says(make_eye: Callable[..., Scene], mi: ModuleType) -> None:
    """Over a wide pupil nothing else is seen: its radiance times Fresnel's reflectance, and black beside the image."""
    lamp = {
        "type": "disk",
        "position": [0.0, 9.0, 0.0],
        "normal": [0.0, -1.0, 0.0],
        "radius": 1.0,
        "radiance": [5.0] * 3,
    }
    sensor = camera(TALK, view_deg=0.0, pixels=64, field=0.3)
    scene = make_eye(TALK | {"pupil_radius": 0.59}, lamp, sensor=sensor)
    made = render(mi, scene, None, spp=4)[..., 0]
    origin, directions = eye_rays.camera_rays(scene.sensor, *(np.mgrid[0:64, 0:64].reshape(2, -1)[::-1] + 0.5))
    optics = optics_of(eye_of(scene))
    t, _ = eye_rays.outer_hit(optics, np.broadcast_to(origin, directions.shape), directions)
    outward = origin + t[:, None] * directions
    cos_o = -np.einsum("ij,ij->i", directions, outward)
    mirrored = directions + 2 * cos_o[:, None] * outward
    reach = (9.0 - outward[:, 1]) / mirrored[:, 1]
    away = np.hypot(*(outward + reach[:, None] * mirrored)[:, [0, 2]].T).reshape(64, 64)
    is_image, is_beside = away < 0.87, away > 1.13  # half the diagonal of a pixel is 0.12 here
    assert min(is_image.sum(), is_beside.sum()) > 30
    np.testing.assert_allclose(made[is_image], 5 * fresnel(cos_o, 1.376).reshape(64, 64)[is_image], rtol=1e-3)
    assert made[is_beside].max() < 0.02


def test_direct_light_of_a_distant_lamp_has_no_noise(make_eye: Callable[..., Scene], mi: ModuleType) -> None:
    scene = make_eye(HUMAN, sun(30.0))
    points = np.repeat(on_iris(optics_of(eye_of(scene)), np.array([1.0, 3.0]), np.array([-3.0, 2.5])), 50, axis=0)
    found = irradiance_at(mi, scene, points).reshape(2, 50)
    assert (found.std(axis=1) == 0).all()
    assert (found > 0.5).all()


@pytest.mark.parametrize("name", ["one surface", "human"])
def test_lamps_are_limits_of_each_other(make_eye: Callable[..., Scene], mi: ModuleType, name: str) -> None:
    """A point far away lights as a direction does, a small disk as a point."""
    far = 1e4 * towards(40.0)
    normal = (-towards(40.0)).tolist()
    lamps: list[dict[str, Any]] = [
        sun(40.0),
        {"type": "point", "position": far.tolist(), "intensity": [1e8] * 3},
        {
            "type": "disk",
            "position": far.tolist(),
            "normal": normal,
            "radius": 10.0,
            "radiance": [1e6 / np.pi] * 3,
        },
    ]
    optics = optics_of(eye_of(make_eye(SHAPES[name])))
    points = on_iris(optics, np.array([-4.0, 0.0, 3.0]), np.array([2.0, -3.0, 3.0]))
    first, *others = (irradiance_at(mi, make_eye(SHAPES[name], lamp), points) for lamp in lamps)
    for other in others:
        np.testing.assert_allclose(other, first, rtol=3e-3)


def test_straight_shadows_fall_between_the_cornea_and_the_sclera(
    make_eye: Callable[..., Scene], mi: ModuleType
) -> None:
    """As a ray in float64 from just above the surface meets the eye again or not."""
    lights = lights_of(build_stage(mi, scene := make_eye(ONE_SURFACE, sun(20.0)), geometry_of(scene)))
    optics, generator = lights.surfaces.optics, np.random.default_rng(2)
    p, outward = entries(optics, 3000)
    direction = generator.normal(size=p.shape)
    direction /= np.linalg.norm(direction, axis=-1, keepdims=True)
    upward = np.einsum("ij,ij->i", direction, outward) > 0.02
    p, outward, direction = p[upward], outward[upward], direction[upward]
    t, _ = eye_rays.outer_hit(optics, p + 1e-6 * outward, direction)
    free = np.array(
        lights.reaches(mi.Point3f(p.T), mi.Vector3f(direction.T), mi.Float(np.inf), optics.sclera), dtype=bool
    )
    assert (~np.isfinite(t)).sum() != len(t)
    assert (free != ~np.isfinite(t)).mean() < 0.002


def test_the_texture_of_the_iris_lies_as_its_coordinate_says(
    make_eye: Callable[..., Scene], mi: ModuleType, tmp_path: Path
) -> None:
    """Light in its upper left quarter: where u < 0.5 and v > 0.5."""
    texels = np.full((64, 64, 3), 0.02, dtype=np.float32)
    texels[:32, :32] = 0.9
    write_exr(tmp_path / "iris.exr", Image(texels))
    painted = MATERIALS | {
        "skin": {"type": "diffuse", "reflectance": {"path": "iris.exr", "color_space": "linear"}},
    }
    scene = make_eye(TALK, sun(0.0), materials=painted)
    uv, seen = eye_rays.iris_uv(scene), eye_rays.iris_coverage(scene)[..., 0] == 1
    made = render(mi, scene, "caustic", spp=64)[..., 0]
    is_light = seen & (uv[..., 0] < 0.45) & (uv[..., 1] > 0.55)
    is_dark = seen & ((uv[..., 0] > 0.55) | (uv[..., 1] < 0.45))
    assert min(is_light.sum(), is_dark.sum()) > 10
    assert made[is_light].min() > 3 * made[is_dark].max()


def test_clamping_moves_light_and_loses_none(make_eye: Callable[..., Scene], mi: ModuleType) -> None:
    scene = make_eye(ONE_SURFACE, sun(20.0))
    stage = build_stage(mi, scene, geometry_of(scene))
    whole = eye_block("caustic", stage, np.arange(256), 3, 4)
    parts = eye_block("caustic", stage, np.arange(256), 3, 4, 0.1)
    assert parts[:, :3].max() <= 0.1 + 1e-6
    assert parts[:, 3:].max() > 0
    np.testing.assert_allclose(parts[:, :3] + parts[:, 3:], whole, rtol=1e-5, atol=1e-7)


def test_the_quantities_are_sampled_where_they_are_judged(
    make_eye: Callable[..., Scene], reference: MakeReference
) -> None:
    made = reference(make_eye(ONE_SURFACE, sun(25.0), sensor=camera(ONE_SURFACE, field=0.6)))
    whole, iris, flat = (made.truth(name, 64) for name in ("eye_radiance", "iris_radiance", "iris_radiance_flat"))
    assert (iris.mask <= whole.mask).all()
    assert iris.mask.sum() < whole.mask.sum()
    bright, of_iris, unfocused = (t.accumulators[:, iris.mask].mean() for t in (whole, iris, flat))
    assert bright == pytest.approx(of_iris, rel=0.03)
    assert unfocused < 0.95 * of_iris


def test_without_light_the_truth_is_known(make_eye: Callable[..., Scene], reference: MakeReference) -> None:
    truth = reference(make_eye(TALK)).truth("iris_radiance", 64)
    assert truth.is_exact
    assert not truth.accumulators.any()


def refusal(made: Reference, name: str) -> str:
    with pytest.raises(SceneError) as caught:
        made.truth(name, 16)
    return str(caught.value)


def test_what_has_no_answer_is_refused(
    make_eye: Callable[..., Scene], reference: MakeReference, tmp_path: Path
) -> None:
    ball = {"name": "ball", "type": "sphere", "radius": 0.1, "position": [0.0, 2.0, 0.0], "material": "white"}
    no_eye = make_eye(TALK, SKY, shapes=[ball], subject=["ball"], sensor=camera(TALK, field=3.0))
    assert "no eye" in refusal(reference(no_eye), "iris_uv")
    assert "other things" in refusal(reference(make_eye(TALK, SKY, shapes=[TALK, ball])), "eye_radiance")
    both = make_eye(TALK, SKY, shapes=[TALK, ball], subject=["eye", "ball"])
    assert "beside the eye (ball)" in refusal(reference(both), "iris_radiance")
    assert "everywhere" in refusal(reference(make_eye(TALK, SKY)), "iris_radiance_flat")
    line = {"type": "line", "start": [0.0, 3.0, 0.0], "end": [1.0, 3.0, 0.0], "radius": 0.01, "radiance": [1.0] * 3}
    assert "type line" in refusal(reference(make_eye(TALK, line)), "iris_radiance")
    write_exr(tmp_path / "white.exr", Image(np.full((4, 4, 3), 0.5, dtype=np.float32)))
    painted = MATERIALS | {"white": {"type": "diffuse", "reflectance": {"path": "white.exr", "color_space": "linear"}}}
    assert "texture on the white" in refusal(reference(make_eye(TALK, SKY, materials=painted)), "eye_radiance")


@pytest.mark.parametrize(
    ("shape", "angle_deg", "is_refused"), [(HUMAN, 85.0, False), (HUMAN, 95.0, True), (TALK, 110.0, False)]
)
def test_lamps_that_make_caustic_lines_on_the_iris_are_refused(
    make_eye: Callable[..., Scene], shape: Shape, angle_deg: float, is_refused: bool
) -> None:
    """Beside such a line light arrives in several ways, of which only one would be found."""
    from reference.integrators.eye_lights import require_no_caustic_lines

    far = (1e3 * shape["sclera_radius"] * towards(angle_deg)).tolist()
    lamps: list[dict[str, Any]] = [
        sun(angle_deg),
        {"type": "point", "position": far, "intensity": [1.0] * 3},
        {"type": "disk", "position": far, "normal": [0.0, -1.0, 0.0], "radius": 0.1, "radiance": [1.0] * 3},
    ]
    for lamp in lamps:
        scene = make_eye(shape, lamp)
        if is_refused:
            with pytest.raises(SceneError, match="focuses it to a line"):
                require_no_caustic_lines(scene)
        else:
            require_no_caustic_lines(scene)
