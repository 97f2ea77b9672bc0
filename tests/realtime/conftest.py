from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from scipy.ndimage import map_coordinates

from realtime.frame import Frame
from realtime.graph import plan
from realtime.render import Renderer, Rendering
from realtime.shader import load, set_uniforms
from realtime.techniques import technique
from scenes.exr import write_exr
from scenes.features import features_of
from scenes.geometry import geometry_of, heights_of
from scenes.image import Float32, Float64, Image
from scenes.model import Scene
from scenes.procedural import normalised, rotation_xyz
from scenes.shapes import Relief

if TYPE_CHECKING:
    import moderngl

GRID_SHADER = """
layout(local_size_x = 64) in;
layout(std430, binding = 0) readonly buffer In {{ vec4 given[]; }};
layout(std430, binding = 1) writeonly buffer Out {{ vec4 made[]; }};
uniform int count;
void main() {{
    int i = int(gl_GlobalInvocationID.x);
    if (i >= count) return;
    vec4 a[{inputs}], r[{outputs}];
    for (int k = 0; k < {inputs}; ++k) a[k] = given[i * {inputs} + k];
    for (int k = 0; k < {outputs}; ++k) r[k] = vec4(0.0);
    {body}
    for (int k = 0; k < {outputs}; ++k) made[i * {outputs} + k] = r[k];
}}
"""


