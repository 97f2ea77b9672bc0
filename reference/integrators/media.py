"""Bodies that scatter evenly and do not refract, and free paths in them, for loops of Dr.Jit.

Free paths are drawn for one channel, chosen anew each time in proportion to the throughput beta_c, so that their
density is that of all channels together: with s_c = beta_c / sum(beta),
    scattering after t:  beta_c <- beta_c sigma_s,c exp(-sigma_t,c t) / sum over k of s_k sigma_t,k exp(-sigma_t,k t),
    passing a length l:  beta_c <- beta_c exp(-sigma_t,c l) / sum over k of s_k exp(-sigma_t,k l).
The sum of beta never grows. That is the balance heuristic over channels of Miller, Georgiev, Jarosz 2019, "A
null-scattering path integral formulation of light transport" (spectral MIS), with the choice by throughput of Chiang,
Kutz, Burley 2016, "Practical and controllable subsurface scattering for production path tracing".
"""

from collections.abc import Iterable
from typing import Any

import drjit as dr
import numpy as np

STEP = 2.0**-20
"""Beyond a body's surface a ray is cast anew along the same line, so that what it was aimed at stays there: so far
behind the hit, as part of the largest coordinate of what is traced. 8 spacings of float32.
"""

JUST_BEFORE = 1 - 1e-4
"""Part of the way to an emitter that is searched for what hides it: the emitter itself does not."""

RUSSIAN_ROULETTE_BELOW = 0.5
"""Throughput under which paths end by chance; the weights of survivors grow, so that nothing is lost."""


class Bodies:
    """Those of some shapes that a medium fills, and its coefficients per unit of length; constants of a loop.

    step : `STEP` in units of the scene, where rays start at any of the shapes
    """

    def __init__(self, mi: Any, shapes: Iterable[Any]) -> None:
        self.step = 0.0
        self._media = []
        for shape in shapes:
            box = shape.bbox()
            self.step = max(self.step, STEP * float(np.abs([box.min, box.max]).max()))
            medium = shape.interior_medium()
            if medium is not None:
                sigma_s, _, sigma_t = medium.get_scattering_coefficients(dr.zeros(mi.MediumInteraction3f))
                self._media.append((mi.ShapePtr(shape), sigma_s, sigma_t))

    def at(self, mi: Any, shape: Any) -> tuple[Any, Any, Any]:
        """Whether shapes that were hit are bodies, and their sigma_s and sigma_t, as colours."""
        is_body, sigma_s, sigma_t = mi.Bool(False), mi.Color3f(0.0), mi.Color3f(0.0)
        for own, scattering, extinction in self._media:
            is_own = shape == own
            is_body |= is_own
            sigma_s = dr.select(is_own, scattering, sigma_s)
            sigma_t = dr.select(is_own, extinction, sigma_t)
        return is_body, sigma_s, sigma_t


def free_path(sampler: Any, beta: Any, sigma_s: Any, sigma_t: Any, in_medium: Any, reach: Any) -> tuple[Any, Any, Any]:
    """How far paths of the throughput `beta` get before they scatter, at most a length `reach` that may be infinite.

    Returns
    -------
    Whether they scatter there, the distance, and what that does to their throughput: nothing outside of a medium.
    """
    share = beta / dr.sum(beta)
    chosen = chosen_channel(share, sigma_t, sampler.next_1d())
    drawn = -dr.log(1.0 - sampler.next_1d()) / chosen
    scatters = in_medium & (drawn < reach)
    distance = dr.select(scatters, drawn, reach)
    transmittance = dr.exp(-sigma_t * distance)
    scattered = sigma_s / dr.sum(share * sigma_t * transmittance)
    passed = 1.0 / dr.sum(share * transmittance)
    return scatters, distance, dr.select(in_medium, transmittance * dr.select(scatters, scattered, passed), 1.0)


def chosen_channel(share: Any, value: Any, sample: Any) -> Any:
    """The channel of `value` that a number in [0, 1) falls on when the channels have these shares."""
    return dr.select(sample < share.x, value.x, dr.select(sample < share.x + share.y, value.y, value.z))
