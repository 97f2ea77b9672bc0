"""Parity: do both sides see the same scene? Judged for every scene before any of its radiance is."""

from scenes.model import Check, Criterion, Diffuse, Scene

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
        criteria=(Criterion(metric="rms", max=0.01, reason=_GRID),),
    ),
    Check(
        quantity="albedo",
        technique="raster.albedo",
        criteria=(
            Criterion(
                metric="rms", max=0.01, reason="materials, textures and their decoding must agree; edges as above"
            ),
        ),
    ),
)

QUANTITIES = frozenset(check.quantity for check in PARITY)


def checks_of(scene: Scene) -> tuple[Check, ...]:
    """All checks of a scene, parity first; one that the scene spells out itself replaces the standard one.

    Where nothing reflects diffusely there is no albedo to compare.
    """
    own = {(c.quantity, c.technique): c for c in scene.checks if c.quantity in QUANTITIES}
    has_albedo = any(isinstance(material, Diffuse) for material in scene.materials.values())
    parity = [own.pop((c.quantity, c.technique), c) for c in PARITY if has_albedo or c.quantity != "albedo"]
    return (*parity, *own.values(), *(c for c in scene.checks if c.quantity not in QUANTITIES))
