"""The techniques of the cornea on whole eyes: against rays, photons and closed forms in float64."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from scipy.ndimage import binary_erosion, map_coordinates

from realtime.eye import EyeModel, eye_model, the_eye, with_one_surface
from realtime.eye_exchange import RINGS, iris_exchange
from realtime.fresnel import fresnel_dielectric
from realtime.render import Renderer, Rendering
from realtime.techniques import cornea_anatomical, cornea_talk
from realtime.techniques.cornea_talk import exit_branch_is_dead, talk_iris_sphere
from scenes.errors import InputError
from scenes.eyes import endothelium_centre
from scenes.image import Float32, Float64
from scenes.model import Scene
from scenes.procedural import normalised, rotation_xyz
from scenes.shapes import Eye

MakeScene = Callable[..., Scene]
TECHNIQUES = cornea_talk.TECHNIQUES | cornea_anatomical.TECHNIQUES

TALK = {
    "sclera_radius": 1.0,
    "cornea_radius": 1.0,
    "limbus_radius": float(np.sqrt(1 - 0.805**2)),
    "ior": 1.376,
    "iris_curvature": 2.0,
}
FLAT = {key: value for key, value in TALK.items() if key != "iris_curvature"}
HUMAN = {
    "sclera_radius": 12.0,
    "cornea_radius": 7.8,
    "limbus_radius": 5.9,
    "ior": 1.376,
    "iris_depth": 3.55,
    "endothelium": {"radius": 6.5, "thickness": 0.55, "ior": 1.336},
}
ONE_SURFACE = {key: value for key, value in HUMAN.items() if key != "endothelium"} | {"ior": 1.3375}
SKY = {"type": "constant", "radiance": [1.0, 1.0, 1.0]}


def towards(degrees: float, azimuth: float = 0.0) -> Float64:
    """A unit vector so far off the gaze."""
    angle = np.radians(degrees)
    return np.array([np.sin(angle) * np.cos(azimuth), np.cos(angle), np.sin(angle) * np.sin(azimuth)])


def sun(degrees: float, azimuth: float = 0.7) -> dict[str, Any]:
    return {"type": "directional", "direction": list(-towards(degrees, azimuth)), "irradiance": [1.0, 1.0, 1.0]}


@pytest.fixture
def make_eye(make_scene: MakeScene) -> Callable[..., Scene]:
    """An eye seen from `view` degrees off its gaze at `distance` radii of its sclera, the sclera filling the image."""

    def make(
        eye: dict[str, Any],
        view: float = 30.0,
        emitters: tuple[dict[str, Any], ...] = (SKY,),
        albedo: float = 0.5,
        distance: float = 10.0,
        size: int = 32,
        others: tuple[dict[str, Any], ...] = (),
        **shape: Any,
    ) -> Scene:
        place = {"position": [0.0, 0.0, 0.0], "rotation_deg": [0.0, 0.0, 0.0]} | shape
        world = rotation_xyz(tuple(place["rotation_deg"]))
        radius = eye["sclera_radius"] * place.get("scale", 1.0)
        position = np.array(place["position"])
        sensor = {
            "type": "perspective",
            "origin": list(position + world @ (distance * radius * towards(view))),
            "target": list(position),
            "up": list(world @ [0.0, 0.0, 1.0]),
            "fov_deg": float(np.degrees(2 * np.arcsin(1.05 / distance))),
            "width": size,
            "height": size,
        }
        grey = {"type": "diffuse", "reflectance": [albedo] * 3}
        return make_scene(
            title="An eye",
            subject=["eye"],
            sensor=sensor,
            materials={"white": grey, "iris": grey},
            shapes=[{"name": "eye", "type": "eye", "material": "white", "iris": "iris", **place, **eye}, *others],
            emitters=list(emitters),
        )

    return make


def rendered(scene: Scene, name: str, **settings: Any) -> Rendering:
    return Renderer(scene).render(TECHNIQUES[name], settings, timed=False)


def picture(scene: Scene, name: str, **settings: Any) -> Float32:
    return rendered(scene, name, **settings).image.pixels


# The sensor and the eye in float64.


def sphere(o: Float64, d: Float64, y: float, radius: float) -> tuple[Float64, Float64]:
    f = o - np.array([0.0, y, 0.0])
    b = np.sum(f * d, axis=-1)
    with np.errstate(invalid="ignore"):
        root = np.sqrt(radius**2 - np.sum((f - b[..., None] * d) ** 2, axis=-1))
    return -b - root, -b + root


def refracted(d: Float64, n: Float64, ior: float) -> Float64:
    cos_i = -np.sum(d * n, axis=-1, keepdims=True)
    tangential = (d + cos_i * n) / ior
    bent: Float64 = tangential - np.sqrt(1 - np.sum(tangential**2, axis=-1, keepdims=True)) * n
    return bent


def view_rays(scene: Scene) -> tuple[Float64, Float64]:
    """Origin and directions (H, W, 3) through the centres of the pixels, in the frame of the eye."""
    sensor, eye = scene.sensor, the_eye(scene)
    world = rotation_xyz(eye.rotation_deg)
    forward = normalised(np.subtract(sensor.target, sensor.origin)[None])[0]
    right = normalised(np.cross(forward, sensor.up)[None])[0]
    at = (np.arange(sensor.width) + 0.5) / sensor.width * 2 - 1
    x, y = np.meshgrid(at, -at)
    tangent = np.tan(np.radians(sensor.fov_deg) / 2)
    d = forward + tangent * (x[..., None] * right + y[..., None] * np.cross(right, forward))
    origin = np.subtract(sensor.origin, eye.position) @ world
    directions: Float64 = normalised(d.reshape(-1, 3)).reshape(d.shape) @ world
    return origin, directions


def exact_uv(scene: Scene, bowl: tuple[float, float] | None) -> tuple[Float64, Float64]:
    """Iris coordinates (H, W, 2), NaN beside it, and Fresnel's reflectance of the cornea there.

    Rays are bent at both surfaces of the cornea, if it has two.
    bowl : centre and radius of the iris' sphere; None for a flat iris
    """
    eye, (o, d) = the_eye(scene), view_rays(scene)
    model, second = eye_model(eye), eye.endothelium
    t, _ = sphere(np.broadcast_to(o, d.shape), d, model.cornea_centre, model.cornea_radius)
    x = o + t[..., None] * d
    is_cornea = x[..., 1] > model.limbus_height
    n = (x - (0.0, model.cornea_centre, 0.0)) / model.cornea_radius
    inside = refracted(d, n, model.ior)
    if second is not None:
        y = endothelium_centre(eye)
        assert y is not None
        x_second = x + sphere(x, inside, y, second.radius)[0][..., None] * inside
        meets = x_second[..., 1:2] > model.iris_plane  # else it stays in the cornea up to the iris
        with np.errstate(invalid="ignore"):
            twice = refracted(inside, (x_second - (0.0, y, 0.0)) / second.radius, second.ior / model.ior)
        x, inside = np.where(meets, x_second, x), np.where(meets, twice, inside)
    p = x + ((model.iris_plane - x[..., 1]) / inside[..., 1])[..., None] * inside
    sees = is_cornea & (np.hypot(p[..., 0], p[..., 2]) < model.limbus_radius)
    if bowl is not None:
        p = x + sphere(x, inside, *bowl)[1][..., None] * inside
    uv = 0.5 + p[..., [0, 2]] * (0.5, -0.5) / model.limbus_radius
    return np.where(sees[..., None], uv, np.nan), fresnel_dielectric(np.abs(np.sum(n * d, axis=-1)), model.ior)


def uv_error(made: Float32, exact: Float64) -> Float64:
    """Distance in diameters of the iris, at pixels all of whose neighbours see it too."""
    seen = np.isfinite(exact[..., 0])
    assert np.mean(seen != (made != 0).any(axis=-1)) < 0.01
    inner = binary_erosion(seen, np.ones((3, 3)))
    assert inner.sum() > 30
    error: Float64 = np.linalg.norm(made - exact, axis=-1)[inner]
    return error


VIEWS = [0.0, 30.0, 60.0, 75.0]


@pytest.mark.parametrize("view", VIEWS)
@pytest.mark.parametrize("eye", [TALK, FLAT, ONE_SURFACE], ids=["bowl", "flat", "human"])
def test_anatomical_rays_are_those_of_float64(make_eye: MakeScene, eye: dict[str, Any], view: float) -> None:
    scene = make_eye(eye, view, size=64)
    model = eye_model(the_eye(scene))
    bowl = (model.iris_centre, model.iris_curvature) if model.iris_curvature else None
    error = uv_error(picture(scene, "cornea.anatomical_uv"), exact_uv(scene, bowl)[0])
    assert np.percentile(error, 99) < 5e-6


@pytest.mark.parametrize("distance", [50.0, 300.0])
def test_distance_costs_the_rays_little(make_eye: MakeScene, distance: float) -> None:
    """Rounding of the ray's origin grows with the distance; fp32 holds 1e-4 of the iris to some 300 radii."""
    scene = make_eye(TALK, 60.0, distance=distance, size=64)
    model = eye_model(the_eye(scene))
    error = uv_error(
        picture(scene, "cornea.anatomical_uv"), exact_uv(scene, (model.iris_centre, model.iris_curvature))[0]
    )
    assert np.percentile(error, 99) < 1e-4


