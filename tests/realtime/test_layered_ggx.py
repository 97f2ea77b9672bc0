"""Layered materials on the GPU: each term by itself, furnaces, and what is drawn."""

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from realtime.layers import lazanyi
from scenes.errors import InputError
from scenes.image import Float32, Float64
from scenes.metals import INDICES, refractive_index
from scenes.model import Scene

Glsl = Callable[..., Float64]
Draw = Callable[..., Float32]
MakeScene = Callable[..., Scene]

METALS = tuple(INDICES)


def vec4(*columns: Float64) -> Float64:
    """(N, I, 4) from I arrays (N,) or (N, C), filled up with zeros."""
    rows = [np.atleast_2d(c.T).T for c in columns]
    return np.stack([np.pad(r, ((0, 0), (0, 4 - r.shape[1]))) for r in rows], axis=1)


def hemisphere(side: int) -> tuple[Float64, Float64]:
    """Directions (N, 3) about +z and solid angles (N,): Gauss's nodes in the cosine, even ones around."""
    z, weight = np.polynomial.legendre.leggauss(side)
    z, weight = (z + 1) / 2, weight / 2
    phi = (np.arange(2 * side) + 0.5) / (2 * side) * 2 * math.pi
    s = np.sqrt(1 - z**2)[:, None]
    flat = np.broadcast_to(z[:, None], (side, 2 * side))
    L = np.stack([s * np.cos(phi), s * np.sin(phi), flat], axis=-1).reshape(-1, 3)
    return L, np.repeat(weight * 2 * math.pi / (2 * side), 2 * side)


def towards(cosine: float, count: int) -> Float64:
    return np.broadcast_to([math.sqrt(1 - cosine**2), 0.0, cosine], (count, 3))


REFLECTION = "vec3 V = a[0].xyz, L = a[1].xyz, H = normalize(V + L), N = vec3(0.0, 0.0, 1.0); r[0].rgb = {};"


@pytest.mark.parametrize("alpha", [0.001, 0.01, 0.1, 1.0])
def test_the_distribution_is_right_where_dot_products_are_not(glsl: Glsl, alpha: float) -> None:
    """Within a few roughnesses of the normal; the usual form, which takes the sine from the cosine, is 11 % off."""
    tangent = np.linspace(0.0, 4 * alpha, 200)
    H = np.stack([tangent, 0 * tangent, np.ones(200)], axis=1)
    H /= np.linalg.norm(H, axis=1, keepdims=True)
    H = H.astype(np.float32).astype(float)
    body = f"""vec3 N = vec3(0.0, 0.0, 1.0), H = a[0].xyz; float d = dot(N, H), a2 = {alpha * alpha};
        float q = d * d * (a2 - 1.0) + 1.0; r[0].xy = vec2(D_ggx(N, H, {alpha}), a2 / (3.14159265 * q * q));"""
    ours, usual = glsl("lib/ggx.glsl", body, vec4(H))[:, 0, :2].T
    sine2 = H[:, 0] ** 2 / (H[:, 0] ** 2 + H[:, 2] ** 2)
    exact = alpha**2 / (math.pi * (sine2 + alpha**2 * (1 - sine2)) ** 2)
    assert np.abs(ours / exact - 1).max() < 1e-4
    if alpha == 0.001:
        assert np.abs(usual / exact - 1).max() == pytest.approx(0.11, abs=0.05)


