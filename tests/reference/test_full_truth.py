"""Everything at once, against the truths of its parts, a white furnace and Mitsuba's own integrator."""

from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest

from reference.curves import HAIRS_A_SHAPE, curve_dicts, stage_with_hair
from reference.integrators.full_stage import full_stage, iris
from reference.quantities import quantity
from reference.quantities.full import full_block, full_means
from reference.quantities.hair import coverage_means, radiance_means
from reference.sampling import pixel_means
from reference.stage import Stage, build_stage
from reference.strands import strands_of
from scenes.errors import SceneError
from scenes.features import features_of
from scenes.geometry import geometry_of
from scenes.image import Float64
from scenes.model import Scene
from scenes.shapes import Eye
from scenes.topology import surface_area

MakeScene = Callable[..., Scene]
Block = Callable[..., Float64]

SENSOR = {
    "type": "perspective",
    "origin": [0.2, 0.3, 1.2],
    "target": [0.1, 0.05, 0.0],
    "fov_deg": 40.0,
    "width": 12,
    "height": 10,
}
LENS = SENSOR | {"type": "thin_lens", "aperture_radius": 0.05, "focus_distance": 0.9}
SKY = {"type": "constant", "radiance": [1.0, 1.0, 1.0]}
SKIN = {"type": "translucent", "sigma_a": [0.5, 1.0, 2.0], "sigma_s": [6.0, 7.0, 8.0]}
WHITE = {"type": "diffuse", "reflectance": [1.0, 1.0, 1.0]}
BALL = {"name": "ball", "type": "sphere", "radius": 0.25, "detail": 3}
EYE = {
    "name": "eye",
    "type": "eye",
    "material": "white",
    "iris": "white",
    "ior": 1.3375,
    "sclera_radius": 12.0,
    "cornea_radius": 7.8,
    "limbus_radius": 5.9,
    "detail": 96,
    "scale": 0.025,
}


@pytest.fixture
def stage_of(mi: ModuleType) -> Callable[[Scene], Stage]:
    return lambda scene: build_stage(mi, scene, geometry_of(scene))


def means(block: Block, stage: Stage, spp: int, blocks: int = 8) -> Float64:
    """Mean over the pixels of each of some blocks, of each channel (blocks, 3)."""
    pixels = np.arange(stage.width * stage.height)
    each: Float64 = np.stack([block(stage, pixels, 97 * (k + 1), spp) for k in range(blocks)]).mean(axis=1)
    return each


def assert_same_light(one: Float64, other: Float64, left_out: float = 0.0) -> None:
    """Means that differ by no more than four of their own standard errors and the part of them that is left out."""
    error = np.sqrt(sum(each.var(axis=0, ddof=1) / len(each) for each in (one, other)))
    assert (np.abs(one.mean(axis=0) - other.mean(axis=0)) < 4 * error + left_out * one.mean(axis=0)).all()
    assert (error < 0.01 * one.mean(axis=0)).all()  # else nothing was tested


def block_of(name: str, scene: Scene) -> Block:
    block = quantity(name).integrator(features_of(scene, geometry_of(scene))).block
    assert block is not None
    return block


def test_a_diffuse_room_is_that_of_the_whole_frame(make_scene: MakeScene, stage_of: Callable[[Scene], Stage]) -> None:
    scene = make_scene(sensor=SENSOR)
    stage = stage_of(scene)
    assert_same_light(means(full_block, stage, 64), means(block_of("frame_radiance", scene), stage, 64))


def test_through_a_lens_it_is_that_of_defocus(make_scene: MakeScene, stage_of: Callable[[Scene], Stage]) -> None:
    lamp = {"type": "sphere", "position": [-0.2, 0.5, -0.3], "radius": 0.15, "radiance": [4.0, 3.0, 2.0]}
    scene = make_scene(sensor=LENS, emitters=[lamp])
    stage = stage_of(scene)
    assert_same_light(means(full_block, stage, 128), means(block_of("defocus_radiance", scene), stage, 128), 0.005)


SUN = {"type": "directional", "direction": [0.3, -0.4, 1.0], "irradiance": [3.0, 3.0, 3.0]}
LAMP = {"type": "sphere", "position": [0.25, 0.1, 1.9], "radius": 0.3, "radiance": [40.0, 35.0, 30.0]}


