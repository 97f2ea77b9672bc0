from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from realtime.frame import Frame
from realtime.graph import plan
from realtime.render import Renderer, Rendering
from realtime.shader import load, set_uniforms
from realtime.techniques import technique
from scenes.features import features_of
from scenes.geometry import geometry_of
from scenes.image import Float32, Float64
from scenes.model import Scene

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
