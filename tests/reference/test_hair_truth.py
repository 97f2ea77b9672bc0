"""Hair's truths: curves against tubes in float64, fibres against a port of their paper, energy, another integrator."""

import ctypes
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from reference import curves
from reference.curves import TO_BSPLINE, HairStage, curve_text, fibre_dict, hair_stage
from reference.estimator import Reference
from reference.quantities.hair import coverage_means, radiance_means
from reference.strands import strands_of
from reference.worker import Worker
from scenes.errors import SceneError
from scenes.exr import write_exr
from scenes.geometry import geometry_of
from scenes.image import Float64, Image
from scenes.materials import Fibre
from scenes.model import Scene
from scenes.procedural import normalised

MakeScene = Callable[..., Scene]
BLOND = (0.13, 0.21, 0.41)
EYE, TARGET = np.array([0.0, 5.0, 60.0]), np.array([0.0, 5.0, 0.0])
SIDE = 16
SENSOR = {
    "type": "perspective",
    "origin": EYE.tolist(),
    "target": TARGET.tolist(),
    "fov_deg": 14.0,
    "width": SIDE,
    "height": SIDE,
}
FLOOR = {
    "name": "floor",
    "type": "rectangle",
    "material": "skin",
    "size": [12.0, 12.0],
    "rotation_deg": [-80.0, 0.0, 0.0],
}
HAIR = {
    "name": "fur",
    "on": "floor",
    "material": "fibre",
    "count": 40,
    "guides": 4,
    "length": 9.0,
    "radius": 0.1,
    "region": [0.1, 0.1, 0.9, 0.9],
    "comb": [0.4, 0.2],
    "curl": 0.1,
}
SUN = {"type": "directional", "direction": [-0.5, -0.6, -1.0], "irradiance": [3.0, 3.0, 3.0]}


@pytest.fixture
def fur(make_scene: MakeScene) -> MakeScene:
    """Makes a floor with hair, some keys of the hair, of its fibre and of the scene replaced."""

    def make(
        hair: dict[str, Any] | None = None, fibre: dict[str, Any] | None = None, albedo: float = 0.0, **scene: Any
    ) -> Scene:
        materials = {
            "skin": {"type": "diffuse", "reflectance": [albedo] * 3},
            "fibre": {"type": "fibre", "sigma_a": BLOND} | (fibre or {}),
        }
        whole: dict[str, Any] = {"sensor": SENSOR, "shapes": [FLOOR], "subject": ["floor"], "emitters": [SUN]} | scene
        return make_scene(materials=materials, hair=[HAIR | (hair or {})], **whole)

    return make


@pytest.fixture
def staged(mi: ModuleType) -> Callable[[Scene], HairStage]:
    """The stage of a scene with its hair."""
    return lambda scene: hair_stage(mi, scene, geometry_of(scene))


def bezier(points: Float64, t: Float64) -> Float64:
    """Points (N, T, 3) of curves (N, 4, 3)."""
    weights = np.stack([(1 - t) ** 3, 3 * t * (1 - t) ** 2, 3 * t * t * (1 - t), t**3], axis=1)
    return np.asarray(weights @ points)


def bezier_tangent(points: Float64, t: Float64) -> Float64:
    weights = np.stack([(1 - t) ** 2, 2 * t * (1 - t), t * t], axis=1)
    return normalised(np.einsum("nk,nki->ni", weights, np.diff(points, axis=1)))


@given(st.floats(0, 1))
def test_a_bezier_curve_and_its_b_spline_are_the_same(t: float) -> None:
    """Ends included, which a B-spline through the same control points would not reach."""
    points = np.random.default_rng(2).normal(size=(4, 3))
    basis = np.array([(1 - t) ** 3, 3 * t**3 - 6 * t**2 + 4, -3 * t**3 + 3 * t**2 + 3 * t + 1, t**3]) / 6
    np.testing.assert_allclose(basis @ TO_BSPLINE @ points, bezier(points[None], np.array([t]))[0, 0], atol=1e-12)


