import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from scenes import skin
from scenes.bibliography import BIBLIOGRAPHY
from scenes.errors import InputError
from scenes.materials import Translucent
from scenes.media import MEDIA, coefficients

albedos = st.floats(0.5, 0.999)


def translucent(medium: str) -> Translucent:
    return Translucent(type="translucent", medium=medium)


@pytest.mark.parametrize("name", MEDIA)
def test_media_scatter_more_than_they_absorb_and_red_goes_deepest(name: str) -> None:
    sigma_a, sigma_s = coefficients(translucent(name), "mm")
    assert sigma_a.shape == sigma_s.shape == (3,)
    assert sigma_a.dtype == sigma_s.dtype == np.float64
    assert (sigma_a > 0).all()
    assert (sigma_s > sigma_a).all()
    effective = np.sqrt(3 * sigma_a * (sigma_a + sigma_s))
    assert (np.diff(effective) > 0).all()
    assert MEDIA[name].source in BIBLIOGRAPHY


def test_skin1_as_published() -> None:
    """Jensen et al. 2001, figure 5."""
    sigma_a, sigma_s = coefficients(translucent("skin1"), "mm")
    np.testing.assert_array_equal(sigma_a, [0.032, 0.17, 0.48])
    np.testing.assert_array_equal(sigma_s, [0.74, 0.88, 1.01])


def test_a_metre_holds_a_thousand_times_a_millimetre() -> None:
    per_mm, per_m = coefficients(translucent("skin2"), "mm"), coefficients(translucent("skin2"), "m")
    np.testing.assert_array_equal(per_m, 1000 * np.array(per_mm))


def test_numbers_of_the_scene_go_by_its_unit() -> None:
    given = Translucent(type="translucent", sigma_a=(0.0, 0.1, 0.2), sigma_s=(1.0, 2.0, 3.0))
    for unit in ("m", "mm"):
        np.testing.assert_array_equal(coefficients(given, unit), [[0, 0.1, 0.2], [1, 2, 3]])


def test_an_unknown_medium_is_refused_with_those_there_are() -> None:
    with pytest.raises(InputError, match=r"Unknown medium 'skin3'. Known: skin1, skin2, dermis. Did you mean 'skin"):
        coefficients(translucent("skin3"), "mm")


def test_dermis_is_what_its_spectrum_gives() -> None:
    """Each number of the table is that of the fit in three digits."""
    row, made = MEDIA["dermis"], skin.rgb_of(skin.dermis())
    stored, exact = np.array([row.sigma_a, row.sigma_s]), np.array([made.sigma_a, made.sigma_s])
    last_digit = 10 ** (np.floor(np.log10(stored)) - 2)
    assert (np.abs(stored - exact) <= 0.51 * last_digit).all()
    assert made.error == pytest.approx(0.046, abs=0.001)


def test_blood_shows_in_the_spectrum_of_dermis() -> None:
    """Haemoglobin with oxygen has its bands at 540 and 580 nm, without one at 560 nm; beyond 600 nm blood is clear."""
    spectrum = skin.dermis()
    absorbed = dict(zip(spectrum.wavelengths, spectrum.sigma_a, strict=True))
    assert absorbed[540] > absorbed[510]
    assert absorbed[570] > absorbed[600] * 2
    assert max(absorbed.values()) == absorbed[420]
    assert absorbed[650] == pytest.approx(0.03, abs=0.005)
    assert spectrum.sigma_s[list(spectrum.wavelengths).index(500)] == pytest.approx(4.6)


def test_a_grey_medium_is_three_equal_channels() -> None:
    wavelengths = skin.dermis().wavelengths
    grey = skin.Spectrum(wavelengths, np.full(41, 0.08), np.full(41, 2.5))
    made = skin.rgb_of(grey)
    np.testing.assert_allclose(made.sigma_a, 0.08, rtol=1e-5)
    np.testing.assert_allclose(made.sigma_s, 2.5, rtol=1e-5)
    assert made.error < 1e-6


def test_weights_are_those_of_colour_science_at_a_nanometre() -> None:
    """The step of 10 nm loses no more than a thousandth of white, in spite of the bands of blood."""
    import colour

    spectrum = skin.dermis()
    reflectance = np.exp(-3 * spectrum.sigma_a)
    shape = colour.SpectralShape(380, 780, 1)
    xyz = colour.sd_to_XYZ(
        colour.SpectralDistribution(reflectance, spectrum.wavelengths).align(shape),
        colour.MSDS_CMFS["CIE 1931 2 Degree Standard Observer"].copy().align(shape),
        colour.SDS_ILLUMINANTS["D65"].copy().align(shape),
        method="Integration",
    )
    expected = colour.XYZ_to_RGB(xyz / 100, "ITU-R BT.709", apply_cctf_encoding=False)
    weights = skin.rec709_weights(spectrum.wavelengths)
    np.testing.assert_allclose(weights @ reflectance, expected, atol=1e-3)
    np.testing.assert_allclose(weights.sum(axis=1), 1, rtol=1e-12)


@settings(max_examples=50)
@given(albedo=albedos, thickness=st.floats(0.01, 3), other=st.floats(0.01, 3))
def test_fluxes_of_two_slabs_are_those_of_one_as_thick_as_both(albedo: float, thickness: float, other: float) -> None:
    """Stokes 1862: the sum over the reflections between two layers."""

    def fluxes(d: float) -> tuple[float, float]:
        reflected, transmitted = skin.slab_fluxes(np.array(1 - albedo), np.array(albedo), np.array(d))
        return float(reflected), float(transmitted)

    (r1, t1), (r2, t2), both = fluxes(thickness), fluxes(other), fluxes(thickness + other)
    assert both[1] == pytest.approx(t1 * t2 / (1 - r1 * r2), rel=1e-9)
    assert both[0] == pytest.approx(r1 + t1**2 * r2 / (1 - r1 * r2), rel=1e-9)
    assert sum(both) < 1


def test_fluxes_without_absorption_keep_all_light_and_of_thick_slabs_are_those_of_kubelka() -> None:
    clear = skin.slab_fluxes(np.array(1e-9), np.array(2.0), np.array(1.5))
    assert clear.sum() == pytest.approx(1, abs=1e-6)
    assert clear[1] == pytest.approx(1 / (1 + 0.75 * 2 * 1.5), rel=1e-6)
    ratio = 2 * 0.1 / (0.25 * (3 * 2 - 0.1))
    thick = skin.slab_fluxes(np.array(0.1), np.array(2.0), np.array(100.0))
    assert thick[0] == pytest.approx(1 + ratio - np.sqrt(ratio**2 + 2 * ratio), rel=1e-9)
