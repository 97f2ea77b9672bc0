"""Area lights with a texture: how they are loaded, and that both renderers see the same picture shine."""

from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any

import numpy as np
import PIL.Image
import pytest
from numpy.typing import NDArray

from realtime.frame import Frame
from realtime.lights import light_rows, lights_of
from realtime.views import draw_pinhole
from reference.estimator import Reference
from reference.integrators.ray_casts import mean_over_pixels
from reference.stage import build_stage
from reference.store import Store
from reference.to_mitsuba import scene_dict
from scenes.digest import digest_of, scene_parts
from scenes.errors import SceneError
from scenes.exr import write_exr
from scenes.features import features_of
from scenes.geometry import geometry_of, texture_of
from scenes.image import Float32, Float64, Image
from scenes.materials import Texture
from scenes.model import PIXEL_GRID, AreaLight, Scene

if TYPE_CHECKING:
    import moderngl

MakeScene = Callable[..., Scene]

RADIANCE = np.array([4.0, 2.0, 0.5])
MATERIALS = {
    "black": {"type": "diffuse", "reflectance": [0.0, 0.0, 0.0]},
    "white": {"type": "diffuse", "reflectance": [0.7, 0.7, 0.7]},
}
PANEL = {
    "name": "panel",
    "type": "rectangle",
    "size": [1.2, 0.8],
    "position": [0.1, 0.05, 0.0],
    "rotation_deg": [10.0, 25.0, 15.0],
    "material": "black",
}
FACING = {
    "type": "perspective",
    "origin": [0.0, 0.0, 2.0],
    "target": [0.0, 0.0, 0.0],
    "fov_deg": 40.0,
    "width": 32,
    "height": 24,
}


def picture() -> NDArray[np.uint8]:
    """8 x 6 code values without symmetry, every channel its own."""
    rng = np.random.default_rng(3)
    return rng.integers(0, 256, size=(6, 8, 3), dtype=np.uint8)


def write_picture(folder: Path, pixels: NDArray[np.uint8], name: str = "slide.png") -> dict[str, Any]:
    PIL.Image.fromarray(pixels).save(folder / name)
    return {"path": name}


@pytest.fixture
def slide(make_scene: MakeScene, tmp_path: Path) -> Scene:
    """A black panel that shines with a picture in front of nothing; it is the subject."""
    texture = write_picture(tmp_path, picture())
    light = {"type": "area", "shape": "panel", "radiance": RADIANCE.tolist(), "texture": texture}
    return make_scene(sensor=FACING, materials=MATERIALS, subject=["panel"], shapes=[PANEL], emitters=[light])


@pytest.fixture
def reference(mi: ModuleType, tmp_path: Path) -> Callable[[Scene], Reference]:
    return lambda scene: Reference(scene, Store(tmp_path / "store"), lambda what, part: None)


def seen_by_mitsuba(mi: ModuleType, scene: Scene) -> Float32:
    """Emitted radiance (H, W, 3) at the positions that the real-time side averages."""
    stage = build_stage(mi, scene, geometry_of(scene))
    return mean_over_pixels(stage, lambda hit: [*hit.si.emitter(hit.stage.scene, hit.valid).eval(hit.si, hit.valid)])


def seen_by_opengl(gl: "moderngl.Context", scene: Scene) -> Float32:
    meshes = geometry_of(scene)
    frame = Frame(gl, scene, meshes, features_of(scene, meshes), {}, PIXEL_GRID)
    draw_pinhole(frame)
    return frame.read("image", 4)[..., :3]


def test_every_mesh_of_the_shape_has_the_pattern(make_scene: MakeScene, tmp_path: Path) -> None:
    texture = write_picture(tmp_path, picture())
    scene = make_scene(
        emitters=[
            {"type": "area", "shape": "room", "radiance": [1.0, 2.0, 3.0], "texture": texture},
            {"type": "area", "shape": "ball", "radiance": [1.0, 1.0, 1.0]},
        ]
    )
    light = scene.emitters[0]
    assert isinstance(light, AreaLight)
    assert light.texture == Texture(path="slide.png", color_space="srgb")
    for mesh in geometry_of(scene):
        assert mesh.pattern == (light.texture if mesh.shape == "room" else None)


def test_a_picture_that_is_not_there_is_told_with_its_path(slide: Scene) -> None:
    (slide.folder / "slide.png").unlink()
    with pytest.raises(SceneError, match=r"slide\.png: cannot be read"):
        scene_dict(slide, geometry_of(slide))


def test_an_exr_of_code_values_is_refused_at_its_key(make_scene: MakeScene, tmp_path: Path) -> None:
    write_exr(tmp_path / "slide.exr", Image(np.full((2, 2, 3), 0.5, dtype=np.float32)))
    light = {"type": "area", "shape": "room", "radiance": [1.0, 1.0, 1.0], "texture": {"path": "slide.exr"}}
    with pytest.raises(SceneError, match=r"emitters\[0\]\.texture"):
        make_scene(emitters=[light])
    linear = light | {"texture": {"path": "slide.exr", "color_space": "linear"}}
    scene = make_scene(emitters=[linear])
    pattern = geometry_of(scene)[0].pattern
    assert pattern is not None
    assert (texture_of(scene, pattern) == 0.5).all()


def test_other_pixels_make_another_truth(slide: Scene) -> None:
    before = digest_of(scene_parts(slide))
    write_picture(slide.folder, 255 - picture())
    assert digest_of(scene_parts(slide)) != before


