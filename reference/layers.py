"""Layered materials as Mitsuba's dictionaries."""

from collections.abc import Callable
from functools import reduce

from reference.plain import Plain, rgb
from scenes.image import Float32, Float64
from scenes.materials import Film, Layered, Metal, Principled, Texture
from scenes.metals import refractive_index
from scenes.units import Albedo

ReadTexture = Callable[[Texture], Float32]


def layered_dict(material: Layered | Principled, read_texture: ReadTexture) -> Plain:
    """A layered material's surface, with textures left as linear arrays."""
    if isinstance(material, Principled):
        return _principled_dict(material)
    base = _base_dict(material.reflectance, material.film, read_texture)
    return reduce(lambda below, metal: _covered(below, metal, read_texture), material.metals, base)


def _principled_dict(material: Principled) -> Plain:
    return {
        "type": "principled",
        "base_color": rgb(material.base_color),
        **material.model_dump(exclude={"type", "base_color"}),
    }


def _base_dict(reflectance: Albedo | Texture, film: Film | None, read_texture: ReadTexture) -> Plain:
    """Light that the film throws back inward meets the pigment again: that is what Mitsuba calls nonlinear."""
    pigment = _bitmap(read_texture(reflectance)) if isinstance(reflectance, Texture) else rgb(reflectance)
    if film is None:
        return {"type": "diffuse", "reflectance": pigment}
    return {
        "type": "roughplastic",
        "distribution": "ggx",
        "alpha": film.alpha,
        "int_ior": film.ior,
        "ext_ior": 1.0,
        "nonlinear": True,
        "diffuse_reflectance": pigment,
    }


def _covered(below: Plain, metal: Metal, read_texture: ReadTexture) -> Plain:
    """What lies below, under a coat of metal. Mitsuba would read a coloured weight as luminance, not as the mean."""
    eta, k = refractive_index(metal.metal)
    weight: Plain | float = (
        _bitmap(read_texture(metal.weight).mean(axis=-1, keepdims=True))
        if isinstance(metal.weight, Texture)
        else metal.weight
    )
    return {
        "type": "blendbsdf",
        "weight": weight,
        "bsdf_0": below,
        "bsdf_1": {
            "type": "roughconductor",
            "distribution": "ggx",
            "alpha": metal.alpha,
            "eta": _colour(eta),
            "k": _colour(k),
        },
    }


def _colour(values: Float64) -> Plain:
    red, green, blue = values.tolist()
    return rgb((red, green, blue))


def _bitmap(pixels: Float32) -> Plain:
    return {"type": "bitmap", "pixels": pixels, "wrap_mode": "repeat"}
