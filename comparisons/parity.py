"""Parity: do both sides see the same scene? Judged for every scene before any of its radiance is."""

from scenes.checks import Check, Criterion
from scenes.materials import Diffuse, Material, Texture
from scenes.model import AreaLight, Scene

_GRID = "both sides average the same 8 x 8 positions a pixel; what is left are samples that fall on an edge"

PARITY = (
    Check(
        quantity="normal",
        technique="raster.normal",
        criteria=(
            Criterion(metric="shift_px", max=0.01, reason="a hundredth of a pixel moves no radiance that matters"),
            Criterion(metric="rms", max=0.0025, reason=_GRID),
        ),
    ),
    Check(
        quantity="depth",
        technique="raster.depth",
        criteria=(
            Criterion(metric="shift_px", max=0.01, reason="a hundredth of a pixel moves no radiance that matters"),
            Criterion(metric="rel_rms", max=0.005, reason=_GRID),
        ),
    ),
    Check(
        quantity="coverage",
        technique="raster.coverage",
        criteria=(Criterion(metric="rms", max=0.004, reason=_GRID),),
    ),
    Check(
        quantity="emission",
        technique="raster.emission",
        criteria=(
            Criterion(metric="rel_rms", max=0.02, reason="patterns of emitters and their decoding must agree"),
            Criterion(metric="rel_mse_eps1e-2", max=0.004, reason="beside bright lamps, dim emitters must agree too"),
        ),
    ),
    Check(
        quantity="albedo",
        technique="raster.albedo",
        criteria=(Criterion(metric="rel_rms", max=0.02, reason="materials, textures and their decoding must agree"),),
    ),
)

QUANTITIES = frozenset(check.quantity for check in PARITY)


def _reflects(material: Material) -> bool:
    return isinstance(material, Diffuse) and (isinstance(material.reflectance, Texture) or any(material.reflectance))


def checks_of(scene: Scene) -> tuple[Check, ...]:
    """All checks of a scene, parity first; one that the scene spells out itself replaces the standard one.

    Colours are compared by albedo, or where nothing reflects by emission: lamps are often out of sight.
    """
    own = {(c.quantity, c.technique): c for c in scene.checks if c.quantity in QUANTITIES}
    reflects = any(_reflects(material) for material in scene.materials.values())
    emits = any(isinstance(emitter, AreaLight) for emitter in scene.emitters)
    needless = {"albedo": not reflects, "emission": reflects or not emits}
    parity = [own.pop((c.quantity, c.technique), c) for c in PARITY if not needless.get(c.quantity)]
    return (*parity, *own.values(), *(c for c in scene.checks if c.quantity not in QUANTITIES))
