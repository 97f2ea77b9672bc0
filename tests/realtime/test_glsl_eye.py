"""The pure functions behind the eye on grids, against float64 and closed forms; what goes wrong in other precisions."""

from collections.abc import Callable
from dataclasses import astuple

import numpy as np
import pytest

from realtime.eye import EyeModel, diffuse_internal_reflectance, eye_model
from realtime.fresnel import fresnel_dielectric
from scenes.image import Float64
from scenes.procedural import normalised
from scenes.shapes import Eye

Glsl = Callable[..., Float64]

N = 1.376
TALK = Eye(
    type="eye",
    name="eye",
    material="white",
    iris="iris",
    sclera_radius=1.0,
    cornea_radius=1.0,
    limbus_radius=float(np.sqrt(1 - 0.805**2)),
    ior=N,
    iris_curvature=2.0,
)
HUMAN = Eye(
    type="eye",
    name="eye",
    material="white",
    iris="iris",
    sclera_radius=12.0,
    cornea_radius=7.8,
    limbus_radius=5.9,
    ior=1.3375,
    iris_depth=3.55,
)


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(7800)


def literal(eye: EyeModel) -> str:
    """The struct of lib/eye.glsl."""
    return f"Eye({', '.join(repr(float(value)) for value in astuple(eye))})"


def rows(*columns: tuple[Float64, float | Float64]) -> Float64:
    """Input (N, I, 4) of a grid: each column is vectors (N, 3), and what stands in their w."""
    made = np.zeros((len(columns[0][0]), len(columns), 4))
    for k, (xyz, w) in enumerate(columns):
        made[:, k, :3], made[:, k, 3] = xyz, w
    return made


def numbers(*values: Float64) -> Float64:
    """Input (N, 1, 4) of a grid with up to four numbers."""
    made = np.zeros((len(values[0]), 1, 4))
    made[:, 0, : len(values)] = np.stack(values, axis=1)
    return made


def facing_pairs(rng: np.random.Generator, count: int) -> tuple[Float64, Float64]:
    """Unit rays and unit normals against them."""
    ray, normal = normalised(rng.normal(size=(count, 3))), normalised(rng.normal(size=(count, 3)))
    return ray, normal * -np.sign(np.sum(ray * normal, axis=1, keepdims=True))


def snell(ray: Float64, normal: Float64, n: float) -> Float64:
    """The refracted ray from the angles: the tangential part shrinks by n, the length stays 1."""
    cos_i = -np.sum(ray * normal, axis=1, keepdims=True)
    tangential = (ray + cos_i * normal) / n
    refracted: Float64 = tangential - np.sqrt(1 - np.sum(tangential**2, axis=1, keepdims=True)) * normal
    return refracted


TALK_REFRACT = "r[0].xyz = refract_talk(a[0].xyz, a[1].xyz, a[0].w);"


def test_the_talks_refract_is_snells_law(glsl: Glsl, rng: np.random.Generator) -> None:
    ray, normal = facing_pairs(rng, 500)
    made = glsl("lib/refract.glsl", TALK_REFRACT, rows((ray, 1 / N), (normal, 0)))[:, 0, :3]
    np.testing.assert_allclose(made, snell(ray, normal, N), atol=5e-7)


def test_n_instead_of_its_inverse_is_told_by_nan_only_beyond_the_critical_angle(
    glsl: Glsl, rng: np.random.Generator
) -> None:
    """Everything else is finite, and wrong."""
    ray, normal = facing_pairs(rng, 2000)
    made = glsl("lib/refract.glsl", TALK_REFRACT, rows((ray, N), (normal, 0)))[:, 0, :3]
    beyond = 1 - np.sum(ray * normal, axis=1) ** 2 > 1 / N**2
    np.testing.assert_array_equal(np.isnan(made).any(axis=1), beyond)
    wrong = np.linalg.norm(made - snell(ray, normal, N), axis=1)[~beyond] > 1e-2
    assert wrong.mean() > 0.95


