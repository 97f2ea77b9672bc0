"""Where the row `dermis` of `scenes.media` comes from: the spectrum of skin without its pigment, and that in RGB.

Nothing else reads this; a test makes the row anew from it.
"""

from typing import NamedTuple

import numpy as np

from scenes.image import Float64

HAEMOGLOBIN: dict[int, tuple[float, float]] = {
    380: (109564, 145232), 390: (167748, 167780), 400: (266232, 223296), 410: (466840, 303956),
    420: (480360, 407560), 430: (246072, 528600), 440: (102580, 413280), 450: (62816, 103292),
    460: (44480, 23388.8), 470: (33209.2, 16156.4), 480: (26629.2, 14550), 490: (23684.4, 16684),
    500: (20932.8, 20862), 510: (20035.2, 25773.6), 520: (24202.4, 31589.6), 530: (39956.8, 39036.4),
    540: (53236, 46592), 550: (43016, 53412), 560: (32613.2, 53788), 570: (44496, 45072),
    580: (50104, 37020), 590: (14400.8, 28324.4), 600: (3200, 14677.2), 610: (1506, 9443.6),
    620: (942, 6509.6), 630: (610, 5148.8), 640: (442, 4345.2), 650: (368, 3750.12),
    660: (319.6, 3226.56), 670: (294, 2795.12), 680: (277.6, 2407.92), 690: (276, 2051.96),
    700: (290, 1794.28), 710: (314, 1540.48), 720: (348, 1325.88), 730: (390, 1102.2),
    740: (446, 1115.88), 750: (518, 1405.24), 760: (586, 1548.52), 770: (650, 1311.88),
    780: (710, 1075.44),
}  # fmt: skip
"""Molar extinction of oxygenated and of deoxygenated haemoglobin [1/(cm M)] by wavelength [nm].

Prahl 1999, "Optical absorption of hemoglobin", compiled from data by Gratzer and Kollias.
"""

HAEMOGLOBIN_IN_BLOOD = 150 / 64500
"""Its molarity [mol/l]: 150 g/l, 64500 g/mol (Prahl 1999)."""

BLOOD = 0.002
"""Its share of the dermis' volume, if it were spread evenly (Jacques 1998, "Skin optics")."""

OXYGENATION = 0.75
"""The share of the haemoglobin that carries oxygen: an assumption, between arteries and veins."""

THICKNESSES_MM = np.geomspace(0.2, 10.0, 12)


class Spectrum(NamedTuple):
    """Absorption and reduced scattering per mm at wavelengths in nm, each (N,)."""

    wavelengths: Float64
    sigma_a: Float64
    sigma_s: Float64


class Colour(NamedTuple):
    """A spectral medium as three channels, (3,) each per mm.

    error : the largest difference of any channel of any slab from the spectral one, over that slab's brightest channel
    """

    sigma_a: Float64
    sigma_s: Float64
    error: float


def dermis() -> Spectrum:
    """The dermis with its blood, from 380 to 780 nm.

    Absorption: blood and a baseline of bloodless skin in proportion of their volumes, 0.244 + 85.3 exp(-(λ - 154) /
    66.2) per cm (Jacques 1998, "Skin optics"). Reduced scattering: 46.0 (λ / 500)^-1.421 per cm, the mean of published
    measurements of skin (Jacques 2013, "Optical properties of biological tissues: a review", eq. 1, table 2).
    """
    wavelengths = np.array(list(HAEMOGLOBIN), dtype=np.float64)
    oxygenated, deoxygenated = np.array(list(HAEMOGLOBIN.values())).T
    extinction = OXYGENATION * oxygenated + (1 - OXYGENATION) * deoxygenated
    blood = np.log(10) * extinction * HAEMOGLOBIN_IN_BLOOD
    baseline = 0.244 + 85.3 * np.exp(-(wavelengths - 154) / 66.2)
    scattering = 46.0 * (wavelengths / 500) ** -1.421
    return Spectrum(wavelengths, 0.1 * (BLOOD * blood + (1 - BLOOD) * baseline), 0.1 * scattering)


def slab_fluxes(sigma_a: Float64, sigma_s: Float64, thickness: Float64) -> Float64:
    """Reflected and transmitted share (2, ...) of diffuse light that falls on an index-matched slab.

    Kubelka 1948, "New contributions to the optics of intensely light-scattering materials. Part I", with the
    coefficients K = 2 sigma_a and S = (3 sigma_s - sigma_a) / 4 of Star, Marijnissen and van Gemert 1988, "Light
    dosimetry in optical phantoms and in tissues", for absorption well below scattering.
    """
    k, s = 2 * sigma_a, 0.25 * (3 * sigma_s - sigma_a)
    b = np.sqrt(k * (k + 2 * s))
    sinh, cosh = np.sinh(b * thickness), np.cosh(b * thickness)
    below = (k + s) * sinh + b * cosh
    return np.stack([s * sinh / below, b / below])


def rec709_weights(wavelengths: Float64) -> Float64:
    """The matrix (3, N) that takes a spectrum of reflectance under D65 to linear Rec. 709; white gives (1, 1, 1)."""
    import colour

    shape = colour.SpectralShape(wavelengths[0], wavelengths[-1], wavelengths[1] - wavelengths[0])
    observer = colour.MSDS_CMFS["CIE 1931 2 Degree Standard Observer"].copy().align(shape)
    daylight = colour.SDS_ILLUMINANTS["D65"].copy().align(shape)
    single = colour.MultiSpectralDistributions(np.eye(len(wavelengths)), wavelengths)
    xyz = colour.msds_to_XYZ(single, observer, daylight, method="Integration") / 100
    rgb = colour.RGB_COLOURSPACES["ITU-R BT.709"].matrix_XYZ_to_RGB @ xyz.T
    weights: Float64 = rgb / rgb.sum(axis=1, keepdims=True)
    return weights


def rgb_of(spectrum: Spectrum) -> Colour:
    """The three pairs of coefficients that look most like a spectral medium.

    They are those for which the light that slabs of 0.2 to 10 mm reflect and transmit under diffuse D65 comes closest
    to the spectral medium's in linear Rec. 709, by least squares of the difference divided by the brightest channel of
    that slab, so that neither thick nor thin ones count more. Fluxes by `slab_fluxes`; by exact radiative transfer,
    straight through and at 60 degrees, the dermis in three channels errs by 2 % of the brightest channel up to 4 mm and
    by 4 % at 8 mm.
    """
    from scipy.optimize import least_squares

    thickness = THICKNESSES_MM[:, None]
    fluxes = slab_fluxes(spectrum.sigma_a, spectrum.sigma_s, thickness)
    wanted = fluxes @ rec709_weights(spectrum.wavelengths).T
    brightest = wanted.max(axis=2, keepdims=True)

    def misfit(logarithms: Float64) -> Float64:
        sigma_a, sigma_s = np.exp(logarithms).reshape(2, 3)
        misses: Float64 = (slab_fluxes(sigma_a, sigma_s, thickness) - wanted) / brightest
        return misses.ravel()

    fit = least_squares(misfit, np.log([0.05, 0.1, 0.2, 3.0, 4.0, 5.0]), xtol=1e-12, ftol=1e-12)
    sigma_a, sigma_s = np.exp(np.asarray(fit.x, dtype=np.float64)).reshape(2, 3)
    return Colour(sigma_a, sigma_s, float(np.abs(fit.fun).max()))