@pytest.mark.parametrize("view", VIEWS)
@pytest.mark.parametrize(
    ("settings", "detail", "most"), [({}, 512, 1e-4), ({"surface": "spheres"}, 64, 5e-6)], ids=["polygons", "spheres"]
)
def test_the_talks_rays_are_those_of_float64(
    make_eye: MakeScene, settings: dict[str, Any], detail: int, most: float, view: float
) -> None:
    scene = make_eye(TALK, view, size=64, detail=detail)
    exact, _ = exact_uv(scene, talk_iris_sphere(eye_model(the_eye(scene)), 2.0))
    assert np.percentile(uv_error(picture(scene, "cornea.talk_uv", **settings), exact), 99) < most


def test_coarse_polygons_cost_the_talk_what_half_precision_would(make_eye: MakeScene) -> None:
    """64 segments: two texels of an iris of 1024, and a quarter of that at twice as many."""
    errors = []
    for detail in (64, 128):
        scene = make_eye(TALK, 45.0, size=64, detail=detail)
        exact, _ = exact_uv(scene, talk_iris_sphere(eye_model(the_eye(scene)), 2.0))
        errors.append(np.percentile(uv_error(picture(scene, "cornea.talk_uv"), exact), 99))
    assert 5e-4 < errors[0] < 4e-3
    assert errors[1] / errors[0] == pytest.approx(0.25, rel=0.3)