def test_rounding_of_unit_vectors_makes_nothing_infinite(glsl: Glsl) -> None:
    """N.H and cosines a little above 1 or below 0; a power of a negative number is NaN, which clamps then hide."""
    cosine = np.array([1.0 + 2.0**-23, 1.0 + 1e-6, 1.0, 1e-30, 0.0, -1e-7])
    body = """vec3 F0 = vec3(0.9, 0.5, 0.1); float c = a[0].x;
        r[0].rgb = F_schlick(c, F0); r[1].rgb = F_lazanyi(c, F0, vec3(1.0)); r[2].rgb = F_conductor(c, F0, vec3(3.0));
        r[3].xy = vec2(V1_smith(max(c, 0.0), 0.001), burley_diffuse(c, c, c, 0.5));
        vec3 N = vec3(0.0, 0.0, 1.0), H = vec3(0.0, 0.0, c > 0.5 ? c : 1.0);
        r[3].zw = vec2(D_ggx(N, H, 0.001), D_gtr1(N, H, 0.001));"""
    found = glsl("lib/burley.glsl", body, vec4(cosine), outputs=4)
    assert np.isfinite(found).all()
    assert (found[:, :3] <= 1 + 1e-5).all()
    assert (found[:, 3] >= 0).all()


@pytest.mark.parametrize("metal", METALS)
def test_fresnels_equations_are_those_of_complex_amplitudes(glsl: Glsl, metal: Any) -> None:
    eta, k = refractive_index(metal)
    cosine = np.linspace(0.0, 1.0, 201)
    found = glsl(
        "lib/fresnel_metal.glsl", f"r[0].rgb = F_conductor(a[0].x, {glsl_vec(eta)}, {glsl_vec(k)});", vec4(cosine)
    )
    np.testing.assert_allclose(found[:, 0, :3], exact_fresnel(cosine, eta, k), atol=2e-6)


@pytest.mark.parametrize("metal", METALS)
def test_lazanyi_is_closer_than_schlick(glsl: Glsl, metal: Any) -> None:
    """Right straight on and at the dip; 0.02 rms at most in each channel, which is chromium's red."""
    eta, k = refractive_index(metal)
    straight, dip = lazanyi(eta, k)
    cosine = np.append(np.linspace(0.0, 1.0, 201), 1 / 7)
    body = f"""vec3 F0 = {glsl_vec(straight)};
        r[0].rgb = F_lazanyi(a[0].x, F0, {glsl_vec(dip)}); r[1].rgb = F_schlick(a[0].x, F0);"""
    found = glsl("lib/fresnel_metal.glsl", body, vec4(cosine), outputs=2)[..., :3]
    exact = exact_fresnel(cosine, eta, k)
    np.testing.assert_allclose(found[[200, 201], 0], exact[[200, 201]], atol=2e-6)
    ours, schlick = (np.sqrt(((found[:201, i] - exact[:201]) ** 2).mean(axis=0)) for i in (0, 1))
    assert (ours < 0.02).all()
    assert (ours <= schlick).all()
    assert schlick.mean() > 1.2 * ours.mean()


def glsl_vec(values: Float64) -> str:
    return f"vec3({', '.join(repr(float(v)) for v in values)})"


def exact_fresnel(cosine: Float64, eta: Float64, k: Float64) -> Float64:
    c, n = cosine[:, None], eta + 1j * k
    inside = np.sqrt(n * n - 1 + c * c)
    s, p = (c - inside) / (c + inside), (n * n * c - inside) / (n * n * c + inside)
    return np.asarray((np.abs(s) ** 2 + np.abs(p) ** 2) / 2)


@pytest.mark.parametrize("alpha", [0.1, 0.3, 0.6, 1.0])
def test_a_white_furnace_gets_nothing_back_but_what_it_gave(glsl: Glsl, alpha: float) -> None:
    """Facets that mirror all light: what they reflect once is 1 at most, and less the rougher they are."""
    L, solid_angle = hemisphere(128)
    for cosine in (0.1, 0.5, 1.0):
        inputs = vec4(towards(cosine, len(L)), L)
        call = f"vec3(ggx_reflection(N, V, L, H, {alpha}), film_reflection(N, V, L, H, {alpha}, 1.5), 0.0)"
        found = glsl("lib/rough_film.glsl", REFLECTION.format(call), inputs)[:, 0]
        mirror, film, _, _ = (found * solid_angle[:, None]).sum(axis=0)
        assert film < mirror < 1.002
        assert mirror > {0.1: 0.85, 0.3: 0.75, 0.6: 0.55, 1.0: 0.3}[alpha]


