"""The radiance of the translucency techniques: against slabs solved by adding-doubling, in limits, and in each trap."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from scipy.special import expn

from realtime.backlight import ELEMENT, backlights, beam, subject_medium
from realtime.face_lists import light_view
from realtime.lights import POINT, Light
from realtime.ordinates import LEVEL_SYMMETRIC, chebyshev, largest_eigenvalue, level_symmetric
from realtime.render import Renderer, Rendering
from realtime.slab import layers_of, normal_albedo, slab_table
from realtime.techniques.translucency_additive import TECHNIQUES as ADDITIVE
from realtime.techniques.translucency_ordinates import TECHNIQUES as ORDINATES
from realtime.techniques.translucency_talk import TECHNIQUES as TALK
from realtime.techniques.translucency_talk import longest_useful, lookup, sigma_eff, talk_lights, view_plane_point
from scenes.errors import InputError, RenderError
from scenes.geometry import geometry_of
from scenes.image import Float32, Float64
from scenes.model import Scene

MakeScene = Callable[..., Scene]
TECHNIQUES = {**TALK, **ADDITIVE, **ORDINATES}
RADIANCE = ["translucency.talk", "translucency.additive", "translucency.ordinates"]
SIGMA_A, SIGMA_S = np.array([0.032, 0.17, 0.48]), np.array([0.74, 0.88, 1.01])
COARSE: dict[str, Any] = {"cells": 8, "iterations": 4, "light_side": 512}
"""Settings of translucency.ordinates for tests that do not look at its accuracy."""


def sun(degrees: float, irradiance: float = 1.0) -> dict[str, Any]:
    """Parallel light from behind, turned about y."""
    direction = [float(np.sin(np.radians(degrees))), 0.0, float(np.cos(np.radians(degrees)))]
    return {"type": "directional", "direction": direction, "irradiance": [irradiance] * 3}


def layer(thickness: float, z: float = 0.0, name: str = "layer") -> dict[str, Any]:
    """Wider than light spreads in 100 mm of skin, and than any padding."""
    return {"type": "slab", "name": name, "thickness": thickness, "width": 400.0, "position": [0.0, 0.0, z]}


BALL = {"type": "sphere", "name": "ball", "radius": 5.0, "detail": 4}


@pytest.fixture
def lit(make_scene: MakeScene) -> MakeScene:
    """Makes a scene of skin, in millimetres, seen along -z from 120 mm, `extent` mm across."""

    def make(shapes: list[dict[str, Any]], *lights: dict[str, Any], extent: float = 12.0, **overrides: Any) -> Scene:
        sensor = {
            "type": "perspective",
            "origin": [0.0, 0.0, 120.0],
            "target": [0.0, 0.0, 0.0],
            "fov_deg": float(2 * np.degrees(np.arctan(extent / 240))),
            "width": 12,
            "height": 10,
        }
        return make_scene(
            **{
                "length_unit": "mm",
                "subject": [s["name"] for s in shapes],
                "shapes": [{"material": "skin"} | s for s in shapes],
                "materials": {"skin": {"type": "translucent", "medium": "skin1"}},
                "emitters": list(lights),
                "sensor": sensor,
            }
            | overrides
        )

    return make


def rendered(scene: Scene, name: str, **settings: Any) -> Rendering:
    return Renderer(scene).render(TECHNIQUES[name], settings, timed=False)


def drawn(scene: Scene, name: str, **settings: Any) -> Float32:
    return rendered(scene, name, **settings).image.pixels


def slab_radiance(thickness: float, degrees: float, reflected: bool = False) -> Float64:
    """Along the normal of a slab of skin, of a beam of irradiance 1 at an angle to the normal, by adding-doubling."""
    cosine = float(np.cos(np.radians(degrees)))
    found = []
    for sigma_t, sigma_s in zip(SIGMA_A + SIGMA_S, SIGMA_S, strict=True):
        layers, _, _ = layers_of(np.array([sigma_t * thickness]), sigma_s / sigma_t, np.array([cosine, 1.0]))
        kernel = layers.reflected if reflected else layers.transmitted
        found.append(kernel[0, -1, -2] * cosine / np.pi)
    return np.array(found)


def middle(image: Float32) -> Float64:
    """Mean of the four pixels in the middle, where the camera looks along its axis to half a degree."""
    height, width, _ = image.shape
    mean: Float64 = image[height // 2 - 1 : height // 2 + 1, width // 2 - 1 : width // 2 + 1].mean(
        axis=(0, 1), dtype=float
    )
    return mean


@pytest.mark.parametrize("thickness", [0.3, 2.0, 8.0])
@pytest.mark.parametrize("degrees", [0.0, 30.0, 60.0])
def test_the_additive_technique_is_adding_doubling_on_a_slab(lit: MakeScene, thickness: float, degrees: float) -> None:
    """V.L differs from the angle of incidence by what perspective takes; off the table's nodes .5 % is the budget."""
    made = middle(drawn(lit([layer(thickness)], sun(degrees)), "translucency.additive"))
    np.testing.assert_allclose(made, slab_radiance(thickness, degrees), rtol=1e-2)