@pytest.mark.parametrize("name", ["cornea.talk_uv", "cornea.anatomical_uv"])
def test_the_iris_goes_with_its_eye(make_eye: MakeScene, name: str) -> None:
    """Turned, moved and twice as large, seen from the same side."""
    plain = picture(make_eye(TALK), name)
    placed = picture(make_eye(TALK, scale=2.0, position=[3.0, 1.0, -2.0], rotation_deg=[20.0, 50.0, -30.0]), name)
    agree = np.linalg.norm(plain - placed, axis=-1) < 1e-4
    assert agree.mean() > 0.99


@pytest.mark.parametrize("view", VIEWS)
def test_a_cornea_of_two_surfaces_is_nearly_one_of_the_keratometric_index(make_eye: MakeScene, view: float) -> None:
    """Within .3 % of the iris' diameter; painted on the cornea it would be off by 3 to 24 %."""
    scene = make_eye(HUMAN, view, size=64)
    assert uv_error(picture(scene, "cornea.anatomical_uv"), exact_uv(scene, None)[0]).mean() < 3e-3


def test_only_a_cornea_of_two_surfaces_takes_the_keratometric_index(make_eye: MakeScene) -> None:
    scene = make_eye(HUMAN)
    assert with_one_surface(the_eye(scene), 1.3375).ior == 1.3375
    assert with_one_surface(the_eye(scene), 1.3375).front_ior == 1.376
    assert with_one_surface(the_eye(make_eye(TALK)), 1.3375).ior == 1.376


# What is skipped.


def reasons(made: Rendering) -> dict[str, str]:
    return {skip.what: skip.why for skip in made.skipped}


EXIT = "exit through the cornea's side"


def test_the_exit_branch_is_skipped_where_it_is_dead_and_dropping_it_changes_nothing(
    make_eye: MakeScene, monkeypatch: pytest.MonkeyPatch
) -> None:
    scene = make_eye(TALK, 80.0)
    skipped = rendered(scene, "cornea.talk_uv")
    assert "n = 1.376 >= 1 / cos(cap) = 1.242" in reasons(skipped)[EXIT]
    monkeypatch.setattr(cornea_talk, "exit_branch_is_dead", lambda model: "")
    kept = rendered(scene, "cornea.talk_uv")
    assert EXIT not in reasons(kept)
    np.testing.assert_array_equal(kept.image.pixels, skipped.image.pixels)


