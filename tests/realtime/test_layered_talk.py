"""The talk's suit: its formulas on grids, its layers one by one, and how its numbers are driven."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from realtime.looks import components
from realtime.render import Renderer
from realtime.techniques import technique
from realtime.techniques.layered_talk import SLIDERS, noise
from scenes.errors import InputError
from scenes.image import Float32, Float64
from scenes.model import Scene

Glsl = Callable[..., Float64]
Draw = Callable[..., Float32]
MakeScene = Callable[..., Scene]

PIGMENT = (0.3, 0.6, 0.1)
SENSOR = {
    "type": "perspective",
    "origin": [0.0, 0.0, 4.0],
    "target": [0.0, 0.0, 0.0],
    "fov_deg": 24.0,
    "width": 12,
    "height": 12,
}
WALL = {"name": "wall", "type": "rectangle", "size": [4.0, 4.0], "material": "suit"}
BALL = {"name": "ball", "type": "sphere", "radius": 0.8, "detail": 4, "material": "suit"}
SUN = {"type": "directional", "direction": [-0.3, -0.2, -1.0], "irradiance": [2.0, 3.0, 4.0]}
DARK = {
    "damping": 0.0,
    "layer1_diffuse": 0.0,
    "layer1_noise": 0.0,
    "layer2_alpha": 0.0,
    **{f"layer{k}_strength_{i}": 0.0 for k in (1, 2, 3) for i in (1, 2)},
    **{f"ramp_{i}": 0.0 for i in range(4)},
}
"""Everything switched off."""


@pytest.fixture
def suit(make_scene: MakeScene) -> MakeScene:
    """A scene with a wall that faces the sensor, or another shape, in one light."""

    def make(shape: dict[str, Any] = WALL, emitters: tuple[dict[str, Any], ...] = (SUN,), **material: Any) -> Scene:
        return make_scene(
            sensor=SENSOR,
            subject=[shape["name"]],
            materials={
                "suit": {"type": "layered" if "metals" in material else "diffuse", "reflectance": PIGMENT} | material
            },
            shapes=[shape],
            emitters=list(emitters),
        )

    return make


def half_vector_cosines(scene: Scene, toward: Float64) -> tuple[Float64, Float64]:
    """N.H and N.V at the middle of each pixel of the wall in a scene, each (H, W)."""
    sensor = scene.sensor
    side = np.tan(np.radians(sensor.fov_deg) / 2) * 4.0
    x, y = np.meshgrid((np.arange(12) + 0.5) / 6 - 1, 1 - (np.arange(12) + 0.5) / 6)
    v = np.stack([-side * x, -side * y, np.full_like(x, 4.0)], axis=-1)
    v /= np.linalg.norm(v, axis=-1, keepdims=True)
    h = v + toward
    return h[..., 2] / np.linalg.norm(h, axis=-1), v[..., 2]


def lobe(n: float, cosine: Float64) -> Float64:
    """A lobe that reflects all light that comes straight on."""
    return np.asarray((n + 2) / (8 * np.pi * (1 - 2 ** (-(n + 2) / 2))) * cosine**n)


def lobe_albedo(n: float, view: Float64) -> float:
    """The integral of (N.H)^n over the hemisphere of L, by Gauss's nodes in cos and even steps in angle."""
    nodes, weights = np.polynomial.legendre.leggauss(160)
    cosine, weights = (nodes + 1) / 2, weights / 2
    phi = (np.arange(160) + 0.5) * 2 * np.pi / 160
    sine = np.sqrt(1 - cosine**2)[:, None]
    light = np.stack([sine * np.cos(phi), sine * np.sin(phi), np.broadcast_to(cosine[:, None], (160, 160))], axis=-1)
    h = light + view
    n_dot_h = np.clip(h[..., 2] / np.linalg.norm(h, axis=-1), 0, 1)
    return float(np.sum((n_dot_h**n).mean(axis=1) * weights) * 2 * np.pi)


# Formulas


def test_a_raw_lobe_throws_back_more_than_what_arrives(glsl: Glsl) -> None:
    """1.12 at n = 16, and with the factor (n + 2) / 2 pi of a distribution of normals 3.9 at n = 128."""
    nodes, weights = np.polynomial.legendre.leggauss(400)
    cosine, weights = (nodes + 1) / 2, weights / 2
    inputs = np.zeros((len(cosine), 1, 4))
    inputs[:, 0, 0], inputs[:, 0, 2] = np.sqrt(1 - cosine**2), cosine
    body = (
        "vec3 N = vec3(0, 0, 1), L = a[0].xyz; r[0].xy = vec2(blinn_phong(N, L, N, 16.0), blinn_phong(N, L, N, 128.0));"
    )
    made = glsl("lib/blinn_phong.glsl", body, inputs)[:, 0, :2]
    broad, sharp = 2 * np.pi * (weights * cosine) @ made
    assert broad == pytest.approx(1.12, abs=0.005)
    assert 130 / (2 * np.pi) * sharp == pytest.approx(3.88, abs=0.01)


