"""The domains of all shader functions that can be run by themselves.

Most inputs mean the same wherever their name stands; a function says only what is different about its own.
"""

import math

import numpy as np

from comparisons.glsl.values import Array
from comparisons.stress import eye_inputs as eye
from comparisons.stress import inputs as draw
from comparisons.stress.domain import (
    DIRECTION,
    EXACT,
    LENGTH,
    RADIANCE,
    RADII,
    SHARE,
    SOLID_ANGLE,
    TEXELS,
    UV,
    Domain,
    Measure,
    between,
    is_direction,
)
from comparisons.stress.inputs import Inputs, Kind, facing, number, place, unit_of, whole

LIGHT = {
    "place_kind": draw.vector(place(20.0, 100.0), draw.choice(0.0, 1.0, 2.0)),
    "axis_area": draw.vector(draw.unit(), number(1e-4, 10.0, log=True)),
    "strength": draw.vector(draw.colour(1e-3, 1e3), draw.choice(0.0)),
}
SURFEL = {
    "position_area": draw.vector(place(1.0, 100.0), number(1e-4, 10.0, log=True)),
    "normal_solid_angle": draw.vector(draw.unit(), number(1e-4, 1.0, log=True)),
    "albedo": draw.vector(draw.colour(1e-2, 1.0), draw.choice(1.0)),
}


def _index(below: str, power: int = 1) -> Kind:
    """A place in a list that is as long as a power of an input."""
    return Kind(
        lambda rng, count, reach, made: rng.integers(0, made[below] ** power),
        lambda rng, count, made: np.where(rng.random(count) < 0.5, 0, made[below] ** power - 1),
        lambda value, made: [np.array([0])],
        lambda value, made: bool(value[0] < made[below][0] ** power),
    )


def _where_the_light_is() -> Kind:
    """A place to be lit, which may be that of the light itself."""
    anywhere = place(0.01, 10.0)
    return Kind(
        anywhere.draw,
        lambda rng, count, made: (
            made["light"]["place_kind"][:, :3] * rng.choice(np.array([0.0, 1.0, 1.0001]), (count, 1))
        ),
        anywhere.simple,
    )


def _cosine_inside(made: Inputs) -> Array:
    return np.asarray(np.sqrt(np.maximum(1.0 - (1.0 - made["cos_i"] ** 2) / made["n"] ** 2, 1e-6)))


def _corner(x: float, y: float) -> Kind:
    """The direction from the place `seen_from`, above the plane z = 0, to a corner of a square in that plane."""
    return draw.derived(lambda made: unit_of(np.array([x, y, 0.0]) - made["seen_from"]), unit_of)


def _along_the_surface(made: Inputs) -> Array:
    """A vector of some length that leans away from the normal at the place."""
    across = np.cross(made["normal"], made["normal"][:, [1, 2, 0]] * (1.0, -1.0, 0.5))
    return np.asarray(across + 0.5 * made["normal"])


def _reciprocal_direction() -> Kind:
    """1 / d for a direction d, along an axis as glsl/indirect/bvh.glsl has it."""
    d, axes = draw.unit(), np.where(np.eye(3) == 1.0, 1.0, 1e20)
    return Kind(
        lambda rng, count, reach, made: 1.0 / d.draw(rng, count, reach, made),
        lambda rng, count, made: rng.choice(np.concatenate([axes, -axes]), count),
    )


def _box_face() -> Kind:
    """Where a ray begins; at the extreme, on a face of the box."""
    anywhere = place(0.1, 100.0)
    return Kind(anywhere.draw, lambda rng, count, made: made["low"], anywhere.simple)