def test_the_exit_branch_is_live_on_a_human_cornea(make_eye: MakeScene, monkeypatch: pytest.MonkeyPatch) -> None:
    """Seen from behind, a ray that grazes the cornea goes out again; without the branch it would see an iris."""
    scene = make_eye(ONE_SURFACE, 120.0, size=64)
    kept = rendered(scene, "cornea.talk_uv")
    assert EXIT not in reasons(kept)
    monkeypatch.setattr(cornea_talk, "exit_branch_is_dead", lambda model: "it is dropped")
    dropped = picture(scene, "cornea.talk_uv")
    sees, saw = kept.image.pixels.any(axis=-1), dropped.any(axis=-1)
    assert (saw & ~sees).sum() > 0.2 * saw.sum() > 0
    np.testing.assert_array_equal(kept.image.pixels[sees], dropped[sees])


@pytest.mark.parametrize("limbus", [0.4, 0.593, 0.8])
@pytest.mark.parametrize("factor", [0.98, 1.02])
def test_rays_leave_sideways_where_the_rule_says_so_and_nowhere_else(
    make_eye: MakeScene, limbus: float, factor: float
) -> None:
    """Rays at the rim of a cap from all directions, grazing ones included: the first to leave are among them."""
    height = np.sqrt(1 - limbus**2)
    model = eye_model(the_eye(make_eye(FLAT | {"limbus_radius": limbus, "ior": max(1.001, factor / height)})))
    rim, along, across = np.array([[limbus, height, 0.0], [-height, limbus, 0.0], [0.0, 0.0, 1.0]])
    polar, azimuth = np.meshgrid(np.linspace(0, np.pi / 2, 400), np.linspace(0, 2 * np.pi, 400))
    sideways = np.cos(azimuth)[..., None] * along + np.sin(azimuth)[..., None] * across
    inside = refracted(np.sin(polar)[..., None] * sideways - np.cos(polar)[..., None] * rim, rim, model.ior)
    end = rim - 2 * (inside @ rim)[..., None] * inside
    assert (end[..., 1] > height).any() == (exit_branch_is_dead(model) == "")


@pytest.mark.parametrize("view", [0.0, 60.0])
@pytest.mark.parametrize("eye", [TALK, HUMAN], ids=["talk", "human"])
def test_branching_and_selecting_give_the_same_eye(make_eye: MakeScene, eye: dict[str, Any], view: float) -> None:
    scene = make_eye(eye, view, emitters=(sun(30.0), SKY))
    branched, selected = (picture(scene, "cornea.talk", branching=on) for on in (True, False))
    np.testing.assert_array_equal(branched, selected)


def test_nothing_to_mirror_and_nothing_that_casts_shadows_is_skipped(make_eye: MakeScene) -> None:
    why = reasons(rendered(make_eye(TALK, emitters=(sun(30.0),)), "cornea.talk"))
    assert why["sky"] == "there is no sky"
    assert why["capture"] == why["relight"] == "nothing around the eye reflects light"
    assert why["eye's shadow maps"] == "nothing but lamps is beside the eye: nothing casts a shadow on it"


# The talk's shading.


def test_a_light_of_the_talk_is_right_where_it_falls_straight(make_eye: MakeScene) -> None:
    """White seen along the light, from behind the eye: albedo E / pi, wrapped, less the talk's Fresnel term of 0.05."""
    scene = make_eye(TALK, 180.0, emitters=(sun(180.0, 0.0),), distance=50.0)
    centre = picture(scene, "cornea.talk_iris")[15:17, 15:17]
    assert not centre.any()
    whole = picture(scene, "cornea.talk")[14:18, 14:18]
    highlight = whole.max()
    beside = picture(scene, "cornea.talk")[15, 20]
    normal = 4.75 / 16 * 1.05
    lambert = (np.sqrt(1 - normal**2) + 0.2) / 1.2
    np.testing.assert_allclose(beside, 0.95 * 0.5 / np.pi * lambert, rtol=0.02)
    assert highlight > 2 * beside.max()


def test_the_talk_mirrors_the_sky_by_its_fresnel_term(make_eye: MakeScene) -> None:
    """No light but the sky: nothing diffuse, a twentieth of the sky straight on."""
    made = picture(make_eye(TALK, 180.0, distance=50.0), "cornea.talk")
    np.testing.assert_allclose(made[15:17, 15:17], 0.05, rtol=1e-3)


