"""Shorter numbers, emulated in shaders."""

from typing import TYPE_CHECKING

import numpy as np
import pytest

from comparisons.stress.half import FLOAT16, Rounded, Rounding
from comparisons.stress.techniques import subject_of
from realtime.render import Renderer
from scenes.image import Float32

if TYPE_CHECKING:
    import moderngl

SHADER = """#version 430
layout(local_size_x = 64) in;
layout(std430, binding = 0) buffer Numbers {{ vec4 numbers[]; }};
{function}
void main() {{ numbers[gl_GlobalInvocationID.x] = lg_round(numbers[gl_GlobalInvocationID.x]); }}
"""


def rounded_on_gpu(gl: "moderngl.Context", rounding: Rounding, numbers: Float32) -> Float32:
    padded = np.zeros(-(-len(numbers) // 256) * 256, np.float32)
    padded[: len(numbers)] = numbers
    buffer = gl.buffer(padded.tobytes())
    buffer.bind_to_storage_buffer(0)
    gl.compute_shader(SHADER.format(function=rounding.glsl)).run(len(padded) // 256)
    gl.memory_barrier()
    return np.frombuffer(buffer.read(), np.float32)[: len(numbers)]


def test_every_half_and_what_lies_between_rounds_as_in_numpy(gl: "moderngl.Context") -> None:
    """All float16, the ties between neighbours and what is just beside a tie; all magnitudes; overflow at 65520."""
    finite = np.arange(0x7C00, dtype=np.uint16).view(np.float16).astype(np.float32)
    ties = (finite[:-1] + finite[1:]) / 2
    spread = np.float32(10) ** np.random.default_rng(0).uniform(-12, 8, 20000).astype(np.float32)
    edges = np.array([65504, 65519.996, 65520, 1e30, np.inf], np.float32)
    above, below = (np.nextafter(ties, np.float32(to)) for to in (np.inf, 0))
    numbers = np.concatenate([finite, ties, above, below, spread, edges])
    numbers = np.concatenate([numbers, -numbers]).astype(np.float32)
    with np.errstate(over="ignore"):
        expected = numbers.astype(np.float16).astype(np.float32)
    made = rounded_on_gpu(gl, FLOAT16, numbers)
    np.testing.assert_array_equal(made.view(np.uint32), expected.view(np.uint32))


def test_no_number_stays_none(gl: "moderngl.Context") -> None:
    for rounding in (FLOAT16, Rounding(16)):
        made = rounded_on_gpu(gl, rounding, np.array([np.nan, np.inf, -np.inf, 0, -0.0], np.float32))
        np.testing.assert_array_equal(made, np.array([np.nan, np.inf, -np.inf, 0, -0.0], np.float32))


@pytest.mark.parametrize("bits", [20, 16, 7])
def test_fewer_bits_round_to_nearest_even(gl: "moderngl.Context", bits: int) -> None:
    rng = np.random.default_rng(1)
    numbers = (rng.normal(size=4096) * 10.0 ** rng.integers(-30, 30, 4096)).astype(np.float32)
    significand, exponent = np.frexp(numbers.astype(np.float64))
    expected = np.ldexp(np.rint(np.ldexp(significand, bits + 1)), exponent - bits - 1)
    np.testing.assert_array_equal(rounded_on_gpu(gl, Rounding(bits), numbers), expected)


def test_the_talks_iris_needs_more_than_half(gl: object) -> None:
    """The talk: "full fp32 is required". 16 bits of significand do, float16 does not.

    You should see errors halve with every bit, far below a texel of an iris 1000 texels wide at 16 bits.
    """
    subject = subject_of("cornea.talk_uv")

    def error(rounding: Rounding) -> float:
        renderer = Renderer(subject.case.scene, Rounded(rounding))
        drawn = renderer.render(subject.technique, dict(subject.case.settings), timed=False)
        return subject.difference(drawn.image.pixels.astype(float), subject.base)

    by_bits = {bits: error(Rounding(bits)) for bits in (20, 16)}
    assert by_bits[16] < 1e-4
    assert 4 < by_bits[16] / by_bits[20] < 64
    assert error(FLOAT16) > subject.tolerance.value
