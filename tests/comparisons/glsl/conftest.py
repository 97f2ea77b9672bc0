"""What the tests of the interpreter share: the same function on the GPU."""

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

import numpy as np
import pytest

from comparisons.glsl.source import preprocessed
from comparisons.glsl.values import Array, Type, Value, parts
from comparisons.stress.examination import Subject
from realtime.shader import Source

if TYPE_CHECKING:
    import moderngl

GROUP = 64
SHADER = """#version 430
{source}
layout(local_size_x = 64) in;
layout(std430, binding = 0) readonly buffer In {{ float given[]; }};
layout(std430, binding = 1) writeonly buffer Out {{ float made[]; }};
void main() {{
    int from = int(gl_GlobalInvocationID.x) * {width}, to = int(gl_GlobalInvocationID.x) * {outputs};
    {body}
}}
"""


class Reader:
    """Builds the expression that reads a value of a type from the numbers of an invocation."""

    def __init__(self, structs: Mapping[str, tuple[tuple[str, Type], ...]]) -> None:
        self.structs, self.at = structs, 0

    def read(self, kind: Type) -> str:
        if kind.name in self.structs:
            return f"{kind.name}({', '.join(self.read(field) for _, field in self.structs[kind.name])})"
        size = int(np.prod(kind.shape or (1,)))
        numbers = ", ".join(f"given[from + {self.at + k}]" for k in range(size))
        self.at += size
        return f"{kind.name}({numbers})"


class Writer:
    """Builds the statements that write the parts of a value."""

    def __init__(self, structs: Mapping[str, tuple[tuple[str, Type], ...]]) -> None:
        self.structs, self.at, self.lines = structs, 0, list[str]()

    def write(self, kind: Type, name: str) -> None:
        if kind.length is not None:
            for k in range(kind.length):
                self.write(kind.element, f"{name}[{k}]")
        elif kind.name in self.structs:
            for field, inner in self.structs[kind.name]:
                self.write(inner, f"{name}.{field}")
        else:
            for k in range(int(np.prod(kind.shape or (1,)))):
                place = f"{name}[{k}]" if kind.shape else name
                self.lines.append(f"made[to + {self.at}] = float({place});")
                self.at += 1


def flat(kind: Type, value: Value, structs: Mapping[str, tuple[tuple[str, Type], ...]]) -> list[Array]:
    if kind.name in structs:
        return [column for field, inner in structs[kind.name] for column in flat(inner, value[field], structs)]
    return [np.asarray(value, np.float32).reshape(len(value), -1)]


@pytest.fixture
def on_gpu(gl: "moderngl.Context") -> Callable[[Subject, Mapping[str, Value]], Array]:
    """Runs a function that needs no uniforms on inputs (N, ...); all numbers of its results side by side (N, K)."""

    def run(of: Subject, inputs: Mapping[str, Value]) -> Array:
        program, function = of.program, of.program.functions[of.function]
        reader, writer, setup, arguments = Reader(program.structs), Writer(program.structs), [], []
        for p in function.parameters:
            kind = Type.parse(p.type)
            setup.append(f"{p.type} _{p.name}" + (";" if p.qualifier == "out" else f" = {reader.read(kind)};"))
            arguments.append(f"_{p.name}")
        setup.append(f"{function.returns} _result = {function.name}({', '.join(arguments)});")
        writer.write(Type.parse(function.returns), "_result")
        for p in function.parameters:
            if p.qualifier == "out":
                writer.write(Type.parse(p.type), f"_{p.name}")
        body = "\n    ".join([*setup, *writer.lines])
        columns = [c for p in function.parameters if p.qualifier != "out"
                   for c in flat(Type.parse(p.type), inputs[p.name], program.structs)]  # fmt: skip
        given = np.ascontiguousarray(np.concatenate(columns, axis=1), np.float32)
        assert len(given) % GROUP == 0
        assert given.shape[1] == reader.at
        text = preprocessed(Source(program.source.text, program.source.lines), of.domain.defines).text
        shader = gl.compute_shader(SHADER.format(source=text, width=reader.at, outputs=writer.at, body=body))
        read, written = gl.buffer(given.tobytes()), gl.buffer(reserve=len(given) * writer.at * 4)
        read.bind_to_storage_buffer(0)
        written.bind_to_storage_buffer(1)
        shader.run(len(given) // GROUP)
        gl.memory_barrier()
        return np.frombuffer(written.read(), np.float32).reshape(len(given), writer.at)

    return run


@pytest.fixture
def side_by_side() -> Callable[[Mapping[str, Value], int], Array]:
    """All numbers of outputs (N, ...) side by side (N, K), as `on_gpu` gives them."""

    def join(outputs: Mapping[str, Value], count: int) -> Array:
        return np.concatenate(
            [
                np.broadcast_to(part.reshape(len(part), -1), (count, part.size // len(part))).astype(np.float64)
                for part in parts(dict(outputs)).values()
            ],
            axis=1,
        )

    return join