def test_a_ray_that_is_not_normalised_gives_wrong_directions_without_nan(glsl: Glsl, rng: np.random.Generator) -> None:
    """Of length 1.05: what a sensor's ray would be that is not normalised, at the edge of the image."""
    ray, normal = facing_pairs(rng, 2000)
    made = glsl("lib/refract.glsl", TALK_REFRACT, rows((1.05 * ray, 1 / N), (normal, 0)))[:, 0, :3]
    assert not np.isnan(made).any()
    assert (np.linalg.norm(made - snell(ray, normal, N), axis=1) > 1e-3).mean() > 0.8


def test_total_reflection_is_told(glsl: Glsl, rng: np.random.Generator) -> None:
    ray, normal = facing_pairs(rng, 500)
    body = "vec3 t; r[0].w = float(refract_through(a[0].xyz, a[1].xyz, a[0].w, t)); r[0].xyz = t;"
    made = glsl("lib/refract.glsl", body, rows((ray, N), (normal, 0)))[:, 0]
    through = 1 - np.sum(ray * normal, axis=1) ** 2 < 1 / N**2
    np.testing.assert_array_equal(made[:, 3], through)
    assert np.isfinite(made).all()
    exact = snell(ray[through], normal[through], 1 / N)
    np.testing.assert_allclose(
        made[through, :3], exact, atol=3e-3
    )  # the root's slope is infinite at the critical angle
    np.testing.assert_allclose(np.median(np.abs(made[through, :3] - exact)), 0, atol=1e-6)


def rays_at_sphere(rng: np.random.Generator, distance: float, count: int = 1000) -> tuple[Float64, Float64]:
    """Origins, and unit rays at points well inside the unit sphere's outline, as float32 holds them."""
    origin = distance * normalised(rng.normal(size=(count, 3)))
    aim = 0.9 * normalised(rng.normal(size=(count, 3))) * rng.uniform(size=(count, 1)) ** (1 / 3)
    return origin.astype(np.float32).astype(float), normalised(aim - origin).astype(np.float32).astype(float)


def exact_roots(origin: Float64, ray: Float64) -> tuple[Float64, Float64]:
    a, b = np.sum(ray * ray, axis=1), np.sum(origin * ray, axis=1)
    root = np.sqrt(b * b - a * (np.sum(origin**2, axis=1) - 1))
    return (-b - root) / a, (-b + root) / a


def test_the_talks_intersection_is_the_far_one(glsl: Glsl, rng: np.random.Generator) -> None:
    """From points on the sphere along refracted rays, as the talk uses it: their chords are never short."""
    ray, normal = facing_pairs(rng, 500)
    bent = snell(ray, normal, N)
    made = glsl("lib/sphere.glsl", "r[0].x = SphereIntersect(1.0, a[0].xyz, a[1].xyz);", rows((normal, 0), (bent, 0)))
    np.testing.assert_allclose(made[:, 0, 0], -2 * np.sum(normal * bent, axis=1), atol=1e-6)


@pytest.mark.parametrize(("distance", "textbook", "stable"), [(50, 3e-5, 1e-5), (1000, 1e-2, 2e-4)])
def test_from_far_away_only_the_stable_intersection_is_near_the_sphere(
    glsl: Glsl, rng: np.random.Generator, distance: float, textbook: float, stable: float
) -> None:
    """Median error of the near hit. The textbook's discriminant takes the difference of squared distances."""
    origin, ray = rays_at_sphere(rng, distance)
    body = """
        vec3 v = -a[0].xyz; float b = dot(v, a[1].xyz); r[0].x = b - sqrt(b * b - dot(v, v) + 1.0);
        vec2 t; r[0].z = float(sphere_roots(1.0, a[0].xyz, a[1].xyz, t)); r[0].y = t.x;"""
    made = glsl("lib/sphere.glsl", body, rows((origin, 0), (ray, 0)))[:, 0]
    near, _ = exact_roots(origin, ray)
    missed = np.isnan(made[:, 0])
    error = np.where(missed[:, None], np.inf, np.abs(made[:, :2] - near[:, None]))
    assert made[:, 2].all()
    assert np.median(np.abs(made[:, 1] - near)) < stable
    assert np.median(error[:, 0]) > textbook
    assert np.median(error[:, 0]) > 3 * np.median(np.abs(made[:, 1] - near))


