"""Every technique on a scene with few pixels, quickly: what tests of all of them share."""

from typing import Any

from scenes.load import find_scene, load_scene
from scenes.model import Scene

CAPTURE: dict[str, Any] = {"side": 12, "block": 6, "shadow_side": 32, "facets": 2}
PARTS: dict[str, Any] = {
    "facets": 2,
    "rays": 8,
    "cells": 8,
    "iterations": 2,
    "shadow_side": 64,
    "light_side": 64,
    "sky_rays": 8,
}
SETTINGS: dict[str, dict[str, Any]] = {
    "indirect.talk": {"side": 16},
    "indirect.probe": CAPTURE,
    "indirect.irradiance": CAPTURE | {"subject_surfels": 16},
    "indirect.grid": CAPTURE | {"subject_surfels": 16, "probes": 2, "directions": 32},
    "translucency.ordinates": {"cells": 8, "iterations": 2, "light_side": 64, "pieces": 2},
    "cornea.anatomical_iris": {"sky_rays": 8},
    "cornea.anatomical": {"side": 12, "shadow_side": 32, "sky_rays": 8},
    "defocus.accumulate": {"views": 16, "shadow_side": 64},
    "defocus.layers": {"taps": 50, "shadow_side": 64},
    "shadow.soft": {"method": "pcss", "side": 64},
    "lighting.talk": {"side": 16},
    "shadow.soft_talk": {"side": 16},
    "hair.frame": {"cells": 8, "iterations": 2, "shadow_side": 64},
    "character.talk": PARTS,
    "character.accurate": PARTS,
}
SCENES = {
    "indirect": "small-room-knot",
    "translucency": "skin-slab",
    "cornea": "eye-talk-view30-light40",
    "defocus": "defocus-crisp-foreground",
    "shadow": "shadow-room-10cm",
    "lighting": "shadow-room-10cm",
    "displacement": "relief-tiles-lamp",
    "layered": "suit-woven",
    "hair": "hair-groomed",
    "character": "character-bust",
    "raster": "parity-wide",
}
"""For each family of techniques one that makes them run most of their passes."""


def small(name: str) -> Scene:
    """A scene of the library with few pixels."""
    scene = load_scene(find_scene(name))
    sensor = scene.sensor
    width = max(8, round(16 * sensor.width / max(sensor.width, sensor.height)))
    height = max(1, round(width * sensor.height / sensor.width))
    return scene.model_copy(update={"sensor": sensor.model_copy(update={"width": width, "height": height})})
