"""Light scattered inside bodies against closed forms, plane-parallel theory and Mitsuba's volumetric paths."""

from collections.abc import Callable
from types import ModuleType
from typing import Any

import numpy as np
import pytest

from reference.estimator import Reference, seed_of
from reference.quantities import quantity
from reference.quantities.translucency import medium_paths_block
from reference.slab import slab_bsdf
from reference.stage import Stage, build_stage
from scenes.errors import SceneError
from scenes.features import features_of
from scenes.geometry import geometry_of
from scenes.image import Float64
from scenes.materials import Translucent
from scenes.media import coefficients
from scenes.model import Scene

MakeScene = Callable[..., Scene]
MakeReference = Callable[..., Reference]
TRANSMITTED = "transmitted_radiance"

STANDARD_ERRORS = 5
"""Known from 16 estimates, they are exceeded by chance in about one of five thousand comparisons."""

BLOCKS = 16
SENSOR = {"type": "perspective", "origin": [0.0, 0.0, 120.0], "target": [0.0, 0.0, 0.0], "fov_deg": 3.0}
SKIN = {"type": "translucent", "medium": "skin1"}
BODY = {"name": "ball", "material": "skin"}
BALL = BODY | {"type": "sphere", "radius": 6.0, "detail": 4}
SLAB = BODY | {"type": "slab", "thickness": 0.5, "width": 200.0}
FINGER = BODY | {"name": "finger", "type": "capsule", "radius": 3.0, "length": 12.0, "detail": 32}
BEHIND = {"type": "directional", "direction": [0.0, 0.0, 1.0], "irradiance": [3.0, 3.0, 3.0]}
SKY = {"type": "constant", "radiance": [2.0, 1.0, 0.5]}


@pytest.fixture
def bodies(make_scene: MakeScene) -> Callable[..., Scene]:
    """A scene in mm whose shapes are all its subject."""

    def make(*shapes: dict[str, Any], **overrides: Any) -> Scene:
        base = {
            "length_unit": "mm",
            "sensor": SENSOR | {"width": 8, "height": 8},
            "materials": {"skin": SKIN},
            "shapes": shapes,
            "subject": [shape["name"] for shape in shapes],
            "emitters": [BEHIND],
        }
        return make_scene(**(base | overrides))

    return make


def paths(stage: Stage, spp: int, block: Callable[..., Float64] = medium_paths_block) -> Float64:
    """Independent estimates of the whole image, (BLOCKS, P, 3)."""
    pixels = np.tile(np.arange(stage.width * stage.height), BLOCKS)
    return block(stage, pixels, seed_of("test", spp), spp, None).reshape(BLOCKS, -1, 3)