@pytest.mark.parametrize("light", [SUN, LAMP], ids=["sun", "lamp"])
def test_a_body_alone_is_that_of_translucency(
    light: dict[str, Any], make_scene: MakeScene, stage_of: Callable[[Scene], Stage]
) -> None:
    """A ray that leaves a body goes on along the same line: beside it, a lamp may hide itself from a grazing ray."""
    ball = {"name": "ball", "type": "sphere", "radius": 0.45, "detail": 4, "material": "skin"}
    scene = make_scene(sensor=SENSOR, materials={"skin": SKIN}, shapes=[ball], emitters=[light])
    stage = stage_of(scene)
    assert_same_light(means(full_block, stage, 128), means(block_of("transmitted_radiance", scene), stage, 128))


@pytest.mark.parametrize(("is_lit_by_lamp", "left_out"), [(False, 0.0), (True, 0.02)])
def test_an_eye_alone_is_that_of_the_eye(
    is_lit_by_lamp: bool, left_out: float, make_scene: MakeScene, stage_of: Callable[[Scene], Stage]
) -> None:
    """An eye's truth leaves out what a cornea throws on the sclera, and what it reflects inside before the iris."""
    lamp = {"type": "disk", "position": [-1.2, 1.5, 0.2], "normal": [1.2, -1.3, -0.2], "radius": 0.6}
    materials = {"white": {"type": "diffuse", "reflectance": [0.6, 0.5, 0.4]}}
    scene = make_scene(
        sensor=SENSOR | {"origin": [0.3, 1.2, 0.6], "target": [0.0, 0.2, 0.0], "fov_deg": 22.0},
        materials=materials,
        shapes=[EYE | {"pupil_radius": 2.0}],
        emitters=[SKY, *([lamp | {"radiance": [5.0, 4.0, 3.0]}] if is_lit_by_lamp else [])],
        subject=["eye"],
    )
    stage = stage_of(scene)
    eye = block_of("eye_radiance", scene)
    assert_same_light(means(full_block, stage, 256), means(_on_the_eye(eye), stage, 256), left_out)


def _on_the_eye(block: Block) -> Block:
    """The eye's light and, where the eye is not seen, that of the sky, which an eye's truth leaves out."""

    def whole(stage: Stage, pixels: Any, seed: int, spp: int) -> Float64:
        from reference.integrators.emitted_light import emitted_light

        def sky(stage: Stage, sampler: Any, ray: Any) -> tuple[Any, Any]:
            return emitted_light(stage, ray), stage.mi.Color3f(0.0)

        return block(stage, pixels, seed, spp) + pixel_means(sky, stage, pixels, seed + 1, spp, None)

    return whole


def test_in_a_white_furnace_all_is_as_bright_as_the_sky(
    make_scene: MakeScene, stage_of: Callable[[Scene], Stage]
) -> None:
    """Nothing absorbs: a body, an eye, a wall. Light that goes far in a body makes the noise of single pixels."""
    milk = {"type": "translucent", "sigma_a": [0.0, 0.0, 0.0], "sigma_s": [3.0, 5.0, 8.0]}
    shapes = [
        {
            "name": "ball",
            "type": "sphere",
            "radius": 0.3,
            "detail": 3,
            "position": [0.35, 0.0, 0.0],
            "material": "milk",
        },
        EYE | {"position": [-0.1, 0.1, 0.0], "rotation_deg": [80.0, 10.0, 0.0]},
        {"name": "wall", "type": "rectangle", "size": [2.0, 2.0], "position": [0.0, 0.0, -0.5], "material": "white"},
    ]
    scene = make_scene(sensor=LENS, materials={"milk": milk, "white": WHITE}, shapes=shapes, emitters=[SKY])
    stage = stage_of(scene)
    pixels = np.arange(stage.width * stage.height)
    seen = np.mean([full_block(stage, pixels, seed, 256) for seed in range(4)], axis=0)
    np.testing.assert_allclose(seen, 1, atol=0.1)
    assert (np.abs(seen - 1) < 0.02).mean() > 0.8
    np.testing.assert_allclose(seen.mean(axis=0), 1, atol=0.004)


