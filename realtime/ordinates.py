"""Discrete ordinates: the directions in which light travels, and how its scattering is iterated."""

from itertools import permutations, product

import numpy as np

from scenes.image import Float32, Float64

LEVEL_SYMMETRIC: dict[int, tuple[tuple[float, ...], dict[tuple[int, int, int], float]]] = {
    4: ((0.3500212, 0.8688903), {(0, 0, 1): 1 / 3}),
    6: ((0.2666355, 0.6815076, 0.9261808), {(0, 0, 2): 0.1761263, (0, 1, 1): 0.1572071}),
    8: (
        (0.2182179, 0.5773503, 0.7867958, 0.9511897),
        {(0, 0, 3): 0.1209877, (0, 1, 2): 0.0907407, (1, 1, 1): 0.0925926},
    ),
}
"""Cosines of the sets S4, S6 and S8, and the weights in an octant of the directions that three of them make.

Lewis & Miller 1984, "Computational Methods of Neutron Transport", table 4-1.
"""


def level_symmetric(order: int) -> Float32:
    """Directions and weights (order (order + 2), 4), the weights of sum 1."""
    cosines, weights = LEVEL_SYMMETRIC[order]
    return np.array(
        [
            [sx * cosines[i], sy * cosines[j], sz * cosines[k], weight / 8]
            for levels, weight in weights.items()
            for i, j, k in sorted(set(permutations(levels)))
            for sx, sy, sz in product((-1, 1), repeat=3)
        ],
        dtype=np.float32,
    )


EXTRAPOLATION = 0.7104
"""Mean free paths outside a body where diffuse light would vanish. Chandrasekhar 1960, section 27 (Hopf's number)."""


def largest_eigenvalue(albedo: Float64, optical_size: Float64) -> Float64:
    """Part (C,) of slowly dying scattered light that one more scattering leaves, in a box of albedo (C,).

    optical_size (C, 3) are the box's edges in mean free paths. Light that varies as the box's lowest mode, of buckling
    B, is left in the part albedo * arctan(B) / B (Case & Zweifel 1967, "Linear Transport Theory", section 2.2, in a
    Fourier mode); what is inside the box leaks more.
    """
    B = np.sqrt(np.sum((np.pi / (optical_size + 2 * EXTRAPOLATION)) ** 2, axis=1))
    left: Float64 = albedo * np.arctan(B) / B
    return left


def chebyshev(largest: Float64, steps: int) -> tuple[Float64, list[Float64]]:
    """Damping (C,) and omegas (steps of (C,)) for an iteration whose eigenvalues lie between 0 and `largest` (C,).

    Golub & Varga 1961, "Chebyshev Semi-Iterative Methods", eqs. 2.11 and 2.13, after a shift that centres them.
    """
    damping = 2 / (2 - largest)
    spread = largest / (2 - largest)
    omegas = [np.ones_like(largest)]
    for step in range(1, steps):
        omegas.append(1 / (1 - spread**2 * omegas[-1] / (2 if step == 1 else 4)))
    return damping, omegas
