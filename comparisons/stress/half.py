"""Shaders in fewer bits: the result of every operation rounded to what a shorter number can hold."""

from __future__ import annotations

from dataclasses import dataclass

from comparisons.glsl.rewrite import Site, enclosed, wrap
from comparisons.glsl.source import preprocessed
from comparisons.glsl.syntax import parse
from comparisons.stress.watch import EXACT
from realtime.instrument import Instrument
from realtime.shader import Source

ROUNDED_STAGES = ("fragment_shader", "compute_shader")
FLOAT32_BITS = 23
"""Of the significand, the leading one left out."""


@dataclass(frozen=True)
class Rounding:
    """Numbers with so many bits of significand, the leading one left out; `is_half`: with float16's range too.

    They round to nearest, ties to even (IEEE 754-2019, section 4.3.1). With float16's range they underflow gradually
    and overflow to infinity.
    """

    bits: int
    is_half: bool = False

    @property
    def glsl(self) -> str:
        """A function of GLSL, `lg_round`, for all types that shaders compute with, in one line.

        By bits, as drivers differ in packHalf2x16: some truncate.
        """
        parts = [_HALF if self.is_half else _SHORT.format(**_masks(FLOAT32_BITS - self.bits))]
        for count in (2, 3, 4):
            each = ", ".join(f"lg_round(x.{c})" for c in "xyzw"[:count])
            parts.append(f"vec{count} lg_round(vec{count} x) {{ return vec{count}({each}); }}")
        for count in (2, 3, 4):
            each = ", ".join(f"lg_round(x[{k}])" for k in range(count))
            parts.append(f"mat{count} lg_round(mat{count} x) {{ return mat{count}({each}); }}")
        parts += [f"{kind} lg_round({kind} x) {{ return x; }}" for kind in EXACT]
        return " ".join(parts) + " "


FLOAT16 = Rounding(10, is_half=True)

_SHORT = (
    "float lg_round(float x) {{ uint b = floatBitsToUint(x);"
    " uint near = (b + {half}u + ((b >> {dropped}) & 1u)) & {kept}u;"
    " return (b & 0x7f800000u) == 0x7f800000u ? x : uintBitsToFloat(near); }}"
)
_HALF = (
    "float lg_round(float x) { uint b = floatBitsToUint(x), a = b & 0x7fffffffu;"
    " uint near = (a + 0xfffu + ((a >> 13) & 1u)) & 0xffffe000u;"
    " uint tiny = floatBitsToUint(roundEven(abs(x) * 16777216.0) / 16777216.0);"  # multiples of 2^-24 below 2^-14
    " near = a < 0x38800000u ? tiny : near;"
    " near = a >= 0x477ff000u ? 0x7f800000u : near;"  # 65520 and above
    " return a > 0x7f800000u ? x : uintBitsToFloat(near | (b & 0x80000000u)); }"
)


def _masks(dropped: int) -> dict[str, int]:
    return {"half": (1 << dropped - 1) - 1, "dropped": dropped, "kept": 0xFFFFFFFF ^ (1 << dropped) - 1}


class Rounded(Instrument):
    """Draws with fragment and compute shaders whose numbers are shorter than float32.

    Vertices are placed in float32, and textures and buffers keep their formats: a GPU without float32 in its vertex
    shaders is none that OpenGL 4 allows.
    """

    def __init__(self, rounding: Rounding) -> None:
        self.rounding = rounding

    def rewrite(self, source: Source, stage: str) -> Source:
        if stage not in ROUNDED_STAGES:
            return source
        plain = preprocessed(source)
        return Source(enclosed(wrap(parse(plain.text), _rounded), self.rounding.glsl), plain.lines)


def _rounded(site: Site, inside: str) -> str:
    return f"lg_round({inside})"
