"""Light on hair: fibres against closed forms and float64, then what hair takes and gives in a grid."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.special import erfc, i0e

from realtime import hair_ordinates
from realtime.fibre import (
    AZIMUTHS,
    INCLINATIONS,
    at_inclination,
    fibre_table,
    kajiya_of,
    logistic_scale,
    longitudinal,
    scattering,
    table_layers,
    trimmed_logistic,
    variances,
)
from realtime.frame import Frame
from realtime.hair import HairSamples, Strands
from realtime.hair_ordinates import ordinate_rows, phases
from realtime.hair_voxels import FIBRE_UNIT, Voxels, fibre_of
from realtime.lights import directions
from realtime.ordinates import level_symmetric
from realtime.shader import program, set_uniforms
from realtime.sky import sky_directions
from realtime.techniques import technique
from scenes.errors import InputError
from scenes.exr import write_exr
from scenes.image import Float32, Float64, Image
from scenes.materials import Fibre
from scenes.model import Scene
from scenes.procedural import normalised

if TYPE_CHECKING:
    import moderngl

Glsl = Callable[..., Float64]
MakeScene = Callable[..., Scene]
FrameWith = Callable[..., Frame]
StrandPoints = Callable[..., Float64]

BLOND = Fibre(type="fibre", sigma_a=(0.13, 0.21, 0.41))
DARK = Fibre(type="fibre", sigma_a=(1.7, 2.8, 5.5))
CLEAR = Fibre(type="fibre", sigma_a=(0.0, 0.0, 0.0))
UP = np.array([0.0, 1.0, 0.0])
NODES = tuple(part * np.pi / 2 for part in np.polynomial.legendre.leggauss(1200))
"""Inclinations from one end of a fibre to the other, and their weights."""


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(20050805)


def towards(inclination: float) -> Float64:
    """A direction so many degrees off the plane across a fibre along y."""
    angle = np.radians(inclination)
    return np.array([np.cos(angle), np.sin(angle), 0.0])


# One fibre.


@settings(max_examples=20, deadline=None)
@given(inclination=st.floats(-1.5, 1.5), beta_m=st.floats(0.05, 1.0))
def test_longitudinal_lobes_hold_all_light(inclination: float, beta_m: float) -> None:
    """Their integral over the cosine-weighted inclination is 1."""
    o, weights = NODES
    for variance in variances(beta_m):
        M = longitudinal(np.sin(inclination), np.cos(inclination), np.sin(o), np.cos(o), variance)
        assert weights @ (M * np.cos(o)) == pytest.approx(1, rel=1e-3)


@settings(max_examples=20, deadline=None)
@given(beta_n=st.floats(0.05, 1.0), turned=st.floats(-20.0, 20.0))
def test_azimuthal_lobes_hold_all_light_wherever_they_point(beta_n: float, turned: float) -> None:
    azimuths = np.linspace(-np.pi, np.pi, 20001)[:-1]
    density = trimmed_logistic(azimuths - turned, logistic_scale(beta_n))
    assert density.mean() * 2 * np.pi == pytest.approx(1, rel=1e-3)


@settings(max_examples=3, deadline=None)
@given(ior=st.floats(1.3, 1.8), beta_m=st.floats(0.1, 0.9), beta_n=st.floats(0.1, 0.9), tilt=st.floats(-5, 5))
def test_a_fibre_that_absorbs_nothing_sends_all_light(ior: float, beta_m: float, beta_n: float, tilt: float) -> None:
    """A white furnace, at all inclinations."""
    fibre = Fibre(type="fibre", sigma_a=(0.0, 0.0, 0.0), ior=ior, beta_m=beta_m, beta_n=beta_n, tilt_deg=tilt)
    np.testing.assert_allclose(fibre_table(fibre).albedo, 1, atol=1e-9)


@pytest.mark.parametrize("fibre", [BLOND, DARK])
@pytest.mark.parametrize("inclination", [0.0, 30.0, -65.0])
def test_the_albedo_is_what_the_lobes_add_up_to(fibre: Fibre, inclination: float) -> None:
    table, lights = fibre_table(fibre), directions(20000)
    eye = np.broadcast_to(towards(inclination), lights.shape)
    sent = scattering(table, np.broadcast_to(UP, lights.shape), eye, lights)
    albedo = at_inclination(table.albedo, np.cos(np.radians(inclination)))
    np.testing.assert_allclose(4 * np.pi * sent.mean(axis=0), albedo, rtol=1e-2)


@pytest.mark.parametrize("inclination", [0.0, 30.0, 60.0, 80.0])
def test_what_is_sent_in_all_is_the_integral_over_eyes(inclination: float) -> None:
    """Eyes are weighted by the width that the fibre shows them; light comes from one end as well as from the other."""
    table, eyes = fibre_table(BLOND), directions(20000)
    T, shown = np.broadcast_to(UP, eyes.shape), np.sqrt(1 - eyes[:, 1:2] ** 2)
    both = [scattering(table, T, eyes, np.broadcast_to(towards(a), eyes.shape)) for a in (inclination, -inclination)]
    cosine = np.cos(np.radians(inclination))
    found = 4 * np.pi * (shown * sum(both) / 2).mean(axis=0) / cosine
    np.testing.assert_allclose(found, at_inclination(table.sent, cosine), rtol=1e-2)


def test_a_fibre_is_reciprocal_but_for_what_the_model_leaves_out() -> None:
    """Chiang et al. attenuate by the eye's inclination alone: up to 60 degrees expect 3 %, at 75 as much as 20 %."""
    table = fibre_table(BLOND)
    for inclination, loss in ((0.0, 0.03), (60.0, 0.05), (75.0, 0.25)):
        cosine = np.cos(np.radians(inclination))
        ratio = at_inclination(table.sent, cosine) / at_inclination(table.albedo, cosine)
        assert np.abs(ratio - 1).max() < loss
    assert np.abs(ratio - 1).max() > 0.1