@pytest.mark.parametrize("degrees", [150.0, 180.0])
def test_light_in_front_is_reflected_as_by_a_slab(lit: MakeScene, degrees: float) -> None:
    made = middle(drawn(lit([layer(2.0)], sun(degrees)), "translucency.additive"))
    np.testing.assert_allclose(made, slab_radiance(2.0, 180 - degrees, reflected=True), rtol=1e-2)


def test_a_slab_that_fills_the_frame_loses_nothing_at_its_borders(lit: MakeScene) -> None:
    """The coverage blur reaches 5.6 mm past a frame of 12 mm; what lies there is seen by the padded mask."""
    scene = lit([layer(8.0)], sun(0.0))
    blurred, plain = (drawn(scene, "translucency.additive", spread=s) for s in (0.7, 0.0))
    np.testing.assert_allclose(blurred, plain, rtol=1e-3)


def test_the_coverage_blur_darkens_what_has_an_edge_nearby(lit: MakeScene) -> None:
    """Of a Gaussian of .7 x 10 mm about the middle of a disk of 5 mm, 1 - exp(-25 / 98) = 22.5 % is inside it."""
    scene = lit([BALL], sun(0.0))
    blurred, plain = (middle(drawn(scene, "translucency.additive", spread=s)) for s in (0.7, 0.0))
    np.testing.assert_allclose(blurred / plain, 0.225, atol=0.03)


@pytest.mark.parametrize("gap", [2.0, 10.0])
def test_light_that_comes_through_a_far_layer_is_diffuse(lit: MakeScene, gap: float) -> None:
    """Two slabs are as one of twice the thickness, whatever the gap, as they are infinitely wide.

    Expect a quarter less in red: what the two reflect between them is lost.
    """
    scene = lit([layer(1.0, gap / 2, "near"), layer(1.0, -gap / 2, "far")], sun(0.0))
    made, exact = middle(drawn(scene, "translucency.additive")), slab_radiance(2.0, 0.0)
    np.testing.assert_allclose(made, exact, rtol=0.25)


@pytest.mark.parametrize(("thickness", "degrees"), [(0.5, 30.0), (3.0, 0.0), (3.0, 60.0), (3.0, 180.0), (8.0, 30.0)])
def test_ordinates_solve_a_slab(lit: MakeScene, thickness: float, degrees: float) -> None:
    """Within 3 % of adding-doubling, whatever the light's angle; what is a thousandth as bright may be worse.

    In a membrane most of what is scattered again travels along it, where there are few directions: 6 %.
    """
    scene = lit([layer(thickness)], sun(degrees))
    made = middle(drawn(scene, "translucency.ordinates", order=6, cells=16 if thickness < 8 else 32, light_side=256))
    exact = slab_radiance(thickness, min(degrees, 180 - degrees), reflected=degrees > 90)
    np.testing.assert_allclose(made, exact, rtol=0.03 if thickness > 1 else 0.06, atol=1e-3 * exact.max())


@pytest.mark.parametrize("degrees", [0.0, 50.0])
def test_single_scattering_is_exact(lit: MakeScene, degrees: float) -> None:
    """sigma_s times the integral over depth of exp(-sigma_t (x + (d - x) / cosine)) / (4 pi), for parallel light."""
    made = drawn(lit([layer(2.0)], sun(degrees), extent=1.0), "translucency.ordinates", iterations=0)
    x = (np.arange(400)[:, None] + 0.5) / 200
    attenuated = np.exp(-(SIGMA_A + SIGMA_S) * (x + (2 - x) / np.cos(np.radians(degrees))))
    np.testing.assert_allclose(middle(made), SIGMA_S * 2 * attenuated.mean(axis=0) / (4 * np.pi), rtol=5e-3)


