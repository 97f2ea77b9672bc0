"""Inputs of the functions that draw an eye: eyes in use, points on them, rays to them, light through the cornea."""

from collections.abc import Callable

import numpy as np

from comparisons.glsl.values import Array, Value
from comparisons.stress import inputs as draw
from comparisons.stress.inputs import Inputs, Kind, dot, unit_of

UP = np.array([0.0, 1.0, 0.0])


def eyes() -> Kind:
    """Eyes in use: a sclera with a radius of about 1, limbus and cornea in proportion, the iris flat or a bowl."""

    def eye(made: Inputs) -> Value:
        sclera, flat = made["sclera"], made["flat"] < 0.5
        limbus = made["limbus"] * sclera
        cornea = limbus * made["bulge"]
        height = np.sqrt(sclera**2 - limbus**2)
        centre = height - np.sqrt(cornea**2 - limbus**2)
        apex = centre + cornea
        plane = height - made["depth"] * (apex - height)
        bowl = limbus * made["bowl"]
        return {
            "sclera_radius": sclera,
            "cornea_radius": cornea,
            "cornea_centre": centre,
            "limbus_radius": limbus,
            "limbus_height": height,
            "apex": apex,
            "iris_plane": plane,
            "iris_curvature": np.where(flat, 0.0, bowl),
            "iris_centre": np.where(flat, 0.0, plane + np.sqrt(bowl**2 - limbus**2)),
            "pupil_radius": 0.35 * limbus,
            "ior": made["ior"],
            "front_ior": made["ior"],
        }

    parts = {
        "sclera": draw.number(0.5, 2.0),
        "limbus": draw.number(0.4, 0.6),
        "bulge": draw.number(1.05, 1.7),
        "flat": draw.choice(0.0, 1.0),
        "depth": draw.number(0.0, 0.1),
        "bowl": draw.number(1.05, 20.0, log=True),
        "ior": draw.number(1.0001, 1.6, 1.376),
    }
    whole = draw.struct(**parts)
    assert whole.extremes is not None
    extremes = whole.extremes
    return Kind(
        lambda rng, count, reach, made: eye(whole.draw(rng, count, 1.0, made)),
        lambda rng, count, made: eye(extremes(rng, count, made)),
        lambda value, made: [eye({name: np.array([x]) for name, x in PLAIN_EYE.items()})],
    )


PLAIN_EYE = {"sclera": 1.0, "limbus": 0.6, "bulge": 1.25, "flat": 0.0, "depth": 0.0, "bowl": 2.0, "ior": 1.376}


def on_cornea(eye: str) -> Kind:
    """A point of the cornea of an eye drawn before: at the apex, at the limbus, or between."""
    return _on_cap(lambda e: (e["cornea_radius"], e["cornea_centre"], e["limbus_radius"]), eye)


def on_iris(eye: str) -> Kind:
    """A point of a flat iris, or of one in a bowl, from the axis to the rim."""

    def point(e: Value, part: Array, phi: Array) -> Array:
        r = part * e["limbus_radius"]
        depth = np.sqrt(np.maximum(e["iris_curvature"] ** 2 - r**2, 0.0))
        y = np.where(e["iris_curvature"] > 0, e["iris_centre"] - depth, e["iris_plane"])
        return np.stack([r * np.cos(phi), y, -r * np.sin(phi)], axis=1)

    return _at_polar(point, eye)


def _on_cap(sphere: Callable[[Value], tuple[Array, Array, Array]], eye: str) -> Kind:
    def point(e: Value, part: Array, phi: Array) -> Array:
        radius, centre, rim = sphere(e)
        r = part * rim
        return np.stack([r * np.cos(phi), centre + np.sqrt(radius**2 - r**2), -r * np.sin(phi)], axis=1)

    return _at_polar(point, eye)