def test_the_eye_mirrors_what_stands_around_it(make_eye: MakeScene) -> None:
    """A lit wall behind the camera, seen in the cornea where there was no sky."""
    wall = {"name": "wall", "type": "rectangle", "size": [60.0, 60.0], "material": "white"}
    wall |= {"position": [0.0, 15.0, 0.0], "rotation_deg": [90.0, 0.0, 0.0]}
    lamp = {"type": "point", "position": [0.0, 10.0, 6.0], "intensity": [500.0] * 3}
    for name in ("cornea.talk", "cornea.anatomical"):
        alone = picture(make_eye(TALK, 20.0, emitters=(lamp,)), name)
        with_wall = picture(make_eye(TALK, 20.0, emitters=(lamp,), others=(wall,)), name)
        assert (with_wall - alone).min() > -1e-6
        assert (with_wall - alone).max() > 0.02 * 0.5 / np.pi * 500 / 25


def screen(y: float, low: float, high: float) -> dict[str, Any]:
    """A wall across the gaze that covers x from low to high."""
    middle, width = (low + high) / 2, high - low
    return {
        "name": "screen",
        "type": "box",
        "size": [width, 0.02, 6.0],
        "position": [middle, y, 0.0],
        "material": "white",
    }


def test_shadows_on_the_talks_iris_lie_at_the_traced_point(make_eye: MakeScene) -> None:
    """Light along the gaze, and a screen that hides x > 0: its edge runs through the iris' middle, u = 0.5.

    Seen from 50 degrees the polygon in front of that point has another x by a fifth of the iris.
    """
    scene = make_eye(TALK, 50.0, emitters=(sun(0.0),), others=(screen(6.0, 0.0, 4.0),), size=64)
    lit = picture(scene, "cornea.talk_iris").sum(axis=-1)
    u = picture(scene, "cornea.talk_uv")[..., 0]
    middle = np.abs(u - 0.5) < 0.35
    seen = (u > 0) & middle & (np.abs(u - 0.5) > 0.04)
    assert seen.sum() > 100
    np.testing.assert_array_equal(lit[seen] < 1e-3, u[seen] > 0.5)


def test_a_screen_beside_the_light_casts_no_shadow(make_eye: MakeScene) -> None:
    lamp = {"type": "point", "position": [0.0, 9.0, 0.0], "intensity": [80.0] * 3}
    for light in (sun(0.0), lamp):
        alone = picture(make_eye(TALK, emitters=(light,)), "cornea.talk_iris")
        beside = picture(make_eye(TALK, emitters=(light,), others=(screen(5.0, 2.0, 4.0),)), "cornea.talk_iris")
        hidden = picture(make_eye(TALK, emitters=(light,), others=(screen(5.0, -2.0, 2.0),)), "cornea.talk_iris")
        np.testing.assert_array_equal(alone, beside)
        assert alone.max() > 0
        assert not hidden.any()


# Light through the cornea.


TWO_SURFACES = FLAT | {"endothelium": {"radius": 0.8, "thickness": 0.1, "ior": 1.336}}


@pytest.mark.parametrize("eye", [FLAT, TWO_SURFACES], ids=["one surface", "two surfaces"])
def test_white_furnace(make_eye: MakeScene, eye: dict[str, Any]) -> None:
    """An eye that absorbs nothing under a uniform sky is as bright as the sky: iris, sclera and mirror image together.

    What comes in through the cornea, what it throws back, and the n² of both ways must balance.
    """
    made = picture(make_eye(eye, albedo=1.0), "cornea.anatomical", sky_rays=512)
    edge = np.hypot(*np.meshgrid(*[np.arange(32) - 15.5] * 2)) > 14.5
    np.testing.assert_allclose(made[~edge], 1, atol=0.02)
    assert made[~edge].mean() == pytest.approx(1, abs=2e-3)


def test_without_interreflection_the_furnace_loses_what_the_cornea_throws_back(make_eye: MakeScene) -> None:
    scene = make_eye(FLAT, 0.0, albedo=1.0)
    full, less = (picture(scene, "cornea.anatomical_iris", interreflection=on)[16, 16, 0] for on in (True, False))
    assert 0.2 < 1 - less / full < 0.5