def test_looking_along_a_fibre_gives_numbers() -> None:
    T = np.array([UP, UP, UP, UP])
    along = np.array([UP, -UP, UP, -UP])
    assert np.isfinite(scattering(fibre_table(BLOND), T, along, along[::-1])).all()


def test_kajiya_and_kay_send_as_much_as_the_fibre_to_its_side() -> None:
    """Their diffuse and glossy parts, integrated over all lights."""
    diffuse, glossy, exponent = kajiya_of(DARK)
    lights = directions(20000)
    sine, cosine = np.sqrt(1 - lights[:, 1] ** 2)[:, None], np.sqrt(1 - lights[:, 1] ** 2)[:, None] ** exponent
    found = 4 * np.pi * (diffuse * sine + glossy * cosine).mean(axis=0)
    np.testing.assert_allclose(found, fibre_table(DARK).albedo[0], rtol=1e-3)


# The shaders.


def test_the_shader_knows_the_bessel_function(glsl: Glsl) -> None:
    x = np.concatenate([np.linspace(0, 8, 200), np.geomspace(8, 5000, 200)])
    inputs = np.zeros((len(x), 1, 4))
    inputs[:, 0, 0] = x
    found = glsl("lib/fibre.glsl", "r[0].x = log_i0(a[0].x);", inputs)[:, 0, 0]
    np.testing.assert_allclose(found, np.log(i0e(x)) + x, rtol=2e-6, atol=2e-6)


def test_the_shader_has_the_longitudinal_lobes(glsl: Glsl, rng: np.random.Generator) -> None:
    """The narrowest lobes too, where the exponent is a small difference of large numbers."""
    i, o, v = rng.uniform(-1.55, 1.55, 2000), rng.uniform(-1.55, 1.55, 2000), rng.choice(variances(0.05), 2000)
    o = np.where(rng.random(2000) < 0.5, np.clip(-i + 3 * np.sqrt(v) * rng.normal(size=2000), -1.55, 1.55), o)
    inputs = np.stack([np.stack([np.sin(i), np.cos(i), np.sin(o), np.cos(o)], axis=1)] * 2, axis=1)
    inputs[:, 1] = v[:, None]
    body = "r[0].x = fibre_longitudinal(a[0].x, a[0].y, a[0].z, a[0].w, a[1].x);"
    found = glsl("lib/fibre.glsl", body, inputs)[:, 0, 0]
    exact = np.array([longitudinal(*given) for given in zip(*inputs[:, 0].T, v, strict=True)])
    np.testing.assert_allclose(found, exact, rtol=2e-3, atol=1e-3)