def _at_polar(point: Callable[[Value, Array, Array], Array], eye: str) -> Kind:
    """Points by their part of the rim's radius, of even density, and an angle."""

    def at(rng: np.random.Generator, count: int, reach: float, made: Inputs) -> Array:
        return point(made[eye], np.sqrt(rng.random(count)), rng.uniform(0, 2 * np.pi, count))

    def ends(rng: np.random.Generator, count: int, made: Inputs) -> Array:
        return point(
            made[eye], rng.choice(np.array([0.0, 1e-6, 1 - 1e-6]), count), rng.choice(np.arange(8), count) * np.pi / 4
        )

    return Kind(at, ends, lambda value, made: [point(made[eye], np.zeros(1), np.zeros(1))])


def entries() -> Kind:
    """How light gets from a source in front of the cornea to a point of the iris."""
    return draw.struct(
        point=on_cornea("e"),
        normal=draw.derived(lambda made: outer_normal(made["e"], made["point"]), unit_of),
        to_light=draw.facing("normal", 1.0),
        inverse_r=draw.number(0.0, 1.0),
        iris=on_iris("e"),
        to_entry=draw.derived(lambda made: unit_of(made["point"] - made["iris"]), unit_of),
        s=draw.derived(lambda made: np.sqrt(dot(made["point"] - made["iris"], made["point"] - made["iris"]))),
    )


def sources() -> Kind:
    """A light in front of an eye: a place (w = 1), or a direction (w = 0)."""

    def source(rng: np.random.Generator, count: int, reach: float, made: Inputs) -> Array:
        d = rng.normal(size=(count, 3))
        d[:, 1] = np.abs(d[:, 1]) + 0.5 * np.linalg.norm(d[:, [0, 2]], axis=1)
        far = np.exp(rng.uniform(np.log(3.0), np.log(100.0 * reach), (count, 1)))
        w = rng.choice(np.array([0.0, 1.0]), (count, 1))
        return np.concatenate([unit_of(d) * np.where(w > 0, far, 1.0), w], axis=1)

    return Kind(
        source,
        lambda rng, count, made: np.append(UP, 0.0) * np.ones((count, 1)),
        lambda value, made: [np.array([[0.0, 1.0, 0.0, 0.0]]), np.array([[0.0, 10.0, 0.0, 1.0]])],
    )


def outer_normal(e: Value, p: Array) -> Array:
    """Of the cornea of an eye at a point of its sphere."""
    return unit_of(p - e["cornea_centre"][:, None] * UP)


def on_sclera(name: str) -> Kind:
    """A point of the sclera of an eye drawn before, below the limbus."""

    def point(e: Value, part: Array, phi: Array) -> Array:
        y = e["limbus_height"] - part * (e["limbus_height"] + e["sclera_radius"])
        r = np.sqrt(np.maximum(e["sclera_radius"] ** 2 - y**2, 0.0))
        return np.stack([r * np.cos(phi), y, -r * np.sin(phi)], axis=1)

    return _at_polar(point, name)


def upward() -> Kind:
    """A direction in front of an eye."""
    d = draw.unit()
    return Kind(
        lambda rng, count, reach, made: np.abs(d.draw(rng, count, reach, made)),
        lambda rng, count, made: unit_of(UP + rng.choice(np.array([0.0, 1e-7, 1e4]), (count, 1)) * (1.0, 0.0, 0.0)),
        lambda value, made: [UP[None]],
        meant=unit_of,
    )


def rays_to_sphere(origin: str, radius: float) -> Kind:
    """Directions from an origin drawn before to a place within that distance of the centre."""

    def aim(rng: np.random.Generator, count: int, reach: float, made: Inputs) -> Array:
        inside = unit_of(rng.normal(size=(count, 3))) * radius * rng.random((count, 1)) ** (1 / 3)
        return unit_of(inside - made[origin])

    def ends(rng: np.random.Generator, count: int, made: Inputs) -> Array:
        return unit_of(made[origin] * rng.choice(np.array([-1.0, 1.0]), (count, 1)))

    return Kind(aim, ends, lambda value, made: [unit_of(-made[origin])], meant=unit_of)


def rays_to_eye() -> Kind:
    """Directions from `o` to an eye or past its edge."""
    return rays_to_sphere("o", 1.2)