BY_NAME: dict[str, Kind] = {
    **dict.fromkeys(("cos_i", "cos_o", "cosine"), draw.cosine()),
    **dict.fromkeys(("in_ray", "d", "N", "normal", "to_light", "V", "L", "axis", "a", "b", "c"), draw.unit()),
    **dict.fromkeys(("eta", "ior", "n"), number(1.0001, 2.5, 1.5)),
    **dict.fromkeys(("radius", "longest", "thinnest", "scene_radius"), number(0.01, 100.0, log=True)),
    **dict.fromkeys(("position", "centre", "o", "to_source", "v"), place(0.01, 100.0)),
    **dict.fromkeys(("e", "eyeball"), eye.eyes()),
    **dict.fromkeys(("source_normal", "iris_normal"), draw.unit()),
    **dict.fromkeys(("turn", "phi", "angle"), number(0.0, 2 * math.pi)),
    **dict.fromkeys(("wrap", "t", "internal"), number(0.0, 1.0)),
    "albedo": draw.colour(0.01, 1.0),
    "area": number(1e-4, 10.0, log=True),
    "exponent": number(1.0, 8192.0, 4000.0),
    "light": draw.struct(**LIGHT),
    "s": draw.struct(**SURFEL),
    "side": draw.choice(16.0, 64.0, 512.0, 2048.0),
    "count": whole(1, 256),
    "st": draw.vector(number(-1.0, 1.0, 0.0), number(-1.0, 1.0, 0.0)),
    "closed": draw.choice(0.0, 1.0),
    "thickness": number(1e-3, 1e3, log=True),
}
"""Inputs that mean the same everywhere."""

RIBBON = {"away": number(-2.0, 2.0, 0.0), "width": number(1e-3, 4.0, 1.0, log=True)}
CURVE = {**dict.fromkeys(("a", "b", "c", "d"), place(0.01, 1.0)), "t": number(0.0, 1.0)}

ABOVE_A_SQUARE = draw.vector(number(-3.0, 3.0, -1.0, 1.0), number(-3.0, 3.0, -1.0, 1.0), number(1e-3, 3.0, log=True))


def _half_vector(made: Inputs) -> Array:
    """Between V and L; of opposite ones, which lie on the horizon, the normal."""
    between_both = made["V"] + made["L"]
    is_none = np.linalg.norm(between_both, axis=1, keepdims=True) < 1e-3
    return unit_of(np.where(is_none, made["N"], between_both))


ALPHA = number(1e-3, 1.0, log=True)
FACETS = {
    "N": draw.unit(),
    "V": facing("N", 1.0),
    "L": facing("N", 1.0),
    "H": draw.derived(_half_vector, unit_of),
    "alpha": ALPHA,
}
"""Directions above the horizon, and a roughness that is not rounded to 0."""
METAL = {"eta": draw.vector(*3 * [number(0.1, 5.0)]), "k": draw.vector(*3 * [number(1.0, 10.0)])}
STRAIGHT_BACK = draw.vector(*3 * [number(0.0, 1.0)])
BURLEY = {
    **dict.fromkeys(("roughness", "metallic", "clearcoat", "clearcoat_gloss", "sheen"), number(0.0, 1.0)),
    "base_color": draw.colour(0.01, 1.0),
    "ior": number(1.0, 1.8, 1.5),
}

EXPONENT = number(1.0, 8192.0, log=True)
LOBE = Measure("relative exponent", 1e-3, is_relative=True, floor=1.0)

CROSSING = Measure("lengths of the direction, relative above 1", 1e-3, is_relative=True, floor=1.0)
BOX = {"low": draw.vector(*3 * [number(-1.0, 0.0)]), "high": draw.vector(*3 * [number(0.5, 1.0)])}
CORNERS = draw.vector(*4 * [number(0.0, 1.0)])
IN_A_CELL = draw.vector(*2 * [number(0.0, 1.0)])
SINKING = draw.vector(number(-1.0, 1.0, 0.0), number(-1.0, 1.0, 0.0), number(-1.0, -0.02))


FIELD = draw.vector(*2 * [draw.choice(1, 32, 255)])
IN_A_FIELD = draw.vector(*2 * [number(0.0, 255.0, 0.0, 1.0)])


def _above_a_patch() -> Kind:
    """A place in a cell that is higher than its corners."""
    return draw.vector(number(0.0, 1.0), number(0.0, 1.0), number(1.01, 1.5))


def _cosine_of(sine: str) -> Kind:
    return draw.derived(lambda made: np.asarray(np.sqrt(np.maximum(1.0 - made[sine] ** 2, 0.0))))


