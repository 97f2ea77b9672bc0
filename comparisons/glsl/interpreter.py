"""Runs a function of a shader by itself, for many inputs at once, in half, single or double precision.

Invocations go in step, as on a GPU: those that a branch or a loop is not for wait. Every operation is rounded to the
precision of the run, without fused multiply-adds; single precision knows no subnormal numbers. Each intermediate is
looked at, so that the first one that is not finite is known however much of it is left in the result.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from tree_sitter import Node

from comparisons.glsl.expressions import Callee, Scope
from comparisons.glsl.machine import Run, Site, Statement
from comparisons.glsl.statements import statement
from comparisons.glsl.syntax import Function, Syntax
from comparisons.glsl.values import Array, Structs, Type, Value, converted, undefined
from realtime.shader import Source


@dataclass(frozen=True)
class Evaluation:
    """What a function made of its inputs.

    outputs : 'return' and what it wrote to its out parameters
    first (count,), faults : index of the site at which the first number of an invocation stopped being finite, or -1
    trace : every intermediate of the run, if asked for
    """

    outputs: dict[str, Value]
    first: Array
    faults: tuple[Site, ...]
    trace: tuple[tuple[Site, Value], ...]


class Program:
    """The functions of a shader.

    Parameters
    ----------
    source : as it was loaded, with its map of lines
    syntax : the tree of its preprocessed text
    """

    def __init__(self, source: Source, syntax: Syntax) -> None:
        self.source, self.syntax = source, syntax
        self.functions = {function.name: function for function in syntax.functions()}
        self.structs: Structs = {
            name: tuple((field, Type.parse(kind)) for kind, field in fields)
            for name, fields in syntax.structs().items()
        }
        self.uniforms = dict(self._declared("uniform"))
        self._compiled: dict[str, Callee] = {}
        self._used: dict[str, set[str]] = {}
        self._globals: list[Statement] = []
        self._scope = Scope(syntax, self.structs, {}, self._callee, self.site, [0])
        for name in self.uniforms:
            self._scope.declare(name)
        for node in syntax.root.children:
            if node.type == "declaration" and node.children[0].type == "type_qualifier":
                self._globals.append(statement(self._scope, node))

    def site(self, node: Node) -> Site:
        row = node.start_point[0]
        file, line = self.source.lines[row] if row < len(self.source.lines) else ("shader", row + 1)
        return Site(file, line, " ".join(self.syntax.words(node).split()))

    def file_of(self, name: str) -> str:
        """The file in which a function is defined."""
        return self.site(self.functions[name].body).file

    def inputs(self, name: str) -> dict[str, Type]:
        """What a function reads: its parameters, then the uniforms that it or what it calls uses.

        Raises
        ------
        InputError
            It uses what only a draw call gives, such as a texture.
        """
        self._callee(name)
        function = self.functions[name]
        listed = {p.name: Type.parse(p.type) for p in function.parameters if p.qualifier != "out"}
        words = set(self._words(function.body))
        return listed | {uniform: kind for uniform, kind in self.uniforms.items() if uniform in words}

    def evaluate(
        self, name: str, given: Mapping[str, Value], real: type[np.floating[Any]], *, traced: bool = False
    ) -> Evaluation:
        """Run a function on inputs (L, ...) by name, which are rounded to `real`.

        Raises
        ------
        InputError
            There is no such function, or it needs more than its inputs.
        """
        inputs, function = self.inputs(name), self.functions[name]
        count = max((len(part) for value in given.values() for part in _arrays(value)), default=1)
        run = Run(real, count, self.structs)
        with np.errstate(all="ignore"):
            values = {key: converted(given[key], kind, real, self.structs) for key, kind in inputs.items()}
            for uniform in self.uniforms.keys() & values.keys():
                run.slots[self._scope.slots[uniform]] = values[uniform]
            for constant in self._globals:
                constant(run)
            run.trace = [] if traced else None
            arguments = [
                undefined(Type.parse(p.type), real, self.structs) if p.qualifier == "out" else values[p.name]
                for p in function.parameters
            ]
            callee = self._callee(name)
            assert callee is not None
            result = callee.call(run, arguments)
        outputs = {} if result is None else {"return": result}
        outputs |= {function.parameters[k].name: run.slots[slot] for k, slot in callee.outs}
        return Evaluation(outputs, run.first, tuple(run.faults), tuple(run.trace or ()))

    def _callee(self, name: str, count: int | None = None) -> Callee | None:
        """A function of the shader, made ready at its first use; None if the shader has none of that name."""
        if name not in self.functions:
            return None
        if name not in self._compiled:
            self._compiled[name] = _ready(self._scope.inner(), self.functions[name])
        return self._compiled[name]

    def _words(self, node: Node) -> Iterator[str]:
        """All identifiers in a node and in the functions that it calls."""
        if node.type == "identifier":
            name = self.syntax.words(node)
            yield name
            if name in self.functions:
                yield from self._words(self.functions[name].body)
        for child in node.children:
            yield from self._words(child)

    def _declared(self, qualifier: str) -> Iterator[tuple[str, Type]]:
        for node in self.syntax.root.children:
            if node.type != "declaration" or not any(child.type == qualifier for child in node.children):
                continue
            declared = node.child_by_field_name("type")
            for declarator in node.children_by_field_name("declarator"):
                if declared is None:
                    continue
                kind, name = self.syntax.typed(self.syntax.words(declared), declarator)
                if Type.parse(kind).shape is not None or Type.parse(kind).name in self.structs:
                    yield name, Type.parse(kind)


def _arrays(value: Value) -> Iterator[Array]:
    if isinstance(value, list):
        for item in value:
            yield from _arrays(item)
    elif isinstance(value, dict):
        yield from _arrays(list(value.values()))
    else:
        yield value


def _ready(scope: Scope, function: Function) -> Callee:
    """A function of the shader as one of Python."""
    kinds = [Type.parse(p.type) for p in function.parameters]
    slots = [scope.declare(p.name) for p in function.parameters]
    result_kind, result = Type.parse(function.returns), scope.declare("return")
    body = statement(scope, function.body)
    reads = [p.qualifier != "out" for p in function.parameters]

    def call(run: Run, arguments: list[Value]) -> Value:
        for slot, kind, argument, is_read in zip(slots, kinds, arguments, reads, strict=True):
            value = argument if is_read else undefined(kind, run.real, run.structs)
            run.slots[slot] = converted(value, kind, run.real, run.structs)
        if function.returns != "void":
            run.slots[result] = undefined(result_kind, run.real, run.structs)
        entry, broken, continued = run.active, run.broken, run.continued
        run.forget_jumps()
        body(run)
        run.active, run.broken, run.continued = entry, broken, continued
        return None if function.returns == "void" else run.slots[result]

    outs = tuple((k, slot) for k, slot in enumerate(slots) if function.parameters[k].qualifier != "in")
    return Callee(call, outs)