@pytest.fixture
def glsl(gl: "moderngl.Context") -> Callable[..., Float64]:
    """Evaluates GLSL on a grid: `body` turns vec4 a[I] into vec4 r[O], with a file of glsl/ included.

    glsl(file, body, inputs (N, I, 4), outputs=O, buffers={binding: array}, defines={...}, name=value) -> (N, O, 4)
    """

    def evaluate(
        file: str,
        body: str,
        inputs: Float64,
        outputs: int = 1,
        buffers: Mapping[int, Float32] | None = None,
        defines: Mapping[str, int] | None = None,
        **uniforms: int,
    ) -> Float64:
        count, width, _ = inputs.shape
        constants = "".join(f"#define {name} {value}\n" for name, value in (defines or {}).items())
        text = (
            "#version 430\n"
            + constants
            + load(file).text
            + GRID_SHADER.format(inputs=width, outputs=outputs, body=body)
        )
        shader = gl.compute_shader(text)
        set_uniforms(shader, count=count, **uniforms)
        bound = [(binding, gl.buffer(array.tobytes())) for binding, array in (buffers or {}).items()]
        for binding, buffer in bound:
            buffer.bind_to_storage_buffer(binding)
        given = gl.buffer(np.ascontiguousarray(inputs, dtype=np.float32).tobytes())
        made = gl.buffer(reserve=count * outputs * 16)
        given.bind_to_storage_buffer(0)
        made.bind_to_storage_buffer(1)
        shader.run(-(-count // 64))
        gl.memory_barrier()
        return np.frombuffer(made.read(), dtype=np.float32).reshape(count, outputs, 4).astype(np.float64)

    return evaluate


@pytest.fixture
def sheet(tmp_path: Path) -> dict[str, Any]:
    """The shape of a mesh that is not closed: a square of side 4 that faces +z."""
    corners = "".join(f"v {x} {y} 0\n" for x, y in ((-2, -2), (2, -2), (2, 2), (-2, 2)))
    (tmp_path / "sheet.obj").write_text(f"{corners}f 1 2 3\nf 1 3 4\n", encoding="ascii")
    return {"type": "mesh", "name": "sheet", "path": "sheet.obj"}


@pytest.fixture
def render() -> Callable[..., Rendering]:
    """Draws a scene once with the technique of a name and some settings: render(scene, name, **settings)."""

    def run(scene: Scene, name: str, **settings: Any) -> Rendering:
        return Renderer(scene).render(technique(name), settings, timed=False)

    return run


@pytest.fixture
def draw(render: Callable[..., Rendering]) -> Callable[..., Float32]:
    """As `render`, pixels alone."""
    return lambda scene, name, **settings: render(scene, name, **settings).image.pixels


@pytest.fixture
def frame_with(gl: "moderngl.Context") -> Callable[..., Frame]:
    """Runs the passes of a technique that `wanted` needs, and returns the frame with what they wrote."""

    def run(scene: Scene, name: str, wanted: str, **settings: Any) -> Frame:
        used, meshes = technique(name), geometry_of(scene)
        features, given = features_of(scene, meshes), used.settings(settings)
        frame = Frame(gl, scene, meshes, features, given, used.grid)
        for step in plan(used.passes(scene, features, given), wanted).passes:
            step.run(frame)
        return frame

    return run


@pytest.fixture
def make_hair(make_scene: Callable[..., Scene]) -> Callable[..., Scene]:
    """Makes a scene with hair on a finger of two bones, or on another skin.

    make_hair({fields of the limb}, {fields of the hair}, skin={another shape}, size=pixels, **overrides)
    """

    def make(
        limb: Mapping[str, Any] | None = None,
        hair: Mapping[str, Any] | None = None,
        skin: Mapping[str, Any] | None = None,
        size: int = 24,
        **overrides: Any,
    ) -> Scene:
        finger = {"type": "limb", "radius": 12.0, "length": 60.0, "detail": 48} | dict(limb or {})
        grown = {"count": 60, "guides": 4, "length": 12.0, "radius": 0.1, "comb": [0.3, 0.8], "curl": 0.05}
        grown |= {"region": [0.0, 0.15, 1.0, 0.85]} | dict(hair or {})
        sensor = {"type": "perspective", "origin": [0.0, 10.0, 160.0], "target": [0.0, 0.0, 0.0], "fov_deg": 30.0}
        return make_scene(
            **{
                "length_unit": "mm",
                "subject": ["skin"],
                "sensor": sensor | {"width": size, "height": size},
                "materials": {
                    "skin": {"type": "diffuse", "reflectance": [0.6, 0.5, 0.4]},
                    "fibre": {"type": "fibre", "sigma_a": [0.1, 0.2, 0.4]},
                },
                "shapes": [dict(skin or finger) | {"name": "skin", "material": "skin"}],
                "hair": [{"name": "hair", "on": "skin", "material": "fibre"} | grown],
            }
            | overrides
        )

    return make


@pytest.fixture
def make_relief(make_scene: Callable[..., Scene], tmp_path: Path) -> Callable[..., Scene]:
    """Makes a scene with one relief, seen by a sensor `view` degrees off its normal that looks at its middle.

    `heights` is a field by name, or an array (N, M) with row 0 at v = 0. `width` is that of what the image shows, in
    widths of the block, `distance` that of the sensor. `light` goes where a sun's light goes, in the block's own axes.
    """

    def make(
        heights: str | Float64 = "gravel",
        view: float = 60.0,
        azimuth: float = 25.0,
        pixels: tuple[int, int] = (24, 24),
        width: float = 0.25,
        distance: float = 8.0,
        light: tuple[float, float, float] = (-0.5, 0.3, -0.8),
        target: tuple[float, float, float] = (0.0, 0.0, 0.0),
        overrides: Mapping[str, Any] | None = None,
        **shape: Any,
    ) -> Scene:
        block: dict[str, Any] = {
            "name": "block",
            "type": "relief",
            "material": "stone",
            "size": [1.0, 1.0],
            "depth": 0.1,
        }
        if isinstance(heights, str):
            block |= {"heights": heights}
        else:
            write_exr(tmp_path / "heights.exr", Image(heights[::-1, :, None].astype(np.float32), {}))
            block |= {"heights": {"path": "heights.exr", "color_space": "linear"}}
        block |= {"resolution": 64} | shape
        turn, scale = rotation_xyz(tuple(block.get("rotation_deg", (0, 0, 0)))), block.get("scale", 1.0)
        place = np.array(block.get("position", (0.0, 0.0, 0.0)))
        tilt, around = np.radians(view), np.radians(azimuth)
        towards = np.array([np.sin(tilt) * np.cos(around), np.sin(tilt) * np.sin(around), np.cos(tilt)])
        seen = scale * block["size"][0]
        sensor = {
            "type": "perspective",
            "origin": list(place + turn @ (scale * np.array(target) + seen * distance * towards)),
            "target": list(place + turn @ (scale * np.array(target))),
            "up": list(turn @ [np.sin(around), -np.cos(around), 0.0]),
            "fov_deg": float(np.degrees(2 * np.arctan(width / (2 * distance)))),
            "width": pixels[0],
            "height": pixels[1],
        }
        sun = {"type": "directional", "direction": list(turn @ light), "irradiance": [2.0, 2.0, 2.0]}
        return make_scene(
            **{
                "title": "A relief",
                "subject": ["block"],
                "sensor": sensor,
                "materials": {"stone": {"type": "diffuse", "reflectance": [0.5, 0.5, 0.5]}},
                "shapes": [block],
                "emitters": [sun],
            }
            | dict(overrides or {})
        )

    return make


@pytest.fixture
def marched() -> Callable[..., Float64]:
    """Marches the rays through a relief's pixel centres in float64, in small steps that end in bisection.

    marched(scene, steps=4000) -> (H, W, 3) in samples along u and v, and in heights; NaN where nothing is met
    """

    def march(scene: Scene, steps: int = 4000) -> Float64:
        shape, sensor = scene.shapes[0], scene.sensor
        assert isinstance(shape, Relief)
        heights = heights_of(scene, shape)
        last = np.array([heights.shape[1] - 1, heights.shape[0] - 1, 1])
        eye = np.array(sensor.origin)
        forward = normalised(np.array(sensor.target) - eye)
        right = normalised(np.cross(forward, sensor.up))
        half = np.tan(np.radians(sensor.fov_deg / 2)) * (2 * np.arange(sensor.width) + 1 - sensor.width) / sensor.width
        down = (
            np.tan(np.radians(sensor.fov_deg / 2)) * (2 * np.arange(sensor.height) + 1 - sensor.height) / sensor.width
        )
        d = forward + half[None, :, None] * right - down[:, None, None] * np.cross(right, forward)
        turn = rotation_xyz(shape.rotation_deg)
        per_length = last / (shape.scale * np.array([*shape.size, shape.depth]))
        corner = shape.scale * np.array([shape.size[0] / 2, shape.size[1] / 2, shape.depth])
        o = ((eye - np.array(shape.position)) @ turn + corner) * per_length
        d = d @ turn * per_length
        with np.errstate(divide="ignore"):
            slabs = np.sort(np.stack([-o / d, (last - o) / d]), axis=0)
        begin, end = np.maximum(slabs[0].max(axis=-1), 0), slabs[1].min(axis=-1)

        def above(t: Float64) -> Float64:
            """How far the rays are above the field at t (H, W)."""
            at = o + t[..., None] * d
            over: Float64 = at[..., 2] - map_coordinates(heights, [at[..., 1], at[..., 0]], order=1, mode="nearest")
            return over

        crosses = begin <= end
        low, high = np.where(crosses, begin, 0), np.full(begin.shape, np.nan)
        searching = crosses.copy()
        for k in range(steps + 1):
            t = np.where(crosses, begin + k / steps * (end - begin), 0)
            met = searching & (above(t) <= 1e-12)
            high[met] = t[met]
            searching &= ~met
            low = np.where(searching, t, low)
        for _ in range(60):
            t = (low + np.nan_to_num(high)) / 2
            is_low = above(t) > 1e-12
            low, high = np.where(is_low, t, low), np.where(is_low, high, np.where(np.isnan(high), np.nan, t))
        hit: Float64 = o + high[..., None] * d
        return hit

    return march


@pytest.fixture
def strand_points(frame_with: Callable[..., Frame]) -> Callable[..., Float64]:
    """Control points (N, 4, 3) of all hairs as the GPU has them: strand_points(scene, name of a technique)."""

    def read(scene: Scene, name: str = "hair.frame_coverage") -> Float64:
        strands = frame_with(scene, name, "strands").resources["strands"]
        rows = np.frombuffer(strands.points.read(), dtype=np.float32).reshape(-1, 4, 4)
        return rows[: strands.count, :, :3].astype(np.float64)

    return read