INCLINATIONS = {
    "sin_i": number(-1.0, 1.0, 0.0),
    "cos_i": _cosine_of("sin_i"),
    "sin_o": number(-1.0, 1.0, 0.0),
    "cos_o": _cosine_of("sin_o"),
    "variance": number(4e-4, 1.0),
}
CIRCLE = Kind(
    lambda rng, count, reach, made: unit_of(rng.normal(size=(count, 2))),
    lambda rng, count, made: rng.choice(np.array([[0.0, 1.0], [1.0, 0.0], [-1.0, 0.0]]), count),
    meant=unit_of,
)
"""The sine and the cosine of an angle."""


def _moments(rng: np.random.Generator, count: int, reach: float, made: Inputs) -> Array:
    """An area, and its part along each axis, of hair that runs in one direction."""
    area, squares = rng.uniform(0.1, 1.0, (count, 1)), unit_of(rng.normal(size=(count, 3))) ** 2
    return np.concatenate([area, area * squares], axis=1)


def _mixed_moments(made: Inputs) -> Array:
    x, y, z = np.sqrt(np.maximum(made["a"][:, 1:], 0.0)).T
    return np.stack([x * y, x * z, y * z], axis=1)


HAIR_IN_A_CELL = {"a": Kind(_moments), "b": draw.derived(_mixed_moments), "d": draw.unit()}

