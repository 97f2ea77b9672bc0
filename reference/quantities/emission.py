"""What surfaces emit towards the sensor, by ray casts: parity for emitters that are seen.

Hair is left out: an emitter behind it is seen.
"""

from typing import Any

from reference.integrators.ray_casts import Hit, mean_over_pixels
from reference.quantity import Integrator, Quantity
from reference.stage import Stage
from scenes.features import Features
from scenes.image import Float32


def _emitted(hit: Hit) -> list[Any]:
    rgb = hit.si.emitter(hit.stage.scene, hit.valid).eval(hit.si, hit.valid)
    return [rgb.x, rgb.y, rgb.z]


def _exact(stage: Stage) -> Float32:
    return mean_over_pixels(stage, _emitted)


def _integrator(features: Features) -> Integrator:
    why = "what the first surface emits is a deterministic function of the primary rays: no light is transported"
    return Integrator("ray casts", why, exact=_exact)


QUANTITIES = {
    "emission": Quantity(
        "emission",
        "W/(length² sr)",
        "radiance that the first surface emits",
        "radiance",
        channels=3,
        is_sampled=False,
        integrator=_integrator,
    )
}