def test_both_roots_of_a_sphere(glsl: Glsl, rng: np.random.Generator) -> None:
    """From outside, from inside, and past it."""
    origin, ray = rays_at_sphere(rng, 3.0)
    origin[:500] *= 0.1
    body = "vec2 t; r[0].z = float(sphere_roots(1.0, a[0].xyz, a[1].xyz, t)); r[0].xy = t;"
    made = glsl("lib/sphere.glsl", body, rows((origin, 0), (ray, 0)))[:, 0]
    np.testing.assert_allclose(made[:, :2], np.stack(exact_roots(origin, ray), axis=1), atol=3e-6)


def test_a_ray_that_passes_a_sphere_misses_it(glsl: Glsl, rng: np.random.Generator) -> None:
    ray, aside = normalised(rng.normal(size=(200, 3))), normalised(rng.normal(size=(200, 3)))
    offset = rng.uniform(0, 2, (200, 1))
    origin = offset * normalised(np.cross(ray, aside)) - 3 * ray
    body = "vec2 t; r[0].x = float(sphere_roots(1.0, a[0].xyz, a[1].xyz, t));"
    made = glsl("lib/sphere.glsl", body, rows((origin, 0), (ray, 0)))[:, 0, 0]
    np.testing.assert_array_equal(made, offset[:, 0] < 1)


COSINES = np.linspace(0, 1, 101)
DIELECTRIC = "r[0].x = F_dielectric(a[0].x, a[0].y);"


def test_fresnel_has_its_closed_forms(glsl: Glsl) -> None:
    """Straight on, at Brewster's angle (where half of the s part is left), and grazing; total reflection inside."""
    brewster = 1 / np.sqrt(1 + N**2)
    s = ((N**2 - 1) / (N**2 + 1)) ** 2
    cosines, etas = np.array([1.0, brewster, 0.0, 0.3]), np.array([N, N, N, 1 / N])
    made = glsl("lib/fresnel.glsl", DIELECTRIC, numbers(cosines, etas))[:, 0, 0]
    np.testing.assert_allclose(made, [((N - 1) / (N + 1)) ** 2, s / 2, 1, 1], rtol=1e-5)


def test_fresnel_is_that_of_float64_and_the_same_both_ways(glsl: Glsl) -> None:
    inside = np.sqrt(1 - (1 - COSINES**2) / N**2)
    made = glsl("lib/fresnel.glsl", DIELECTRIC, numbers(COSINES, np.full(101, N)))[:, 0, 0]
    back = glsl("lib/fresnel.glsl", DIELECTRIC, numbers(inside[5:], np.full(96, 1 / N)))[:, 0, 0]
    np.testing.assert_allclose(made, fresnel_dielectric(COSINES, N), rtol=1e-4, atol=1e-6)
    np.testing.assert_allclose(back, made[5:], rtol=1e-3)


def test_the_talks_fresnel_is_twice_the_exact_one_straight_on(glsl: Glsl) -> None:
    """0.05 where a cornea has 0.025; 1.2 times as much at 60 degrees."""
    made = glsl("lib/fresnel.glsl", "r[0].x = F_talk(a[0].x);", numbers(np.array([1.0, 0.5, 0.0])))[:, 0, 0]
    ratio = made / fresnel_dielectric(np.array([1.0, 0.5, 0.0]), N)
    np.testing.assert_allclose(ratio, [2.0, 1.18, 1.0], rtol=0.02)


def test_wrapped_light_is_a_fifth_more_on_the_whole(glsl: Glsl) -> None:
    """Over all directions of a normal: (1 + wrap) times that of Lambert."""
    cosines = np.linspace(-1, 1, 4001)
    normals = np.stack([np.sqrt(1 - cosines**2), cosines, 0 * cosines], axis=1)
    body = "r[0].x = wrap_diffuse(a[0].xyz, vec3(0.0, 1.0, 0.0), 0.2);"
    made = glsl("lib/wrap.glsl", body, rows((normals, 0)))[:, 0, 0]
    assert made.mean() / np.maximum(cosines, 0).mean() == pytest.approx(1.2, abs=1e-3)


def half_vectors() -> tuple[Float64, Float64]:
    """N.H from just below 1 down to where nothing is left of a highlight of exponent 4000, and its exact power."""
    cosine = 1 - np.geomspace(1e-6, 3e-3, 200)
    return cosine, cosine**4000


