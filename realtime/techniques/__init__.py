"""The registry of techniques: one module each, named here and imported when asked for.

Those of a user are added by `realtime.own.load_own`.
"""

import importlib

from realtime.technique import Technique
from scenes.errors import InputError, unknown_name

MODULES = {
    "raster.depth": "realtime.techniques.raster",
    "raster.normal": "realtime.techniques.raster",
    "raster.albedo": "realtime.techniques.raster",
    "raster.emission": "realtime.techniques.raster",
    "raster.coverage": "realtime.techniques.raster",
    "indirect.talk": "realtime.techniques.indirect_talk",
    "indirect.probe": "realtime.techniques.indirect_probe",
    "indirect.irradiance": "realtime.techniques.indirect_irradiance",
    "indirect.grid": "realtime.techniques.indirect_grid",
    "translucency.talk_thickness": "realtime.techniques.translucency_talk",
    "translucency.talk": "realtime.techniques.translucency_talk",
    "translucency.additive_thickness": "realtime.techniques.translucency_additive",
    "translucency.additive": "realtime.techniques.translucency_additive",
    "translucency.ordinates": "realtime.techniques.translucency_ordinates",
    "cornea.talk_uv": "realtime.techniques.cornea_talk",
    "cornea.talk_iris": "realtime.techniques.cornea_talk",
    "cornea.talk": "realtime.techniques.cornea_talk",
    "cornea.anatomical_uv": "realtime.techniques.cornea_anatomical",
    "cornea.anatomical_iris": "realtime.techniques.cornea_anatomical",
    "cornea.anatomical": "realtime.techniques.cornea_anatomical",
    "defocus.talk": "realtime.techniques.defocus_talk",
    "defocus.layers": "realtime.techniques.defocus_layers",
    "defocus.accumulate": "realtime.techniques.defocus_accumulate",
    "shadow.vcm": "realtime.techniques.shadow_vcm",
    "shadow.vcm_literal": "realtime.techniques.shadow_vcm",
    "shadow.vcm_analytic": "realtime.techniques.shadow_vcm",
    "shadow.soft_talk": "realtime.techniques.shadow_soft_talk",
    "shadow.soft": "realtime.techniques.shadow_soft",
    "lighting.talk": "realtime.techniques.lighting_talk",
    "displacement.parallax_uv": "realtime.techniques.displacement_parallax",
    "displacement.parallax": "realtime.techniques.displacement_parallax",
    "displacement.talk_uv": "realtime.techniques.displacement_talk",
    "displacement.talk": "realtime.techniques.displacement_talk",
    "displacement.quadtree_uv": "realtime.techniques.displacement_quadtree",
    "displacement.quadtree": "realtime.techniques.displacement_quadtree",
    "layered.talk": "realtime.techniques.layered_talk",
    "layered.ggx": "realtime.techniques.layered_ggx",
    "hair.talk_geometry": "realtime.techniques.hair_talk",
    "hair.talk_tangent": "realtime.techniques.hair_talk",
    "hair.talk_coverage": "realtime.techniques.hair_talk",
    "hair.talk": "realtime.techniques.hair_talk",
    "hair.frame_geometry": "realtime.techniques.hair_frame",
    "hair.frame_tangent": "realtime.techniques.hair_frame",
    "hair.frame_coverage": "realtime.techniques.hair_frame",
    "hair.frame": "realtime.techniques.hair_frame",
    "character.talk": "realtime.techniques.character",
    "character.accurate": "realtime.techniques.character",
}

OWN: dict[str, Technique] = {}
"""Techniques of a user, by name: filled by `realtime.own`."""


def technique(name: str) -> Technique:
    """Raises InputError for an unknown name."""
    if name in OWN:
        return OWN[name]
    if name not in MODULES:
        unknown = unknown_name("technique", name, (*MODULES, *OWN))
        own = "If it is your own, name its file with --technique, or in pytest with lightgauge_techniques."
        raise InputError(f"{unknown} {own}")
    found: Technique = importlib.import_module(MODULES[name]).TECHNIQUES[name]
    return found