@pytest.mark.parametrize("eye", [TALK, FLAT, ONE_SURFACE], ids=["bowl", "flat", "human"])
def test_rings_of_the_iris_exchange_light_by_reciprocity(make_eye: MakeScene, eye: dict[str, Any]) -> None:
    """A_k K_kj = A_j K_jk, to the noise of the rays; and no ring receives more than all there is."""
    model = eye_model(the_eye(make_eye(eye)))
    exchange = iris_exchange(model).sum(axis=2).astype(float)
    r = np.arange(RINGS + 1) / RINGS * model.limbus_radius
    bowl = model.iris_curvature
    areas = np.diff(-np.sqrt(bowl**2 - r**2)) * bowl if bowl else np.diff(r**2) / 2
    given = areas[:, None] * exchange
    assert np.abs(given - given.T).sum() < 0.06 * given.sum()
    assert (exchange.sum(axis=1) < 1).all()
    assert exchange.sum(axis=1).min() > 0


def test_a_cornea_like_air_throws_nothing_back(make_eye: MakeScene) -> None:
    assert iris_exchange(eye_model(the_eye(make_eye(FLAT | {"ior": 1.0001})))).sum() < 0.3 * RINGS * 0.1


def photons(model: EyeModel, degrees: float, albedo: float, count: int, bins: int) -> tuple[Float64, Float64]:
    """Irradiance (bins, bins; z then x) of a flat iris in parallel light: what comes in, and what the cornea returns.

    Photons forward from the cornea, by Snell and Fresnel, reflected by Lambert's law: no formula of the technique's.
    """
    rng = np.random.default_rng(7)
    light, centre = towards(degrees, 0.7), np.array([0.0, model.cornea_centre, 0.0])
    y, phi = rng.uniform(model.cap_cosine, 1, count), rng.uniform(0, 2 * np.pi, count)
    n = np.stack([np.sqrt(1 - y * y) * np.cos(phi), y, np.sqrt(1 - y * y) * np.sin(phi)], axis=1)
    cosine = n @ light
    n, cosine = n[cosine > 0], cosine[cosine > 0]
    cap = 2 * np.pi * (1 - model.cap_cosine) * model.cornea_radius**2
    weight = cosine * (1 - fresnel_dielectric(cosine, model.ior)) * cap / count
    x, d = centre + model.cornea_radius * n, refracted(np.broadcast_to(-light, n.shape), n, model.ior)
    maps = []
    for _ in range(6):
        landed, arrived = [], []
        for _ in range(6):
            down = d[:, 1] < 0
            p = x + np.where(down, (model.iris_plane - x[:, 1]) / np.where(down, d[:, 1], -1), 0)[:, None] * d
            hit = down & (np.hypot(p[:, 0], p[:, 2]) < model.limbus_radius)
            landed.append(p[hit])
            arrived.append(weight[hit])
            x, d, weight = off_the_cornea(model, x[~hit], d[~hit], weight[~hit])
        x, weight = np.concatenate(landed), np.concatenate(arrived)
        square = [[-model.limbus_radius, model.limbus_radius]] * 2
        found, _, _ = np.histogram2d(x[:, 2], x[:, 0], bins=bins, range=square, weights=weight)
        maps.append(found * (bins / (2 * model.limbus_radius)) ** 2)
        u, angle = rng.uniform(size=len(x)), rng.uniform(0, 2 * np.pi, len(x))
        d = np.stack([np.sqrt(u) * np.cos(angle), np.sqrt(1 - u), np.sqrt(u) * np.sin(angle)], axis=1)
        x, d, weight = off_the_cornea(model, x, d, albedo * weight)
    return maps[0], np.sum(maps[1:], axis=0)


def off_the_cornea(model: EyeModel, x: Float64, d: Float64, weight: Float64) -> tuple[Float64, Float64, Float64]:
    """Photons reflected where they meet the cornea from inside; those that meet the wall beside it are gone."""
    x = x + sphere(x, d, model.cornea_centre, model.cornea_radius)[1][:, None] * d
    kept = x[:, 1] > model.limbus_height
    x, d, weight = x[kept], d[kept], weight[kept]
    n = (x - (0.0, model.cornea_centre, 0.0)) / model.cornea_radius
    cosine = np.sum(n * d, axis=1)
    return x, d - 2 * cosine[:, None] * n, weight * fresnel_dielectric(cosine, 1 / model.ior)


BINS = 24