@pytest.mark.slow
def test_a_white_body_in_uniform_light_all_but_vanishes(lit: MakeScene) -> None:
    """Furnace: what is scattered should replace what is taken from the light behind, 1 - exp(-sigma_t d) of it.

    The grid blurs the surface by a cell, through which light that is never absorbed leaks: at ten mean free paths
    across, 5 % for 32 cells, and almost twice as much for 16. Nothing is gained.
    """
    sigma_s = np.array([0.1, 0.3, 1.0])
    white = {"skin": {"type": "translucent", "sigma_a": [0.0] * 3, "sigma_s": sigma_s.tolist()}}
    sky = [
        {"type": "directional", "direction": row[:3].tolist(), "irradiance": [float(4 * np.pi * row[3])] * 3}
        for row in level_symmetric(6)
    ]
    scene = lit([BALL], *sky, materials=white, extent=6.0)
    taken = 1 - np.exp(-sigma_s * drawn(scene, "translucency.additive_thickness"))
    coarse, fine = (
        (drawn(scene, "translucency.ordinates", light_side=128, cells=cells) / taken).mean(axis=(0, 1))
        for cells in (16, 32)
    )
    assert (fine > [0.99, 0.97, 0.94]).all()
    assert (fine < 1).all()
    assert (1 - coarse > 1.5 * (1 - fine)).all()


@pytest.mark.parametrize("order", LEVEL_SYMMETRIC)
def test_directions_average_as_a_sphere_does(order: int) -> None:
    """Mean of 1, x², x⁴ and x² y² over the sphere: 1, 1/3, 1/5 and, for the higher sets, 1/15."""
    x, y, z, weight = level_symmetric(order).astype(float).T
    assert len(x) == order * (order + 2)
    np.testing.assert_allclose(x * x + y * y + z * z, 1, rtol=1e-6)
    np.testing.assert_allclose([weight.sum(), *(weight @ c**2 for c in (x, y, z))], [1, 1 / 3, 1 / 3, 1 / 3], rtol=1e-6)
    if order > 4:
        np.testing.assert_allclose([weight @ x**4, weight @ (x * y) ** 2], [1 / 5, 1 / 15], rtol=1e-6)


@pytest.mark.parametrize("largest", [0.5, 0.9, 0.99])
def test_chebyshev_needs_far_fewer_steps_than_plain_iteration(largest: float) -> None:
    """On the fixed point x = m x + 1 for every m up to the largest, after 16 steps."""
    m = np.linspace(0, largest, 50)
    damping, omegas = chebyshev(np.full(1, largest), 16)
    now, before, plain = np.zeros(50), np.zeros(50), np.zeros(50)
    for omega in omegas:
        now, before = before + omega * (damping * (m * now + 1 - now) + now - before), now
        plain = m * plain + 1
    error, plain_error = (np.abs((x - 1 / (1 - m)) * (1 - m)).max() for x in (now, plain))
    root = np.sqrt(1 - largest)
    assert error <= 2.1 * ((1 - root) / (1 + root)) ** 16
    assert error < 0.3 * plain_error


@pytest.mark.parametrize(("depth", "excess"), [(0.5, 0.2), (2.0, 0.06), (10.0, 2e-3)])
def test_the_largest_eigenvalue_of_a_slab_is_that_of_milnes_kernel(depth: float, excess: float) -> None:
    """A box that is wide in two directions. In thin slabs, which converge at once, the estimate is too high."""
    edges = np.linspace(0, depth, 301)
    distance = edges - (edges[1:, None] + edges[:-1, None]) / 2
    kernel = 0.5 * np.diff(np.sign(distance) * (1 - expn(2, np.abs(distance))), axis=1)
    exact = np.abs(np.linalg.eigvals(kernel)).max()
    made = largest_eigenvalue(np.array([1.0, 0.9]), np.array([[1e4, depth, 1e4]] * 2))
    assert exact - 2e-3 < made[0] < exact + excess
    assert made[1] == pytest.approx(0.9 * made[0])


@pytest.mark.parametrize("name", RADIANCE)
def test_a_scene_without_light_is_black(lit: MakeScene, name: str) -> None:
    assert drawn(lit([BALL]), name).max() == 0