def test_it_is_what_mitsubas_own_integrator_finds(
    mi: ModuleType, make_scene: MakeScene, stage_of: Callable[[Scene], Stage]
) -> None:
    """A body before a layered ball, two eyes, a lamp that is seen through the body, a lens: `volpathmis`."""
    import drjit as dr

    suit = {"type": "layered", "reflectance": [0.1, 0.2, 0.5], "metals": [{"metal": "Cr", "alpha": 0.3, "weight": 0.3}]}
    shapes = [
        {
            "name": "ball",
            "type": "sphere",
            "radius": 0.25,
            "detail": 3,
            "position": [0.2, 0.0, 0.2],
            "material": "skin",
        },
        {
            "name": "suit",
            "type": "sphere",
            "radius": 0.35,
            "detail": 3,
            "position": [-0.2, -0.3, 0.0],
            "material": "suit",
        },
        EYE | {"position": [-0.2, 0.3, 0.0], "rotation_deg": [80.0, 10.0, 0.0]},
        EYE | {"name": "other", "position": [0.5, 0.35, 0.0], "rotation_deg": [80.0, 10.0, 0.0]},
    ]
    lamp = {"type": "sphere", "position": [0.25, 0.1, -0.8], "radius": 0.3, "radiance": [8.0, 7.0, 6.0]}
    scene = make_scene(
        sensor=LENS,
        materials={"skin": SKIN, "suit": suit, "white": {"type": "diffuse", "reflectance": [0.7, 0.6, 0.5]}},
        shapes=shapes,
        emitters=[lamp, SKY],
    )
    stage = stage_of(scene)
    whole = full_stage(scene)
    theirs = mi.load_dict({"type": "volpathmis", "max_depth": 200, "rr_depth": 50})

    def block(stage: Stage, pixels: Any, seed: int, spp: int) -> Float64:
        image = mi.render(whole.scene, sensor=whole.sensor, integrator=theirs, spp=spp, seed=seed)
        rendered: Float64 = np.array(image, dtype=np.float64)[..., :3].reshape(-1, 3)
        dr.eval(image)
        return rendered

    assert_same_light(means(full_block, stage, 256), means(block, stage, 256))


def test_an_iris_is_a_ring_or_a_part_of_a_sphere() -> None:
    flat = Eye.model_validate(EYE | {"pupil_radius": 2.0})
    assert surface_area(iris(flat)) == pytest.approx(np.pi * (5.9**2 - 2.0**2), rel=2e-3)
    bowl = iris(Eye.model_validate(EYE | {"iris_curvature": 12.0}))
    assert surface_area(bowl) == pytest.approx(2 * np.pi * 12.0 * (12.0 - np.sqrt(12.0**2 - 5.9**2)), rel=2e-3)
    assert (bowl.normals[:, 1] > 0.8).all()


def test_hair_that_is_painted_is_refused(make_scene: MakeScene, tmp_path: Any) -> None:
    """Before anything is rendered; whoever renders it all the same is told too."""
    from PIL import Image

    Image.new("RGB", (2, 2), (200, 100, 50)).save(tmp_path / "paint.png")
    fibre = {"type": "fibre", "sigma_a": [0.1, 0.2, 0.3]}
    hair = {"name": "fur", "on": "ball", "material": "fibre", "count": 5, "length": 0.1, "radius": 0.001}
    scene = make_scene(
        materials={"white": WHITE, "skin": WHITE, "red": WHITE, "fibre": fibre},
        hair=[hair | {"color": {"path": "paint.png"}}],
    )
    assert "judge hair_radiance" in quantity("full_radiance").refuses(features_of(scene, geometry_of(scene)))
    with pytest.raises(SceneError, match="hair with a colour texture \\(fur\\)"):
        full_stage(scene)


def test_hair_that_is_too_thin_for_mitsuba_is_refused(make_scene: MakeScene) -> None:
    fibre = {"type": "fibre", "sigma_a": [0.1, 0.2, 0.3]}
    hair = {"name": "fur", "on": "ball", "material": "fibre", "count": 5, "length": 0.5, "radius": 0.0001}
    scene = make_scene(materials={"white": WHITE, "skin": WHITE, "red": WHITE, "fibre": fibre}, hair=[hair])
    assert "of its radii long" in quantity("full_radiance").refuses(features_of(scene, geometry_of(scene)))


def test_in_the_dark_nothing_is_traced(make_scene: MakeScene) -> None:
    scene = make_scene(emitters=[])
    assert quantity("full_radiance").integrator(features_of(scene, geometry_of(scene))).exact is not None


def test_several_eyes_are_no_matter_for_it_but_for_the_truths_of_one(make_scene: MakeScene) -> None:
    scene = make_scene(
        materials={"white": WHITE},
        shapes=[EYE, EYE | {"name": "other", "position": [1.0, 0.0, 0.0]}],
        emitters=[LAMP],
        subject=["eye", "other"],
    )
    features = features_of(scene, geometry_of(scene))
    assert quantity("full_radiance").refuses(features) == ""
    assert "several eyes" in quantity("eye_radiance").refuses(features)