def test_a_highlight_of_exponent_4000_needs_float32(glsl: Glsl) -> None:
    cosine, exact = half_vectors()
    normals = np.stack([np.sqrt(1 - cosine**2), cosine, 0 * cosine], axis=1)
    body = "r[0].x = blinn_phong(a[0].xyz, vec3(0.0, 1.0, 0.0), vec3(0.0, 1.0, 0.0), 4000.0);"
    made = glsl("lib/blinn_phong.glsl", body, rows((normals, 0)))[:, 0, 0]
    np.testing.assert_allclose(made, exact, rtol=2e-3, atol=1e-5)


def test_a_highlight_of_exponent_4000_in_half_precision_has_five_levels() -> None:
    """And rounding N.H up by one step makes it fifty times as bright as it can be."""
    cosine, exact = half_vectors()
    halves = cosine.astype(np.float16)
    assert len(np.unique(halves[exact > 1e-3])) <= 5
    above = float(np.nextafter(np.float16(1), np.float16(2)))
    assert above**4000 > 40
    assert np.abs(halves.astype(float) ** 4000 - exact).max() > 0.3


FILM = "r[0].xyz = film_brdf(vec3(a[0].z), a[0].x, a[0].y, {n}, {internal});"


def film(glsl: Glsl, cos_i: Float64, cos_o: Float64, albedo: float) -> Float64:
    body = FILM.format(n=N, internal=diffuse_internal_reflectance(N))
    return glsl("lib/film.glsl", body, numbers(cos_i, cos_o, np.full(len(cos_i), albedo)))[:, 0, 0]


def test_a_white_surface_under_a_film_reflects_all_that_enters(glsl: Glsl) -> None:
    """White furnace: what it sends to one side, and what the film mirrors there, add up to all light."""
    x = (np.arange(4000) + 0.5) / 4000
    cos_i = np.sqrt(x)  # as dense as the cosine
    for cos_o in (1.0, 0.5, 0.1):
        reflected = np.pi * film(glsl, cos_i, np.full(4000, cos_o), 1.0).mean()
        assert reflected + fresnel_dielectric(np.array(cos_o), N) == pytest.approx(1, abs=1e-4)


def test_a_film_is_reciprocal(glsl: Glsl, rng: np.random.Generator) -> None:
    a, b = rng.uniform(0.05, 1, (2, 100))
    np.testing.assert_allclose(film(glsl, a, b, 0.6), film(glsl, b, a, 0.6), rtol=1e-5)


def test_diffuse_internal_reflectance_by_brute_force() -> None:
    x = (np.arange(1_000_000) + 0.5) / 1_000_000
    brute = fresnel_dielectric(np.sqrt(x), 1 / N).mean()
    assert diffuse_internal_reflectance(N) == pytest.approx(float(brute), abs=1e-5)


def test_a_disk_is_hit_from_its_front_alone(glsl: Glsl) -> None:
    """Straight at it, past its edge, from behind, with it behind the ray."""
    up, down = np.array([0.0, 1.0, 0.0]), np.array([0.0, -1.0, 0.0])
    origin = np.array([[0.0, 0, 0], [0.6, 0, 0], [0, 4, 0], [0, 0, 0]])
    ray = np.array([up, up, down, down])
    body = "r[0].x = float(disk_hit(a[0].xyz, a[1].xyz, vec3(0.0, 2.0, 0.0), vec3(0.0, -1.0, 0.0), 0.5));"
    np.testing.assert_array_equal(glsl("lib/disk.glsl", body, rows((origin, 0), (ray, 0)))[:, 0, 0], [1, 0, 0, 0])


def test_cosine_directions_have_the_moments_of_the_cosine(glsl: Glsl) -> None:
    """Mean of cos: 2/3, of cos²: 1/2; they are of length 1, and no side is preferred."""
    normal = normalised(np.array([[0.3, 0.9, -0.2]]))[0]
    grid = rows((np.tile(normal, (1024, 1)), np.arange(1024.0)))
    d = glsl("lib/hemisphere.glsl", "r[0].xyz = cosine_direction(int(a[0].w), a[0].xyz);", grid)[:, 0, :3]
    np.testing.assert_allclose(np.linalg.norm(d, axis=1), 1, atol=1e-6)
    np.testing.assert_allclose(d.mean(axis=0), 2 / 3 * normal, atol=3e-3)
    assert np.mean((d @ normal) ** 2) == pytest.approx(0.5, abs=3e-3)


