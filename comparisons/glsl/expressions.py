"""Expressions of GLSL, from nodes of the tree to Python functions that evaluate them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from tree_sitter import Node

from comparisons.glsl.builtins import BUILTINS
from comparisons.glsl.machine import Expression, Run, Site
from comparisons.glsl.operators import BINARY, SWIZZLES, constructed, element, with_element, with_field
from comparisons.glsl.syntax import Syntax
from comparisons.glsl.values import Array, Structs, Type, Value, aligned, cast, select
from scenes.errors import InputError

Store = Callable[[Run, Value], None]


@dataclass(frozen=True)
class Callee:
    """A function of the shader, ready to be called. `outs` are the places of those arguments that are written."""

    call: Callable[[Run, list[Value]], Value]
    outs: tuple[tuple[int, int], ...]


@dataclass(frozen=True)
class Scope:
    """What a piece of a shader can see.

    slots : of variables, by name
    callee : the function of a name that takes that many arguments, or None
    site : where a node stands
    """

    syntax: Syntax
    structs: Structs
    slots: dict[str, int]
    callee: Callable[[str, int], Callee | None]
    site: Callable[[Node], Site]
    next_slot: list[int]

    def inner(self) -> Scope:
        """That of a block inside: what it declares is not seen outside."""
        return replace(self, slots=dict(self.slots))

    def declare(self, name: str) -> int:
        self.slots[name] = self.next_slot[0]
        self.next_slot[0] += 1
        return self.slots[name]

    def unknown(self, node: Node, what: str) -> InputError:
        return InputError(
            f"{self.site(node)}: {what}. A function that is run by itself can use arguments, constants, uniforms "
            "other than samplers and images, and functions that do so."
        )


def field_of(node: Node, name: str) -> Node:
    """A child that the grammar says is there."""
    found = node.child_by_field_name(name)
    assert found is not None
    return found


def expression(scope: Scope, node: Node) -> Expression:
    """A function that evaluates a node.

    Raises
    ------
    InputError
        The expression uses something that only a draw call gives: a texture, a buffer, a built-in variable.
    """
    make = EXPRESSIONS.get(node.type)
    if make is None:
        raise scope.unknown(node, f"a {node.type.replace('_', ' ')} is not understood")
    return make(scope, node)


def _watched(scope: Scope, node: Node, evaluate: Expression) -> Expression:
    site = scope.site(node)
    return lambda run: run.looked_at(site, evaluate(run))


def _literal(scope: Scope, node: Node) -> Expression:
    text = scope.syntax.words(node).lower()
    if text in ("true", "false"):
        truth = np.array([text == "true"])
        return lambda run: truth
    if text.startswith("0x") or not set(text) & set(".ef"):
        whole = np.array([int(text.rstrip("u"), 0)], np.uint32 if text.endswith("u") else np.int32)
        return lambda run: whole
    number = float(text.rstrip("lf"))
    return lambda run: np.array([number], run.real)


def _identifier(scope: Scope, node: Node) -> Expression:
    name = scope.syntax.words(node)
    if name not in scope.slots:
        raise scope.unknown(node, f"'{name}' is no variable, constant or uniform")
    slot = scope.slots[name]
    return lambda run: run.slots[slot]


def _parenthesized(scope: Scope, node: Node) -> Expression:
    return expression(scope, node.named_children[0])


def _comma(scope: Scope, node: Node) -> Expression:
    left, right = (expression(scope, child) for child in node.named_children)
    return lambda run: (left(run), right(run))[1]


def _binary(scope: Scope, node: Node) -> Expression:
    sign = field_of(node, "operator").type
    left, right = expression(scope, field_of(node, "left")), expression(scope, field_of(node, "right"))
    if sign in ("&&", "||"):
        return _watched(scope, node, _short_circuit(sign == "&&", left, right))
    operation = BINARY[sign]
    return _watched(scope, node, lambda run: operation(left(run), right(run)))


def _short_circuit(is_and: bool, left: Expression, right: Expression) -> Expression:
    """The right side is evaluated only where it decides."""

    def evaluate(run: Run) -> Value:
        entry, first = run.active, left(run)
        run.active = entry & (first if is_and else ~first)
        second = right(run) if run.active.any() else np.array([is_and])
        run.active = entry
        return first & second if is_and else first | second

    return evaluate


def _unary(scope: Scope, node: Node) -> Expression:
    sign, operand = field_of(node, "operator").type, expression(scope, field_of(node, "argument"))
    functions: dict[str, Callable[[Any], Array]] = {
        "-": np.negative, "+": np.positive, "!": np.logical_not, "~": np.bitwise_not,
    }  # fmt: skip
    operation = functions[sign]
    return lambda run: operation(operand(run))


def _conditional(scope: Scope, node: Node) -> Expression:
    """Only the side that is chosen is evaluated."""
    condition, chosen, other = (
        expression(scope, field_of(node, name)) for name in ("condition", "consequence", "alternative")
    )

    def evaluate(run: Run) -> Value:
        entry = run.active
        mask = np.broadcast_to(condition(run), entry.shape)
        sides = []
        for side, part in ((chosen, mask), (other, ~mask)):
            run.active = entry & part
            sides.append(side(run) if run.active.any() else None)
        run.active = entry
        a, b = sides
        return b if a is None else a if b is None else _joined(mask, a, b)

    return evaluate


def _joined(mask: Array, a: Value, b: Value) -> Value:
    if isinstance(a, np.ndarray):
        a, b = aligned(a, b)
    return select(mask, a, b)


def _subscript(scope: Scope, node: Node) -> Expression:
    base, index = expression(scope, field_of(node, "argument")), expression(scope, field_of(node, "index"))
    return lambda run: element(base(run), index(run))


def _field(scope: Scope, node: Node) -> Expression:
    base = expression(scope, field_of(node, "argument"))
    name = scope.syntax.words(field_of(node, "field"))
    places = [SWIZZLES.get(letter, 0) for letter in name]

    def evaluate(run: Run) -> Value:
        whole = base(run)
        if isinstance(whole, dict):
            return whole[name]
        return whole[:, places[0]] if len(places) == 1 else whole[:, places]

    return evaluate


def store(scope: Scope, node: Node) -> Store:
    """A function that assigns to what a node names, in the active invocations."""
    if node.type == "identifier":
        slot = scope.slots.get(scope.syntax.words(node))
        if slot is None:
            raise scope.unknown(node, f"'{scope.syntax.words(node)}' is no variable")
        return lambda run, value: run.slots.__setitem__(slot, _assigned(run, value, run.slots[slot]))
    if node.type == "parenthesized_expression":
        return store(scope, node.named_children[0])
    base, outer = expression(scope, field_of(node, "argument")), store(scope, field_of(node, "argument"))
    if node.type == "subscript_expression":
        index = expression(scope, field_of(node, "index"))
        return lambda run, value: outer(run, with_element(base(run), index(run), value))
    name = scope.syntax.words(field_of(node, "field"))
    return lambda run, value: outer(run, with_field(base(run), name, value))


def _assigned(run: Run, value: Value, old: Value) -> Value:
    if isinstance(value, np.ndarray):
        value = cast(value, old.dtype.type)
    return select(run.active, value, old)


def _assignment(scope: Scope, node: Node) -> Expression:
    sign, left = field_of(node, "operator").type, field_of(node, "left")
    put, value = store(scope, left), expression(scope, field_of(node, "right"))
    if sign != "=":
        operation, old, right = BINARY[sign[:-1]], expression(scope, left), value
        value = _watched(scope, node, lambda run: operation(old(run), right(run)))
    return _assigning(put, value)


def _assigning(put: Store, value: Expression) -> Expression:
    def evaluate(run: Run) -> Value:
        made = value(run)
        put(run, made)
        return made

    return evaluate


def _update(scope: Scope, node: Node) -> Expression:
    target = field_of(node, "argument")
    put, old = store(scope, target), expression(scope, target)
    step = 1 if field_of(node, "operator").type == "++" else -1
    is_prefix = node.children[0].type in ("++", "--")

    def evaluate(run: Run) -> Value:
        before = old(run)
        after = before + before.dtype.type(step)
        put(run, after)
        return after if is_prefix else before

    return evaluate


def _call(scope: Scope, node: Node) -> Expression:
    name, arguments = scope.syntax.words(field_of(node, "function")), field_of(node, "arguments").named_children
    values = [expression(scope, argument) for argument in arguments]
    callee = scope.callee(name, len(values))
    if callee is not None:
        puts = [(store(scope, arguments[k]), slot) for k, slot in callee.outs]
        return _calling(callee, values, puts)
    if name in BUILTINS:
        function = BUILTINS[name]
        return _watched(scope, node, lambda run: function(*(value(run) for value in values)))
    kind = Type.parse(name)
    if name in scope.structs or kind.length is not None or kind.shape is not None:
        return lambda run: constructed(kind, [value(run) for value in values], run)
    raise scope.unknown(node, f"'{name}' is no function that is known here")


def _calling(callee: Callee, values: list[Expression], puts: list[tuple[Store, int]]) -> Expression:
    def evaluate(run: Run) -> Value:
        made = callee.call(run, [value(run) for value in values])
        for put, slot in puts:
            put(run, run.slots[slot])
        return made

    return evaluate


EXPRESSIONS: dict[str, Callable[[Scope, Node], Expression]] = {
    "number_literal": _literal,
    "true": _literal,
    "false": _literal,
    "identifier": _identifier,
    "parenthesized_expression": _parenthesized,
    "comma_expression": _comma,
    "binary_expression": _binary,
    "unary_expression": _unary,
    "conditional_expression": _conditional,
    "subscript_expression": _subscript,
    "field_expression": _field,
    "assignment_expression": _assignment,
    "update_expression": _update,
    "call_expression": _call,
}