DOMAINS: dict[str, Domain] = {
    "lib/ball.glsl:part_above_horizon": Domain(
        SHARE,
        {"height": draw.scaled(number(-1.5, 1.5, -1.0, 1.0, 0.0), lambda made: made["radius"])},
        between(0.0, 1.0),
    ),
    "lib/beam.glsl:beam_of": Domain(
        RADIANCE,
        {
            "light": draw.struct(
                **LIGHT | {"place_kind": draw.vector(place(20.0, 100.0), draw.choice(0.0, 1.0, 2.0, 3.0))}
            ),
            "position": _where_the_light_is(),
        },
    ),
    "lib/bezier.glsl:bezier_point": Domain(Measure("lengths", 1e-4), CURVE),
    "lib/bezier.glsl:bezier_derivative": Domain(Measure("lengths", 1e-4), CURVE),
    "lib/blinn_phong.glsl:blinn_phong": Domain(
        SHARE, {"L": facing("N", 1.0), "to_eye": draw.or_opposite(facing("N", 1.0), "L")}, between(0.0, 1.0)
    ),
    "lib/burley.glsl:D_gtr1": Domain(RADIANCE, FACETS | {"alpha": number(1e-3, 0.999, log=True)}),
    "lib/burley.glsl:burley_diffuse": Domain(
        SHARE, {"cos_d": draw.cosine(), "roughness": number(0.0, 1.0)}, between(0.0, 6.25)
    ),
    "lib/burley.glsl:clearcoat_reflection": Domain(RADIANCE, FACETS | {"alpha": number(1e-3, 0.999, log=True)}),
    "lib/burley.glsl:burley_reflection": Domain(
        RADIANCE,
        {"m": draw.struct(**BURLEY), **{k: v for k, v in FACETS.items() if k != "alpha"}, "wider": number(0.0, 0.1)},
    ),
    "lib/blinn_phong.glsl:alpha_of_exponent": Domain(SHARE, {"n": EXPONENT}, between(0.0, 1.0)),
    "lib/blinn_phong.glsl:exponent_of_alpha": Domain(LOBE, {"alpha": number(0.0156, 0.9, log=True)}),
    "lib/blinn_phong.glsl:widened_exponent": Domain(LOBE, {"n": EXPONENT, "spread": number(0.0, 0.5, 10.0)}),
    "lib/blinn_phong.glsl:blinn_phong_normalisation": Domain(RADIANCE, {"n": EXPONENT}),
    "lib/centred_distance.glsl:centred_distance": Domain(LENGTH, {"v": place(0.01, 1.0), "offset": place(2.0, 100.0)}),
    "lib/cornea.glsl:wavefront_curvatures": Domain(
        Measure("per radius of the eye", 1e-3),
        {
            "n": number(1.01, 1.6, 1.376),
            "cos_t": draw.derived(_cosine_inside),
            "curvature": number(0.5, 2.0, 0.0),
            "inverse_r": number(0.0, 1.0),
        },
    ),
    "lib/cornea.glsl:focus": Domain(
        RADIANCE, {"curvatures": draw.vector(number(-1.0, 2.0, 0.0), number(-1.0, 2.0, 0.0)), "s": number(0.0, 1.0)}
    ),
    "lib/cornea.glsl:refracted_cosine": Domain(SHARE, {}, between(0.0, 1.0 + 1e-6)),
    "lib/cornea.glsl:cornea_entry": Domain(
        RADII, {"p": eye.on_iris("e"), "place": eye.sources(), "steps": whole(0, 8)}
    ),
    "lib/cornea.glsl:cornea_transfer": Domain(SHARE, {"x": eye.entries()}, between(0.0, 1.0)),
    "lib/cornea.glsl:cornea_focus": Domain(RADIANCE, {"x": eye.entries()}),
    "lib/cornea.glsl:unfocused_spread": Domain(SHARE, {"e": eye.eyes(), "x": eye.entries()}, between(0.0, 1.0)),
    "lib/cornea.glsl:straight_transfer": Domain(
        SHARE, {"p": eye.on_iris("e"), "to_light": eye.upward()}, between(0.0, 1.0)
    ),
    "lib/cornea_talk.glsl:trace_iris_talk": Domain(
        RADII,
        eye.talk_iris(),
        defines={"EXIT_BRANCH": 1},
    ),
    "lib/cornea_talk.glsl:edge_blend": Domain(
        SHARE,
        {
            "limbus_height": number(0.5, 0.9, 0.805),
            "apex": draw.scaled(number(1.05, 1.5), lambda made: made["limbus_height"]),
            "height": draw.scaled(number(0.9, 1.5, 1.0), lambda made: made["limbus_height"]),
        },
        between(0.0, 1.0),
    ),
    "lib/coverage_taps.glsl:gaussian_tap": Domain(Measure("deviations", 1e-3), {"i": _index("count")}),
    "lib/cube.glsl:cube_direction": Domain(SHARE, {"face": whole(0, 5)}),
    "lib/cube.glsl:cube_face": Domain(SHARE, {"d": place(0.01, 100.0)}),
    "lib/cube.glsl:cube_texel_solid_angle": Domain(RADIANCE),
    "lib/disk.glsl:disk_hit": Domain(EXACT),
    "lib/eye.glsl:on_axis": Domain(EXACT, {"y": number(-2.0, 2.0)}),
    "lib/eye.glsl:eye_hit": Domain(RADII, {"o": place(3.0, 100.0), "d": eye.rays_to_eye()}),
    "lib/eye.glsl:leaves_cornea": Domain(EXACT, {"o": eye.on_cornea("e")}),
    "lib/eye.glsl:leaves_sclera": Domain(EXACT, {"o": eye.on_sclera("e")}),
    "lib/eye.glsl:iris_hit": Domain(RADII, {"o": eye.on_cornea("e"), "d": eye.rays_to_iris()}),
    "lib/eye.glsl:iris_uv": Domain(UV, {"p": eye.on_iris("e")}),
    "lib/eye.glsl:iris_point": Domain(
        RADII, {"r": draw.scaled(number(0.0, 1.0), lambda made: made["e"]["limbus_radius"])}
    ),
    "lib/film.glsl:below_film": Domain(
        SHARE, dict.fromkeys(("entering", "leaving"), number(0.0, 1.0)) | {"internal": number(0.0, 0.95)}
    ),
    "lib/film.glsl:film_brdf": Domain(
        Measure("relative to a white surface", 1e-3, is_relative=True, floor=0.3), {"internal": number(0.0, 0.7)}
    ),
    "lib/fibre.glsl:log_i0": Domain(Measure("of a logarithm", 1e-3), {"x": number(1e-3, 100.0, 0.0, 3.75, log=True)}),
    "lib/fibre.glsl:fibre_longitudinal": Domain(
        Measure("relative density, 1/rad below 1", 1e-3, is_relative=True, floor=1.0), INCLINATIONS
    ),
    "lib/fibre.glsl:fibre_tilted": Domain(
        SHARE, {"inclination": CIRCLE, "turn": CIRCLE}, between(-1.0 - 1e-6, 1.0 + 1e-6)
    ),
    "lib/fresnel.glsl:F_dielectric": Domain(SHARE, {}, between(0.0, 1.0)),
    "lib/fresnel.glsl:schlick_weight": Domain(SHARE, {}, between(0.0, 1.0)),
    "lib/fresnel.glsl:F_talk": Domain(SHARE, {}, between(0.0, 1.0)),
    "lib/fresnel_metal.glsl:F_conductor": Domain(SHARE, METAL, between(0.0, 1.0 + 1e-6)),
    "lib/fresnel_metal.glsl:F_schlick": Domain(SHARE, {"F0": STRAIGHT_BACK}, between(0.0, 1.0 + 1e-6)),
    "lib/fresnel_metal.glsl:F_lazanyi": Domain(
        SHARE, {"F0": STRAIGHT_BACK, "dip": draw.vector(*3 * [number(-0.5, 2.0)])}
    ),
    "lib/ggx.glsl:D_ggx": Domain(RADIANCE, FACETS),
    "lib/ggx.glsl:V1_smith": Domain(RADIANCE, {"alpha": ALPHA}),
    "lib/ggx.glsl:ggx_reflection": Domain(RADIANCE, FACETS),
    "lib/hemisphere.glsl:cosine_direction": Domain(SHARE, {"i": whole(0, 1023)}, is_direction()),
    "lib/kajiya_kay.glsl:kajiya_kay": Domain(
        SHARE, {"T": draw.unit(), "exponent": number(1.0, 700.0)}, between(0.0, 1.0)
    ),
    "lib/lambert.glsl:disk_form_factor": Domain(SHARE, {}, between(0.0, 1.0)),
    "lib/light_place.glsl:light_place": Domain(LENGTH),
    "lib/light_spread.glsl:light_spread": Domain(
        SHARE, {"light": draw.struct(**LIGHT), "position": _where_the_light_is()}
    ),
    "lib/lights.glsl:unshadowed_irradiance": Domain(
        RADIANCE, {"light": draw.struct(**LIGHT), "position": _where_the_light_is()}
    ),
    "lib/receive.glsl:surfel_factor": Domain(SHARE, {}, between(0.0, 1.0)),
    "lib/receive.glsl:closure_scale": Domain(SHARE, {"sum": number(0.0, 2.0, 1.0)}),
    "lib/refract.glsl:refract_talk": Domain(
        DIRECTION, {"in_normal": facing("in_ray"), "in_u": number(0.4, 1.0, 1.376)}, is_direction()
    ),
    "lib/refract.glsl:refract_through": Domain(
        DIRECTION, {"in_normal": facing("in_ray"), "in_u": number(0.4, 2.5, 1.0)}, is_direction("refracted")
    ),
    "lib/ribbon.glsl:ribbon_coverage": Domain(SHARE, RIBBON, between(0.0, 1.0)),
    "lib/ribbon.glsl:within_ends": Domain(
        SHARE, dict.fromkeys(("from_root", "to_tip"), number(-2.0, 2.0, 0.0, 0.5)), between(0.0, 1.0)
    ),
    "lib/ribbon.glsl:height_of_tube": Domain(SHARE, RIBBON, between(0.0, 1.0)),
    "lib/rough_film.glsl:film_reflection": Domain(RADIANCE, FACETS),
    "lib/relief_box.glsl:box_span": Domain(CROSSING, {"o": place(0.1, 100.0), **BOX}),
    "lib/relief_march.glsl:march_step": Domain(
        UV,
        {
            "distance": number(-0.5, 1.0, 0.0),
            "t": draw.vector(number(-5.0, 5.0, 0.0), number(-5.0, 5.0, 0.0), number(-1.0, -1e-2)),
            "metric": draw.vector(*3 * [number(0.01, 2.0, 1.0)]),
        },
    ),
    "lib/relief_march.glsl:parallax_uv": Domain(
        UV,
        {
            "uv": draw.vector(*2 * [number(0.0, 1.0)]),
            "t": draw.vector(number(-1.0, 1.0, 0.0), number(-1.0, 1.0, 0.0), number(-1.0, -0.05)),
            "depth": number(0.0, 1.0),
        },
    ),
    "lib/relief_patch.glsl:patch_height": Domain(SHARE, {"corners": CORNERS, "at": IN_A_CELL}, between(0.0, 1.0)),
    "lib/relief_patch.glsl:patch_slope": Domain(SHARE, {"corners": CORNERS, "at": IN_A_CELL}, between(-1.0, 1.0)),
    "lib/relief_patch.glsl:patch_hit": Domain(CROSSING, {"corners": CORNERS, "o": _above_a_patch(), "d": SINKING}),
    "lib/sh.glsl:sh_basis": Domain(Measure("of 1", 2e-3), {"d": draw.unit()}),
    "lib/sh.glsl:sh_cosine_factor": Domain(Measure("of 1", 2e-3), {"i": whole(0, 8)}),
    "lib/shadow.glsl:shadow_coordinates": Domain(
        TEXELS, {"position": place(0.01, 10.0), "scene_radius": number(50.0, 200.0)}
    ),
    "lib/signed_length.glsl:signed_length": Domain(
        Measure("lengths", 1e-4), {"face": number(-1.0, 1.0), "sign": draw.choice(-1.0, 1.0), "end": number(-1.0, 1.0)}
    ),
    "lib/sky.glsl:sky_uv": Domain(UV, {"d": place(0.01, 100.0), "rows": draw.choice(8.0, 512.0)}),
    "lib/slab_table.glsl:slab_table_uv": Domain(
        Measure("uv", 1e-3),
        {"size": draw.vector(draw.choice(64.0), draw.choice(32.0))},
        between(0.0, 1.0),
        defines={"PER_OCTAVE": 4},
    ),
    "lib/slab_table.glsl:slab_table_radiance": Domain(
        RADIANCE,
        {"entry": draw.vector(*3 * [number(-10.0, 0.0)])},
        defines={"PER_OCTAVE": 4},
    ),
    "lib/sphere.glsl:SphereIntersect": Domain(
        Measure("radii", 1e-4),
        {
            "rayo": place(0.1, 0.999),
            "sphere_radius_squared": draw.choice(1.0),
            "rayd": eye.rays_to_sphere("rayo", 0.9),
        },
    ),
    "lib/sphere.glsl:sphere_roots": Domain(
        Measure("radii", 1e-4), {"radius": draw.choice(1.0), "o": place(0.1, 100.0), "d": eye.rays_to_sphere("o", 1.1)}
    ),
    "lib/step_characteristic.glsl:step_characteristic": Domain(
        RADIANCE,
        {
            **dict.fromkeys(("entering", "emitted"), draw.colour(1e-2, 100.0)),
            "extinction": draw.colour(1e-2, 100.0),
            "path": number(1e-2, 10.0, log=True),
        },
    ),
    "lib/surface_tangent.glsl:surface_tangent": Domain(
        DIRECTION, {"normal": draw.unit(), "along_u": draw.derived(_along_the_surface)}, is_direction()
    ),
    "lib/suit_talk.glsl:silhouette_ramp": Domain(
        SHARE, {"n_dot_v": number(-0.1, 1.0, 0.0), "k": draw.vector(*4 * [number(-2.0, 2.0)])}, between(0.0, 1.0)
    ),
    "lib/suit_talk.glsl:silhouette_damping": Domain(
        SHARE, {"n_dot_v": number(-0.1, 1.0, 0.0), "width": number(0.0, 1.0)}, between(0.0, 1.0)
    ),
    "lib/suit_talk.glsl:self_shadowing": Domain(
        SHARE, {"n_dot_l": number(-1.0, 1.0, 0.0), "slope": number(1.0, 100.0, log=True)}, between(0.0, 1.0)
    ),
    "lib/suit_talk.glsl:composited": Domain(
        RADIANCE, {**dict.fromkeys(("below", "above"), draw.colour(1e-3, 1.0)), "alpha": number(0.0, 1.0)}
    ),
    "lib/suit_talk.glsl:driven": Domain(
        Measure("of 1", 2e-3),
        {
            "special": draw.vector(draw.choice(1.0), *3 * [number(0.0, 1.0)]),
            "amount": draw.vector(*4 * [number(-1.0, 1.0, 0.0)]),
        },
    ),
    "lib/talk_translucency.glsl:normalised_thickness": Domain(
        SHARE,
        {"front": place(0.01, 1.0), "back": place(0.01, 1.0), "longest": number(0.1, 2.0, log=True)},
        between(0.0, 1.0),
    ),
    "lib/talk_translucency.glsl:area_of_influence": Domain(SHARE, {"n": number(0.5, 64.0)}, between(0.0, 1.0)),
    "lib/vogel.glsl:vogel_point": Domain(SHARE, {"i": _index("count")}, between(-1.0, 1.0)),
    "lib/wrap.glsl:wrap_diffuse": Domain(SHARE, {}, between(0.0, 1.0)),
    # Functions of the passes that read nothing but arguments and uniforms.
    "cornea_anatomical/view.glsl:sees_iris": Domain(
        RADII,
        {
            "x": eye.on_cornea("eyeball"),
            "cornea_normal": draw.derived(lambda made: eye.outer_normal(made["eyeball"], made["x"]), unit_of),
            "d": facing("cornea_normal"),
        },
    ),
    "cornea_talk/eye.frag:blend": Domain(
        SHARE,
        {
            "white": eye.surfaces(draw.unit()),
            "iris": eye.surfaces(eye.with_it("white", "normal")),
            "t": number(0.0, 1.0, 0.5),
        },
    ),
    "cornea_talk/eye.frag:traced_iris": Domain(RADII, eye.talk_iris_of_uniforms()),
    "displacement/box.glsl:box_corner": Domain(EXACT, {"vertex": whole(0, 35)}, between(0.0, 1.0)),
    "displacement/polygon.glsl:between_samples": Domain(
        UV, {"uv": draw.vector(*2 * [number(0.0, 1.0)]), "size": draw.vector(*2 * [draw.choice(2.0, 33.0, 2048.0)])}
    ),
    "displacement/quadtree.glsl:cell_at": Domain(EXACT, {"cells": FIELD, "place": IN_A_FIELD}),
    "displacement/quadtree.glsl:field_span": Domain(
        CROSSING, {"cells": FIELD, "top": number(0.0, 1.0), "o": place(0.1, 1000.0)}
    ),
    "displacement/view.glsl:view_ray": Domain(
        Measure("samples, relative above 1", 1e-3, is_relative=True, floor=1.0),
        {
            "sample_at": draw.vector(whole(0, 1279), whole(0, 1023)),
            "size": draw.vector(draw.choice(1280), draw.choice(1024)),
            "ray_anchor": place(1.0, 300.0),
            "ray_forward": place(300.0, 1e4),
            **dict.fromkeys(("ray_right", "ray_up"), place(1.0, 300.0)),
        },
    ),
    "defocus_layers/octave.glsl:octave_of": Domain(
        EXACT, {"finest_radius": draw.choice(1.0, 2.0), "radius": number(0.0, 256.0, 1.0, 2.0)}
    ),
    "defocus_layers/overlap.glsl:largest_moment": Domain(SHARE, {"area": number(0.0, 1.0, *draw.NEARLY_ONE)}),
    "defocus_layers/overlap.glsl:overlap": Domain(
        SHARE,
        {
            **dict.fromkeys(("a", "b"), number(0.0, 1.0, *draw.NEARLY_ONE)),
            **dict.fromkeys(("moment_a", "moment_b"), draw.vector(*2 * [number(-0.15, 0.15, 0.0)])),
        },
        between(0.0, 1.0 + 1e-6),
    ),
    "defocus_talk/ramps.glsl:far_blur": Domain(
        SHARE, {"f": number(0.0, 1.0), "ramp": number(0.2, 1.5, 1.0)}, between(0.0, 1.0)
    ),
    "defocus_talk/ramps.glsl:near_blur": Domain(
        SHARE, {"f": number(0.0, 1.0), "start": number(0.0, 0.95, 0.85)}, between(0.0, 1.0)
    ),
    "hair/guides.glsl:guide_weights": Domain(SHARE, {"place": draw.vector(*4 * [number(0.0, 1.0)])}, between(0.0, 1.0)),
    "hair_light/extinction.glsl:hair_extinction": Domain(SHARE, HAIR_IN_A_CELL),
    "hair_light/sweep.comp:crossing_skin": Domain(
        RADIANCE,
        {
            "bundle": draw.vector(draw.colour(1e-3, 1e3), number(-1.0, 1.0, 0.0)),
            "cosine": number(-1.0, 1.0),
            "part": number(0.0, 2.0, 0.0),
            "radiance": draw.colour(1e-3, 1e3),
        },
    ),
    "hair_light/march.glsl:own_part": Domain(
        SHARE,
        {"joint": number(1e-3, 1e3, 0.0, log=True), "deviation": number(1e-2, 10.0, log=True)},
        between(0.0, 1.0),
    ),
    "hair_light/march.glsl:free_length": Domain(
        LENGTH, {"s": number(1e-3, 10.0, 0.0, log=True), "joint": number(1e-3, 10.0, 0.0, log=True)}
    ),
    "indirect/bvh.glsl:reciprocal": Domain(LENGTH, {"direction": draw.unit()}),
    "indirect/bvh.glsl:misses_box": Domain(
        EXACT,
        {
            "low": place(0.1, 10.0),
            "high": draw.derived(lambda made: made["low"] + np.abs(made["low"][:, [1, 2, 0]])),
            "origin": _box_face(),
            "inverse": _reciprocal_direction(),
            "end": number(0.1, 100.0, log=True),
        },
    ),
    "indirect_grid/places.glsl:probe_place": Domain(
        LENGTH,
        {
            "per_side": whole(1, 16),
            "box_low": draw.vector(*3 * [number(-10.0, -0.1)]),
            "box_high": draw.vector(*3 * [number(0.1, 10.0)]),
            "probe": _index("per_side", 3),
        },
    ),
    "indirect_grid/seen_from.glsl:triangle_solid_angle": Domain(
        SOLID_ANGLE,
        {"seen_from": ABOVE_A_SQUARE, "a": _corner(-1.0, -1.0), "b": _corner(1.0, -1.0), "c": _corner(1.0, 1.0)},
    ),
    "indirect_grid/seen_from.glsl:edge_vector": Domain(
        Measure("rad", 1e-3), {"seen_from": ABOVE_A_SQUARE, "a": _corner(-1.0, -1.0), "b": _corner(1.0, -1.0)}
    ),
    "indirect_grid/seen_from.glsl:seen_from": Domain(SOLID_ANGLE, {"place": place(0.01, 10.0)}),
    "indirect_grid/seen_from.glsl:band_factor": Domain(
        SHARE, {"k": whole(0, 8), "solid_angle": number(0.0, 2 * math.pi)}, between(-0.2, 1.0)
    ),
    "indirect_grid/seen_from.glsl:sphere_scale": Domain(RADIANCE, {"sum": number(1.0, 20.0, 4 * math.pi)}),
    "indirect_talk/blur.frag:rotated": Domain(SHARE, {"v": draw.unit()}),
    "shadow_vcm/remapped.comp:unpacked": Domain(SHARE, {"packed_uv": draw.vector(*4 * [number(0.0, 1.0)])}),
    "layered/material.glsl:metal_fresnel": Domain(
        SHARE, {"first": METAL["eta"], "second": METAL["k"]}, between(0.0, 1.0 + 1e-6), {"METALS": 2, "FRESNEL": 0}
    ),
}
"""By FILE:FUNCTION."""

CONSTANT = "a constant unless its pass binds a texture for it"
MATRIX = "it takes matrices, which inputs are not drawn as"
WHOLE = "whole numbers alone: there is nothing to round"
WITHOUT = {
    "cornea_anatomical/eye.comp:returned_irradiance": CONSTANT,
    "cornea_talk/eye.frag:visibility": CONSTANT,
    "eye/surroundings.glsl:sky_radiance": CONSTANT,
    "eye/surroundings.glsl:mirrored_radiance": CONSTANT,
    "hair/ribbon.vert:on_target": MATRIX,
    "hair/skinning.glsl:blended_bone": MATRIX,
    "hair/sort.comp:is_after": WHOLE,
    "hair/sort.comp:lower": WHOLE,
}
"""Functions without a domain though they can be run by themselves, and why."""