@pytest.mark.parametrize("distance", [3.0, 50.0, 1000.0])
@pytest.mark.parametrize("eye", [TALK, HUMAN], ids=["talk", "human"])
def test_the_first_hit_lies_on_the_surface_and_on_the_ray(
    glsl: Glsl, rng: np.random.Generator, eye: Eye, distance: float
) -> None:
    """Rounding of the ray itself moves a hit by about its distance times 1e-7."""
    model, size = eye_model(eye), eye.sclera_radius
    origin, ray = rays_at_sphere(rng, distance)
    body = f"""vec3 x, n; bool c;
        r[1].w = float(eye_hit({literal(model)}, a[0].xyz, a[1].xyz, x, n, c));
        r[0] = vec4(x, float(c)); r[1].xyz = n;"""
    made = glsl("lib/eye.glsl", body, rows((size * origin, 0), (ray, 0)), outputs=2)
    x, is_cornea, n, hit = made[:, 0, :3], made[:, 0, 3] > 0, made[:, 1, :3], made[:, 1, 3]
    assert hit.all()
    assert 0.02 < is_cornea.mean() < 0.3
    np.testing.assert_array_equal(is_cornea, x[:, 1] > np.float32(model.limbus_height))
    centre = np.where(is_cornea, model.cornea_centre, 0.0)[:, None] * np.array([0.0, 1.0, 0.0])
    radius = np.where(is_cornea, model.cornea_radius, model.sclera_radius)
    np.testing.assert_allclose(np.linalg.norm(x - centre, axis=1), radius, rtol=1e-6)
    np.testing.assert_allclose(n, (x - centre) / radius[:, None], atol=1e-6)
    aside = np.linalg.norm(np.cross(x - size * origin, ray), axis=1)
    assert np.percentile(aside, 99) < 1e-6 * size * distance
    assert (np.sum(n * ray, axis=1) < 0).all()


@pytest.mark.parametrize("eye", [TALK, HUMAN], ids=["bowl", "flat"])
def test_the_iris_is_hit_within_its_rim_alone(glsl: Glsl, rng: np.random.Generator, eye: Eye) -> None:
    model = eye_model(eye)
    start = np.column_stack([rng.uniform(-1, 1, (2, 400)).T, np.zeros(400)])[:, [0, 2, 1]] * eye.limbus_radius
    start[:, 1] = model.apex
    ray = normalised(np.column_stack([rng.normal(0, 0.5, 400), rng.normal(-1, 0.3, 400), rng.normal(0, 0.5, 400)]))
    body = f"""vec3 p, n; r[0].w = float(iris_hit({literal(model)}, a[0].xyz, a[1].xyz, p, n));
        r[0].xyz = p; r[1].xyz = n;"""
    made = glsl("lib/eye.glsl", body, rows((start, 0), (ray, 0)), outputs=2)
    t = (model.iris_plane - start[:, 1]) / ray[:, 1]
    crossing = start + t[:, None] * ray
    within = (t > 0) & (np.hypot(crossing[:, 0], crossing[:, 2]) < model.limbus_radius)
    np.testing.assert_array_equal(made[:, 0, 3] > 0, within)
    p, n = made[within, 0, :3], made[within, 1, :3]
    if model.iris_curvature:
        centre = np.array([0.0, model.iris_centre, 0.0])
        np.testing.assert_allclose(np.linalg.norm(p - centre, axis=1), model.iris_curvature, rtol=1e-6)
        np.testing.assert_allclose(n, (centre - p) / model.iris_curvature, atol=1e-6)
        assert (p[:, 1] < model.iris_plane + 1e-6).all()
    else:
        np.testing.assert_allclose(p, crossing[within], rtol=0, atol=1e-5 * model.sclera_radius)


