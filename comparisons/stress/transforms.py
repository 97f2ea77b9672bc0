"""What stresses do to a scene: pure functions from a frozen scene to another, whose image is known from the first's."""

from collections.abc import Callable
from typing import Any

import numpy as np

from scenes.image import Float64
from scenes.materials import Diffuse, Material, Translucent
from scenes.media import coefficients
from scenes.model import (
    AreaLight,
    ConstantLight,
    DirectionalLight,
    DiskLight,
    Emitter,
    LineLight,
    Perspective,
    PointLight,
    Scene,
    SphereLight,
    ThinLens,
)
from scenes.placing import POINTS, mapped, vec3, with_points_mapped
from scenes.procedural import rotation_xyz
from scenes.shapes import Rectangle, Room, Shape
from scenes.units import Rgb, Vec3

DIRECTIONS = ("direction", "normal")
LENGTHS = ("radius",)
STRENGTHS = ("intensity", "irradiance", "radiance", "scale")
"""The fields of emitters that a transform changes, by what they are. `scale` is that of an environment map."""

CARD = "far-card"
CARD_SIZE = 1e-3
"""Side of a far card in viewing distances."""


def viewing_distance(scene: Scene) -> float:
    """From the sensor to what it looks at: the scene's own measure of length, known without its geometry."""
    return float(np.linalg.norm(np.subtract(scene.sensor.target, scene.sensor.origin)))


def scaled(scene: Scene, factor: float) -> Scene:
    """Every length times `factor`, with the same radiance everywhere: point lights and media follow suit."""
    moved = with_points_mapped(scene, lambda point: factor * point)
    lens = {"aperture_radius", "focus_distance"} & set(type(scene.sensor).model_fields)
    return moved.model_copy(
        update={
            "sensor": _times(moved.sensor, factor, tuple(lens)),
            "materials": {name: _thinned(scene, material, factor) for name, material in scene.materials.items()},
            "shapes": tuple(_times(shape, factor, ("scale",)) for shape in moved.shapes),
            "hair": tuple(_times(hair, factor, ("length", "radius")) for hair in scene.hair),
            "emitters": tuple(_grown(light, factor) for light in moved.emitters),
        }
    )


def turned(scene: Scene, rotation: Float64) -> Scene:
    """Everything turned about the origin by a rotation (3, 3). Environment maps are not: they have no rotation."""
    turn: Callable[[Float64], Float64] = lambda vector: rotation @ vector  # noqa: E731
    placed = with_points_mapped(scene, turn)
    return placed.model_copy(
        update={
            "sensor": mapped(placed.sensor, ("up",), turn),
            "shapes": tuple(_rotated(shape, rotation) for shape in placed.shapes),
            "emitters": tuple(mapped(light, DIRECTIONS, turn) for light in placed.emitters),
        }
    )


def exposed(scene: Scene, factor: float) -> Scene:
    """Every emitter `factor` times as strong."""
    return scene.model_copy(update={"emitters": tuple(_times(light, factor, STRENGTHS) for light in scene.emitters)})


def unlit(scene: Scene) -> Scene:
    """No emitter at all."""
    return scene.model_copy(update={"emitters": ()})


def reflecting(scene: Scene, reflectance: float) -> Scene:
    """Every diffuse surface with this reflectance; every medium scatters all that it takes out of light, or nothing."""
    materials = {name: _with_albedo(scene, material, reflectance) for name, material in scene.materials.items()}
    return scene.model_copy(update={"materials": materials})


def under_white_sky(scene: Scene) -> Scene:
    """The subject alone, under a sky of radiance 1, all of whose surfaces and media absorb nothing."""
    shapes = tuple(shape for shape in scene.shapes if shape.name in scene.subject)
    sky = ConstantLight(type="constant", radiance=(1.0, 1.0, 1.0))
    return reflecting(scene.model_copy(update={"shapes": shapes, "emitters": (sky,)}), 1.0)


def glowing_room(scene: Scene, reflectance: float) -> Scene:
    """Every room's walls emit radiance 1 and nothing else emits; everything has this reflectance."""
    lights = tuple(
        AreaLight(type="area", shape=shape.name, radiance=(1.0, 1.0, 1.0))
        for shape in scene.shapes
        if isinstance(shape, Room)
    )
    return reflecting(scene.model_copy(update={"emitters": lights}), reflectance)


def with_aperture(scene: Scene, factor: float) -> Scene:
    """The lens `factor` times as wide."""
    return scene.model_copy(update={"sensor": _times(scene.sensor, factor, ("aperture_radius",))})


def with_pinhole(scene: Scene) -> Scene:
    """The sensor without its lens."""
    fields = {name: getattr(scene.sensor, name) for name in Perspective.model_fields}
    return scene.model_copy(update={"sensor": Perspective(**(fields | {"type": "perspective"}))})


def with_points(scene: Scene) -> Scene:
    """Balls of light shrunk to points of the same power."""
    return scene.model_copy(update={"emitters": tuple(_as_point(light) for light in scene.emitters)})


def with_balls(scene: Scene, radius: float) -> Scene:
    """Points of light grown to balls of the same power."""
    return scene.model_copy(update={"emitters": tuple(_as_ball(light, radius) for light in scene.emitters)})


def with_sensor(scene: Scene, **fields: Any) -> Scene:
    """The sensor with some of its fields replaced."""
    return scene.model_copy(update={"sensor": scene.sensor.model_copy(update=fields)})