@pytest.mark.parametrize("n", [1.0, 8.0, 64.0, 512.0])
def test_a_normalised_lobe_throws_back_all_light_straight_on_and_less_at_other_angles(glsl: Glsl, n: float) -> None:
    inputs = np.full((1, 1, 4), n)
    factor = float(glsl("lib/blinn_phong.glsl", "r[0].x = blinn_phong_normalisation(a[0].x);", inputs)[0, 0, 0])
    albedos = [factor * lobe_albedo(n, np.array([np.sin(t), 0.0, np.cos(t)])) for t in np.radians([0, 20, 45, 70, 89])]
    assert albedos[0] == pytest.approx(1, abs=2e-5)
    assert max(albedos) <= 1 + 2e-5


def test_exponents_and_roughnesses_are_those_of_beckmanns_distribution(glsl: Glsl) -> None:
    """Nearly the same for sharp lobes, and far from it for broad ones: relative L2 of .14 at n = 4, .0003 at 2048."""
    theta = np.linspace(0, np.pi / 2, 4000)[:-1]
    weight = np.sin(theta) * np.cos(theta)

    def apart(n: float) -> float:
        body = "r[0] = vec4(alpha_of_exponent(a[0].x), exponent_of_alpha(alpha_of_exponent(a[0].x)), 0, 0);"
        alpha, back, _, _ = glsl("lib/blinn_phong.glsl", body, np.full((1, 1, 4), n))[0, 0]
        assert back == pytest.approx(n, rel=1e-4)
        blinn = (n + 2) / (2 * np.pi) * np.cos(theta) ** n
        beckmann = np.exp(-((np.tan(theta) / alpha) ** 2)) / (np.pi * alpha**2 * np.cos(theta) ** 4)
        return float(np.sqrt(np.sum(weight * (blinn - beckmann) ** 2) / np.sum(weight * beckmann**2)))

    assert apart(4) == pytest.approx(0.14, abs=0.02)
    assert apart(2048) < 1e-3


def test_of_all_roughnesses_ggx_is_nearest_at_a_little_less(glsl: Glsl) -> None:
    """The notes' .925, found again for a lobe of n = 100; what is left is a fifth."""
    theta = np.linspace(0, np.pi / 2, 4000)[:-1]
    weight, n = np.sin(theta) * np.cos(theta), 100.0
    alpha = np.sqrt(2 / (n + 2))
    blinn = (n + 2) / (2 * np.pi) * np.cos(theta) ** n

    def apart(part: float) -> float:
        a2 = (part * alpha) ** 2
        ggx = a2 / (np.pi * (np.sin(theta) ** 2 + a2 * np.cos(theta) ** 2) ** 2)
        return float(np.sqrt(np.sum(weight * (blinn - ggx) ** 2) / np.sum(weight * blinn**2)))

    parts = np.linspace(0.7, 1.3, 121)
    best = parts[np.argmin([apart(part) for part in parts])]
    assert best == pytest.approx(0.925, abs=0.006)
    assert apart(best) == pytest.approx(0.21, abs=0.03)
    body = "r[0].x = widened_exponent(a[0].x, a[0].y);"
    widened = glsl("lib/blinn_phong.glsl", body, np.array([[[n, 0.0, 0, 0]], [[n, 0.1, 0, 0]]]))[:, 0, 0]
    assert widened[0] == pytest.approx(n, rel=1e-4)
    assert np.sqrt(2 / (widened[1] + 2)) == pytest.approx(np.hypot(alpha, 0.1 / 0.925), rel=1e-4)


def test_cosines_that_rounding_left_out_of_range_make_no_nan_and_no_light_from_nowhere(glsl: Glsl) -> None:
    """pow(-0.1, 16) is undefined, and 1.0000001 to the 8192 is not 1: both are cut off before the power."""
    rng = np.random.default_rng(8192)
    n = rng.normal(size=(4096, 3))
    n = (n / np.linalg.norm(n, axis=1, keepdims=True)).astype(np.float32)
    inputs = np.zeros((4096, 2, 4))
    inputs[:, 0, :3], inputs[:, 1, :3] = n * np.float32(1 + 1e-7), -n
    body = (
        "r[0] = vec4(blinn_phong(a[0].xyz, a[0].xyz, a[0].xyz, 8192.0),"
        " blinn_phong(a[0].xyz, a[1].xyz, a[1].xyz, 16.0), 0, 0);"
    )
    made = glsl("lib/blinn_phong.glsl", body, inputs)[:, 0]
    assert np.isfinite(made).all()
    assert made[:, 0].max() <= 1
    assert made[:, 0].min() > 0.99
    assert (made[:, 1] == 0).all()