def test_the_coordinate_of_the_iris_grows_along_x_and_against_z(glsl: Glsl) -> None:
    model = eye_model(TALK)
    points = model.limbus_radius * np.array([[1.0, 0, 0], [0, 0, -1.0], [-1.0, 0, 1.0]])
    made = glsl("lib/eye.glsl", f"r[0].xy = iris_uv({literal(model)}, a[0].xyz);", rows((points, 0)))[:, 0, :2]
    np.testing.assert_allclose(made, np.array([[1.0, 0.5], [0.5, 1.0], [0.0, 0.0]]), atol=1e-6)


def bent_to_iris(model: EyeModel, entry: Float64, place: Float64, w: float) -> tuple[Float64, Float64]:
    """Where light from a place (or direction) hits the plane of the iris that enters the cornea at points (..., 3).

    And the irradiance on the cornea there that gets through, per unit of that on a plane across the light.
    """
    centre = np.array([0.0, model.cornea_centre, 0.0])
    normal = (entry - centre) / model.cornea_radius
    to_light = normalised(place - w * entry)
    cos_i = np.sum(normal * to_light, axis=1)
    d = snell(-to_light, normal, model.ior)
    t = (model.iris_plane - entry[:, 1]) / d[:, 1]
    through = 1 - fresnel_dielectric(np.maximum(cos_i, 0), model.front_ior)
    return entry + t[:, None] * d, np.maximum(cos_i, 0) * through


LIGHTS = [(0.0, 0.0, 1), (0.5, 0.0, 1), (1.1, 0.0, 1), (0.4, 1.0, 8), (1.0, 1.0, 4)]


@pytest.mark.parametrize(("angle", "w", "distance"), LIGHTS)
@pytest.mark.parametrize("eye", [TALK.model_copy(update={"iris_curvature": None}), HUMAN], ids=["talk", "human"])
def test_focused_light_is_what_the_refracted_map_concentrates(
    glsl: Glsl, rng: np.random.Generator, eye: Eye, angle: float, w: float, distance: float
) -> None:
    """Irradiance from the area that a patch of the cornea is mapped to, by central differences in float64.

    Nothing of Coddington's equations goes in. Near lights (w = 1) are at a few radii of the sclera.
    """
    model = eye_model(eye)
    place = distance * model.sclera_radius * np.array([np.sin(angle) * 0.8, np.cos(angle), np.sin(angle) * 0.6])
    polar, azimuth = rng.uniform(0, 0.9 * np.arccos(model.cap_cosine), 300), rng.uniform(0, 2 * np.pi, 300)

    def entry(du: float, dv: float) -> Float64:
        a, b = polar + du, azimuth + dv
        n = np.stack([np.sin(a) * np.cos(b), np.cos(a), np.sin(a) * np.sin(b)], axis=1)
        return np.array([0.0, model.cornea_centre, 0.0]) + model.cornea_radius * n

    h = 1e-5
    p, arriving = bent_to_iris(model, entry(0, 0), place, w)
    across = np.cross(
        bent_to_iris(model, entry(h, 0), place, w)[0] - bent_to_iris(model, entry(-h, 0), place, w)[0],
        bent_to_iris(model, entry(0, h), place, w)[0] - bent_to_iris(model, entry(0, -h), place, w)[0],
    )
    patch = model.cornea_radius**2 * np.sin(polar) * 4 * h * h
    # The light that arrives on the patch, by the distance from the source, spreads over its image on the iris.
    expected = arriving * patch / np.abs(across[:, 1])
    body = f"""Eye e = {literal(model)};
        Entry x = cornea_entry(e, a[0].xyz, a[1], 6);
        r[0] = vec4(x.point, cornea_transfer(e, x, vec3(0.0, 1.0, 0.0)) * cornea_focus(e, x));"""
    inside = np.hypot(p[:, 0], p[:, 2]) < 0.95 * model.limbus_radius
    lit = inside & (arriving > 0.05 * arriving.max()) & (expected < 4 * np.median(expected))
    made = glsl("lib/cornea.glsl", body, rows((p, 0), (np.tile(place, (300, 1)), w)))[lit, 0]
    assert lit.sum() > 50
    np.testing.assert_allclose(made[:, :3], entry(0, 0)[lit], atol=2e-4 * model.sclera_radius)
    np.testing.assert_allclose(made[:, 3], expected[lit], rtol=4e-3)


