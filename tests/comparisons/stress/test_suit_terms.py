"""The talk's suit in double precision: each formula of its shader is numpy's to a relative squared error of 1e-10."""

from collections.abc import Callable

import numpy as np
import pytest

from comparisons.glsl.values import Array
from comparisons.stress.examination import subject
from comparisons.stress.inputs import Inputs, drawn
from scenes.image import Float64

BLINN, SUIT = "lib/blinn_phong.glsl", "lib/suit_talk.glsl"


def blinn_phong(x: Inputs) -> Float64:
    """Cosines by the angle between N and H, with its sine."""
    h = x["L"] + x["to_eye"]
    length = np.linalg.norm(h, axis=1)
    with np.errstate(invalid="ignore", divide="ignore"):
        cosine = np.einsum("nk,nk->n", x["N"], h) / length
    return np.where((length > 1e-3) & (cosine > 0), np.minimum(np.nan_to_num(cosine), 1) ** x["exponent"], 0.0)


def widened(x: Inputs) -> Float64:
    alpha2 = np.minimum(2 / (x["n"] + 2) + (x["spread"] / 0.925) ** 2, 1)
    return np.asarray(2 / alpha2 - 2)


def normalisation(x: Inputs) -> Float64:
    """1 over the integral over the angle t of H from N: cos(t)^n sin(2 t) 4 pi dt, to t = 45 degrees.

    The angle of L is twice that of H, and L stays above the horizon; with s = cos(t)^2, that is 4 pi / (n / 2 + 1)
    (1 - 2^-(n / 2 + 1)), here by quadrature.
    """
    nodes, weights = np.polynomial.legendre.leggauss(2000)
    t = (nodes + 1) / 2 * np.pi / 4
    integral = np.exp(np.outer(x["n"], np.log(np.cos(t)))) @ (weights * np.sin(2 * t)) * 4 * np.pi * np.pi / 8
    return np.asarray(1 / integral)


def ramp(x: Inputs) -> Float64:
    u = 1 - np.clip(x["n_dot_v"], 0, 1)
    return np.asarray(np.clip(np.einsum("nk,nk->n", x["k"], np.stack([u**i for i in range(4)], axis=1)), 0, 1))


def damping(x: Inputs) -> Float64:
    with np.errstate(invalid="ignore", divide="ignore"):
        t = np.clip(x["n_dot_v"] / x["width"], 0, 1)
    return np.where(x["width"] > 0, t * t * (3 - 2 * t), 1.0)


TERMS: dict[str, Callable[[Inputs], Array]] = {
    f"{BLINN}:blinn_phong": blinn_phong,
    f"{BLINN}:alpha_of_exponent": lambda x: np.sqrt(2 / (x["n"] + 2)),
    f"{BLINN}:exponent_of_alpha": lambda x: 2 / x["alpha"] ** 2 - 2,
    f"{BLINN}:widened_exponent": widened,
    f"{BLINN}:blinn_phong_normalisation": normalisation,
    f"{SUIT}:silhouette_ramp": ramp,
    f"{SUIT}:silhouette_damping": damping,
    f"{SUIT}:self_shadowing": lambda x: np.clip(x["slope"] * x["n_dot_l"], 0, 1),
    f"{SUIT}:composited": lambda x: x["alpha"][:, None] * x["above"] + (1 - x["alpha"][:, None]) * x["below"],
    f"{SUIT}:driven": lambda x: np.einsum("nk,nk->n", x["special"], x["amount"]),
}


@pytest.mark.parametrize("name", TERMS)
def test_a_ported_term_is_that_of_numpy(name: str) -> None:
    of = subject(name)
    inputs = drawn(of.kinds, np.random.default_rng(45), 1024)
    meant = {key: np.asarray(of.kinds[key].meant(value), dtype=np.float64) for key, value in inputs.items()}
    made, truth = np.asarray(of.evaluate(inputs, np.float64).outputs["return"]), TERMS[name](meant)
    assert np.isfinite(made).all()
    error = np.mean((made - truth) ** 2 / (truth**2 + (0.01 * np.abs(truth).mean()) ** 2))
    assert error <= 1e-10