def test_the_text_of_curves_ends_with_a_speck() -> None:
    points = np.random.default_rng(2).normal(size=(3, 4, 3))
    splines = [np.loadtxt(part.splitlines()) for part in curve_text(points, np.full(3, 0.1)).split("\n\n")]
    assert len(splines) == 4
    np.testing.assert_allclose(np.linalg.inv(TO_BSPLINE) @ splines[1][:, :3], points[1], atol=1e-6)
    speck = np.linalg.inv(TO_BSPLINE) @ splines[3][:, :3]
    piece = bezier(points[-1:], 0.5 + 1e-3 * np.linspace(-0.5, 0.5, 4))[0]
    np.testing.assert_allclose(speck, piece, atol=1e-5)
    np.testing.assert_allclose(splines[3][:, 3], 1e-4)


def without_speck(points: Float64, radius: Float64) -> str:
    return curve_text(points, radius).rpartition("\n\n")[0] + "\n"


@pytest.mark.parametrize("has_speck", [True, False])
def test_no_ray_reads_beyond_the_curves(
    has_speck: bool,
    fur: MakeScene,
    staged: Callable[[Scene], HairStage],
    mi: ModuleType,
    capfd: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Rays at the very tip of the last hair, under Dr.Jit's debug mode, which tells what would have crashed.

    Without the speck they do read beyond, so that this is where to look.
    """
    import drjit as dr

    if not has_speck:
        monkeypatch.setattr(curves, "curve_text", without_speck)
    scene = fur(hair={"count": 8})
    stage, points = staged(scene), strands_of(scene).points
    along = normalised(points[-1, 3] - points[-1, 2])
    tip = points[-1, 3] - 1e-6 * np.random.default_rng(1).exponential(size=(1 << 16, 1)) * along
    direction = normalised(np.cross(along, np.random.default_rng(3).normal(size=tip.shape)))
    origin = tip - 0.5 * direction
    with dr.scoped_set_flag(dr.JitFlag.Debug, True):
        ray = mi.Ray3f(mi.Point3f(*origin.T.astype(np.float32)), mi.Vector3f(*direction.T.astype(np.float32)))
        si = stage.scene.ray_intersect(ray)
        dr.eval(si)
        dr.sync_thread()
    ctypes.CDLL(None).fflush(None)  # what Dr.Jit says stays in C's own buffer
    assert np.asarray(stage.is_subject(si.shape, si.is_valid())).mean() > 0.1
    assert ("out-of-bounds" in "".join(capfd.readouterr())) is not has_speck


def test_no_ray_meets_the_speck_of_a_long_thin_hair_that_bends(
    fur: MakeScene, staged: Callable[[Scene], HairStage], mi: ModuleType
) -> None:
    """It is 2000 radii long. The speck is the last curve; rays from all around are aimed at it."""
    scene = fur(hair={"count": 3, "radius": 5e-3, "length": 10.0, "comb": [3.0, 1.0]})
    stage, points = staged(scene), strands_of(scene).points
    rng = np.random.default_rng(5)
    middle = bezier(points[-1:], np.array([0.5]))[0]
    origin = middle + 2 * normalised(rng.normal(size=(1 << 16, 3)))
    direction = normalised(middle + 1e-4 * rng.normal(size=origin.shape) - origin)
    si = stage.scene.ray_intersect(
        mi.Ray3f(mi.Point3f(*origin.T.astype(np.float32)), mi.Vector3f(*direction.T.astype(np.float32)))
    )
    met = np.asarray(stage.is_subject(si.shape, si.is_valid()))
    assert met.mean() > 0.5
    assert np.asarray(si.prim_index)[met].max() == 2


@pytest.mark.parametrize(
    ("radii", "low", "high"), [(1000, 0, 2e-4), (3000, 0, 3e-4), (5000, 1e-3, 0.01), (10000, 0.04, 0.15)]
)
def test_rays_miss_hair_that_is_too_thin_for_mitsuba(
    fur: MakeScene, staged: Callable[[Scene], HairStage], mi: ModuleType, radii: float, low: float, high: float
) -> None:
    """Rays across bent hairs, through their axes. Such scenes are refused above 3000 radii."""
    scene = fur(hair={"count": 200, "length": 10.0, "radius": 10.0 / radii, "comb": [1.0, 0.5]})
    rng, points = np.random.default_rng(3), strands_of(scene).points
    points, t = points[rng.integers(0, len(points), 1 << 15)], rng.uniform(0.02, 0.98, (1 << 15, 1))
    weights = np.hstack([(1 - t) ** 3, 3 * t * (1 - t) ** 2, 3 * t * t * (1 - t), t**3])
    slopes = np.hstack([(1 - t) ** 2, 2 * t * (1 - t), t * t])
    aim, along = np.einsum("nk,nki->ni", weights, points), np.einsum("nk,nki->ni", slopes, np.diff(points, axis=1))
    direction = normalised(np.cross(along, rng.normal(size=aim.shape)))
    ray = mi.Ray3f(
        mi.Point3f(*(aim - 3 * direction).T.astype(np.float32)), mi.Vector3f(*direction.T.astype(np.float32))
    )
    si = staged(scene).scene.ray_intersect(ray)
    missed = np.mean(~np.asarray(si.is_valid()) | (np.asarray(si.t) > 3.1))
    assert low <= missed <= high


def test_the_speck_has_a_colour(fur: MakeScene, staged: Callable[[Scene], HairStage], tmp_path: Path) -> None:
    """So that to meet it all the same reads nothing beyond."""
    pixels = np.full((2, 2, 3), 0.5, dtype=np.float32)
    write_exr(tmp_path / "colour.exr", Image(pixels))
    color = {"path": "colour.exr", "color_space": "linear"}
    [colors] = staged(fur(hair={"count": 4, "color": color})).colors
    np.testing.assert_allclose(colors, np.full((5, 3), 0.5))


def test_the_frame_of_a_hit_has_the_hairs_tangent(
    fur: MakeScene, staged: Callable[[Scene], HairStage], mi: ModuleType
) -> None:
    """Root to tip, as the tilt of scales needs it: it is t of the shading frame, which Mitsuba's fibres scatter in."""
    scene = fur(hair={"count": 1, "curl": 0.3, "comb": [0.8, 0.8]})
    points = strands_of(scene).points
    t = np.linspace(0.02, 0.98, 200)
    places, along = bezier(points, t)[0], bezier_tangent(np.repeat(points, 200, axis=0), t)
    direction = normalised(places - EYE)
    ray = mi.Ray3f(
        mi.Point3f(*np.repeat(EYE[:, None], 200, axis=1).astype(np.float32)),
        mi.Vector3f(*direction.T.astype(np.float32)),
    )
    si = staged(scene).scene.ray_intersect(ray)
    assert np.asarray(si.is_valid()).all()
    np.testing.assert_allclose(np.abs(np.sum(np.asarray(si.sh_frame.t).T * along, axis=1)), 1, atol=1e-3)
    assert (np.sum(np.asarray(si.sh_frame.t).T * along, axis=1) > 0).all()


def tubes_seen(points: Float64, radius: float, x: Float64, y: Float64, has_round_ends: bool = False) -> Float64:
    """Whether rays through film positions in pixels (N,) meet a curve's tube: 0 or 1.

    Hairs as chains of 48 straight pieces; a ray meets a piece if it passes it within the radius, and if the ends are
    cut, beside neither end of the chain.
    """
    half = np.tan(np.radians(14.0 / 2))
    direction = normalised(
        np.column_stack([half * (2 * x / SIDE - 1), half * (1 - 2 * y / SIDE), np.full(len(x), -1.0)])
    )
    chain = bezier(points, np.linspace(0, 1, 49)) - EYE
    a, b = chain[:, :-1].reshape(-1, 3), chain[:, 1:].reshape(-1, 3)
    seen = np.zeros(len(x), dtype=bool)
    for piece, (start, end) in enumerate(zip(a, b, strict=True)):
        e = end - start
        de, ds, es = direction @ e, direction @ start, e @ start
        beside = (de * ds - es) / (e @ e - de**2)
        s = np.clip(beside, 0, 1)
        nearest = start + s[:, None] * e
        along = np.sum(nearest * direction, axis=1)
        is_near = np.sum((nearest - along[:, None] * direction) ** 2, axis=1) <= radius**2
        if not has_round_ends:
            is_near &= ~((piece % 48 == 0) & (beside < 0)) & ~((piece % 48 == 47) & (beside > 1))
        seen |= is_near
    return seen.astype(np.float64)


@pytest.mark.parametrize(("radius", "most"), [(0.02, 2e-4), (0.3, 1.2e-3)])
def test_coverage_is_that_of_tubes_in_float64(
    fur: MakeScene, staged: Callable[[Scene], HairStage], mi: ModuleType, radius: float, most: float
) -> None:
    """Ray by ray. Ends are cut, not rounded: that thick hair would be 2 % more."""
    scene = fur(hair={"radius": radius, "count": 12})
    x, y = SIDE * np.random.default_rng(4).random((2, 1 << 14))
    stage, points = staged(scene), strands_of(scene).points
    si = stage.scene.ray_intersect(stage.rays(mi.Float(x.astype(np.float32)), mi.Float(y.astype(np.float32))))
    met = np.asarray(mi.Float(stage.is_subject(si.shape, si.is_valid())))
    open_view = ~(np.asarray(si.is_valid()) & (met == 0))  # the floor hides what is below it
    wrong = np.mean((met != tubes_seen(points, radius, x, y))[open_view])
    assert met.mean() > 0.01
    assert wrong < most
    rounded = tubes_seen(points, radius, x, y, has_round_ends=True)
    assert radius < 0.1 or np.mean((met != rounded)[open_view]) > 2 * wrong


def test_hair_behind_something_covers_nothing(fur: MakeScene) -> None:
    card = {"name": "card", "type": "rectangle", "material": "skin", "size": [40.0, 40.0], "position": [0.0, 5.0, 30.0]}
    hidden = fur(shapes=[FLOOR, card])
    everything = np.arange(SIDE**2)
    assert coverage_means(fur(), everything, 1, 4, None).mean() > 0.1
    assert coverage_means(hidden, everything, 1, 4, None).max() == 0
    assert radiance_means(hidden, everything, 1, 4, None).max() == 0


def test_coverage_is_never_clamped(fur: MakeScene) -> None:
    kept = coverage_means(fur(), np.arange(SIDE**2), 1, 4, 0.1)
    assert kept.shape == (SIDE**2, 2)
    np.testing.assert_array_equal(kept[:, :1], coverage_means(fur(), np.arange(SIDE**2), 1, 4, None))
    np.testing.assert_array_equal(kept[:, 1], 0)


def fibre_scattering(fibre: Fibre, seen: Float64, lit: Float64) -> Float64:
    """Light (N, 3) that a fibre lit from `lit` sends to `seen` where it is met, for an irradiance of 1 across it.

    Chiang et al. 2016, "A Practical and Controllable Hair and Fur Model for Production Path Tracing", sections 3 to 5:
    lobes R, TT, TRT and all after them, each a longitudinal and an azimuthal distribution times its attenuation. Unit
    vectors (N, 3): x across, y along the fibre to its tip, z the normal. In float64, and independent of Mitsuba.
    """
    from scipy.special import ive

    sin_o, sin_i = seen[:, 1], lit[:, 1]
    cos_o, cos_i = np.hypot(seen[:, 0], seen[:, 2]), np.hypot(lit[:, 0], lit[:, 2])
    phi_o, phi_i = np.arctan2(seen[:, 0], seen[:, 2]), np.arctan2(lit[:, 0], lit[:, 2])
    h = np.sin(phi_o)
    inside = h * cos_o / np.sqrt(fibre.ior**2 - sin_o**2)
    path = 2 * np.sqrt(1 - inside**2) / np.sqrt(1 - (sin_o / fibre.ior) ** 2)
    passes = np.exp(-np.array(fibre.sigma_a) * path[:, None])
    cos_r = cos_o * np.sqrt(1 - h * h)
    cos_t = np.sqrt(1 - (1 - cos_r**2) / fibre.ior**2)
    across, along = (
        (cos_r - fibre.ior * cos_t) / (cos_r + fibre.ior * cos_t),
        ((fibre.ior * cos_r - cos_t) / (fibre.ior * cos_r + cos_t)),
    )
    fresnel = (0.5 * (across**2 + along**2))[:, None]
    parts = [np.broadcast_to(fresnel, passes.shape), (1 - fresnel) ** 2 * passes]
    parts.append(parts[1] * fresnel * passes)
    rest = parts[2] * fresnel * passes / (1 - fresnel * passes)

    m, n = fibre.beta_m, fibre.beta_n
    v = (0.726 * m + 0.812 * m**2 + 3.7 * m**20) ** 2
    scale = np.sqrt(np.pi / 8) * (0.265 * n + 1.194 * n**2 + 5.372 * n**22)
    cut = 1 / (1 + np.exp(-np.pi / scale)) - 1 / (1 + np.exp(np.pi / scale))
    tilt = np.radians(fibre.tilt_deg)
    out = np.zeros_like(passes)
    for p, (part, width, turn) in enumerate(zip(parts, (v, v / 4, 4 * v), (-2 * tilt, tilt, 4 * tilt), strict=True)):
        theta = np.arcsin(sin_o) + turn
        exit_angle = 2 * p * np.arcsin(inside) - 2 * np.arcsin(h) + p * np.pi
        off = np.abs((phi_i - phi_o - exit_angle + np.pi) % (2 * np.pi) - np.pi)
        azimuthal = np.exp(-off / scale) / (scale * (1 + np.exp(-off / scale)) ** 2 * cut)
        out += (_longitudinal(ive, sin_i, cos_i, np.sin(theta), np.abs(np.cos(theta)), width) * azimuthal)[
            :, None
        ] * part
    out += (_longitudinal(ive, sin_i, cos_i, sin_o, cos_o, 4 * v) / (2 * np.pi))[:, None] * rest
    return np.asarray(out)


def _longitudinal(ive: Any, sin_i: Float64, cos_i: Float64, sin_o: Float64, cos_o: Float64, v: float) -> Float64:
    """Equation 7 of d'Eon et al. 2011, "An Energy-Conserving Hair Reflectance Model"."""
    a, b = cos_i * cos_o / v, sin_i * sin_o / v
    return np.asarray(np.exp(a - b - 1 / v) * ive(0, a) / (v * (1 - np.exp(-2 / v))))


def directions(count: int, seed: int) -> Float64:
    return normalised(np.random.default_rng(seed).normal(size=(count, 3)))


@pytest.mark.parametrize(
    "changes",
    [{}, {"sigma_a": (1.7, 2.8, 5.5), "tilt_deg": 0.0}, {"beta_m": 0.6, "beta_n": 0.15, "tilt_deg": 5.0, "ior": 1.4}],
    ids=["blond", "dark", "rough"],
)
def test_mitsubas_fibre_is_that_of_its_paper(mi: ModuleType, changes: dict[str, Any]) -> None:
    """Absorption is per radius. Where lobes are wide half of all values are within 1e-5; narrow ones are too dark.

    For a large argument Mitsuba takes ln I0(x) = x - ln(2 pi x) / 2 + 1 / (16 x), where 1 / (8 x) is right.
    """
    import drjit as dr

    fibre = Fibre.model_validate({"type": "fibre", "sigma_a": BLOND} | changes)
    bsdf = mi.load_dict(fibre_dict(fibre))
    seen, lit = directions(20000, 1), directions(20000, 2)
    seen[:, 2] = np.abs(seen[:, 2])
    si = dr.zeros(mi.SurfaceInteraction3f, len(seen))
    si.wi = mi.Vector3f(*seen.T.astype(np.float32))
    got = np.asarray(bsdf.eval(mi.BSDFContext(), si, mi.Vector3f(*lit.T.astype(np.float32)))).T
    expected = fibre_scattering(fibre, seen, lit)
    ratio = (got / expected)[expected > 1e-4 * expected.max()]
    assert np.quantile(ratio, 0.001) > 0.994
    assert np.quantile(ratio, 0.999) < 1.0005
    assert fibre.beta_m < 0.5 or np.median(np.abs(ratio - 1)) < 1e-5
    assert got.sum() == pytest.approx(expected.sum(), rel=2e-3)


def test_a_pixel_shows_the_mean_over_the_fibres_width(fur: MakeScene) -> None:
    """A straight fibre half a pixel wide, and the paper's formula integrated over h, at each pixel's own angle."""
    sensor = SENSOR | {"origin": [0.0, 5.0, 5.0], "fov_deg": 90.0, "width": 17, "height": 32, "fov_axis": "y"}
    floor = FLOOR | {"rotation_deg": [-90.0, 0.0, 0.0], "position": [2.4, 0.0, -2.4]}
    place = [0.29999, 0.29999, 0.30001, 0.30001]
    radius = 0.25 * 10 / 32
    upright = {"count": 1, "length": 12.0, "radius": radius, "region": place, "comb": [0, 0], "curl": 0, "spread": 0}
    scene = fur(hair=upright, sensor=sensor, shapes=[floor])
    image = radiance_means(scene, np.arange(17 * 32), 7, 1024, None).reshape(32, 17, 3)
    np.testing.assert_array_equal(image[:, :8], 0)
    np.testing.assert_array_equal(image[:, 9:], 0)

    pixel = 10 / 32
    x, y = np.meshgrid(pixel * ((np.arange(400) + 0.5) / 400 - 0.5), 5 - pixel * (np.arange(32 * 8) + 0.5) / 8)
    ray = normalised(np.stack([x, y, np.full_like(x, -5.0)], axis=-1).reshape(-1, 3))
    flat = ray * (1, 0, 1)
    a, b = np.sum(flat**2, axis=1), 5 * flat[:, 2]
    roots = b**2 - a * (25 - radius**2)
    seen, flat = -ray[roots > 0], flat[roots > 0]
    normal = (flat * ((-b - np.sqrt(np.maximum(roots, 0))) / a)[roots > 0, None] + (0, 0, 5)) / radius
    across = np.cross((0, 1, 0), normal)
    lit = -normalised(np.array(SUN["direction"]))
    into = np.stack([across, np.broadcast_to((0.0, 1.0, 0.0), normal.shape), normal], axis=1)
    fibre = scene.materials["fibre"]
    assert isinstance(fibre, Fibre)
    light = np.zeros((len(ray), 3))
    light[roots > 0] = 3.0 * fibre_scattering(fibre, np.einsum("nij,nj->ni", into, seen), into @ lit)
    expected = light.reshape(32, -1, 3).mean(axis=1)
    np.testing.assert_allclose(image[:, 8], expected, rtol=0.02)
    np.testing.assert_allclose(image[:, 8].mean(axis=0), expected.mean(axis=0), rtol=5e-3)


@pytest.mark.slow
def test_white_fibres_in_white_light_are_invisible(fur: MakeScene) -> None:
    """A furnace: what does not absorb sends on all the light that comes, after as many events as it takes."""
    scene = fur(
        hair={"count": 400},
        fibre={"sigma_a": [0.0] * 3},
        albedo=1.0,
        emitters=[{"type": "constant", "radiance": [1.0] * 3}],
    )
    everything = np.arange(SIDE**2)
    light = np.mean([radiance_means(scene, everything, k, 256, None).mean() for k in range(3)])
    covered = coverage_means(scene, everything, 3, 256, None).mean()
    assert covered > 0.4
    assert light / covered == pytest.approx(1, abs=6e-3)


@pytest.mark.slow
def test_mitsubas_own_path_tracer_arrives_at_the_same_light(
    fur: MakeScene, staged: Callable[[Scene], HairStage], mi: ModuleType
) -> None:
    """Under a sky on a black floor all light is that of hair. 4 sigma of both, from eight images each."""
    scene = fur(hair={"count": 300}, emitters=[{"type": "constant", "radiance": [1.0] * 3}])
    stage = staged(scene)
    path = mi.load_dict({"type": "path", "max_depth": -1, "hide_emitters": True})
    theirs = [
        np.asarray(mi.render(stage.scene, spp=256, seed=50 + k, integrator=path)).mean(axis=(0, 1)) for k in range(8)
    ]
    ours = [radiance_means(scene, np.arange(SIDE**2), 200 + k, 256, None).mean(axis=0) for k in range(8)]
    error = np.sqrt((np.var(theirs, axis=0, ddof=1) + np.var(ours, axis=0, ddof=1)) / 8)
    assert (error < 4e-3 * np.mean(ours, axis=0)).all()
    np.testing.assert_array_less(np.abs(np.mean(ours, axis=0) - np.mean(theirs, axis=0)), 4 * error)


@pytest.mark.slow
def test_most_of_the_light_of_light_hair_was_scattered_among_hairs(
    fur: MakeScene, staged: Callable[[Scene], HairStage], mi: ModuleType
) -> None:
    """Why a technique needs multiple scattering: light scattered once is a part of the whole, of dark hair most."""
    once = mi.load_dict({"type": "path", "max_depth": 2, "hide_emitters": True})
    share = {}
    for name, sigma_a in (("light", 0.05), ("dark", 3.0)):
        scene = fur(hair={"count": 1500}, fibre={"sigma_a": [sigma_a] * 3})
        single = np.asarray(mi.render(staged(scene).scene, spp=64, seed=1, integrator=once)).mean()
        share[name] = single / radiance_means(scene, np.arange(SIDE**2), 1, 64, None).mean()
    assert share["light"] < 0.5
    assert share["dark"] > 0.9


def test_the_colour_texture_scales_what_is_sent_to_the_sensor(fur: MakeScene, tmp_path: Path) -> None:
    """One colour everywhere: the image is scaled by it, however often light was scattered."""
    pixels = np.broadcast_to(np.array([0.2, 0.5, 1.0], dtype=np.float32), (2, 2, 3))
    write_exr(tmp_path / "colour.exr", Image(np.ascontiguousarray(pixels)))
    everything = np.arange(SIDE**2)
    plain = radiance_means(fur(), everything, 1, 4, None)
    dyed = radiance_means(fur(hair={"color": {"path": "colour.exr", "color_space": "linear"}}), everything, 1, 4, None)
    np.testing.assert_allclose(dyed, plain * pixels[0, 0], rtol=1e-5)


def test_hairs_have_colours_of_their_own(fur: MakeScene, tmp_path: Path) -> None:
    """Left half of the chart black, right half white: no light comes from the hair of the left."""
    pixels = np.zeros((1, 64, 3), dtype=np.float32)
    pixels[:, 32:] = 1
    write_exr(tmp_path / "colour.exr", Image(pixels))
    hair = {"comb": [0.0, 0.2], "curl": 0.0, "spread": 0.0, "color": {"path": "colour.exr", "color_space": "linear"}}
    image = radiance_means(fur(hair=hair), np.arange(SIDE**2), 1, 64, None).reshape(SIDE, SIDE, 3)
    assert image[:, : SIDE // 2 - 1].max() == 0
    assert image[:, SIDE // 2 + 1 :].max() > 0


def test_light_that_is_not_clamped_and_what_clamping_takes_add_up(fur: MakeScene) -> None:
    everything = np.arange(SIDE**2)
    both = radiance_means(fur(), everything, 1, 16, 0.02)
    np.testing.assert_allclose(both[:, :3] + both[:, 3:], radiance_means(fur(), everything, 1, 16, None), atol=1e-6)
    assert both[:, 3:].max() > 0


def test_blocks_come_from_a_worker(
    fur: MakeScene, reference: Callable[[Scene], Reference], monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: list[Any] = []
    call = Worker.call

    def noted(self: Worker, function: Any, *arguments: Any) -> Any:
        asked.append(function)
        return call(self, function, *arguments)

    monkeypatch.setattr(Worker, "call", noted)
    truth = reference(fur()).truth("hair_coverage", 16)
    assert set(asked) == {coverage_means}
    assert truth.accumulators.shape == (16, SIDE, SIDE, 1)
    assert truth.accumulators.mean() == pytest.approx(
        coverage_means(fur(), np.arange(SIDE**2), 1, 64, None).mean(), rel=0.05
    )


def test_hair_in_the_dark_is_black(fur: MakeScene, reference: Callable[[Scene], Reference]) -> None:
    truth = reference(fur(emitters=[])).truth("hair_radiance", 16)
    assert truth.is_exact
    assert truth.accumulators.max() == 0


@pytest.mark.parametrize("name", ["hair_coverage", "hair_radiance"])
def test_hair_that_is_too_thin_is_refused(name: str, fur: MakeScene, reference: Callable[[Scene], Reference]) -> None:
    with pytest.raises(SceneError, match=f"{name} is not defined here: hair is up to 3105 of its radii long"):
        reference(fur(hair={"length": 9.0, "radius": 1 / 300})).truth(name, 16)


@pytest.mark.parametrize("name", ["hair_geometry", "hair_tangent", "hair_coverage", "hair_radiance"])
def test_a_scene_without_hair_is_refused(
    name: str, make_scene: MakeScene, reference: Callable[[Scene], Reference]
) -> None:
    with pytest.raises(SceneError, match=f"{name} is not defined here: the scene has no hair"):
        reference(make_scene()).truth(name, 16)