def test_without_light_no_transport_is_solved(lit: MakeScene) -> None:
    skipped = rendered(lit([BALL]), "translucency.ordinates").skipped
    assert {s.what: s.why for s in skipped} == dict.fromkeys(
        ("content", "single scattering", "ordinates", "gather"), "no emitter: nothing is lit"
    )


@pytest.mark.parametrize("name", RADIANCE)
def test_a_channel_in_which_the_medium_is_clear_is_black(lit: MakeScene, name: str) -> None:
    clear = {"skin": {"type": "translucent", "sigma_a": [0.0, 0.2, 0.2], "sigma_s": [0.0, 1.0, 1.0]}}
    settings = COARSE if name == "translucency.ordinates" else {}
    made = drawn(lit([BALL], sun(0.0), materials=clear), name, **settings)
    assert made[..., 1].max() > 0
    assert made[..., 0].max() < 1e-20


@pytest.mark.parametrize("name", RADIANCE)
def test_twice_the_light_is_twice_the_radiance(lit: MakeScene, name: str) -> None:
    settings = COARSE if name == "translucency.ordinates" else {}
    dim, bright = (drawn(lit([BALL], sun(20.0, e)), name, **settings) for e in (1.0, 2.0))
    assert dim.max() > 0
    np.testing.assert_allclose(bright, 2 * dim, rtol=1e-4)


@pytest.mark.parametrize("name", RADIANCE)
def test_lights_add_up(lit: MakeScene, name: str) -> None:
    point = {"type": "point", "position": [5.0, 4.0, -30.0], "intensity": [700.0, 500.0, 300.0]}
    settings = COARSE if name == "translucency.ordinates" else {}
    both, *single = (
        drawn(lit([BALL], *lights), name, **settings) for lights in ([sun(0.0), point], [sun(0.0)], [point])
    )
    np.testing.assert_allclose(both, single[0] + single[1], rtol=1e-4)


@pytest.mark.parametrize("name", RADIANCE)
@pytest.mark.parametrize("kind", ["point", "disk", "line"])
def test_a_light_far_away_is_parallel(lit: MakeScene, name: str, kind: str) -> None:
    """Each of them 5 m behind the subject, scaled to an irradiance of 1."""
    place = [0.0, 0.0, -5000.0]
    lamps: dict[str, dict[str, Any]] = {
        "point": {"type": "point", "position": place, "intensity": [5000.0**2] * 3},
        "disk": {
            "type": "disk",
            "position": place,
            "normal": [0.0, 0.0, 1.0],
            "radius": 5.0,
            "radiance": [5000.0**2 / (25 * np.pi)] * 3,
        },
        "line": {
            "type": "line",
            "start": [0.0, -5.0, -5000.0],
            "end": [0.0, 5.0, -5000.0],
            "radius": 0.5,
            "radiance": [5000.0**2 / 10] * 3,
        },
    }
    settings = COARSE | {"pieces": 4} if name == "translucency.ordinates" else {}
    made, expected = (middle(drawn(lit([BALL], light), name, **settings)) for light in (lamps[kind], sun(0.0)))
    np.testing.assert_allclose(made, expected, rtol=0.01)


def test_a_line_light_is_the_sum_of_its_pieces(lit: MakeScene) -> None:
    """On the axis of symmetry of a thin tube: E = 2 r L (angle + sin(angle) cos(angle)) / h, half its angle."""
    line = {
        "type": "line",
        "start": [0.0, -30.0, -40.0],
        "end": [0.0, 30.0, -40.0],
        "radius": 0.5,
        "radiance": [2.0] * 3,
    }
    scene = lit([BALL], line)
    elements = backlights(scene, geometry_of(scene), 64)
    assert {e.kind for e in elements} == {ELEMENT}
    flux = np.sum([np.outer(*beam(e, np.zeros(3))) for e in elements], axis=0)
    angle = np.arctan(30 / 40)
    np.testing.assert_allclose(flux[2], 2 * 0.5 * 2 * (angle + np.sin(angle) * np.cos(angle)) / 40, rtol=1e-3)
    np.testing.assert_allclose(flux[:2], 0, atol=1e-9)