def test_the_shader_scatters_as_float64_does(glsl: Glsl, gl: "moderngl.Context", rng: np.random.Generator) -> None:
    layers = table_layers([DARK, BLOND])
    texture = gl.texture_array((AZIMUTHS, INCLINATIONS, len(layers)), 4, layers.tobytes(), dtype="f4")
    texture.repeat_x = texture.repeat_y = False
    texture.use(FIBRE_UNIT)
    vectors = normalised(rng.normal(size=(1000, 3, 3)))
    inputs = np.zeros((1000, 3, 4))
    inputs[..., :3] = vectors
    body = "r[0].xyz = fibre_scattering(1, a[0].xyz, a[1].xyz, a[2].xyz);"
    found = glsl("hair_light/scattering.glsl", body, inputs)[:, 0, :3]
    exact = scattering(fibre_table(BLOND), *vectors.transpose(1, 0, 2))
    np.testing.assert_allclose(found, exact, rtol=5e-3, atol=2e-3 * exact.max())


def test_the_shader_has_the_cylinder_of_kajiya_and_kay(glsl: Glsl, rng: np.random.Generator) -> None:
    """Its highlight is a power of the cosine between the inclinations, mirrored; light along the hair has none."""
    T, L, V = normalised(rng.normal(size=(3, 500, 3)))
    L[0] = V[0] = T[0]
    inputs = np.zeros((500, 3, 4))
    inputs[:, 0, :3], inputs[:, 1, :3], inputs[:, 2, :3] = T, L, V
    found = glsl("lib/kajiya_kay.glsl", "r[0].xy = kajiya_kay(a[0].xyz, a[1].xyz, a[2].xyz, 20.0);", inputs)[:, 0]
    i, o = np.arcsin(np.clip((T * L).sum(axis=1), -1, 1)), np.arcsin(np.clip((T * V).sum(axis=1), -1, 1))
    np.testing.assert_allclose(found[:, 0], np.cos(i), atol=1e-3)
    np.testing.assert_allclose(found[:, 1], np.maximum(np.cos(i + o), 0) ** 20, atol=1e-4)


@pytest.mark.parametrize("order", [4, 6])
def test_scattering_between_ordinates_loses_nothing(order: int) -> None:
    """Each gets what the albedo is; what is sent of each is right in the mean within 1 %, and within 10 % rms.

    Few ordinates hit or miss lobes: before rows and columns are balanced, rows are off by a third and more.
    """
    table, quadrature, tangents = fibre_table(BLOND), level_symmetric(order).astype(float), directions(64)
    rows = phases(table, tangents, quadrature)[..., 0]
    sine = np.sqrt(1 - (tangents @ quadrature[:, :3].T) ** 2)
    albedo, wanted = (at_inclination(values, sine)[..., 0] for values in (table.albedo, table.sent))
    np.testing.assert_allclose(rows.sum(axis=2), albedo, rtol=1e-9)
    shown = quadrature[:, 3] * sine
    ratio = np.einsum("tkj,tk->tj", rows, shown) / (shown * wanted)
    weights = shown / shown.sum(axis=1, keepdims=True) / len(tangents)
    assert (weights * ratio).sum() == pytest.approx(1, abs=0.01)
    assert np.sqrt((weights * (ratio - 1) ** 2).sum()) < 0.1
    kernel = scattering(table, *np.broadcast_arrays(tangents[:, None], quadrature[:1, :3], -quadrature[None, :, :3]))
    unbalanced = 4 * np.pi * kernel[..., 0] @ quadrature[:, 3] / albedo[:, 0]
    assert np.abs(unbalanced - 1).max() > 0.3


# The sky.


def test_an_even_sky_is_even(make_hair: MakeScene) -> None:
    scene = make_hair(emitters=[{"type": "constant", "radiance": [1.0, 2.0, 3.0]}])
    rows = ordinate_rows(scene, level_symmetric(4))
    np.testing.assert_allclose(rows[:, 1, :3], np.broadcast_to([1.0, 2.0, 3.0], (24, 3)))


def test_all_light_of_an_image_of_the_sky_enters(make_hair: MakeScene, tmp_path: Any) -> None:
    pixels: Float32 = np.random.default_rng(3).uniform(0, 2, (16, 32, 3)).astype(np.float32)
    write_exr(tmp_path / "sky.exr", Image(pixels))
    scene = make_hair(emitters=[{"type": "environment", "path": "sky.exr"}])
    quadrature = level_symmetric(6)
    rows = ordinate_rows(scene, quadrature)
    towards_sky, solid_angles = sky_directions(16, 32)
    assert solid_angles.sum() == pytest.approx(4 * np.pi)
    np.testing.assert_allclose(np.linalg.norm(towards_sky, axis=1), 1)
    power = 4 * np.pi * quadrature[:, 3] @ rows[:, 1, :3]
    np.testing.assert_allclose(power, solid_angles @ pixels.reshape(-1, 3), rtol=1e-4)


