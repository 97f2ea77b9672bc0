"""Blur against what a thin lens does in theory, and against Mitsuba's own integrators."""

from collections.abc import Callable
from functools import partial
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest

from reference.estimator import Reference, seed_of
from reference.quantities import quantity
from reference.quantities.defocus import picture_block
from reference.quantity import BlockRender
from reference.sampling import film_and_lens, sobol
from reference.stage import Stage, build_stage
from scenes.errors import SceneError
from scenes.features import features_of
from scenes.geometry import geometry_of
from scenes.image import Float64
from scenes.model import Scene, ThinLens
from scenes.topology import surface_area

MakeScene = Callable[..., Scene]
MakeReference = Callable[..., Reference]

BLACK = {"type": "diffuse", "reflectance": [0.0, 0.0, 0.0]}
GREY = {"type": "diffuse", "reflectance": [0.6, 0.6, 0.6]}
SKY = {"type": "constant", "radiance": [1.0, 1.0, 1.0]}
APERTURE, FOCUS, WIDTH = 0.06, 2.0, 64


def lens_at(height: int = WIDTH, aperture: float = APERTURE, focus: float = FOCUS) -> dict[str, Any]:
    """Looks from the origin along -z, 40 degrees wide."""
    return {
        "type": "thin_lens",
        "origin": [0.0, 0.0, 0.0],
        "target": [0.0, 0.0, -1.0],
        "fov_deg": 40.0,
        "width": WIDTH,
        "height": height,
        "aperture_radius": aperture,
        "focus_distance": focus,
    }


PER_UNIT = WIDTH / (2 * np.tan(np.radians(20)))
"""Pixels of something of size 1 at depth 1."""


def coc_px(depth: float) -> float:
    """Potmesil & Chakravarty 1982: |K (1 / z_f - 1 / z)|, K = R W / (2 tan(fov / 2))."""
    return float(APERTURE * PER_UNIT * abs(1 / FOCUS - 1 / depth))


def ball(name: str, radius: float, place: tuple[float, float, float], detail: int = 3) -> dict[str, Any]:
    return {
        "name": name,
        "type": "sphere",
        "material": "black",
        "radius": radius,
        "position": list(place),
        "detail": detail,
    }


def card(name: str, size: tuple[float, float], place: tuple[float, float, float], turn: float = 0.0) -> dict[str, Any]:
    rotation = [0.0, 0.0, turn]
    return {
        "name": name,
        "type": "rectangle",
        "material": "black",
        "size": list(size),
        "position": list(place),
        "rotation_deg": rotation,
    }


def glow(shape: str, *radiance: float) -> dict[str, Any]:
    return {"type": "area", "shape": shape, "radiance": list(radiance)}


def staged(mi: ModuleType, scene: Scene) -> Stage:
    return build_stage(mi, scene, geometry_of(scene))


def render_of(scene: Scene, name: str = "defocus_radiance") -> BlockRender:
    block = quantity(name).integrator(features_of(scene, geometry_of(scene))).block
    assert block is not None
    return block


def blocks(stage: Stage, render: BlockRender, spp: int, count: int = 8) -> Float64:
    """Independent images (count, H, W, 3)."""
    pixels = np.arange(stage.width * stage.height)
    images = [render(stage, pixels, seed_of("test", k), spp, None) for k in range(count)]
    return np.stack(images).reshape(count, stage.height, stage.width, 3)


def images_of(stage: Stage, integrator: dict[str, Any], spp: int, count: int = 8) -> Float64:
    """The same by one of Mitsuba's own integrators, lens and film."""
    render = partial(stage.mi.render, stage.scene, integrator=stage.mi.load_dict(integrator), spp=spp)
    return np.stack([np.array(render(seed=seed_of("path", k)), dtype=np.float64) for k in range(count)])