@pytest.mark.parametrize(("steps", "least", "most"), [(0, 0.3, 0.8), (1, 0.05, 0.25), (2, 4e-3, 0.03), (4, 0, 5e-6)])
def test_each_step_comes_closer_to_where_light_enters(
    glsl: Glsl, rng: np.random.Generator, steps: int, least: float, most: float
) -> None:
    """Light 70 degrees off the axis of a human eye; expect the error to be squared by each step."""
    model = eye_model(HUMAN)
    r, phi = 0.9 * model.limbus_radius * np.sqrt(rng.uniform(size=300)), rng.uniform(0, 2 * np.pi, 300)
    p = np.stack([r * np.cos(phi), np.full(300, model.iris_plane), r * np.sin(phi)], axis=1)
    light = np.array([np.sin(1.22), np.cos(1.22), 0.0])
    body = f"r[0].xyz = cornea_entry({literal(model)}, a[0].xyz, a[1], {steps}).point;"
    entry = glsl("lib/cornea.glsl", body, rows((p, 0), (np.tile(light, (300, 1)), 0)))[:, 0, :3]
    landed, arriving = bent_to_iris(model, entry, light, 0.0)
    lit = (arriving > 0) & (entry[:, 1] > model.limbus_height)
    assert lit.mean() > 0.4
    error = np.linalg.norm(landed - p, axis=1)[lit] / model.limbus_radius
    assert least <= error.max() < most


@pytest.mark.parametrize("part", ["cornea", "sclera"])
def test_near_the_limbus_cornea_and_sclera_hide_one_another(glsl: Glsl, rng: np.random.Generator, part: str) -> None:
    """By steps along the ray: what enters the other part has been hidden by it."""
    model, count = eye_model(HUMAN), 2000
    spheres = {"cornea": (model.cornea_radius, model.cornea_centre, -1.0), "sclera": (model.sclera_radius, 0.0, 1.0)}
    radius, centre, down = spheres.pop(part)
    ((other_radius, other_centre, other_down),) = spheres.values()
    polar = np.arcsin(model.limbus_radius / radius) + down * rng.uniform(0.01, 0.1, count)
    azimuth = rng.uniform(0, 2 * np.pi, count)
    n = np.stack([np.sin(polar) * np.cos(azimuth), np.cos(polar), np.sin(polar) * np.sin(azimuth)], axis=1)
    start = radius * n + [0.0, centre, 0.0]
    ray = normalised(rng.normal(size=n.shape))
    ray *= np.sign(np.sum(ray * n, axis=1, keepdims=True))
    body = f"r[0].x = float(leaves_{part}({literal(model)}, a[0].xyz, a[1].xyz));"
    leaves = glsl("lib/eye.glsl", body, rows((start, 0), (ray, 0)))[:, 0, 0] > 0
    points = start[:, None] + np.linspace(0.003, 6, 2000)[:, None] * ray[:, None]
    within = np.linalg.norm(points - [0.0, other_centre, 0.0], axis=-1) < other_radius
    hidden = (within & (other_down * (model.limbus_height - points[..., 1]) > 0)).any(axis=1)
    assert 20 < hidden.sum() < 1000
    assert np.mean(leaves == ~hidden) > 0.99  # a step may miss a short way through the other part


def test_straight_light_is_weakened_but_not_bent(glsl: Glsl) -> None:
    """Along the axis: T at normal incidence; 30 degrees off it, from the middle of a cornea about that point: T cos."""
    model = eye_model(HUMAN)
    centre = np.tile([0.0, model.cornea_centre, 0.0], (2, 1))
    light = np.array([[0.0, 1.0, 0.0], [0.5, np.sqrt(0.75), 0.0]])
    body = f"r[0].x = straight_transfer({literal(model)}, a[0].xyz, a[1].xyz, vec3(0.0, 1.0, 0.0));"
    made = glsl("lib/cornea.glsl", body, rows((centre, 0), (light, 0)))[:, 0, 0]
    through = 1 - ((HUMAN.ior - 1) / (HUMAN.ior + 1)) ** 2
    np.testing.assert_allclose(made, through * light[:, 1], rtol=1e-5)