# Hair in a grid.


def radiance_of(frame: Frame) -> Float64:
    rows = np.frombuffer(frame.resources["hair_radiance"].read(), dtype=np.float32).reshape(-1, 4)
    return rows[:, :3].astype(float)


def test_white_hair_on_white_skin_is_as_bright_as_an_even_sky(make_hair: MakeScene, frame_with: FrameWith) -> None:
    """A furnace: nothing absorbs, so that all that is seen has the sky's radiance.

    Roots share their cells with the skin: some of them are darker by up to a fifth.
    """
    white = {
        "skin": {"type": "diffuse", "reflectance": [1.0, 1.0, 1.0]},
        "fibre": {"type": "fibre", "sigma_a": [0.0, 0.0, 0.0]},
    }
    sky = [{"type": "constant", "radiance": [1.0, 1.0, 1.0]}]
    scene = make_hair(hair={"count": 600}, materials=white, emitters=sky)
    frame = frame_with(scene, "hair.frame", "hair_radiance", cells=12, iterations=64, order=4)
    found = radiance_of(frame)
    assert found.mean() == pytest.approx(1, abs=0.02)
    np.testing.assert_allclose(found, 1, atol=0.2)


def blocked_by_others(
    strands: Float64, own: NDArray[np.int64], points: Float64, light: Float64, radius: float
) -> Float64:
    """1 where points (M, 3) of the hairs `own` (M,) see the light past all other hairs, cut in straight pieces."""
    t = np.linspace(0, 1, 9)[:, None]
    weights = np.hstack([(1 - t) ** 3, 3 * t * (1 - t) ** 2, 3 * t * t * (1 - t), t**3])
    courses = np.einsum("tk,nkc->ntc", weights, strands)
    low, along = courses[:, :-1].reshape(-1, 3), np.diff(courses, axis=1).reshape(-1, 3)
    of = np.repeat(np.arange(len(strands)), 8)
    blocked = np.zeros(len(points), dtype=bool)
    normal = np.cross(along, light)
    length = np.linalg.norm(normal, axis=1)
    for k, point in enumerate(points):
        v = low - point
        apart = np.abs(np.einsum("nc,nc->n", v, normal)) / length
        across = np.cross(normal, light) / length[:, None] ** 2
        place = -np.einsum("nc,nc->n", v, across) / np.einsum("nc,nc->n", along, across)
        ahead = (v + place[:, None] * along) @ light
        hits = (apart < radius) & (place >= 0) & (place <= 1) & (ahead > 0) & (of != own[k])
        blocked[k] = hits.any()
    return 1.0 - blocked


MEADOW = {"type": "rectangle", "size": [24.0, 24.0]}
GRASS: dict[str, Any] = {
    "count": 1500,
    "radius": 0.09,
    "length": 8.0,
    "region": [0.0, 0.0, 1.0, 1.0],
    "comb": [0.5, 0.8],
}
MARCH = {"CELLS": 8, "ORIENTED": 1, "JOINT": 1, "STEPS_A_CELL": 1}
DEPTH = "r[0].x = exp(-hair_optical_depth(a[0].xyz, a[1].xyz, 3e38, a[2].xyz, a[0].w, a[3].xyz));"


@dataclass(frozen=True)
class Meadow:
    """Points (M, 3) on the hairs `own` (M,) of a meadow, the tangents there, and the grid that holds it."""

    strands: Float64
    own: NDArray[np.int64]
    points: Float64
    tangents: Float64
    voxels: Voxels

    def free(self, light: Float64) -> Float64:
        """1 where rays find the way to the light free of other hair (M,)."""
        return blocked_by_others(self.strands, self.own, self.points, light, GRASS["radius"])

    def kept(self, glsl: Glsl, light: Float64, to_eye: Float64, oriented: int = 1, joint: int = 1) -> Float64:
        """What the shader finds of it (M,)."""
        self.voxels.across.use(0)
        self.voxels.between.use(1)
        inputs = np.zeros((len(self.points), 4, 4))
        inputs[:, 0, :3], inputs[:, 0, 3], inputs[:, 1, :3] = self.points, GRASS["radius"], light
        inputs[:, 2, :3], inputs[:, 3, :3] = self.tangents, to_eye
        bounds = np.frombuffer(self.voxels.bounds.read(), dtype=np.float32)
        defines = {"CELLS": self.voxels.cells, "ORIENTED": oriented, "JOINT": joint, "STEPS_A_CELL": 1}
        return glsl("hair_light/march.glsl", DEPTH, inputs, buffers={4: bounds}, defines=defines)[:, 0, 0]


