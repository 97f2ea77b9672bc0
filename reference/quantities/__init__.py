"""The registry of quantities: one module each, named here and imported when asked for."""

import importlib

from reference.quantity import Quantity
from scenes.errors import unknown_name

MODULES = {
    "depth": "reference.quantities.geometry",
    "normal": "reference.quantities.geometry",
    "coverage": "reference.quantities.geometry",
    "albedo": "reference.quantities.geometry",
    "emission": "reference.quantities.emission",
    "radiance": "reference.quantities.radiance",
    "direct_radiance": "reference.quantities.radiance",
    "indirect_radiance": "reference.quantities.radiance",
    "defocus_radiance": "reference.quantities.defocus",
    "frame_radiance": "reference.quantities.defocus",
    "thickness": "reference.quantities.translucency",
    "transmitted_radiance": "reference.quantities.translucency",
    "receiver_coverage": "reference.quantities.visibility",
    "visibility": "reference.quantities.visibility",
    "iris_coverage": "reference.quantities.eye",
    "iris_uv": "reference.quantities.eye",
    "eye_radiance": "reference.quantities.eye",
    "iris_radiance": "reference.quantities.eye",
    "iris_radiance_flat": "reference.quantities.eye",
    "iris_radiance_straight": "reference.quantities.eye",
    "displaced_uv": "reference.quantities.displacement",
    "displaced_radiance": "reference.quantities.displacement",
    "layered_radiance": "reference.quantities.layered",
    "hair_geometry": "reference.quantities.hair_frames",
    "hair_tangent": "reference.quantities.hair_frames",
    "hair_coverage": "reference.quantities.hair",
    "hair_radiance": "reference.quantities.hair",
    "full_radiance": "reference.quantities.full",
}

EFFECTS = {
    "parity": ("depth", "normal", "coverage", "albedo", "emission", "receiver_coverage", "iris_coverage"),
    "indirect light": ("radiance", "direct_radiance", "indirect_radiance"),
    "translucency": ("thickness", "transmitted_radiance"),
    "eye": ("iris_uv", "eye_radiance", "iris_radiance", "iris_radiance_flat", "iris_radiance_straight"),
    "defocus": ("defocus_radiance",),
    "shadows": ("visibility",),
    "whole frame": ("frame_radiance",),
    "displacement": ("displaced_uv", "displaced_radiance"),
    "layered suit": ("layered_radiance",),
    "hair": ("hair_geometry", "hair_tangent", "hair_coverage", "hair_radiance"),
    "character": ("full_radiance",),
}
"""What a shading engineer calls the subject that a quantity belongs to."""


def effect_of(name: str) -> str:
    """The effect that a quantity belongs to."""
    return next((effect for effect, names in EFFECTS.items() if name in names), "other")


def quantity(name: str) -> Quantity:
    """Raises InputError for an unknown name."""
    if name not in MODULES:
        raise unknown_name("quantity", name, MODULES)
    found: Quantity = importlib.import_module(MODULES[name]).QUANTITIES[name]
    return found