def test_the_plasma_line_shines_from_where_it_meets_the_view_plane(lit: MakeScene) -> None:
    line = {
        "type": "line",
        "start": [3.0, -30.0, -40.0],
        "end": [7.0, 10.0, -40.0],
        "radius": 0.5,
        "radiance": [2.0] * 3,
    }
    scene = lit([BALL], line)
    ((place, color),) = talk_lights(scene, geometry_of(scene), np.zeros(3))
    np.testing.assert_allclose(place, (6.0, 0.0, -40.0, 1.0))
    assert color.min() > 0
    start, end = np.array([0.0, 5.0, 0.0]), np.array([4.0, 5.0, 0.0])
    np.testing.assert_allclose(view_plane_point(start, end, 0.0), [2, 5, 0])


def test_the_talk_is_lambert_where_the_light_is_in_front(lit: MakeScene) -> None:
    """V.L < 0: the power of a negative number would be NaN, and Renderer refuses an image with one."""
    made = middle(drawn(lit([layer(2.0)], sun(180.0)), "translucency.talk", power=0.5))
    np.testing.assert_allclose(made, normal_albedo(SIGMA_S / (SIGMA_A + SIGMA_S)) / np.pi, rtol=1e-4)


@pytest.mark.parametrize(("name", "tolerance"), [("beer_lambert", 2e-2), ("slab", 2e-2)])
def test_the_talk_looks_its_colour_up_by_thickness(lit: MakeScene, name: str, tolerance: float) -> None:
    """With the light right behind. 256 texels over some 25 mm are .1 mm apart, between which they are straight."""
    made = middle(drawn(lit([layer(3.0)], sun(0.0)), "translucency.talk", lookup=name))
    beer = np.exp(-sigma_eff(SIGMA_A, SIGMA_S) * 3) / np.pi
    exact = slab_radiance(3.0, 0.0) if name == "slab" else beer
    np.testing.assert_allclose(made, exact, rtol=tolerance)


def test_eight_bits_would_lose_what_half_floats_keep() -> None:
    """Of the colours behind 0 to 8 mm: why the lookup is no 8-bit texture. Thick skin is dark."""
    colors = lookup("slab", SIGMA_A, SIGMA_S, 8.0)[16:]
    half = colors.astype(np.float16).astype(float)
    eight = np.round(colors / colors.max() * 255) / 255 * colors.max()
    assert np.abs(half / colors - 1).max() < 1e-3
    assert np.abs(eight / colors - 1).max() > 0.1


def test_a_lookup_ends_where_nothing_comes_through() -> None:
    assert longest_useful(10.0, SIGMA_A, SIGMA_S) == 10
    assert longest_useful(1e4, SIGMA_A, SIGMA_S) == pytest.approx(-np.log(1e-3) / sigma_eff(SIGMA_A, SIGMA_S)[0])
    assert longest_useful(1e4, np.zeros(3), SIGMA_S) == 1e4


def test_an_unknown_lookup_is_refused_with_the_known_ones(lit: MakeScene) -> None:
    with pytest.raises(InputError, match="'painted'; allowed: 'beer_lambert', 'slab'"):
        drawn(lit([BALL], sun(0.0)), "translucency.talk", lookup="painted")


@pytest.mark.parametrize("name", ["translucency.talk", "translucency.additive"])
def test_thickness_is_averaged_after_the_lookup(lit: MakeScene, name: str) -> None:
    """Half a pixel of 8 mm is half as bright as a whole one; a lookup of the mean, 4 mm, is far brighter."""
    block = {"type": "box", "name": "block", "size": [20.0, 200.0, 8.0], "position": [10.0, 0.0, 0.0]}
    scene = lit([block], sun(0.0), extent=24.0, sensor=lit([BALL]).sensor.model_dump(mode="json") | {"width": 11})
    settings = {"spread": 0.0} if name == "translucency.additive" else {"half_float": False}
    row = drawn(scene, name, **settings)[5]
    half, whole = row[5], row[8]
    assert (half < 0.6 * whole).all()
    assert (half > 0.3 * whole).all()
    averaged = slab_table(SIGMA_A, SIGMA_S, 20.0).transmission(np.array([4.0]), np.ones(1))[0]
    assert (averaged > 1.5 * half).all()


def test_one_layer_needs_no_nearest_layer(lit: MakeScene) -> None:
    skipped = {s.what: s.why for s in rendered(lit([BALL], sun(0.0)), "translucency.additive").skipped}
    assert skipped == {"nearest layer": "the subject is convex: a ray enters it once"}
    two = [BALL, BALL | {"name": "other", "position": [12.0, 0.0, 0.0]}]
    assert not rendered(lit(two, sun(0.0)), "translucency.additive").skipped


