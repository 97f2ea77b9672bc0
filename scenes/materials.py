"""What surfaces and bodies are made of."""

from typing import Annotated, Literal

from pydantic import Field, model_validator

from scenes.strict import Strict
from scenes.units import Albedo, Reflectance, Rgb


class Texture(Strict):
    """An image file, relative to the scene. `srgb` values are decoded to linear when read."""

    path: str
    color_space: Literal["srgb", "linear"] = "srgb"


class Diffuse(Strict):
    """A Lambertian surface, seen from its front side only."""

    type: Literal["diffuse"]
    reflectance: Albedo | Texture


class Translucent(Strict):
    """A body that light enters, is scattered in and leaves again; its shape must be closed.

    The medium is homogeneous and scatters evenly in all directions with the reduced coefficient sigma_s' = (1 - g)
    sigma_s, which stands for a forward scattering medium after a few events (similarity theory: van de Hulst 1980,
    "Multiple Light Scattering", section 14.1). Its refractive index is that of the surroundings: nothing is reflected
    or refracted at the surface.

    medium  : a name from `scenes.media`, whose coefficients are measured; or instead of it
    sigma_a : absorption, sigma_s : reduced scattering, both per unit of length of the scene
    """

    type: Literal["translucent"]
    medium: str | None = None
    sigma_a: Rgb | None = None
    sigma_s: Rgb | None = None

    @model_validator(mode="after")
    def _has_one_medium(self) -> "Translucent":
        numbers = [self.sigma_a is not None, self.sigma_s is not None]
        if self.medium is not None and any(numbers):
            raise ValueError("give either medium, or sigma_a and sigma_s")
        if self.medium is None and not all(numbers):
            raise ValueError("give medium, or both sigma_a and sigma_s")
        return self


MetalName = Literal["Ag", "Al", "Au", "Cr", "Cu", "W"]


class Film(Strict):
    """A rough dielectric coat, GGX with the roughness `alpha`, over a diffuse base."""

    ior: Annotated[float, Field(gt=1, le=3)] = 1.5
    alpha: Annotated[float, Field(ge=1e-3, le=1)]


class Metal(Strict):
    """Rough metal that covers a part of what lies under it.

    metal  : whose complex refractive index it has, from `scenes.metals`
    alpha  : roughness of its GGX distribution with separable Smith shadowing. Walter et al. 2007, "Microfacet Models
        for Refraction through Rough Surfaces"
    weight : part of the area that it covers; of a texture, the mean of the channels
    """

    metal: MetalName
    alpha: Annotated[float, Field(ge=1e-3, le=1)]
    weight: Reflectance | Texture


class Layered(Strict):
    """A base under coats of metal flakes, one over another: each takes its share of the area from what lies under it.

    reflectance : of the Lambertian base
    film        : a clear rough coat on the base; what it lets through goes in and out of the base
    metals      : from the lowest to the topmost
    """

    type: Literal["layered"]
    reflectance: Albedo | Texture
    film: Film | None = None
    metals: Annotated[tuple[Metal, ...], Field(max_length=4)] = ()

    @model_validator(mode="after")
    def _has_layers(self) -> "Layered":
        if self.film is None and not self.metals:
            raise ValueError('give film or metals; a base by itself is a material of type "diffuse"')
        return self


class Principled(Strict):
    """Disney's material. Burley 2012, "Physically-Based Shading at Disney", as Mitsuba's `principled` has it."""

    type: Literal["principled"]
    base_color: Albedo
    roughness: Annotated[float, Field(ge=0.01, le=1)] = 0.5
    metallic: Reflectance = 0.0
    specular: Reflectance = 0.5
    clearcoat: Reflectance = 0.0
    clearcoat_gloss: Reflectance = 0.0
    sheen: Reflectance = 0.0


class Fibre(Strict):
    """A hair's inside: a rough dielectric cylinder that absorbs.

    Chiang et al. 2016, "A Practical and Controllable Hair and Fur Model for Production Path Tracing", as
    Mitsuba's `hair`.

    sigma_a    : absorption per radius of the fibre
    beta_m     : longitudinal roughness, beta_n : azimuthal roughness
    tilt_deg   : of the scales on its surface
    """

    type: Literal["fibre"]
    sigma_a: Rgb
    ior: Annotated[float, Field(gt=1, le=3)] = 1.55
    beta_m: Annotated[float, Field(ge=0.05, le=1)] = 0.3
    beta_n: Annotated[float, Field(ge=0.05, le=1)] = 0.3
    tilt_deg: Annotated[float, Field(ge=-30, le=30)] = 2.0


Material = Annotated[Diffuse | Translucent | Layered | Principled | Fibre, Field(discriminator="type")]
