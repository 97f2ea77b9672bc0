"""What a coat reflects of even light, on both sides: the table of the character against samples of Mitsuba."""

from collections.abc import Callable
from types import ModuleType
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from realtime.coat_albedo import COSINES, albedo_of
from realtime.frame import Frame
from reference.stage import build_stage
from scenes.features import features_of
from scenes.geometry import geometry_of
from scenes.image import Float64
from scenes.model import Scene

if TYPE_CHECKING:
    import moderngl

SUIT = {
    "type": "layered",
    "reflectance": [0.03, 0.07, 0.2],
    "film": {"alpha": 0.35},
    "metals": [{"metal": "Cr", "alpha": 0.3, "weight": 0.2}, {"metal": "Al", "alpha": 0.15, "weight": 0.1}],
}
COATS: dict[str, dict[str, Any]] = {
    "suit": SUIT,
    "film on white": {"type": "layered", "reflectance": [0.9, 0.9, 0.9], "film": {"alpha": 0.35}},
    "bright metal": {
        "type": "layered",
        "reflectance": [0, 0, 0],
        "metals": [{"metal": "Al", "alpha": 0.05, "weight": 1}],
    },
    "lacquer": {
        "type": "principled",
        "base_color": [0.02, 0.02, 0.02],
        "roughness": 0.4,
        "clearcoat": 1.0,
        "clearcoat_gloss": 0.5,
    },
}
SAMPLES = 1 << 18


def sampled(mi: ModuleType, bsdf: Any, cosine: float) -> Float64:
    """The mean weight of samples (3,)."""
    import drjit as dr

    sampler = mi.load_dict({"type": "independent"})
    sampler.seed(3, SAMPLES)
    seen = dr.zeros(mi.SurfaceInteraction3f, SAMPLES)
    seen.wi = mi.Vector3f(float(np.sqrt(1 - cosine**2)), 0.0, cosine)
    _, weight = bsdf.sample(mi.BSDFContext(), seen, sampler.next_1d(), sampler.next_2d())
    mean: Float64 = np.array(weight).reshape(3, -1).mean(axis=1, dtype=np.float64)
    return mean


@pytest.mark.parametrize("name", COATS)
def test_the_albedo_is_that_of_samples(
    name: str, make_scene: Callable[..., Scene], gl: "moderngl.Context", mi: ModuleType
) -> None:
    ball = {"name": "ball", "type": "sphere", "radius": 0.1, "detail": 1, "material": "coat"}
    scene = make_scene(materials={"coat": COATS[name]}, shapes=[ball], subject=["ball"])
    meshes = geometry_of(scene)
    frame = Frame(gl, scene, meshes, features_of(scene, meshes), {}, 1)
    found = albedo_of(frame, scene.materials["coat"])  # type: ignore[arg-type]
    row = np.frombuffer(found.by_cosine.read(), dtype=np.float32).reshape(COSINES, 4)[:, :3]
    bsdf = build_stage(mi, scene, meshes).subject[0].bsdf()
    for at in (6, 32, 57):
        true = sampled(mi, bsdf, (at + 0.5) / COSINES)
        np.testing.assert_allclose(row[at], true, atol=0.004 + 0.01 * true.max(), err_msg=f"row {at}")
    assert (found.on_the_whole <= 1).all()