POINT = {"type": "point", "position": [0.0, 2.0, 1.0], "intensity": [1.0, 1.0, 1.0]}


@pytest.mark.parametrize("light", [SUN, POINT], ids=["sun", "point"])
def test_a_lamp_without_extent_is_refused_before_a_cornea_alone(light: dict[str, Any], make_scene: MakeScene) -> None:
    """No path meets it, and none is joined to it through the cornea: the iris would be black."""
    eye = make_scene(materials={"white": WHITE}, shapes=[EYE], emitters=[SKY, light], subject=["eye"])
    refused = quantity("full_radiance").refuses(features_of(eye, geometry_of(eye)))
    assert refused == "light of a lamp without extent cannot be followed through a cornea; give it a radius"
    ball = make_scene(emitters=[SKY, light])
    assert not quantity("full_radiance").refuses(features_of(ball, geometry_of(ball)))


@pytest.fixture
def furry(make_scene: MakeScene) -> Scene:
    """Two diffuse balls under a sky, with hair of two fibres, one of it more than a shape of Mitsuba's holds."""
    balls = [BALL | {"material": "white"}, BALL | {"name": "other", "position": [0.4, 0.1, -0.1], "material": "white"}]
    hair = {"on": "ball", "count": 300, "length": 0.15, "radius": 0.006, "comb": [0.5, 0.3]}
    return make_scene(
        sensor=SENSOR,
        materials={
            "white": {"type": "diffuse", "reflectance": [0.7, 0.5, 0.3]},
            "light": {"type": "fibre", "sigma_a": [0.05, 0.1, 0.2]},
            "dark": {"type": "fibre", "sigma_a": [0.5, 1.0, 2.0]},
        },
        shapes=balls,
        hair=[
            hair | {"name": "fur", "material": "light"},
            hair | {"name": "mane", "on": "other", "material": "dark", "count": HAIRS_A_SHAPE + 400, "radius": 0.002},
        ],
        emitters=[SKY],
    )


@pytest.mark.slow
def test_hair_and_the_rest_of_what_is_seen_are_the_whole(furry: Scene, stage_of: Callable[[Scene], Stage]) -> None:
    """Light that hair sends to the sensor, light that balls send there, and the sky between them."""

    def parts(stage: Stage, pixels: Any, seed: int, spp: int) -> Float64:
        return radiance_means(furry, pixels, seed, spp, None) + pixel_means(
            _all_but_hair, stage_with_hair(furry), pixels, seed + 1, spp, None
        )

    def whole(stage: Stage, pixels: Any, seed: int, spp: int) -> Float64:
        return full_means(furry, pixels, seed, spp, None)

    stage = stage_of(furry)
    assert_same_light(means(whole, stage, 256), means(parts, stage, 256))
    assert coverage_means(furry, np.arange(stage.width * stage.height), 1, 64, None).mean() > 0.1


def _all_but_hair(stage: Stage, sampler: Any, ray: Any) -> tuple[Any, Any]:
    from reference.integrators.light_paths import UNBOUNDED, trace_light_paths

    def begins(shape: Any, active: Any) -> Any:
        return active & ~stage.is_subject(shape, active)

    return trace_light_paths(stage, sampler, ray, 0, UNBOUNDED, begins)


def test_every_hair_of_the_scene_is_in_the_stage(furry: Scene, tmp_path: Path) -> None:
    """In shapes of few hairs, each with a speck, and each of its own fibre."""
    strands = strands_of(furry)
    dicts = curve_dicts(furry, strands, tmp_path)
    texts = [Path(plain["filename"]).read_text(encoding="ascii") for plain in dicts.values()]
    counts = [len(text.split("\n\n")) - 1 for text in texts]
    assert len(counts) == 3
    assert max(counts) <= HAIRS_A_SHAPE
    assert sum(counts) == len(strands.points)
    absorbed = [plain["bsdf"]["sigma_a"]["value"][0] for plain in dicts.values()]
    assert absorbed == [0.05, 0.5, 0.5]
    loaded = {shape.id() for shape in full_stage(furry).scene.shapes()}
    assert loaded >= set(dicts)


def test_hair_of_no_fibre_is_no_hair_left_out(furry: Scene) -> None:
    """No file says so, but a scene made otherwise may."""
    wrong = furry.model_copy(update={"materials": furry.materials | {"light": furry.materials["white"]}})
    with pytest.raises(SceneError, match='hair "fur": the material "light" is not a fibre'):
        full_stage(wrong)
