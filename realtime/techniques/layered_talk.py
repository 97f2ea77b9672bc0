"""The suit of NVIDIA's talk on the GeForce 7800 GTX demos ("Luna", 2005): three layers of Blinn-Phong highlights.

Its artist had a slider for each number of the shader. All of them together are a look; four are shipped: one by eye,
and three that `lightgauge fit` found for the materials of the scenes suit-*.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from realtime.frame import Frame
from realtime.graph import Pass
from realtime.layers import begin_shading, coated, lit_passes
from realtime.looks import with_components, with_looks
from realtime.shader import set_uniforms
from realtime.technique import LOOK, Parameter, Technique
from scenes.checks import SettingValue
from scenes.features import Features
from scenes.image import Float32
from scenes.materials import Layered, Principled, Texture
from scenes.mesh import Mesh
from scenes.model import Scene
from scenes.units import Albedo

if TYPE_CHECKING:
    import moderngl

LOOKS = sorted(Path(__file__).parent.glob("layered_looks/*.toml"))
BY_EYE = "by_eye"

NOISE_SIDE, NOISE_REPEATS = 64, 4.0
"""Texels along an edge of the noise, and how often it repeats over the unit square of (u, v)."""

_LEAST, _MOST = 1e-3, 30.0


def _slider(name: str, default: float, summary: str, tuned: tuple[float, float], most: float = 1e4) -> Parameter:
    return Parameter(name, default, (), summary, (-most if tuned[0] < 0 else 0.0, most), tuned=tuned)


def _highlights(layer: str, strengths: tuple[float, float], exponents: tuple[float, float]) -> tuple[Parameter, ...]:
    """Two lobes, their colour, and how they fade, in the order in which layered_talk/shade.frag counts them."""
    lobes = zip((1, 2), strengths, exponents, strict=True)
    return (
        *(
            slider
            for k, strength, exponent in lobes
            for slider in (
                _slider(f"{layer}_strength_{k}", strength, "part of the light that a lobe reflects", (_LEAST, _MOST)),
                _slider(f"{layer}_exponent_{k}", exponent, "of a Blinn-Phong lobe", (1.0, 8192.0), 1e5),
            )
        ),
        _slider(f"{layer}_red", 1.0, "of its highlights, relative to their green", (0.2, 4.0)),
        _slider(f"{layer}_blue", 1.0, "of its highlights, relative to their green", (0.2, 4.0)),
        _slider(f"{layer}_fade", 8.0, "its highlights fade where N.L is below 1 over this", (1.0, 100.0)),
    )


SLIDERS = (
    _slider("layer1_diffuse", 0.8, "part of the pigment's light that is reflected", (0.05, 3.0)),
    *_highlights("layer1", (0.02, 0.02), (8.0, 20.0)),
    _slider("layer1_noise", 0.3, "how much its highlights are noisy", (0.0, 1.0), 1.0),
    _slider("layer2_alpha", 0.3, "how much of layer 1 this layer covers", (0.0, 1.0), 1.0),
    *_highlights("layer2", (0.5, 0.3), (80.0, 400.0)),
    *_highlights("layer3", (1.0, 1.0), (10.0, 40.0)),
    _slider("ramp_0", 0.0, "the silhouette's ramp straight on", (-1.0, 1.0)),
    _slider("ramp_1", 0.0, "of the silhouette's ramp, times 1 - N.V", (-2.0, 2.0)),
    _slider("ramp_2", 1.5, "of the silhouette's ramp, times its square", (-2.0, 2.0)),
    _slider("ramp_3", -1.0, "of the silhouette's ramp, times its cube", (-2.0, 2.0)),
)
"""Strengths count energy, which the talk's raw numbers do not. Where exponents are the same all over, these are the
same images by other numbers. Where a texture drives an exponent, or `spread` widens a lobe, its energy stays as it is
here, and the talk's would change with it.
"""

LOOK_PARAMETER = Parameter(LOOK, BY_EYE, tuple(path.stem for path in LOOKS), "the file that sets all sliders")
DAMPING = Parameter(
    "damping", 0.2, (0.0, 0.05, 0.1, 0.2, 0.4), "N.V below which the silhouette's layer goes back to 0", (0, 1), off=0.0
)
SPREAD = Parameter(
    "spread", 0.0, (0.0, 0.45), "how much a lamp's angular radius widens highlights; 0, as published: none", (0, 2)
)


def _passes(scene: Scene, features: Features, settings: Mapping[str, SettingValue]) -> list[Pass]:
    return lit_passes(scene, _shade)


def _shade(frame: Frame) -> None:
    count = begin_shading(frame)
    sliders = frame.context.buffer(amounts(frame.settings).tobytes())
    sliders.bind_to_storage_buffer(4)
    places = {slider.name.upper(): i for i, slider in enumerate(SLIDERS)}
    shader = frame.program("raster/mesh.vert", "layered_talk/shade.frag", NOISE_REPEATS=NOISE_REPEATS, **places)
    damping, spread = (float(frame.settings[parameter.name]) for parameter in (DAMPING, SPREAD))
    set_uniforms(shader, light_count=count, damping=damping, spread=spread)
    for mesh in frame.meshes:
        _bind_maps(frame, mesh, shader)
        frame.draw(shader, frame.camera, lambda other, name=mesh.name: other.name == name)  # type: ignore[misc]


def amounts(settings: Mapping[str, Any]) -> Float32:
    """The talk's amount4 of each slider (N, 4): its constant, and what each texture adds to it."""
    return np.array([[settings[part.name] for part in with_components(slider)] for slider in SLIDERS], dtype=np.float32)


