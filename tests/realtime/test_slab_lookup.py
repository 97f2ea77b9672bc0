"""The baked slab against what is known without it: energy, reciprocity, limits, and Milne's integral equation."""

from functools import cache

import numpy as np
import pytest
from scipy.special import expn

from realtime.slab import ANGLES, PER_OCTAVE, STEPS, Layers, SlabTable, layers_of, normal_albedo, slab_table
from scenes.image import Float64

SIGMA_A = np.array([0.032, 0.17, 0.48])
SIGMA_S = np.array([0.74, 0.88, 1.01])
THICKEST = 25.0


@cache
def skin() -> SlabTable:
    return slab_table(SIGMA_A, SIGMA_S, THICKEST)


def fluxes(layers: Layers, weights: Float64) -> tuple[Float64, Float64]:
    """Parts (L, M) of a beam's power that a layer reflects and transmits, straight light left out."""
    return np.einsum("i,lij->lj", weights, layers.reflected), np.einsum("i,lij->lj", weights, layers.transmitted)


@pytest.mark.parametrize("depth", [1e-3, 0.1, 1.0, 10.0, 100.0])
def test_what_is_not_absorbed_comes_out_again(depth: float) -> None:
    """With an albedo of 1; what is scattered twice in the thinnest layer is lost, up to 1e-5 of the whole."""
    layers, _, weights = layers_of(np.array([depth]), 1.0, np.array([0.2, 0.6, 1.0]))
    reflected, transmitted = fluxes(layers, weights)
    np.testing.assert_allclose((reflected + transmitted + layers.beam)[:, -3:], 1, atol=3e-5)


@pytest.mark.parametrize("albedo", [0.3, 0.678, 0.9585, 1.0])
def test_no_slab_gives_more_than_it_gets(albedo: float) -> None:
    depths = np.geomspace(0.01, 40, 60)
    for octave in np.array_split(depths, 20):
        layers, _, weights = layers_of(octave, albedo, np.linspace(0.05, 1, 8))
        reflected, transmitted = fluxes(layers, weights)
        assert (reflected + transmitted + layers.beam).max() <= 1 + 1e-4


def test_reflection_and_transmission_are_reciprocal() -> None:
    layers, _, _ = layers_of(np.array([2.0, 3.0]), 0.9, np.array([0.1, 0.5, 1.0]))
    for kernel in (layers.reflected, layers.transmitted):
        np.testing.assert_allclose(kernel, kernel.transpose(0, 2, 1), rtol=1e-9)


def test_a_thin_slab_scatters_once() -> None:
    """L = albedo tau E / (4 pi) on both sides, at normal incidence and exit, less 2 tau log tau for what is lost."""
    tau = 1e-4
    layers, _, _ = layers_of(np.array([tau]), 0.9, np.ones(1))
    for kernel in (layers.reflected, layers.transmitted):
        assert kernel[0, -1, -1] / np.pi == pytest.approx(0.9 * tau / (4 * np.pi), rel=2e-3)


def test_a_thick_slab_reflects_what_a_half_space_does() -> None:
    """Chandrasekhar's H-functions know nothing of layers."""
    albedo = np.array([0.5, 0.9, 0.9585])
    thick = [layers_of(np.array([400.0]), float(a), np.ones(1)) for a in albedo]
    reflected = [fluxes(layers, weights)[0][0, -1] for layers, _, weights in thick]
    np.testing.assert_allclose(normal_albedo(albedo), reflected, rtol=1e-5)


def test_what_absorbs_nothing_has_an_albedo_of_1_and_what_scatters_nothing_of_0() -> None:
    np.testing.assert_allclose(normal_albedo(np.array([0.0, 1.0])), [0, 1], atol=1e-9)


def milne(albedo: float, depth: float, cosine: float, cells: int) -> tuple[float, float]:
    """Radiance along the normal that a slab transmits and reflects, per irradiance of a beam.

    Milne's equation for the source function, J(t) = albedo / 2 * integral of E1(|t - u|) J(u) du + albedo / (4 pi)
    exp(-t / cosine), with J constant in each of the cells and E1 integrated exactly.
    """
    edges = depth * (1 - np.cos(np.pi * np.arange(cells + 1) / cells)) / 2
    middles = (edges[1:] + edges[:-1]) / 2
    distance = edges - middles[:, None]
    below = np.sign(distance) * (1 - expn(2, np.abs(distance)))
    first = albedo / (4 * np.pi) * np.exp(-middles / cosine)
    J = np.linalg.solve(np.eye(cells) - albedo / 2 * np.diff(below, axis=1), first)
    out, back = np.diff(np.exp(edges - depth)), -np.diff(np.exp(-edges))
    return float(J @ out), float(J @ back)


def extrapolated(albedo: float, depth: float, cosine: float) -> Float64:
    """Milne's equation at two resolutions, extrapolated in the square of the cells' size."""
    coarse, fine = (np.array(milne(albedo, depth, cosine, cells)) for cells in (100, 200))
    limit: Float64 = (4 * fine - coarse) / 3
    return limit


@pytest.mark.parametrize("channel", range(3))
@pytest.mark.parametrize("cosine", [0.157, 0.5, 0.777, 1.0])
def test_the_table_is_within_half_a_percent_of_an_independent_solution(channel: int, cosine: float) -> None:
    """Between the nodes, in both of its dimensions: .5 % is the issue's budget."""
    thicknesses = np.array([0.05, 0.31, 0.617, 1.53, 3.77, 8.3, 15.0])
    sigma_t = SIGMA_A + SIGMA_S
    exact = np.array(
        [extrapolated(SIGMA_S[channel] / sigma_t[channel], sigma_t[channel] * d, cosine) for d in thicknesses]
    )
    cosines = np.full(len(thicknesses), cosine)
    made = [skin().transmission(thicknesses, cosines), skin().reflection(thicknesses, cosines)]
    for side in range(2):
        np.testing.assert_allclose(made[side][:, channel], exact[:, side], rtol=5e-3)


def test_the_table_is_fine_enough_for_its_logarithms_to_be_straight() -> None:
    """Halfway between two columns the logarithms' second difference bounds the error of interpolation."""
    for table in (skin().transmitted, skin().reflected):
        bend = np.abs(np.diff(table, n=2, axis=1))
        assert table.shape == (ANGLES, STEPS, 3)
        assert bend[:, : STEPS - 2 * PER_OCTAVE].max() / 8 < 5e-3


def test_slabs_thinner_than_the_table_go_to_nothing_in_proportion() -> None:
    thin = skin().thinnest * np.array([0.25, 0.5, 1.0])
    made = skin().transmission(thin, np.ones(3))
    np.testing.assert_allclose(made / made[-1], np.repeat(thin[:, None] / thin[-1], 3, axis=1), rtol=1e-6)


def test_slabs_thicker_than_the_table_pass_as_its_thickest() -> None:
    made = skin().transmission(np.array([THICKEST, 2 * THICKEST]), np.ones(2))
    np.testing.assert_array_equal(made[0], made[1])


def test_a_medium_that_only_absorbs_is_black() -> None:
    table = slab_table(np.ones(3), np.zeros(3), 1.0)
    assert table.transmission(np.array([0.5]), np.ones(1)).max() < 1e-29