def assert_same(own: Float64, other: Float64, tile: int, most: float) -> None:
    """Means over tiles of independent images (K, H, W, 3) by two methods; their noise must be below `most` of all."""
    k, height, width, _ = own.shape
    shape = (k, height // tile, tile, width // tile, tile, 3)
    own, other = (images.reshape(shape).mean(axis=(2, 4)) for images in (own, other))
    error = np.sqrt((own.var(axis=0, ddof=1) + other.var(axis=0, ddof=1)) / k)
    difference = own.mean(axis=0) - other.mean(axis=0)
    whole = own.mean(axis=(1, 2))
    level, spread = whole.mean(axis=0), np.hypot(*(x.mean(axis=(1, 2)).std(axis=0, ddof=1) for x in (own, other)))
    assert (spread / np.sqrt(k) < most * level).all(), f"too noisy to tell: {spread / np.sqrt(k) / level}"
    assert (np.abs(difference.mean(axis=(0, 1))) < 5 * spread / np.sqrt(k)).all()
    assert (np.abs(difference) < 6 * error + 1e-3 * level).all(), np.abs(difference / (error + 1e-9)).max()


@pytest.mark.parametrize("depth", [5.0, 0.8])
def test_a_small_lamp_becomes_a_disk_with_all_of_its_light(make_scene: MakeScene, mi: ModuleType, depth: float) -> None:
    """Along each axis a uniform disk of radius r has the variance r² / 4, the lamp's own picture too, a pixel 1/12.

    Its energy is radiance times solid angle: of a convex body with surface A, A / 4 on average over all sides (Cauchy).
    """
    radius = 0.004 * depth
    scene = make_scene(
        sensor=lens_at(height=32),
        materials={"black": BLACK},
        subject=["lamp"],
        shapes=[ball("lamp", radius, (0.06 * depth, -0.04 * depth, -depth))],
        emitters=[glow("lamp", 100.0, 50.0, 25.0)],
    )
    images = blocks(staged(mi, scene), render_of(scene), 512)
    image = images.mean(axis=0)
    energy = image.sum(axis=(0, 1))
    area = surface_area(geometry_of(scene)[0].surface)
    tilt = np.sqrt(1 + 0.06**2 + 0.04**2)  # off the axis a solid angle covers 1 / cos³ more film, 1 / cos² farther away
    expected = area / 4 * tilt / depth**2 * PER_UNIT**2
    error = images.sum(axis=(1, 2)).std(axis=0, ddof=1) / np.sqrt(len(images)) / energy
    assert (error < 0.003).all()
    np.testing.assert_allclose(energy, expected * np.array([100.0, 50.0, 25.0]), rtol=0.01)
    rows, columns = np.mgrid[:32, :WIDTH] + 0.5
    weights = image[..., 0] / energy[0]
    centre = np.array([(weights * p).sum() for p in (columns, rows)])
    np.testing.assert_allclose(centre, np.array([WIDTH, 32]) / 2 + np.array([0.06, 0.04]) * PER_UNIT, atol=0.02)
    spread = sum(float((weights * (p - c) ** 2).sum()) for p, c in zip((columns, rows), centre, strict=True))
    own = radius / depth * PER_UNIT
    assert np.sqrt(2 * (spread - 1 / 6) - own**2) == pytest.approx(coc_px(depth), abs=0.1)


def test_an_edge_spreads_as_the_area_of_a_disk_does(make_scene: MakeScene, mi: ModuleType) -> None:
    """A straight edge is blurred to the part of the disk on one side of it: 1/2 + (x sqrt(1 - x²) + asin x) / pi."""
    from scipy.optimize import least_squares

    depth, aperture = 0.5, 0.2
    scene = make_scene(
        sensor=lens_at(height=16, aperture=aperture),
        materials={"black": BLACK},
        subject=["half"],
        shapes=[card("half", (8.0, 8.0), (4.0, 0.0, -depth))],
        emitters=[glow("half", 1.0, 1.0, 1.0)],
    )
    profile = blocks(staged(mi, scene), render_of(scene), 256, 4).mean(axis=(0, 1, 3))
    places = (np.arange(WIDTH * 16) + 0.5) / 16 - WIDTH / 2

    def spread(parameters: Float64) -> Float64:
        x = np.clip((places - parameters[1]) / parameters[0], -1, 1)
        part: Float64 = 0.5 + (x * np.sqrt(1 - x * x) + np.arcsin(x)) / np.pi
        means: Float64 = part.reshape(WIDTH, 16).mean(axis=1)
        return means

    fit = least_squares(lambda p: spread(p) - profile, [10.0, 0.0])
    expected = coc_px(depth) * aperture / APERTURE
    assert fit.x[0] == pytest.approx(expected, rel=0.005)
    assert fit.x[1] == pytest.approx(0.0, abs=0.02)
    np.testing.assert_allclose(profile, spread(np.array([expected, 0.0])), atol=0.01)


CROWD: dict[str, Any] = {
    "subject": ["near"],
    "shapes": [
        card("near", (0.3, 0.25), (-0.12, 0.05, -1.1), 12.0),
        card("wall", (5.0, 5.0), (0.2, 0.0, -6.0), 30.0),
        ball("small", 0.02, (0.25, 0.15, -4.0)),
        ball("hidden", 0.012, (-0.25, 0.1, -3.5)),
        ball("close", 0.004, (0.05, -0.12, -0.8)),
    ],
    "emitters": [
        glow("near", 0.8, 0.5, 0.3),
        glow("wall", 0.2, 0.3, 0.4),
        glow("small", 20.0, 30.0, 10.0),
        glow("hidden", 50.0, 30.0, 10.0),
        glow("close", 5.0, 10.0, 30.0),
    ],
}
"""Large and small emitters on both sides of the focus, their disks overlapping, one of them half hidden."""

CARDS: dict[str, Any] = {"subject": ["near"], "shapes": CROWD["shapes"][:2], "emitters": CROWD["emitters"][:2]}


def test_emitted_light_is_what_mitsubas_own_path_tracer_sees(make_scene: MakeScene, mi: ModuleType) -> None:
    from reference.integrators.emitted_light import Lens

    scene = make_scene(sensor=lens_at(height=48), materials={"black": BLACK}, **CROWD)
    stage = staged(mi, scene)
    assert isinstance(scene.sensor, ThinLens)
    assert len(Lens(stage, scene.sensor).lamps) == 3
    assert_same(
        blocks(stage, render_of(scene), 128),
        images_of(stage, {"type": "path", "max_depth": 1}, 1024),
        tile=8,
        most=0.003,
    )


def plain_trace(stage: Stage, sampler: Any, ray: Any) -> tuple[Any, Any]:
    """Rays through the lens alone."""
    from reference.integrators.emitted_light import emitted_light

    return emitted_light(stage, ray), stage.mi.Color3f(0.0)


def test_aiming_at_lamps_changes_no_mean_and_makes_their_disks_hundreds_of_times_less_noisy(
    make_scene: MakeScene, mi: ModuleType
) -> None:
    scene = make_scene(
        sensor=lens_at() | {"fov_deg": 8.0, "width": 24, "height": 24},
        materials={"black": BLACK},
        subject=["lamp"],
        shapes=[ball("lamp", 0.01, (0.0, 0.0, -5.0))],
        emitters=[glow("lamp", 9.0, 9.0, 9.0)],
    )
    stage = staged(mi, scene)
    renders = render_of(scene), partial(picture_block, plain_trace, True)
    aimed, plain = (blocks(stage, render, 1024) for render in renders)
    assert_same(aimed, plain, tile=24, most=0.03)
    assert plain.var(axis=0).mean() > 100 * aimed.var(axis=0).mean()


@pytest.mark.parametrize(("detail", "away"), [pytest.param(7, 0.0, marks=pytest.mark.slow), (5, 20.0)])
def test_a_fine_mesh_far_from_the_origin_loses_no_light(
    make_scene: MakeScene, mi: ModuleType, detail: int, away: float
) -> None:
    """Triangles so small that rounding in float32 moves a ray from one to the next: energy as in the test above."""
    radius, depth = 0.005, 5.0
    there = np.array([away, 0.0, -away])
    sensor = {"origin": there.tolist(), "target": (there - [0, 0, 1]).tolist(), "fov_deg": 10.0, "aperture_radius": 0.1}
    scene = make_scene(
        sensor=lens_at() | sensor | {"width": 32, "height": 32},
        materials={"black": BLACK},
        subject=["lamp"],
        shapes=[ball("lamp", radius, (away, 0.0, -away - depth), detail)],
        emitters=[glow("lamp", 1.0, 1.0, 1.0)],
    )
    energy = blocks(staged(mi, scene), render_of(scene), 256).sum(axis=(1, 2))[:, 0]
    expected = surface_area(geometry_of(scene)[0].surface) / 4 * (32 / (2 * np.tan(np.radians(5))) / depth) ** 2
    assert energy.std(ddof=1) / np.sqrt(8) < 1e-3 * expected
    assert energy.mean() == pytest.approx(expected, rel=0.003)


def lamps_at(*places: tuple[float, float, float]) -> dict[str, Any]:
    """Ball lamps of 1 cm under a white sky, all as bright."""
    names = [f"lamp-{i}" for i in range(len(places))]
    balls = [ball(name, 0.01, place, 2) for name, place in zip(names, places, strict=True)]
    emitters = [*(glow(name, 1.0, 1.0, 1.0) for name in names), SKY]
    return {"materials": {"black": BLACK}, "subject": names[:1], "shapes": balls, "emitters": emitters}


@pytest.mark.slow
def test_hundreds_of_lamps_are_one_where_everything_emits_one(make_scene: MakeScene, mi: ModuleType) -> None:
    """Their disks overlap, and one kernel serves any number of them."""
    places = [(x, y, -5.0) for x in np.linspace(-0.5, 0.5, 16).tolist() for y in np.linspace(-0.5, 0.5, 16).tolist()]
    sensor = lens_at(aperture=0.1) | {"fov_deg": 20.0, "width": 24, "height": 24}
    scene = make_scene(sensor=sensor, **lamps_at(*places))
    whole = blocks(staged(mi, scene), render_of(scene), 64).mean(axis=(1, 2, 3))
    assert whole.std(ddof=1) / np.sqrt(8) < 2e-4
    assert whole.mean() == pytest.approx(1.0, abs=5 * whole.std(ddof=1) / np.sqrt(8))


@pytest.mark.parametrize(
    ("lens", "places"),
    [
        ({}, [(0.0, 0.0, 3.0), (0.02, 0.0, 0.005), (0.1, 0.1, -4.0)]),
        ({}, [(0.02, 0.0, -0.011), (0.0, 0.05, -0.03), (0.1, 0.1, -FOCUS), (0.1, 0.0, -FOCUS - 0.03)]),
        ({"focus_distance": 1e300}, [(0.1, 0.1, -4.0), (0.0, 0.0, -0.7)]),
        ({"focus_distance": 0.5, "aperture_radius": 2.0}, [(0.1, 0.1, -4.0), (0.0, 0.0, -0.49)]),
        ({"fov_deg": 1e-3}, [(0.01, 0.0, -4.0)]),
    ],
    ids=["behind and across the lens", "before it and in focus", "focus at infinity", "wide lens", "narrow view"],
)
def test_lamps_at_odd_places_change_no_mean(
    make_scene: MakeScene, mi: ModuleType, lens: dict[str, Any], places: list[tuple[float, float, float]]
) -> None:
    """Lamps that are brighter than the sky, against plain rays."""
    things = lamps_at(*places)
    bright = [e | {"radiance": [3.0, 2.0, 1.5]} if e is not SKY else e for e in things["emitters"]]
    sensor = lens_at(aperture=0.1) | {"fov_deg": 20.0, "width": 24, "height": 24} | lens
    scene = make_scene(sensor=sensor, **things | {"emitters": bright})
    stage = staged(mi, scene)
    aimed, plain = (blocks(stage, r, 256) for r in (render_of(scene), partial(picture_block, plain_trace, True)))
    assert np.isfinite(aimed).all()
    assert_same(aimed, plain, tile=24, most=0.01)


def test_a_picture_on_a_small_lamp_keeps_its_light(make_scene: MakeScene, mi: ModuleType, tmp_path: Path) -> None:
    """A card that shines with a gradient: its mean, and the part that is lit, are seen as plain rays see them."""
    import PIL.Image

    gradient = np.repeat(np.linspace(0, 255, 16).astype(np.uint8)[None, :, None], 3, axis=2)
    PIL.Image.fromarray(np.repeat(gradient, 4, axis=0)).save(tmp_path / "slide.png")
    scene = make_scene(
        sensor=lens_at(aperture=0.1) | {"fov_deg": 8.0, "width": 24, "height": 24},
        materials={"black": BLACK},
        subject=["lamp"],
        shapes=[card("lamp", (0.04, 0.03), (0.05, 0.02, -5.0), 20.0)],
        emitters=[glow("lamp", 9.0, 6.0, 3.0) | {"texture": {"path": "slide.png"}}],
    )
    stage = staged(mi, scene)
    aimed, plain = (blocks(stage, r, 1024) for r in (render_of(scene), partial(picture_block, plain_trace, True)))
    assert_same(aimed, plain, tile=8, most=0.02)
    assert aimed.var(axis=0).mean() < plain.var(axis=0).mean() / 10


def test_where_everything_emits_one_it_is_one_seen(make_scene: MakeScene, mi: ModuleType) -> None:
    """Aimed at or not, hidden by another emitter or not: nothing is counted twice, nothing is lost."""
    white = [glow(e["shape"], 1.0, 1.0, 1.0) for e in CROWD["emitters"]]
    scene = make_scene(sensor=lens_at(height=48), materials={"black": BLACK}, **CROWD | {"emitters": [*white, SKY]})
    images = blocks(staged(mi, scene), render_of(scene), 64, 16)
    tiles = images.reshape(16, 6, 8, 8, 8, 3).mean(axis=(2, 4))
    error = tiles.std(axis=0, ddof=1) / 4
    assert images.mean() == pytest.approx(1.0, abs=2e-4)
    assert error.mean() < 1e-3
    assert (np.abs(tiles.mean(axis=0) - 1) < 6 * error + 1e-6).all()


ROOM: dict[str, Any] = {
    "materials": {"black": BLACK, "skin": GREY, "wall": {"type": "diffuse", "reflectance": [0.7, 0.4, 0.2]}},
    "subject": ["ball"],
    "shapes": [
        {"name": "room", "type": "room", "size": [1.6, 1.6, 6.0], "position": [0.0, 0.0, -2.0], "material": "wall"},
        ball("ball", 0.2, (0.1, -0.2, -1.2)) | {"material": "skin"},
        ball("lamp", 0.012, (-0.2, 0.2, -4.0)),
    ],
    "emitters": [
        {"type": "point", "position": [0.4, 0.6, -1.0], "intensity": [2.0, 2.0, 2.0]},
        glow("lamp", 40.0, 40.0, 40.0),
    ],
}


@pytest.mark.parametrize("name", ["defocus_radiance", pytest.param("frame_radiance", marks=pytest.mark.slow)])
def test_reflected_light_is_what_mitsubas_own_path_tracer_sees(
    make_scene: MakeScene, mi: ModuleType, name: str
) -> None:
    small = {"width": 32, "height": 24}
    scene = make_scene(sensor=lens_at() | small, **ROOM)
    own = blocks(staged(mi, scene), render_of(scene, name), 128)
    if name == "frame_radiance":
        scene = make_scene(sensor=lens_at(aperture=0.0) | small, **ROOM)
    assert_same(own, images_of(staged(mi, scene), {"type": "path"}, 256), tile=8, most=0.01)


def test_a_lens_without_an_opening_shows_the_pinhole_picture_to_the_bit(make_scene: MakeScene, mi: ModuleType) -> None:
    pinhole = {k: v for k, v in lens_at(height=48).items() if k not in ("aperture_radius", "focus_distance")}
    pictures = [
        blocks(staged(mi, scene), render_of(scene, name), 16, 2)
        for sensor in (lens_at(height=48, aperture=0.0), pinhole | {"type": "perspective"})
        for name in ("defocus_radiance", "frame_radiance")
        for scene in [make_scene(sensor=sensor, materials={"black": BLACK}, **CROWD)]
    ]
    assert pictures[0].max() > 0
    for other in pictures[1:]:
        np.testing.assert_array_equal(pictures[0], other)


def test_what_lies_at_the_focus_distance_is_as_sharp_as_through_a_pinhole(
    make_scene: MakeScene, mi: ModuleType
) -> None:
    """The same film positions meet the same points, but for a rounding error at an edge."""
    scene = make_scene(
        sensor=lens_at(),
        materials={"black": BLACK},
        subject=["sharp"],
        shapes=[card("sharp", (0.7, 0.5), (0.1, 0.05, -FOCUS), 20.0)],
        emitters=[glow("sharp", 1.0, 2.0, 3.0)],
    )
    stage = staged(mi, scene)
    through_lens, pinhole = (blocks(stage, render_of(scene, n), 64, 1) for n in ("defocus_radiance", "frame_radiance"))
    assert (np.abs(through_lens - pinhole).max(axis=-1) > 1e-4).mean() < 1e-3
    assert np.abs(through_lens - pinhole).max() < 3 * 3 / 64


@pytest.mark.parametrize(
    ("things", "chosen"),
    [
        ({"emitters": []}, "closed form: 0"),
        (
            {"materials": {"black": BLACK, "skin": BLACK, "wall": BLACK}, "emitters": [glow("room", 1.0, 1.0, 1.0)]},
            "emitted light alone",
        ),
        ({}, "path tracing"),
    ],
)
def test_the_cheapest_integrator_that_suffices_is_chosen(
    make_scene: MakeScene, reference: MakeReference, things: dict[str, Any], chosen: str
) -> None:
    truth = reference(make_scene(sensor=lens_at() | {"width": 8, "height": 8}, **ROOM | things)).truth(
        "defocus_radiance", 16
    )
    assert truth.integrator.name == chosen
    assert truth.mask.all()
    assert truth.accumulators.any() == (chosen != "closed form: 0")


def test_on_black_surfaces_the_cheaper_integrator_is_equal_to_the_general_one(
    make_scene: MakeScene, mi: ModuleType
) -> None:
    scene = make_scene(sensor=lens_at(height=48), materials={"black": BLACK}, **CROWD)
    lit = make_scene(sensor=lens_at(height=48), **ROOM)
    stage = staged(mi, scene)
    emitted, traced = (blocks(stage, render_of(s), 64) for s in (scene, lit))
    assert_same(emitted, traced, tile=16, most=0.005)


def test_translucent_bodies_are_refused(make_scene: MakeScene, reference: MakeReference) -> None:
    body = {"type": "translucent", "sigma_a": [0.1] * 3, "sigma_s": [1.0] * 3}
    scene = make_scene(
        sensor=lens_at(), materials={"black": body}, subject=["ball"], shapes=[ball("ball", 0.2, (0.0, 0.0, -2.0))]
    )
    with pytest.raises(SceneError, match=r"defocus_radiance is not defined here: .* translucent body, an eye"):
        reference(scene).truth("defocus_radiance", 16)


@pytest.mark.parametrize("spp", [1, 2, 3, 7, 16])
def test_sets_of_any_length_are_uniform_and_independent(mi: ModuleType, spp: int) -> None:
    """Every point of a set is uniform in the cube over the sets; what two sets have in common is chance."""
    rows = 1 << 15
    points = np.stack([np.array(c) for c in film_and_lens(mi, rows, spp, seed_of("set", spp))]).reshape(4, rows, spp)
    assert points.min() >= 0
    assert points.max() < 1
    for point in np.moveaxis(points, 2, 0):
        np.testing.assert_allclose(point.mean(axis=1), 1 / 2, atol=5 * np.sqrt(1 / 12 / rows))
        np.testing.assert_allclose(np.cov(point), np.eye(4) / 12, atol=5 * np.sqrt(1 / 144 / rows))
        cells = np.unique((4 * point[0]).astype(int) + 4 * (4 * point[2]).astype(int), return_counts=True)[1]
        assert np.sum((cells - rows / 16) ** 2) / (rows / 16) < 45  # chi² of 15 degrees: once in 10 000
    ends = points - 1 / 2
    together = (ends[:, 1:] * ends[:, :-1]).mean(axis=(1, 2))
    assert (np.abs(together) < 5 / 12 / np.sqrt(rows)).all()


def test_a_set_is_stratified(mi: ModuleType) -> None:
    """Of 16 points one lies in each sixteenth of each coordinate, and one in each cell of 4 x 4 on the film."""
    points = np.stack([np.array(c) for c in film_and_lens(mi, 100, 16, 1)]).reshape(4, 100, 16)
    assert (np.sort((16 * points).astype(int), axis=2) == np.arange(16)).all()
    cells = (4 * points[0]).astype(int) + 4 * (4 * points[1]).astype(int)
    assert (np.sort(cells, axis=1) == np.arange(16)).all()


def test_the_sequence_begins_alike_whatever_its_length() -> None:
    np.testing.assert_array_equal(sobol(3), sobol(256)[:, :3])
    assert sobol(1).tolist() == [[0]] * 4
    assert sobol(2)[:, 1].tolist() == [1 << 31] * 4


@pytest.mark.parametrize("spp", [1, 4, 32])
def test_error_bars_of_stratified_samples_are_honest(make_scene: MakeScene, mi: ModuleType, spp: int) -> None:
    """Over many repetitions, the spread of 16 accumulators tells how far off their mean is, and the mean is right."""
    scene = make_scene(sensor=lens_at() | {"width": 24, "height": 18}, materials={"black": BLACK}, **CARDS)
    stage, render = staged(mi, scene), render_of(scene)
    truth = blocks(stage, render, 512, 16).mean(axis=0)
    repetitions = max(32, 256 // spp)
    pixels = np.tile(np.arange(24 * 18), 16 * repetitions)
    images = render(stage, pixels, seed_of("bars", spp), spp, None).reshape(repetitions, 16, 18, 24, 3)
    said = (images.var(axis=1, ddof=1) / 16).mean(axis=0)
    spread = images.mean(axis=1).var(axis=0, ddof=1)
    assert spread.mean() == pytest.approx(said.mean(), rel=0.65 / np.sqrt(repetitions))  # three standard errors
    means = images.mean(axis=(1, 2, 3))
    error = means.std(axis=0, ddof=1) / np.sqrt(repetitions)
    assert (np.abs(means.mean(axis=0) - truth.mean(axis=(0, 1))) < 5 * error).all()


def test_stratified_samples_are_less_noisy_than_independent_ones(make_scene: MakeScene, mi: ModuleType) -> None:
    """Sets of one point each, 64 of them a pixel, are independent samples."""
    scene = make_scene(sensor=lens_at() | {"width": 32, "height": 32}, materials={"black": BLACK}, **CARDS)
    stage, render = staged(mi, scene), render_of(scene)
    pixels = np.repeat(np.arange(32 * 32), 64)
    single = [render(stage, pixels, seed_of("single", k), 1, None).reshape(-1, 64, 3).mean(axis=1) for k in range(8)]
    independent = np.var(single, axis=0, ddof=1).mean()
    assert blocks(stage, render, 64).var(axis=0, ddof=1).mean() < 0.7 * independent