def volpathmis_block(stage: Stage, pixels: Any, seed: int, spp: int, clamp: float | None) -> Float64:
    """The same by Mitsuba's integrator, which adds light that passes straight through."""
    import drjit as dr

    mi = stage.mi
    sampler = mi.load_dict({"type": "independent"})
    sampler.seed(seed, len(pixels) * spp)
    x = mi.Float(np.repeat((pixels % stage.width).astype(np.float32), spp))
    y = mi.Float(np.repeat((pixels // stage.width).astype(np.float32), spp))
    jitter = sampler.next_2d()
    ray = mi.RayDifferential3f(stage.rays(x + jitter.x, y + jitter.y))
    integrator = mi.load_dict({"type": "volpathmis", "max_depth": -1, "rr_depth": 32})
    found, _, _ = integrator.sample(stage.scene, sampler, ray, None, mi.Bool(True))
    return np.stack([dr.block_sum(c, spp).numpy().astype(np.float64) for c in found], axis=-1) / spp


def stage_of(mi: ModuleType, scene: Scene) -> Stage:
    return build_stage(mi, scene, geometry_of(scene))


def assert_agree(one: Float64, other: Float64, most: float) -> None:
    """Means over the image of independent estimates (K, P, 3), or one exact image (P, 3), differ by noise only.

    Four standard errors must be less than a relative difference of `most`, so that more would be seen.
    """
    means = [estimates.mean(axis=-2) for estimates in (one, other)]
    centres = [mean.mean(axis=0) if mean.ndim == 2 else mean for mean in means]
    errors = [mean.std(axis=0, ddof=1) / np.sqrt(len(mean)) if mean.ndim == 2 else 0 * mean for mean in means]
    error = np.hypot(*errors)
    assert (4 * error < most * centres[1]).all(), f"too noisy to tell: {error / centres[1]}"
    apart = (centres[0] - centres[1]) / error
    assert (np.abs(apart) < STANDARD_ERRORS).all(), f"{apart} standard errors between {centres[0]} and {centres[1]}"


LIGHTS = {
    "behind": [BEHIND],
    "in front, oblique": [BEHIND | {"direction": [0.5, -0.3, -0.8], "irradiance": [1.0, 2.0, 3.0]}],
    "both sides": [BEHIND | {"direction": [0.3, 0.4, 0.9]}, BEHIND | {"direction": [0.0, 0.6, -0.8]}],
}


@pytest.mark.parametrize("lights", LIGHTS)
def test_paths_in_a_slab_are_what_adding_and_doubling_gives(
    lights: str, bodies: Callable[..., Scene], reference: MakeReference, mi: ModuleType
) -> None:
    scene = bodies(SLAB | {"rotation_deg": [20.0, -35.0, 0.0], "scale": 1.5}, emitters=LIGHTS[lights])
    truth = reference(scene).truth(TRANSMITTED, 64)
    assert truth.integrator.name == "adding and doubling"
    assert truth.is_exact
    assert truth.mask.all()
    exact = truth.accumulators[0].reshape(-1, 3).astype(np.float64)
    assert_agree(paths(stage_of(mi, scene), 512), exact, most=0.01)


def test_a_thick_slab(bodies: Callable[..., Scene], reference: MakeReference, mi: ModuleType) -> None:
    """4 mm, where blue light is a thousand times weaker than red."""
    scene = bodies(SLAB | {"thickness": 4.0})
    exact = reference(scene).truth(TRANSMITTED, 64).accumulators[0].reshape(-1, 3).astype(np.float64)
    assert_agree(paths(stage_of(mi, scene), 256), exact, most=0.04)


def test_a_slab_is_exact_at_every_pixel(bodies: Callable[..., Scene], reference: MakeReference) -> None:
    """T(mu, mu0) mu0 E behind, R in front; the middle of the image is seen at the angle at which the slab stands."""
    thin = SENSOR | {"fov_deg": 0.01, "width": 1, "height": 1}
    sigma_a, sigma_s = coefficients(Translucent(type="translucent", medium="skin1"), "mm")
    mu = np.array([np.cos(np.radians(30))])
    for sign, which in ((1, 1), (-1, 0)):
        light = BEHIND | {"direction": [0.0, 0.0, float(sign)]}
        scene = bodies(SLAB | {"rotation_deg": [0.0, 30.0, 0.0]}, sensor=thin, emitters=[light])
        found = reference(scene).truth(TRANSMITTED, 64).accumulators[0, 0, 0]
        kernels = [
            slab_bsdf(s / (s + a), 0.5 * (s + a), mu, mu)[which][0, 0] for a, s in zip(sigma_a, sigma_s, strict=True)
        ]
        np.testing.assert_allclose(found, 3 * mu[0] * np.array(kernels), rtol=1e-5)


@pytest.mark.parametrize(("width", "distance"), [(5.0, 120.0), (200.0, 0.1)])
def test_a_slab_that_ends_in_the_image_or_holds_the_camera_is_refused(
    width: float, distance: float, bodies: Callable[..., Scene], reference: MakeReference
) -> None:
    scene = bodies(SLAB | {"width": width}, sensor=SENSOR | {"width": 8, "height": 8, "origin": [0.0, 0.0, distance]})
    with pytest.raises(SceneError, match="sees an end or the inside; allowed is one that fills the image"):
        reference(scene).truth(TRANSMITTED, 64)


def test_light_along_a_slab_does_not_enter_it(bodies: Callable[..., Scene], reference: MakeReference) -> None:
    along = BEHIND | {"direction": [1.0, 0.0, 0.0]}
    assert not reference(bodies(SLAB, emitters=[along])).truth(TRANSMITTED, 64).accumulators.any()


WHITE_MEDIA: dict[str, dict[str, Any]] = {
    "skin": {"type": "translucent", "sigma_a": [0.0, 0.0, 0.0], "sigma_s": [0.1, 0.4, 0.9]},
    "milk": {"type": "translucent", "sigma_a": [0.0, 0.0, 0.0], "sigma_s": [0.9, 0.2, 0.0]},
}
FURNACES: dict[str, list[dict[str, Any]]] = {
    "a ball": [BALL],
    "two bodies of two media": [
        FINGER | {"rotation_deg": [0.0, 0.0, 40.0]},
        BALL | {"radius": 5.0, "position": [0.0, 1.0, -9.0], "material": "milk"},
    ],
    "a ring": [BODY | {"type": "torus", "radius": 5.0, "tube": 2.0, "rotation_deg": [75.0, 20.0, 0.0]}],
    "a membrane far from the origin": [SLAB | {"thickness": 0.3, "width": 20.0, "position": [300.0, 0.0, 0.0]}],
}


@pytest.mark.parametrize("name", FURNACES)
def test_a_white_furnace(name: str, bodies: Callable[..., Scene], reference: MakeReference, mi: ModuleType) -> None:
    """Bodies that absorb nothing vanish under a constant sky L: what is scattered is L less what passes straight.

    That is L (1 - exp(-sum of sigma_s l)) with l the length of the ray in each body.
    """
    shapes = FURNACES[name]
    at = shapes[0].get("position", [0.0, 0.0, 0.0])
    sensor = SENSOR | {"width": 8, "height": 8, "origin": [at[0], 0.0, 120.0], "target": at}
    looks = {"sensor": sensor, "materials": WHITE_MEDIA, "emitters": [SKY]}
    scene = bodies(*shapes, **looks)
    depth = np.zeros((64 * 64, 3))
    fine = looks | {"sensor": sensor | {"width": 64, "height": 64}}
    for shape in shapes:
        one = bodies(*shapes, **(fine | {"subject": [shape["name"]]}))
        length = reference(one).truth("thickness", 64).accumulators[0].reshape(-1, 1).astype(np.float64)
        depth += length * np.array(WHITE_MEDIA[shape["material"]]["sigma_s"])
    exact = np.array(SKY["radiance"]) * -np.expm1(-depth)
    assert_agree(paths(stage_of(mi, scene), 256), exact, most=0.04)


PALE = {"type": "translucent", "sigma_a": [0.01, 0.05, 0.1], "sigma_s": [0.2, 0.3, 0.4]}
PEA = BALL | {"name": "pea", "radius": 4.0}
POINT = {"type": "point", "position": [12.0, 4.0, -5.0], "intensity": [90.0, 90.0, 90.0]}
AGAINST_MITSUBA: dict[str, tuple[list[dict[str, Any]], list[dict[str, Any]]]] = {
    "a ball": ([PEA], [BEHIND]),
    "two bodies": ([PEA | {"position": [1.0, 0.0, -8.0]}, FINGER], [BEHIND]),
    "a wedge": ([BODY | {"type": "wedge", "size": [10.0, 10.0], "thin": 0.3, "thick": 0.7}], [BEHIND]),
    "a point light": ([PEA], [POINT]),
    "a disk": (
        [PEA],
        [
            {
                "type": "disk",
                "position": [14.0, 0.0, -6.0],
                "normal": [-14.0, 0.0, 6.0],
                "radius": 5.0,
                "radiance": [5.0, 5.0, 5.0],
            }
        ],
    ),
    "a line": (
        [FINGER],
        [
            {
                "type": "line",
                "start": [6.0, -9.0, -3.0],
                "end": [6.0, 9.0, -3.0],
                "radius": 0.2,
                "radiance": [50.0, 50.0, 50.0],
            }
        ],
    ),
}


IN_THE_DAILY_RUN = ("two bodies", "a disk")


@pytest.mark.parametrize(
    "name",
    [name if name in IN_THE_DAILY_RUN else pytest.param(name, marks=pytest.mark.slow) for name in AGAINST_MITSUBA],
)
def test_the_same_as_mitsuba(name: str, bodies: Callable[..., Scene], mi: ModuleType) -> None:
    """No emitter is seen through a body here: Mitsuba would count it. The bodies are thin, as its paths are noisy."""
    shapes, lights = AGAINST_MITSUBA[name]
    stage = stage_of(mi, bodies(*shapes, materials={"skin": PALE}, emitters=lights))
    assert_agree(paths(stage, 128), paths(stage, 192, volpathmis_block), most=0.06)


def test_what_faces_away_hides_the_light_behind_it(bodies: Callable[..., Scene], reference: MakeReference) -> None:
    """A disk that shines away from the body, between it and the sun."""
    disk = {
        "type": "disk",
        "position": [0.0, 0.0, -20.0],
        "normal": [0.0, 0.0, -1.0],
        "radius": 30.0,
        "radiance": [1.0, 1.0, 1.0],
    }
    truth = reference(bodies(BALL, emitters=[BEHIND, disk])).truth(TRANSMITTED, 64)
    assert truth.integrator.block is not None
    assert not truth.accumulators.any()


def test_a_lamp_in_a_body_shines_through_it(bodies: Callable[..., Scene], mi: ModuleType) -> None:
    """In the middle of a ball that absorbs alone, of radius 3: exp(-3 sigma_a) of its light leaves that."""
    sigma_a, place = np.array([0.1, 0.3, 0.6]), [0.0, 9.0, -6.0]
    clear = {"type": "translucent", "sigma_a": sigma_a.tolist(), "sigma_s": [0.0, 0.0, 0.0]}
    glass = BALL | {"name": "glass", "material": "clear", "radius": 3.0, "position": place, "detail": 5}
    looks = {"materials": {"skin": PALE, "clear": clear}, "emitters": [POINT | {"position": place}]}
    free, dimmed = (paths(stage_of(mi, bodies(*shapes, **looks)), 128) for shapes in ([PEA], [PEA, glass]))
    assert_agree(dimmed, free * np.exp(-3 * sigma_a), most=0.05)


def test_a_clamp_only_divides(bodies: Callable[..., Scene], mi: ModuleType) -> None:
    """The same paths with and without: what is kept and what is removed add up."""
    stage = stage_of(mi, bodies(BALL))
    pixels = np.arange(64)
    free = medium_paths_block(stage, pixels, 7, 16, None)
    clamped = medium_paths_block(stage, pixels, 7, 16, 0.05)
    np.testing.assert_allclose(clamped[:, :3] + clamped[:, 3:], free, rtol=1e-5, atol=1e-9)
    assert clamped[:, 3:].sum() > 0
    assert clamped[:, :3].max() <= 0.05


def test_without_light_it_is_dark(bodies: Callable[..., Scene], reference: MakeReference) -> None:
    truth = reference(bodies(BALL, emitters=[])).truth(TRANSMITTED, 64)
    assert truth.is_exact
    assert not truth.accumulators.any()


@pytest.mark.parametrize(
    ("shapes", "lights", "expected"),
    [
        ([SLAB], [BEHIND], "adding and doubling"),
        ([SLAB], [BEHIND, SKY], "path tracing in media"),
        ([SLAB, BALL | {"name": "two"}], [BEHIND], "path tracing in media"),
        ([BALL], [BEHIND], "path tracing in media"),
        ([BALL], [], "closed form: 0"),
    ],
)
def test_the_cheapest_way_that_suffices(
    shapes: list[dict[str, Any]], lights: list[dict[str, Any]], expected: str, bodies: Callable[..., Scene]
) -> None:
    scene = bodies(*shapes, emitters=lights)
    integrator = quantity(TRANSMITTED).integrator(features_of(scene, geometry_of(scene)))
    assert integrator.name == expected
    assert integrator.why


def test_it_is_refused_where_it_is_not_defined(bodies: Callable[..., Scene], reference: MakeReference) -> None:
    grey = {"type": "diffuse", "reflectance": [0.5, 0.5, 0.5]}
    materials = {"skin": SKIN, "grey": grey}
    solid = bodies(BALL | {"material": "grey"}, materials=materials)
    with pytest.raises(SceneError, match="not all of the subject is translucent"):
        reference(solid).truth(TRANSMITTED, 64)
    wall = {"name": "wall", "type": "rectangle", "size": [9.0, 9.0], "material": "grey", "position": [0.0, 0.0, -30.0]}
    beside = bodies(BALL, materials=materials, shapes=[BALL, wall])
    with pytest.raises(SceneError, match="besides the subject"):
        reference(beside).truth(TRANSMITTED, 64)