@pytest.mark.parametrize(("sheen", "most"), [(0.0, 1.507), (1.0, 1.584)])
def test_the_principled_material_is_no_furnace(glsl: Glsl, sheen: float, most: float) -> None:
    """Seen at grazing angles, a rough white base returns half as much again as it gets, and sheen adds to that.

    So does Mitsuba's: nothing is to be mended here.
    """
    L, solid_angle = hemisphere(96)
    brightest = 0.0
    for cosine in (0.05, 0.3, 1.0):
        for roughness in (0.3, 1.0):
            m = f"Burley(vec3(1.0), {roughness}, 0.0, 1.5, 0.0, 0.0, {sheen})"
            inputs = vec4(towards(cosine, len(L)), L)
            found = glsl("lib/burley.glsl", REFLECTION.format(f"burley_reflection({m}, N, V, L, H, 0.0)"), inputs)
            brightest = max(brightest, float(found[:, 0, 0] @ solid_angle))
    assert brightest == pytest.approx(most, rel=5e-3)


def test_light_may_go_either_way(glsl: Glsl) -> None:
    """Helmholtz's reciprocity, of what is per unit of light on the surface."""
    rng = np.random.default_rng(0)
    z, phi = rng.uniform(0.02, 1.0, (2, 500)), rng.uniform(0.0, 2 * math.pi, (2, 500))
    s = np.sqrt(1 - z**2)
    V, L = np.stack([s * np.cos(phi), s * np.sin(phi), z], axis=-1)
    m = "Burley(vec3(0.8, 0.5, 0.2), 0.5, 0.3, 1.5, 1.0, 0.5, 0.5)"
    for call in ("vec3(film_reflection(N, V, L, H, 0.3, 1.5))", f"burley_reflection({m}, N, V, L, H, 0.0)"):
        there, back = (
            glsl("lib/burley.glsl" if "Burley" in call else "lib/rough_film.glsl", REFLECTION.format(call), vec4(*pair))
            for pair in ((V, L), (L, V))
        )
        np.testing.assert_allclose(there[:, 0, :3] / z[1][:, None], back[:, 0, :3] / z[0][:, None], rtol=2e-4)


def test_a_lamp_is_as_wide_as_it_is_seen(glsl: Glsl) -> None:
    """A ball of radius 0.5 and a disk of that radius, from 1 and 3 away; from within a ball it is but a point."""
    area = math.pi * 0.25
    place = np.array([[0.0, 0.0, d] for d in (1.0, 3.0, 0.4)])
    for kind, expected in ((0, [0.5 / 0.75**0.5, 0.5 / 8.75**0.5, 0.0]), (1, [0.5, 0.5 / 3, 0.0]), (2, [0.0] * 3)):
        light = f"Light(vec4(vec3(0.0), {kind}.0), vec4(0.0, 0.0, 1.0, {area}), vec4(1.0))"
        found = glsl("lib/light_spread.glsl", f"r[0].x = light_spread({light}, a[0].xyz);", vec4(place))
        np.testing.assert_allclose(found[:, 0, 0], expected, rtol=1e-6)


FILM = {"type": "layered", "reflectance": [0.5, 0.3, 0.2], "film": {"alpha": 0.3}}
CARD: dict[str, Any] = {
    "subject": ["card"],
    "sensor": {
        "type": "perspective",
        "origin": [0.0, 0.0, 4.0],
        "target": [0.0, 0.0, 0.0],
        "fov_deg": 10.0,
        "width": 4,
        "height": 4,
    },
    "shapes": [{"name": "card", "type": "rectangle", "size": [2.0, 2.0], "material": "suit"}],
    "emitters": [{"type": "directional", "direction": [0.0, -0.6, -0.8], "irradiance": [2.0, 3.0, 4.0]}],
}