def test_skipping_the_nearest_layer_changes_nothing(lit: MakeScene) -> None:
    """A second ball outside the frame makes the pass run for a ball that is convex itself."""
    two = [BALL, BALL | {"name": "other", "position": [60.0, 0.0, 0.0]}]
    alone, beside = (drawn(lit(shapes, sun(0.0)), "translucency.additive") for shapes in ([BALL], two))
    np.testing.assert_allclose(alone, beside, rtol=2e-3)


@pytest.mark.parametrize("name", ["translucency.additive", "translucency.ordinates"])
def test_an_open_mesh_is_refused_unless_accepted(lit: MakeScene, sheet: dict[str, Any], name: str) -> None:
    scene = lit([sheet], sun(0.0))
    with pytest.raises(RenderError, match="allow_open = true"):
        drawn(scene, name)
    settings = COARSE if name == "translucency.ordinates" else {}
    assert np.isfinite(drawn(scene, name, allow_open=True, **settings)).all()


def test_more_layers_than_there_is_room_for_are_refused(lit: MakeScene) -> None:
    scene = lit([layer(0.5, 2.0 * i, f"layer-{i}") for i in range(3)], sun(0.0))
    with pytest.raises(RenderError, match=r"meets 6 faces .* Set layers to 3"):
        drawn(scene, "translucency.ordinates", layers=2, **COARSE)


def test_more_layers_than_memory_are_refused(lit: MakeScene) -> None:
    with pytest.raises(InputError, match="Lower layers, light_side"):
        drawn(lit([BALL], sun(0.0)), "translucency.ordinates", layers=32, light_side=4096)


def test_an_order_without_directions_is_refused(lit: MakeScene) -> None:
    with pytest.raises(InputError, match="'order' is 5; allowed: 4, 6, 8"):
        drawn(lit([BALL], sun(0.0)), "translucency.ordinates", order=5)


def test_a_light_inside_the_ball_around_the_subject_is_refused() -> None:
    light = Light(POINT, np.array([1.0, 0.0, 0.0]), np.zeros(3), np.ones(3), 0.0, 0)
    with pytest.raises(InputError, match="is 1 from the subject's centre, inside the ball of radius 5"):
        light_view(light, np.zeros(3), 5.0)


def test_a_light_sees_the_whole_subject() -> None:
    """The ball around it fills the light's frame, between its planes."""
    light = Light(POINT, np.array([1.0, 9.0, -4.0]), np.zeros(3), np.ones(3), 0.0, 0)
    view = light_view(light, np.array([2.0, 0.0, 1.0]), 5.0)
    rng = np.random.default_rng(4)
    v = rng.normal(size=(5000, 3))
    v *= 5 / np.linalg.norm(v, axis=1, keepdims=True)
    clip = np.hstack([v, np.ones((len(v), 1))]) @ view.centred_to_clip.T
    ndc = clip[:, :3] / clip[:, 3:]
    assert np.abs(ndc).max() == pytest.approx(1, abs=5e-3)


def test_only_translucent_subjects_of_one_medium_are_shaded(lit: MakeScene) -> None:
    materials = {
        "skin": {"type": "translucent", "medium": "skin1"},
        "wax": {"type": "translucent", "sigma_a": [0.1] * 3, "sigma_s": [1.0] * 3},
        "clay": {"type": "diffuse", "reflectance": [0.5] * 3},
    }
    other = BALL | {"name": "other", "position": [12.0, 0.0, 0.0]}
    with pytest.raises(InputError, match="of several media"):
        subject_medium(lit([BALL, other | {"material": "wax"}], materials=materials))
    with pytest.raises(InputError, match="'other' is of the material 'clay', which is diffuse"):
        subject_medium(lit([BALL, other | {"material": "clay"}], materials=materials))


def test_coefficients_go_by_the_unit_of_the_scene(lit: MakeScene) -> None:
    """The same ball in metres is as bright."""
    small = BALL | {"radius": 5e-3}
    sensor = lit([BALL]).sensor.model_dump(mode="json") | {"origin": [0.0, 0.0, 0.12]}
    made = [
        drawn(s, "translucency.additive")
        for s in (lit([BALL], sun(0.0)), lit([small], sun(0.0), length_unit="m", sensor=sensor))
    ]
    np.testing.assert_allclose(made[0], made[1], rtol=1e-3, atol=1e-6)