def test_the_ramp_of_schlicks_kind_follows_a_metals_fresnel_term_and_damping_undoes_it(glsl: Glsl) -> None:
    """The best cubic for chromium is .03 off. Damping takes it to 0 at the limb, where a metal reflects everything."""
    n_dot_v = np.linspace(0, 1, 200)
    eta = complex(2.9165, 4.2313)
    inside = np.sqrt(eta**2 - (1 - n_dot_v**2))
    s, p = (n_dot_v - inside) / (n_dot_v + inside), (eta**2 * n_dot_v - inside) / (eta**2 * n_dot_v + inside)
    fresnel = (np.abs(s) ** 2 + np.abs(p) ** 2) / 2
    k = np.linalg.lstsq(np.stack([(1 - n_dot_v) ** i for i in range(4)], axis=1), fresnel, rcond=None)[0]
    inputs = np.zeros((200, 2, 4))
    inputs[:, 0, 0], inputs[:, 1] = n_dot_v, k
    body = "float x = silhouette_ramp(a[0].x, a[1]); r[0] = vec4(x, x * silhouette_damping(a[0].x, 0.2), 0, 0);"
    ramp, damped = glsl("lib/suit_talk.glsl", body, inputs)[:, 0, :2].T
    assert np.sqrt(np.mean((ramp - fresnel) ** 2)) == pytest.approx(0.03, abs=0.003)
    assert np.abs(damped - fresnel).max() == pytest.approx(1, abs=0.01)
    assert np.sqrt(np.mean((damped - fresnel) ** 2)) > 0.15


# The technique


def test_layer_1_is_diffuse_light_and_two_lobes(suit: MakeScene, draw: Draw) -> None:
    scene = suit()
    toward = np.array([0.3, 0.2, 1.0]) / np.linalg.norm([0.3, 0.2, 1.0])
    n_dot_h, _ = half_vector_cosines(scene, toward)
    given = {"layer1_diffuse": 0.7, "layer1_strength_1": 0.2, "layer1_exponent_1": 9.0}
    given |= {"layer1_strength_2": 0.1, "layer1_exponent_2": 200.0, "layer1_red": 0.5, "layer1_blue": 2.0}
    made = draw(scene, "layered.talk", **DARK | given)
    diffuse = 0.7 / np.pi * np.array(PIGMENT) * toward[2]
    lobes = 0.2 * lobe(9.0, n_dot_h) + 0.1 * lobe(200.0, n_dot_h)
    truth = (diffuse + lobes[..., None] * [0.5, 1.0, 2.0]) * [2.0, 3.0, 4.0]
    np.testing.assert_allclose(made, truth, rtol=4e-3)  # a pixel is the mean of 16 places


def test_layers_lie_over_one_another_as_the_talk_has_it(suit: MakeScene, draw: Draw) -> None:
    """alpha * Layer 2 + (1 - alpha) * Layer 1, and the third in the same way over both."""
    scene = suit()
    below = draw(scene, "layered.talk", **DARK | {"layer1_diffuse": 1.0})
    lobe_2 = {"layer2_strength_1": 0.5, "layer2_exponent_1": 30.0}
    lobe_3 = {"layer3_strength_2": 0.5, "layer3_exponent_2": 10.0}
    second = draw(scene, "layered.talk", **DARK | lobe_2 | {"layer2_alpha": 1.0})
    third = draw(scene, "layered.talk", **DARK | lobe_3 | {"ramp_0": 1.0})
    every = {"layer1_diffuse": 1.0, "layer2_alpha": 0.4, "ramp_0": 0.3} | lobe_2 | lobe_3
    made = draw(scene, "layered.talk", **DARK | every)
    np.testing.assert_allclose(made, 0.3 * third + 0.7 * (0.4 * second + 0.6 * below), rtol=1e-4)