def from_photons(scene: Scene, irradiance: Float64, albedo: float) -> Float64:
    """The iris' radiance outside (H, W), at 2 x 2 samples a pixel; NaN unless all of them see it, clear of its rim.

    At the rim a bin sticks out.
    """
    sensor = scene.sensor.model_copy(update={"width": 2 * scene.sensor.width, "height": 2 * scene.sensor.height})
    uv, F = exact_uv(scene.model_copy(update={"sensor": sensor}), None)
    bins = len(irradiance)
    inner = np.linalg.norm(uv - 0.5, axis=-1) < 0.5 - 1.5 / bins
    at = np.nan_to_num(np.stack([1 - uv[..., 1], uv[..., 0]])) * bins - 0.5
    radiance = (1 - F) * albedo * map_coordinates(irradiance, at, order=1) / (np.pi * the_eye(scene).ior ** 2)
    halves = np.where(inner, radiance, np.nan).reshape(scene.sensor.height, 2, scene.sensor.width, 2)
    pixels: Float64 = halves.mean(axis=(1, 3))
    return pixels


def errors(made: Float32, true: Float64) -> tuple[float, float]:
    """Relative root mean square error and bias of energy where the truth is known."""
    known = np.isfinite(true)
    a, b = made[..., 0][known], true[known]
    return float(np.sqrt(np.mean((a - b) ** 2) / np.mean(b**2))), float(a.sum() / b.sum() - 1)


@pytest.mark.parametrize(("view", "light"), [(0.0, 0.0), (60.0, 50.0)])
@pytest.mark.parametrize("eye", [FLAT, ONE_SURFACE], ids=["talk", "human"])
def test_the_iris_is_as_bright_as_photons_say(
    make_eye: MakeScene, eye: dict[str, Any], view: float, light: float
) -> None:
    """Their noise is about 4 % a bin, and bins straddle the shadow of the limbus; the sum is far better known."""
    scene = make_eye(eye, view, emitters=(sun(light),), size=48)
    direct, returned = photons(eye_model(the_eye(scene)), light, 0.5, 300_000, BINS)
    rmse, energy = errors(picture(scene, "cornea.anatomical_iris"), from_photons(scene, direct + returned, 0.5))
    assert rmse < 0.05
    assert abs(energy) < 0.01


@pytest.mark.slow
@pytest.mark.parametrize(("view", "light"), [(30.0, 40.0), (30.0, 70.0), (60.0, 75.0)])
@pytest.mark.parametrize("eye", [FLAT, ONE_SURFACE], ids=["talk", "human"])
def test_the_iris_is_right_in_oblique_light(
    make_eye: MakeScene, eye: dict[str, Any], view: float, light: float
) -> None:
    """Where it is focused most, bins must be narrow and photons many."""
    scene = make_eye(eye, view, emitters=(sun(light),), size=64)
    direct, returned = photons(eye_model(the_eye(scene)), light, 0.5, 2_000_000, 2 * BINS)
    rmse, energy = errors(picture(scene, "cornea.anatomical_iris"), from_photons(scene, direct + returned, 0.5))
    assert rmse < 0.04
    assert abs(energy) < 0.005


def test_ignoring_the_focus_loses_a_fifth_and_ignoring_the_bend_puts_light_elsewhere(make_eye: MakeScene) -> None:
    """Light 75 degrees off the axis. The talk: "for an eyeball, not much focusing occurs"."""
    scene = make_eye(FLAT, 30.0, emitters=(sun(75.0),), size=48)
    direct, returned = photons(eye_model(the_eye(scene)), 75.0, 0.5, 300_000, BINS)
    true = from_photons(scene, direct + returned, 0.5)
    flat_rmse, flat_energy = errors(picture(scene, "cornea.anatomical_iris", caustics="flat"), true)
    straight_rmse, _ = errors(picture(scene, "cornea.anatomical_iris", caustics="straight"), true)
    assert -0.25 < flat_energy < -0.1
    assert 0.15 < flat_rmse < straight_rmse


def test_the_talks_iris_is_too_bright(make_eye: MakeScene) -> None:
    """It forgets that radiance loses n² on its way out, which the light that comes back makes up for in part."""
    scene = make_eye(FLAT, 0.0, emitters=(sun(0.0),), size=48)
    direct, returned = photons(eye_model(the_eye(scene)), 0.0, 0.5, 100_000, BINS)
    _, energy = errors(
        picture(scene, "cornea.talk_iris", iris_curvature=50.0), from_photons(scene, direct + returned, 0.5)
    )
    assert 0.3 < energy < 0.7


def test_a_disk_light_far_away_is_a_sun(make_eye: MakeScene) -> None:
    """Of a degree; its points together send the irradiance pi L sin² of its half angle."""
    position, radius = 500 * towards(40.0, 0.7), 4.0
    disk = {"type": "disk", "position": list(position), "normal": list(-position), "radius": radius}
    disk |= {"radiance": [500**2 / (np.pi * radius**2)] * 3}
    near, far = (picture(make_eye(FLAT, emitters=(light,)), "cornea.anatomical_iris") for light in (disk, sun(40.0)))
    np.testing.assert_allclose(near, far, rtol=0.02, atol=2e-3)