def seen_from(scene: Scene, degrees: float) -> Scene:
    """The sensor moved around what it looks at, about its up axis."""
    sensor = scene.sensor
    rotation, target = axis_rotation(sensor.up, degrees), np.array(sensor.target)
    origin = target + rotation @ (np.array(sensor.origin) - target)
    return with_sensor(scene, origin=vec3(origin))


def lit_from(scene: Scene, degrees: float) -> Scene:
    """Emitters that are no shapes moved around what the sensor looks at, about its up axis."""
    rotation, target = axis_rotation(scene.sensor.up, degrees), np.array(scene.sensor.target)
    around: Callable[[Float64], Float64] = lambda point: target + rotation @ (point - target)  # noqa: E731
    turn: Callable[[Float64], Float64] = lambda vector: rotation @ vector  # noqa: E731
    lights = (mapped(mapped(light, POINTS, around), DIRECTIONS, turn) for light in scene.emitters)
    return scene.model_copy(update={"emitters": tuple(lights)})


def with_far_card(scene: Scene, distance: float) -> Scene:
    """A black card too small to be seen at `distance` viewing distances, a quarter of the field off the view's middle.

    It changes nothing but the extent of the scene.
    """
    sensor, length = scene.sensor, viewing_distance(scene)
    forward = np.subtract(sensor.target, sensor.origin) / length
    right = np.cross(forward, sensor.up)
    up = np.cross(right, forward) / np.linalg.norm(right)
    place = sensor.origin + distance * length * (forward + np.tan(np.radians(sensor.fov_deg / 4)) * up)
    card = Rectangle(
        type="rectangle",
        name=CARD,
        material=CARD,
        position=vec3(place),
        size=(CARD_SIZE * length, CARD_SIZE * length),
    )
    black = Diffuse(type="diffuse", reflectance=(0.0, 0.0, 0.0))
    return scene.model_copy(update={"shapes": (*scene.shapes, card), "materials": scene.materials | {CARD: black}})


def axis_rotation(axis: Vec3, degrees: float) -> Float64:
    """The matrix (3, 3) that turns column vectors about an axis. Rodrigues' rotation formula."""
    x, y, z = np.array(axis) / np.linalg.norm(axis)
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    angle = np.radians(degrees)
    rotation: Float64 = np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross
    return rotation


def euler_deg(rotation: Float64) -> Vec3:
    """The angles of `scenes.procedural.rotation_xyz`; where two of its axes coincide, the last one is 0."""
    sine = float(np.clip(-rotation[2, 0], -1, 1))
    if abs(sine) < 1 - 1e-12:
        x, z = np.arctan2(rotation[2, 1], rotation[2, 2]), np.arctan2(rotation[1, 0], rotation[0, 0])
    else:
        x, z = np.arctan2(-rotation[1, 2], rotation[1, 1]), 0.0
    return vec3(np.degrees([x, np.arcsin(sine), z]))


def _times(part: Any, factor: float, names: tuple[str, ...]) -> Any:
    """A sensor, shape or emitter with those of the fields that it has multiplied."""
    update: dict[str, Any] = {}
    for name in names:
        if name in type(part).model_fields:
            value = getattr(part, name)
            update[name] = tuple(factor * v for v in value) if isinstance(value, tuple) else factor * value
    return part.model_copy(update=update)


def _rotated(shape: Shape, rotation: Float64) -> Shape:
    return shape.model_copy(update={"rotation_deg": euler_deg(rotation @ rotation_xyz(shape.rotation_deg))})


def _grown(light: Emitter, factor: float) -> Emitter:
    if isinstance(light, PointLight):
        return _times(light, factor**2, ("intensity",))  # type: ignore[no-any-return]
    return _times(light, factor, LENGTHS) if isinstance(light, SphereLight | DiskLight | LineLight) else light


def _thinned(scene: Scene, material: Material, factor: float) -> Material:
    """A medium in which light goes `factor` times as far."""
    if not isinstance(material, Translucent):
        return material
    return _medium(*(vec3(sigma / factor) for sigma in coefficients(material, scene.length_unit)))


def _with_albedo(scene: Scene, material: Material, reflectance: float) -> Material:
    if not isinstance(material, Translucent):
        return Diffuse(type="diffuse", reflectance=(reflectance, reflectance, reflectance))
    extinction = sum(coefficients(material, scene.length_unit))
    return _medium(vec3((1 - reflectance) * extinction), vec3(reflectance * extinction))


def _medium(sigma_a: Rgb, sigma_s: Rgb) -> Translucent:
    return Translucent(type="translucent", sigma_a=sigma_a, sigma_s=sigma_s)


def _as_point(light: Emitter) -> Emitter:
    """A ball of radiance L and radius r shines like a point of intensity pi r^2 L, seen from anywhere outside."""
    if not isinstance(light, SphereLight):
        return light
    intensity = vec3(np.pi * light.radius**2 * np.array(light.radiance))
    return PointLight(type="point", position=light.position, intensity=intensity)


def _as_ball(light: Emitter, radius: float) -> Emitter:
    if not isinstance(light, PointLight):
        return light
    radiance = vec3(np.array(light.intensity) / (np.pi * radius**2))
    return SphereLight(type="sphere", position=light.position, radius=radius, radiance=radiance)


def is_movable(light: Emitter) -> bool:
    """Whether `lit_from` moves it."""
    return isinstance(light, PointLight | SphereLight | DirectionalLight | DiskLight | LineLight)


def has_open_lens(scene: Scene) -> bool:
    """Whether the sensor has a lens of some width."""
    return isinstance(scene.sensor, ThinLens) and scene.sensor.aperture_radius > 0