@pytest.fixture
def meadow(
    make_hair: MakeScene, frame_with: FrameWith, strand_points: StrandPoints, rng: np.random.Generator
) -> Meadow:
    scene = make_hair(hair=GRASS, skin=MEADOW)
    strands = strand_points(scene)
    own, t = rng.integers(0, len(strands), 1500), rng.random((1500, 1))
    weights = np.hstack([(1 - t) ** 3, 3 * t * (1 - t) ** 2, 3 * t * t * (1 - t), t**3])
    slopes = np.hstack([-3 * (1 - t) ** 2, 3 * (1 - t) * (1 - 3 * t), 3 * t * (2 - 3 * t), 3 * t * t])
    points, along = (np.einsum("nk,nkc->nc", w, strands[own]) for w in (weights, slopes))
    voxels = frame_with(scene, "hair.frame", "voxels").resources["voxels"]
    return Meadow(strands, own, points, normalised(along), voxels)


@pytest.mark.parametrize("light", [[0.0, 0.0, 1.0], [0.8, 0.2, 0.6], [-0.5, 0.7, 0.5]])
def test_as_much_light_comes_through_hair_as_rays_find(light: list[float], meadow: Meadow, glsl: Glsl) -> None:
    """Within 5 %, at points on hairs. Hair's area in place of what it shows to light costs 10 % and more."""
    d, nowhere = normalised(np.array(light)), np.zeros(3)
    rays = meadow.free(d).mean()
    assert meadow.kept(glsl, d, nowhere).mean() == pytest.approx(rays, rel=0.05)
    assert meadow.kept(glsl, d, nowhere, oriented=0).mean() < 0.9 * rays
    assert rays < 0.67


@pytest.mark.parametrize(("apart", "loss"), [(0.0, 0.42), (2.0, 0.37), (5.0, 0.31), (15.0, 0.17), (40.0, 0.07)])
def test_hair_that_is_seen_is_lit_from_near_the_eye(apart: float, loss: float, meadow: Meadow, glsl: Glsl) -> None:
    """Of points that rays from the eye reach, within 4 % as many are lit as rays find: all, if the light is at the eye.

    Without the hot spot 42 % of the light is lost there, 7 % where the light is 40 degrees away.
    """
    angle, eye = np.radians(apart), np.array([0.0, -0.6, 0.8])
    light = np.cos(angle) * eye + np.sin(angle) * np.array([0.6, 0.64, 0.48])
    seen = meadow.free(eye) == 1
    rays, found, separate = (
        lit[seen].mean()
        for lit in (meadow.free(light), meadow.kept(glsl, light, eye), meadow.kept(glsl, light, eye, joint=0))
    )
    assert found == pytest.approx(rays, rel=0.04)
    assert 1 - separate / rays == pytest.approx(loss, abs=0.03)


def test_the_part_of_a_hair_itself_that_eye_and_light_do_not_share(glsl: Glsl) -> None:
    """Against its integral: .024 off at most, and right at both ends."""
    ratio = np.concatenate([[1e-3], np.geomspace(0.01, 100, 400), [1e3]])
    inputs = np.zeros((len(ratio), 1, 4))
    inputs[:, 0, 0] = 0.2 * ratio
    found = glsl("hair_light/march.glsl", "r[0].x = own_part(a[0].x, 0.2);", inputs, defines=MARCH)[:, 0, 0]
    exact = np.sqrt(2 / np.pi) * -np.expm1(-(ratio**2) / 2) / ratio + erfc(ratio / np.sqrt(2))
    off = found - exact
    assert off.min() == pytest.approx(-0.0233, abs=5e-4)
    assert off.max() == pytest.approx(0.0137, abs=5e-4)
    np.testing.assert_allclose(off[[0, -1]], 0, atol=1e-5)