def test_the_wet_highlight_is_the_mirror_image_of_the_disk(make_eye: MakeScene) -> None:
    """F times its radiance where a pixel sees nothing else."""
    position = 6 * towards(20.0, 0.3)
    disk = {"type": "disk", "position": list(position), "normal": list(-position), "radius": 2.0, "radiance": [9.0] * 3}
    scene = make_eye(FLAT, 30.0, emitters=(disk,), albedo=0.0, size=48)
    made = picture(scene, "cornea.anatomical")[..., 0]
    o, d = view_rays(scene)
    t, _ = sphere(np.broadcast_to(o, d.shape), d, 0.0, 1.0)
    n = o + t[..., None] * d
    cosine = -np.sum(n * d, axis=-1)
    m = d + 2 * cosine[..., None] * n
    along = np.sum((position - n) * -position, axis=-1) / np.sum(m * -position, axis=-1)
    away = np.linalg.norm(n + along[..., None] * m - position, axis=-1)
    F = fresnel_dielectric(np.nan_to_num(cosine), 1.376)
    within = (along > 0) & (away < 1.6)
    outside = np.isnan(away) | (along < 0) | (away > 2.4)
    assert within.sum() > 15
    np.testing.assert_allclose(made[within], 9 * F[within], rtol=0.02)
    assert not made[outside].any()


def test_the_sclera_under_its_film(make_eye: MakeScene) -> None:
    """Seen and lit straight on: (1 - F)² rho E / (pi n² (1 - rho R))."""
    scene = make_eye(FLAT, 180.0, emitters=(sun(180.0, 0.0),), albedo=0.8, distance=50.0)
    F = (0.376 / 2.376) ** 2
    sines = np.sqrt((np.arange(200_000) + 0.5) / 200_000)
    R = fresnel_dielectric(np.sqrt(1 - sines**2), 1 / 1.376).mean()
    expected = (1 - F) ** 2 * 0.8 / (np.pi * 1.376**2 * (1 - 0.8 * R))
    np.testing.assert_allclose(picture(scene, "cornea.anatomical")[15:17, 15:17], expected, rtol=3e-3)


def test_a_dark_scene_is_black(make_eye: MakeScene) -> None:
    scene = make_eye(TALK, emitters=())
    for name in ("cornea.talk", "cornea.talk_iris", "cornea.anatomical", "cornea.anatomical_iris"):
        assert not picture(scene, name).any()


def test_the_pupil_reflects_nothing_but_mirrors(make_eye: MakeScene) -> None:
    scene = make_eye(FLAT | {"pupil_radius": 0.3}, 0.0, emitters=(sun(20.0), SKY))
    assert not picture(scene, "cornea.anatomical_iris")[15:17, 15:17].any()
    assert picture(scene, "cornea.talk_iris")[15:17, 15:17].max() < 1e-6  # what the blend leaves of the white
    np.testing.assert_allclose(picture(scene, "cornea.anatomical")[15:17, 15:17], (0.376 / 2.376) ** 2, rtol=1e-3)


def test_a_scene_without_an_eye_is_refused(make_scene: MakeScene) -> None:
    scene = make_scene()
    for name in TECHNIQUES:
        with pytest.raises(InputError, match="Found 0 eyes"):
            rendered(scene, name)


@pytest.mark.parametrize(
    ("name", "settings"), [("cornea.anatomical", {"caustics": "bent"}), ("cornea.talk_uv", {"surface": "round"})]
)
def test_an_unknown_choice_is_refused_with_the_known_ones(
    make_eye: MakeScene, name: str, settings: dict[str, Any]
) -> None:
    with pytest.raises(InputError, match=r"allowed: ('focus', 'flat', 'straight'|'interpolated', 'spheres')\."):
        rendered(make_eye(TALK), name, **settings)


def test_an_eye_is_in_lengths_of_the_scene() -> None:
    eye = Eye.model_validate({"type": "eye", "name": "eye", "material": "white", "iris": "iris", "scale": 2.0} | TALK)
    one, two = eye_model(eye.model_copy(update={"scale": 1.0})), eye_model(eye)
    assert two.apex == 2 * one.apex == 2
    assert two.iris_centre == 2 * one.iris_centre
    assert two.ior == one.ior