def test_a_flat_cornea_spreads_and_never_focuses(glsl: Glsl) -> None:
    """Parallel light keeps its width. A near light's rays spread as if it were n times as far behind the surface."""
    body = "r[0].x = focus(wavefront_curvatures(a[0].x, a[0].y, 1.376, 0.0, a[0].z), a[0].w);"
    cos_i = np.array([1.0, 0.3, 1.0])
    cos_t = np.sqrt(1 - (1 - cos_i**2) / N**2)
    made = glsl("lib/cornea.glsl", body, numbers(cos_i, cos_t, np.array([0.0, 0.0, 0.5]), np.ones(3)))[:, 0, 0]
    np.testing.assert_allclose(made, [1, 1, 1 / (1 + 0.5 / N) ** 2], rtol=1e-5)


def test_the_edge_of_the_iris_is_blended_by_the_sixth_power(glsl: Glsl) -> None:
    heights = np.array([0.805, 0.9025, 1.0])
    made = glsl("lib/cornea_talk.glsl", "r[0].x = edge_blend(a[0].x, 0.805, 1.0);", numbers(heights))[:, 0, 0]
    np.testing.assert_allclose(made, [1, 0.5**6, 0], atol=1e-5)


TRACE = "TalkIris t = trace_iris_talk(a[0].xyz, a[0].xyz, a[1].xyz, 1.376, 1.0, 0.805, 2.7088, 2.0);"


def test_half_precision_loses_rays_from_far_away_without_a_nan(glsl: Glsl, rng: np.random.Generator) -> None:
    """From 300 radii the square of a ray's length overflows a half; divided by infinity, the ray has no direction.

    What is refracted then is the normal alone: the iris is painted on the cornea, but for the mistake's other name.
    """
    coord = normalised(np.column_stack([rng.normal(0, 0.2, 500), np.ones(500), rng.normal(0, 0.2, 500)]))
    offset = coord - 300 * np.array([0.6, 0.8, 0.0])
    halves = offset.astype(np.float16)
    with np.errstate(over="ignore"):
        ray = halves / np.sqrt(np.sum(halves * halves, axis=1, keepdims=True, dtype=np.float16))
    made, right = (
        glsl("lib/cornea_talk.glsl", TRACE + "r[0].xyz = t.point;", rows((coord, 0), (d.astype(float), 0)))[:, 0, :3]
        for d in (ray, normalised(offset))
    )
    assert np.isfinite(made).all()
    assert (np.linalg.norm(made - right, axis=1) > 1e-3).mean() > 0.9


def test_blending_instead_of_branching_hides_nan_from_the_output(glsl: Glsl, rng: np.random.Generator) -> None:
    """On the white the traced iris' normal is NaN where its sphere is missed.

    mix(NaN, x, 1) is NaN too, but max(0, NaN) is a number: a count of NaNs in the image sees nothing, the intermediate
    and a comparison with float64 do.
    """
    coord = normalised(rng.normal(size=(3000, 3)))
    coord = coord[coord[:, 1] < 0.7]
    ray = np.tile([0.0, -1.0, 0.0], (len(coord), 1))
    ray[coord[:, 1] < 0] = (0.0, 1.0, 0.0)
    body = (
        TRACE
        + """vec3 mixed = mix(t.normal, a[0].xyz, a[0].w);
        r[0].x = dot(t.normal, t.normal); r[0].y = max(0.0, dot(mixed, -a[1].xyz));
        vec3 selected = a[0].y > 0.805 ? t.normal : a[0].xyz;
        r[0].z = max(0.0, dot(selected, -a[1].xyz));"""
    )
    made = glsl("lib/cornea_talk.glsl", body, rows((coord, 1), (ray, 0)))[:, 0]
    exact = np.maximum(0, -np.sum(coord * ray, axis=1))
    lost = np.isnan(made[:, 0])
    assert lost.mean() > 0.1
    assert not np.isnan(made[:, 1:]).any()
    np.testing.assert_array_equal(made[lost, 1], 0)
    assert exact[lost].max() > 0.2
    np.testing.assert_allclose(made[:, 2], exact, atol=1e-6)