def test_the_way_that_eye_and_light_share_is_half_its_length(glsl: Glsl) -> None:
    """1 - s / shared, integrated: s - s² / 2 shared up to there, no more behind it, nothing if they share none."""
    s, joint = np.array([0.0, 0.5, 2.0, 9.0, 1.0]), np.array([2.0, 2.0, 2.0, 2.0, 0.0])
    inputs = np.zeros((5, 1, 4))
    inputs[:, 0, 0], inputs[:, 0, 1] = s, joint
    found = glsl("hair_light/march.glsl", "r[0].x = free_length(a[0].x, a[0].y);", inputs, defines=MARCH)[:, 0, 0]
    np.testing.assert_allclose(found, [0.0, 0.4375, 1.0, 1.0, 0.0], atol=1e-6)


@pytest.mark.parametrize("name", ["hair.frame", "hair.talk"])
def test_hair_of_no_length_does_no_harm(make_hair: MakeScene, frame_with: FrameWith, tmp_path: Path, name: str) -> None:
    """Where a map of lengths is black. The rest, whose length is what it was, stays as it was."""
    half = np.ones((1, 8, 1), dtype=np.float32)
    half[:, :4] = 0.0
    write_exr(tmp_path / "half.exr", Image(half))
    bald = {"length_map": {"path": "half.exr", "color_space": "linear"}}
    whole, made = (
        frame_with(make_hair(hair=GRASS | {"count": 300} | more, skin=MEADOW, emitters=SUN), name, "hair_radiance")
        for more in ({}, bald)
    )
    points, samples = zip(*(_drawn(frame) for frame in (whole, made)), strict=True)
    assert np.isfinite(samples[1]).all()
    assert np.isfinite(radiance_of(made)).all()
    np.testing.assert_allclose(np.linalg.norm(samples[1][:, :, 4:7], axis=-1), 1, atol=1e-5)
    bare = np.ptp(points[1][..., :3], axis=1).max(axis=1) < 1e-4  # between guides it is 0 to rounding
    kept = (points[0] == points[1]).all(axis=(1, 2))
    assert bare.sum() > 30
    assert kept.sum() > 30
    np.testing.assert_array_equal(samples[0][kept], samples[1][kept])


def _drawn(frame: Frame) -> tuple[Float32, Float32]:
    """Control points (N, 4, 4) and samples (N, S, 8) of all hairs."""
    strands, drawn = frame.resources["strands"], frame.resources["hair_samples"]
    points, samples = (np.frombuffer(buffer.read(), dtype=np.float32) for buffer in (strands.points, drawn.buffer))
    return points.reshape(-1, 4, 4), samples.reshape(-1, drawn.per_hair, 8)


@pytest.mark.parametrize(
    "points",
    [
        [[1, 0, 0], [0, 0, 0], [0, 0, 0]],
        [[0, 0, 0], [1, 0, 0], [0, 0, 0]],
        [[0, 0, 0], [0, 0, 0], [1, 0, 0]],
        [[1, 0, 0], [1, 0, 0], [0, 0, 0]],
        [[1, 0, 0], [1, 0, 0], [1, 0, 0]],
        [[0, 0, 0], [0, 0, 0], [0, 0, 0]],
        [[0, 0, 0], [1, 0, 0], [1, 0, 0]],
    ],
    ids=str,
)
def test_a_hair_has_a_direction_wherever_its_control_points_coincide(points: list[list[int]], gl: Any) -> None:
    """Also where it turns back, halfway or at a third."""
    rows = np.zeros((1, 4, 4), dtype=np.float32)
    rows[0, 1:, :3] = points
    strands = Strands(gl.buffer(rows.tobytes()), gl.buffer(reserve=16), 1)
    samples = HairSamples(gl.buffer(reserve=32 * 13), 13)
    strands.bind()
    samples.bind()
    shader = program(gl, "hair/samples.comp", defines={"SEGMENTS": 12})
    set_uniforms(shader, count=13)
    shader.run(1)
    gl.memory_barrier()
    tangents = np.frombuffer(samples.buffer.read(), dtype=np.float32).reshape(13, 8)[:, 4:7]
    np.testing.assert_allclose(np.abs(tangents), np.tile([1.0, 0, 0] if any(map(any, points)) else UP, (13, 1)))