def test_the_silhouettes_layer_is_seen_at_grazing_angles_but_for_the_damping(suit: MakeScene, draw: Draw) -> None:
    """Of a ball lit from where it is seen: without damping the rim is brighter than the middle, with it dark."""
    light = ({"type": "directional", "direction": [0.0, 0.0, -1.0], "irradiance": [1.0, 1.0, 1.0]},)
    scene = suit(BALL, light)
    given = DARK | {"layer3_strength_1": 1.0, "layer3_exponent_1": 1.0, "layer3_fade": 100.0, "ramp_3": 1.0}
    free, damped = (draw(scene, "layered.talk", **given | {"damping": d})[..., 0] for d in (0.0, 1.0))
    radius = np.hypot(*(np.mgrid[:12, :12] - 5.5)) / 5.6
    middle, rim = radius < 0.3, (radius > 0.8) & (free > 0)
    assert free[rim].mean() > 3 * free[middle].mean()
    assert damped[rim].mean() < 0.5 * free[rim].mean()
    np.testing.assert_allclose(damped[middle], free[middle], rtol=0.05)


def test_numbers_are_driven_by_the_green_of_three_textures(suit: MakeScene, draw: Draw) -> None:
    """dot((1, tex1.y, tex2.y, tex3.y), amount4): pigment, and the weights of the lowest and the topmost metal."""
    metals = [{"metal": name, "alpha": 0.2, "weight": weight} for name, weight in (("Cr", 0.25), ("Al", 0.5))]
    scene = suit(metals=metals)
    alone = DARK | {"layer2_strength_1": 0.5, "layer2_exponent_1": 30.0, "layer1_diffuse": 1.0}
    parts = dict(zip(components("layer2_alpha"), (0.05, 0.1, 0.2, 0.3), strict=True))
    driven = draw(scene, "layered.talk", **alone | parts)
    constant = draw(scene, "layered.talk", **alone | {"layer2_alpha": 0.05 + 0.1 * 0.6 + 0.2 * 0.25 + 0.3 * 0.5})
    np.testing.assert_allclose(driven, constant, rtol=1e-5)


def test_a_texture_drives_a_number_from_place_to_place(suit: MakeScene, draw: Draw, tmp_path: Path) -> None:
    """A weight of 0 on the left and 1 on the right turns the second layer on there alone."""
    from PIL import Image as Picture

    halves = np.zeros((4, 64, 3), dtype=np.uint8)
    halves[:, 32:] = 255
    Picture.fromarray(halves).save(tmp_path / "halves.png")
    weight = {"path": "halves.png", "color_space": "linear"}
    scene = suit(metals=[{"metal": "Cr", "alpha": 0.2, "weight": weight}])
    given = DARK | {"layer1_diffuse": 1.0, "layer2_alpha_texture3": 1.0}
    made = draw(scene, "layered.talk", **given)[..., 1]
    sides = {made[:, :5].mean() > 0, made[:, 7:].mean() > 0}
    assert sides == {True, False}


def test_noise_is_on_the_broad_highlights_and_keeps_their_mean(suit: MakeScene, draw: Draw) -> None:
    scene = suit()
    lobes = DARK | {"layer1_strength_1": 0.5, "layer1_exponent_1": 2.0}
    smooth = draw(scene, "layered.talk", **lobes)
    noisy = draw(scene, "layered.talk", **lobes | {"layer1_noise": 0.5})
    assert np.std(noisy / smooth) > 0.02
    assert np.mean(noisy / smooth) == pytest.approx(1, abs=0.03)
    diffuse = DARK | {"layer1_diffuse": 1.0}
    assert np.array_equal(
        draw(scene, "layered.talk", **diffuse), draw(scene, "layered.talk", **diffuse | {"layer1_noise": 1.0})
    )
    assert noise().mean() == pytest.approx(0.5, abs=1e-6)


def test_highlights_fade_where_the_light_sinks_below_the_surface(suit: MakeScene, draw: Draw) -> None:
    """N.L is .1, and 1 / fade is .2: half of the highlight is left."""
    sunk = ({"type": "directional", "direction": [-np.sqrt(0.99), 0.0, -0.1], "irradiance": [1.0, 1.0, 1.0]},)
    scene = suit(WALL, sunk)
    lobes = DARK | {"layer1_strength_1": 0.5, "layer1_exponent_1": 5.0}
    faded, full = (draw(scene, "layered.talk", **lobes | {"layer1_fade": f}) for f in (5.0, 50.0))
    np.testing.assert_allclose(faded, 0.5 * full, rtol=1e-4)