def test_mitsuba_gets_the_radiance_times_the_picture(slide: Scene) -> None:
    """Above 1 too, which its colours do not hold."""
    emitter = scene_dict(slide, geometry_of(slide))["mesh_0"]["emitter"]
    assert emitter["type"] == "area"
    assert emitter["radiance"]["type"] == "bitmap"
    expected = RADIANCE * texture_of(slide, Texture(path="slide.png"))
    np.testing.assert_allclose(emitter["radiance"]["pixels"], expected, rtol=1e-6)
    assert emitter["radiance"]["pixels"].max() > 1


def test_both_renderers_see_the_same_picture(slide: Scene, mi: ModuleType, gl: "moderngl.Context") -> None:
    """Orientation, colours, decoding and interpolation. A GPU may weigh texels by fractions of 8 bits."""
    assert features_of(slide, geometry_of(slide)).nothing_reflects
    true, made = seen_by_mitsuba(mi, slide), seen_by_opengl(gl, slide)
    panel = true.max(axis=2) > 0
    assert 0.2 < panel.mean() < 0.9
    rms = np.sqrt(np.mean(true[panel] ** 2))
    assert np.sqrt(np.mean((made - true) ** 2)) < 0.005 * rms
    assert np.abs(made - true).max() < 0.05 * rms
    mirrored = (true[::-1], true[:, ::-1], true[..., ::-1], true[::-1, ::-1])
    assert min(np.sqrt(np.mean((made - other) ** 2)) for other in mirrored) > 0.2 * rms


@pytest.mark.parametrize("axis", [0, 1])
def test_the_upper_left_of_the_picture_is_the_upper_left_of_the_panel(
    make_scene: MakeScene, mi: ModuleType, gl: "moderngl.Context", tmp_path: Path, axis: int
) -> None:
    """Row 0 of the file is up, column 0 is left, as seen from the side that shines."""
    pixels = np.zeros((64, 64, 3), dtype=np.uint8)
    pixels[(slice(0, 32), slice(None)) if axis == 0 else (slice(None), slice(0, 32))] = 255
    light = {"type": "area", "shape": "panel", "radiance": [1.0, 1.0, 1.0], "texture": write_picture(tmp_path, pixels)}
    upright = PANEL | {"size": [1.0, 1.0], "position": [0.0, 0.0, 0.0], "rotation_deg": [0.0, 0.0, 0.0]}
    scene = make_scene(
        sensor=FACING | {"width": 16, "height": 16, "fov_deg": 20.0},
        materials=MATERIALS,
        subject=["panel"],
        shapes=[upright],
        emitters=[light],
    )
    for image in (seen_by_mitsuba(mi, scene), seen_by_opengl(gl, scene)):
        first, last = np.array_split(image, 2, axis=axis)
        assert first.mean() > 0.98
        assert last.mean() < 0.02


def test_its_back_is_black(slide: Scene, mi: ModuleType, gl: "moderngl.Context") -> None:
    behind = slide.model_copy(update={"sensor": slide.sensor.model_copy(update={"origin": (0.0, 0.0, -2.0)})})
    assert seen_by_mitsuba(mi, behind).max() == 0
    assert seen_by_opengl(gl, behind).max() == 0


@pytest.mark.slow
def test_a_picture_and_its_negative_light_as_much_as_none(
    make_scene: MakeScene, reference: Callable[[Scene], Reference], tmp_path: Path
) -> None:
    """Light is a linear function of the picture, for Mitsuba's samples and for the facets of a frame alike."""
    pattern = np.zeros((2, 4, 3), dtype=np.uint8)
    pattern[0, 1], pattern[1, 2:], pattern[0, 3] = (255, 0, 255), (255, 255, 0), (0, 0, 255)
    textures = [write_picture(tmp_path, p, f"{name}.png") for name, p in (("one", pattern), ("two", 255 - pattern))]
    panel = PANEL | {"position": [0.0, 0.0, 1.0], "rotation_deg": [0.0, 180.0, 0.0]}
    ball = {"name": "ball", "type": "sphere", "radius": 0.3, "detail": 3, "material": "white"}
    sensor = FACING | {"origin": [1.2, 0.8, 0.9], "fov_deg": 20.0, "width": 8, "height": 8}
    light = {"type": "area", "shape": "panel", "radiance": RADIANCE.tolist()}
    means: list[Float64] = []
    facets: list[Float64] = []
    for extra in ({"texture": textures[0]}, {"texture": textures[1]}, {}):
        scene = make_scene(sensor=sensor, materials=MATERIALS, shapes=[ball, panel], emitters=[light | extra])
        truth = reference(scene).truth("direct_radiance", 8192)
        means.append(truth.accumulators[:, truth.mask].mean(axis=(0, 1), dtype=float))
        facets.append(light_rows(lights_of(scene, geometry_of(scene), 64)).astype(float))
    np.testing.assert_allclose(means[0] + means[1], means[2], rtol=0.01)
    assert (np.minimum(means[0], means[1]) > 0.05 * means[2]).all()
    changed = np.abs(facets[0] - facets[2]).max(axis=0) > 1e-6
    np.testing.assert_allclose((facets[0] + facets[1])[:, changed], facets[2][:, changed], rtol=1e-5)
    np.testing.assert_allclose((facets[0] + facets[1])[:, ~changed], 2 * facets[2][:, ~changed], rtol=1e-5)
    assert np.count_nonzero(changed) == 3