SUN = [{"type": "directional", "direction": [0.3, -0.5, -1.0], "irradiance": [3.0, 3.0, 3.0]}]
SKY = [{"type": "constant", "radiance": [1.0, 2.0, 3.0]}]


def test_the_grid_does_not_depend_on_the_order_in_which_hair_is_added(
    make_hair: MakeScene, frame_with: FrameWith
) -> None:
    """Sums are of whole numbers: two frames agree to the last bit, as images must."""
    scene = make_hair(hair={"count": 200}, emitters=SUN)
    found = [radiance_of(frame_with(scene, "hair.frame", "hair_radiance", cells=8, iterations=2)) for _ in range(2)]
    np.testing.assert_array_equal(found[0], found[1])


def test_each_part_of_the_light_has_a_switch(make_hair: MakeScene, frame_with: FrameWith) -> None:
    """You should see hair in the shadow of hair shine without transmittance, and lose most light without scattering."""
    scene = make_hair(hair={"count": 2500}, emitters=SUN)
    use = {"cells": 12, "iterations": 4, "order": 4}
    whole = radiance_of(frame_with(scene, "hair.frame", "hair_radiance", **use)).mean()
    bare, once = (
        radiance_of(frame_with(scene, "hair.frame", "hair_radiance", **use | off)).mean()
        for off in ({"transmittance": "none"}, {"iterations": 0})
    )
    assert bare > 1.5 * whole
    assert once < 0.5 * whole
    switches = {p.name: p.off for p in technique("hair.frame").parameters if p.off is not None}
    assert {"fibre", "transmittance", "hot_spot", "iterations"} <= switches.keys()


@pytest.mark.parametrize("cells", [11, 12])
def test_it_does_not_matter_how_many_cells_a_thread_has(
    make_hair: MakeScene, frame_with: FrameWith, monkeypatch: pytest.MonkeyPatch, cells: int
) -> None:
    """One or nine of a plane; 11 cells leave some threads without all of theirs. The same to the last bit."""
    scene, use = make_hair(hair={"count": 300}, emitters=SUN + SKY), {"cells": cells, "iterations": 2, "order": 4}
    one = radiance_of(frame_with(scene, "hair.frame", "hair_radiance", **use))
    monkeypatch.setattr(hair_ordinates, "THREADS", 4)
    np.testing.assert_array_equal(radiance_of(frame_with(scene, "hair.frame", "hair_radiance", **use)), one)


def test_light_of_the_sky_that_is_scattered_once(make_hair: MakeScene, frame_with: FrameWith) -> None:
    """Seven hairs that nothing hides from an even sky but the skin below: at their tips their albedo times the sky.

    For some the skin hides a part of where they let light through. Hair in the way takes some light, and what goes on
    from hair to hair adds some.
    """
    few = make_hair(hair=GRASS | {"count": 7}, skin=MEADOW | {"size": [2.0, 2.0]}, emitters=SKY)
    bare = frame_with(few, "hair.frame", "hair_radiance", iterations=0, transmittance="none")
    tips = radiance_of(bare).reshape(7, -1, 3)[:, -1]
    albedo = fibre_table(fibre_of(few, "fibre")).albedo
    sky = np.array([1.0, 2.0, 3.0])
    assert (tips <= albedo.max(axis=0) * sky * 1.001).all()
    assert (tips >= 0.8 * albedo.min(axis=0) * sky).all()
    many = make_hair(hair=GRASS | {"count": 600}, skin=MEADOW, emitters=SKY)
    free, hidden, whole = (
        radiance_of(frame_with(many, "hair.frame", "hair_radiance", cells=12, order=4, **use)).mean()
        for use in ({"iterations": 0, "transmittance": "none"}, {"iterations": 0}, {"iterations": 8})
    )
    assert 0 < hidden < 0.8 * free
    assert whole > 1.2 * hidden


def test_the_talks_hair_refuses_a_sky(make_hair: MakeScene, frame_with: FrameWith) -> None:
    with pytest.raises(InputError, match="Found a sky in"):
        frame_with(make_hair(emitters=SUN + SKY), "hair.talk", "hair_radiance")


def test_without_lights_hair_is_dark(make_hair: MakeScene, frame_with: FrameWith) -> None:
    frame = frame_with(make_hair(hair={"count": 50}, emitters=[]), "hair.frame", "hair_radiance", cells=8)
    assert not radiance_of(frame).any()