def rays_to_iris() -> Kind:
    """Directions from a point `o` of the cornea into the eye, from straight ahead to across it."""

    def aim(rng: np.random.Generator, count: int, reach: float, made: Inputs) -> Array:
        d = rng.normal(size=(count, 3))
        d[:, 1] = -np.abs(d[:, 1]) - 0.3 * np.linalg.norm(d[:, [0, 2]], axis=1)
        return unit_of(d)

    def ends(rng: np.random.Generator, count: int, made: Inputs) -> Array:
        across = rng.choice(np.array([0.0, 1.0]), (count, 1)) * np.array([1.0, 0.0, 1e-3])
        return unit_of(
            across - np.where(across[:, :1] > 0, rng.choice(np.array([0.0, 1e-7, 1.0]), (count, 1)), 1.0) * UP
        )

    return Kind(aim, ends, lambda value, made: [-UP[None]], meant=unit_of)


def talk_iris() -> dict[str, Kind]:
    """What the talk's trace of the iris gets: its sphere through the rim, rays from outside."""
    sclera, height = draw.choice(1.0), draw.number(0.6, 0.9, 0.805)
    return {
        "sphere_radius": sclera,
        "limbus_height": height,
        "iris_radius": draw.number(1.05, 10.0),
        "iris_centre": draw.derived(
            lambda made: made["limbus_height"] + np.sqrt(made["iris_radius"] ** 2 - (1.0 - made["limbus_height"] ** 2))
        ),
        "normal": _on_the_cap(lambda made: made["limbus_height"]),
        "coord": draw.derived(lambda made: made["normal"], unit_of),
        "ray": draw.facing("normal"),
        "ior": draw.number(1.2, 1.6, 1.376),
    }


def talk_iris_of_uniforms() -> dict[str, Kind]:
    """As `talk_iris`, where the eye is a uniform."""
    return {
        "talk_iris_radius": draw.scaled(draw.number(1.05, 10.0), lambda made: made["eyeball"]["limbus_radius"]),
        "talk_iris_centre": draw.derived(
            lambda made: (
                made["eyeball"]["limbus_height"]
                + np.sqrt(made["talk_iris_radius"] ** 2 - made["eyeball"]["limbus_radius"] ** 2)
            )
        ),
        "N": _on_the_cap(lambda made: made["eyeball"]["limbus_height"] / made["eyeball"]["sclera_radius"]),
        "coord": draw.derived(lambda made: made["N"] * made["eyeball"]["sclera_radius"][:, None]),
        "V": draw.facing("N"),
    }


def _on_the_cap(height: Callable[[Inputs], Array]) -> Kind:
    """The normal of a point of the sphere above a part of its radius: where the talk's iris shows."""

    def cap(part: Array, phi: Array, made: Inputs) -> Array:
        y = 1.0 - part * (1.0 - height(made))
        r = np.sqrt(1.0 - y * y)
        return np.stack([r * np.cos(phi), y, r * np.sin(phi)], axis=1)

    return Kind(
        lambda rng, count, reach, made: cap(rng.random(count), rng.uniform(0, 2 * np.pi, count), made),
        lambda rng, count, made: cap(rng.choice(np.array([0.0, 1e-6, 1 - 1e-6]), count), np.zeros(count), made),
        lambda value, made: [UP[None]],
        lambda value, made: bool(value[0, 1] > height(made)[0]),
        unit_of,
    )


def surfaces(normal: Kind) -> Kind:
    """What the talk blends: a place, a normal, colours and an exponent."""
    return draw.struct(
        point=draw.place(0.5, 1.5),
        normal=normal,
        diffuse=draw.colour(0.01, 1.0),
        specular=draw.colour(0.01, 6.0),
        exponent=draw.choice(4000.0),
    )


def with_it(other: str, part: str) -> Kind:
    """A direction at less than a right angle to that of a struct drawn before; against it at the extreme."""

    def near(rng: np.random.Generator, count: int, reach: float, made: Inputs) -> Array:
        d = unit_of(rng.normal(size=(count, 3)))
        return d * np.where(dot(d, made[other][part]) < 0, -1.0, 1.0)[:, None]

    return Kind(
        near, lambda rng, count, made: -made[other][part], lambda value, made: [-made[other][part]], meant=unit_of
    )