def test_a_diffuse_card_shows_its_closed_form(make_scene: MakeScene, draw: Draw) -> None:
    scene = make_scene(**CARD, materials={"suit": {"type": "diffuse", "reflectance": [0.5, 0.3, 0.2]}})
    expected = np.array([0.5, 0.3, 0.2]) / math.pi * 0.8 * np.array([2.0, 3.0, 4.0])
    np.testing.assert_allclose(draw(scene, "layered.ggx"), np.broadcast_to(expected, (4, 4, 3)), rtol=1e-5)


def test_metal_that_covers_nothing_or_all(make_scene: MakeScene, draw: Draw) -> None:
    """Coats are mixed from the lowest to the topmost; other coats make another program, which may round otherwise."""
    gold, silver = ({"metal": name, "alpha": 0.5, "weight": 1.0} for name in ("Au", "Ag"))

    def image(*metals: dict[str, Any]) -> Float32:
        suit = FILM | {"metals": list(metals)} if metals else FILM
        return draw(make_scene(**CARD, materials={"suit": suit}), "layered.ggx")

    np.testing.assert_allclose(image(gold | {"weight": 0.0}), image(), rtol=1e-6)
    np.testing.assert_allclose(image(gold, silver), image(silver), rtol=1e-6)
    half = image(gold, silver | {"weight": 0.5})
    np.testing.assert_allclose(half, (image(gold) + image(silver)) / 2, rtol=1e-5)


@pytest.mark.parametrize("fresnel", ["exact", "lazanyi", "schlick"])
def test_fresnel_terms_agree_straight_on(make_scene: MakeScene, draw: Draw, fresnel: str) -> None:
    gold = FILM | {"metals": [{"metal": "Au", "alpha": 0.3, "weight": 1.0}]}
    ahead = [{"type": "directional", "direction": [0.0, 0.0, -1.0], "irradiance": [1.0, 1.0, 1.0]}]
    scene = make_scene(**CARD | {"emitters": ahead}, materials={"suit": gold})
    np.testing.assert_allclose(draw(scene, "layered.ggx", fresnel=fresnel), draw(scene, "layered.ggx"), rtol=1e-4)


def test_a_wide_lamp_widens_highlights_and_keeps_their_light(make_scene: MakeScene, draw: Draw) -> None:
    """Mirrored in a large plate: lower in the middle, and the same sum."""
    steel = {"type": "layered", "reflectance": [0.0] * 3, "metals": [{"metal": "Cr", "alpha": 0.1, "weight": 1.0}]}
    lamp = [{"type": "sphere", "position": [-1.5, 0.0, 4.0], "radius": 1.2, "radiance": [1.0, 1.0, 1.0]}]
    sensor = CARD["sensor"] | {"origin": [1.5, 0.0, 4.0], "width": 32, "height": 32, "fov_deg": 70.0}
    plate = CARD["shapes"][0] | {"size": [20.0, 20.0]}
    scene = make_scene(**CARD | {"emitters": lamp, "sensor": sensor, "shapes": [plate]}, materials={"suit": steel})
    point, wide = (draw(scene, "layered.ggx", spread=spread)[:, 8:, 0] for spread in (0.0, 0.45))
    assert wide.max() < 0.7 * point.max()
    assert wide.sum() == pytest.approx(point.sum(), rel=0.1)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"emitters": [{"type": "constant", "radiance": [1.0, 1.0, 1.0]}]}, r"emitter of type 'constant'; .*Use one"),
        (
            {"materials": {"suit": {"type": "translucent", "sigma_a": [1.0] * 3, "sigma_s": [1.0] * 3}}},
            r"'card', which light passes; .*Give it such a material",
        ),
    ],
    ids=["sky", "translucent"],
)
def test_what_cannot_be_drawn_is_refused_in_words(
    make_scene: MakeScene, draw: Draw, changes: dict[str, Any], message: str
) -> None:
    card = {"name": "card", "type": "slab", "width": 2.0, "thickness": 0.1, "material": "suit"}
    with pytest.raises(InputError, match=message):
        draw(make_scene(**CARD | {"shapes": [card], "materials": {"suit": FILM}} | changes), "layered.ggx")