def test_lights_add_up_and_what_is_behind_adds_nothing(suit: MakeScene, draw: Draw) -> None:
    lamp = {"type": "point", "position": [0.5, 1.0, 2.0], "intensity": [3.0, 2.0, 1.0]}
    behind = {"type": "point", "position": [0.0, 0.0, -2.0], "intensity": [30.0, 20.0, 10.0]}
    both, sun, spot = (draw(suit(WALL, e), "layered.talk") for e in ((SUN, lamp, behind), (SUN,), (lamp,)))
    np.testing.assert_allclose(both, sun + spot, rtol=1e-5)


def test_a_ball_of_light_shines_from_its_centre_and_may_widen_highlights(suit: MakeScene, draw: Draw) -> None:
    """As published its size does not matter. Where it does, the highlight's peak is lower, and the energy the same."""
    place, radius = [0.0, 0.0, 6.0], 1.5
    ball = {"type": "sphere", "position": place, "radius": radius, "radiance": [1.0, 1.0, 1.0]}
    point = {"type": "point", "position": place, "intensity": [np.pi * radius**2] * 3}
    made, truth = (draw(suit(WALL, (light,)), "layered.talk") for light in (ball, point))
    np.testing.assert_allclose(made, truth, rtol=1e-5)
    wide = draw(suit(WALL, (ball,)), "layered.talk", spread=0.45, layer2_alpha=1.0, ramp_2=0.0, ramp_3=0.0)
    sharp = draw(suit(WALL, (ball,)), "layered.talk", layer2_alpha=1.0, ramp_2=0.0, ramp_3=0.0)
    assert wide.max() < 0.9 * sharp.max()
    assert wide[0, 0, 0] > sharp[0, 0, 0]


@pytest.mark.parametrize("look", ["by_eye", "blend", "plastic", "clearcoat"])
def test_in_a_white_furnace_no_look_throws_back_more_than_what_arrives(suit: MakeScene, draw: Draw, look: str) -> None:
    """Light of radiance 1 from everywhere, as 400 beams, each of which stands for an equal part of all directions."""
    i = np.arange(400)
    z, angle = 1 - (2 * i + 1) / 400, i * np.pi * (3 - np.sqrt(5))
    directions = np.stack([np.sqrt(1 - z**2) * np.cos(angle), np.sqrt(1 - z**2) * np.sin(angle), z], axis=1)
    beams = tuple(
        {"type": "directional", "direction": d, "irradiance": [4 * np.pi / 400] * 3} for d in directions.tolist()
    )
    scene = suit(BALL, beams, reflectance=[1.0, 1.0, 1.0])
    made = draw(scene, "layered.talk", look=look, damping=0.0)
    inside = np.hypot(*(np.mgrid[:12, :12] - 5.5)) < 5
    assert made[inside].max() <= 1
    assert made[inside].min() > 0.05


def test_whatever_covers_what_no_more_comes_back_than_of_the_brightest_layer(glsl: Glsl) -> None:
    inputs = np.random.default_rng(3).uniform(size=(2000, 2, 4))
    made = glsl("lib/suit_talk.glsl", "r[0].xyz = composited(a[0].xyz, a[1].xyz, a[0].w);", inputs)[:, 0, :3]
    low, high = inputs[:, :, :3].min(axis=1), inputs[:, :, :3].max(axis=1)
    assert ((made >= low - 1e-6) & (made <= high + 1e-6)).all()


@pytest.mark.parametrize(
    "emitter",
    [
        {"type": "constant", "radiance": [1.0, 1.0, 1.0]},
        {"type": "line", "start": [0, 1, 1], "end": [1, 1, 1], "radius": 0.01, "radiance": [1.0, 1.0, 1.0]},
    ],
)
def test_light_without_one_direction_is_refused(suit: MakeScene, emitter: dict[str, Any]) -> None:
    with pytest.raises(InputError, match=r"point, sphere, disk and directional"):
        Renderer(suit(WALL, (emitter,))).render(technique("layered.talk"), {}, timed=False)


def test_every_slider_has_a_place_in_the_shader_and_an_effect(suit: MakeScene, draw: Draw) -> None:
    """A number that changes no pixel would be one that no fit can find."""
    side = {"type": "directional", "direction": [-1.0, 0.0, -0.2], "irradiance": [1.0, 1.0, 1.0]}
    scene = suit(BALL, (SUN, side), metals=[{"metal": "Cr", "alpha": 0.2, "weight": 0.4}])
    broad = {f"layer{k}_exponent_{i}": 3.0 for k in (1, 2, 3) for i in (1, 2)}
    base = draw(scene, "layered.talk", **broad)
    for slider in SLIDERS:
        moved = draw(scene, "layered.talk", **broad | {slider.name: 0.7 * float(slider.default) + 0.1})
        assert not np.array_equal(moved, base), slider.name