def _bind_maps(frame: Frame, mesh: Mesh, shader: Any) -> None:
    """The talk's three textures. Here they are the pigment, and the weights of the lowest and the topmost metal."""
    material = coated(frame.scene, mesh)
    pigment = material.base_color if isinstance(material, Principled) else material.reflectance
    metals = material.metals if isinstance(material, Layered) else ()
    weights = (metals[0].weight, metals[-1].weight) if metals else (0.0, 0.0)
    maps = {
        "diffuse_map": _map(frame, pigment),
        "specular_map": _map(frame, weights[0]),
        "alpha_map": _map(frame, weights[1]),
        "noise_map": frame.once("noise", lambda: frame.filtered_texture(noise())),
    }
    for unit, (name, texture) in enumerate(maps.items()):
        texture.use(unit)
        shader[name] = unit


def _map(frame: Frame, values: Albedo | float | Texture) -> moderngl.Texture:
    colours = (values, values, values) if isinstance(values, float) else values
    return frame.once(("suit map", colours), lambda: frame.surface_texture(colours))


def noise() -> Float32:
    """Values (64, 64, 1) between 0 and 1 without any pattern, the same each time; their mean is 1 / 2."""
    values = np.random.default_rng(2005).permutation(NOISE_SIDE**2) / (NOISE_SIDE**2 - 1)
    return values.reshape(NOISE_SIDE, NOISE_SIDE, 1).astype(np.float32)


TECHNIQUES = {
    "layered.talk": with_looks(
        Technique(
            name="layered.talk",
            approximates="layered_radiance",
            summary="the talk's suit: diffuse with noisy highlights, sharp metal, and a silhouette of metal by N.V",
            source="nvidia-2005",
            limits=(
                "As published: six Blinn-Phong lobes of direct light without shadows, whose numbers the artist tuned "
                "by eye; a look that is fitted to one material says nothing about another. Colours of highlights do "
                "not change with the angle. Highlights fade where light grazes, as Kilgard (2000) has it and the talk "
                "does not say; sliders *_fade of 1e4 take that away. Lamps shine from their centres; skies, lines and "
                "surfaces that emit are refused."
            ),
            passes=_passes,
            parameters=(LOOK_PARAMETER, DAMPING, SPREAD),
            grid=4,
            sliders=tuple(component for slider in SLIDERS for component in with_components(slider)),
        ),
        LOOKS,
    )
}
