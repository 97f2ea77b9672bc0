"""Statements of GLSL, from nodes of the tree to Python functions that carry them out in the active invocations."""

from collections.abc import Callable

import numpy as np
from tree_sitter import Node

from comparisons.glsl.expressions import Scope, expression, field_of
from comparisons.glsl.machine import Expression, Run, Site, Statement
from comparisons.glsl.values import Type, converted, select, undefined
from scenes.errors import InputError

MOST_ITERATIONS = 100_000


def statement(scope: Scope, node: Node) -> Statement:
    """A function that carries out a statement in the active invocations."""
    make = STATEMENTS.get(node.type)
    if make is None:
        raise scope.unknown(node, f"a {node.type.replace('_', ' ')} is not understood")
    return make(scope, node)


def _block(scope: Scope, node: Node) -> Statement:
    return _sequence([statement(inner, child) for inner in [scope.inner()] for child in node.named_children])


def _sequence(steps: list[Statement]) -> Statement:
    def run_all(run: Run) -> None:
        for step in steps:
            if not run.active.any():
                return
            step(run)

    return run_all


def _declaration(scope: Scope, node: Node) -> Statement:
    named = scope.syntax.words(field_of(node, "type"))
    steps = []
    for declarator in node.children_by_field_name("declarator"):
        kind, name = scope.syntax.typed(named, declarator)
        value = declarator.child_by_field_name("value") if declarator.type == "init_declarator" else None
        start = expression(scope, value) if value is not None else None
        steps.append(_declaring(scope.declare(name), Type.parse(kind), start))
    return _sequence(steps)


def _declaring(slot: int, kind: Type, start: Expression | None) -> Statement:
    def declare(run: Run) -> None:
        if start is None:
            run.slots[slot] = undefined(kind, run.real, run.structs)
        else:
            run.slots[slot] = converted(start(run), kind, run.real, run.structs)

    return declare


def _expression(scope: Scope, node: Node) -> Statement:
    if not node.named_children:
        return lambda run: None
    return _evaluated(expression(scope, node.named_children[0]))


def _return(scope: Scope, node: Node) -> Statement:
    value = expression(scope, node.named_children[0]) if node.named_children else None
    slot = scope.slots["return"]

    def leave(run: Run) -> None:
        if value is not None:
            made, old = value(run), run.slots[slot]
            run.slots[slot] = select(run.active, made.astype(old.dtype) if isinstance(old, np.ndarray) else made, old)
        run.active = np.zeros_like(run.active)

    return leave


def _if(scope: Scope, node: Node) -> Statement:
    condition = expression(scope, field_of(node, "condition"))
    chosen = statement(scope.inner(), field_of(node, "consequence"))
    alternative = node.child_by_field_name("alternative")
    other = statement(scope.inner(), alternative.named_children[0]) if alternative is not None else None

    def branch(run: Run) -> None:
        entry, mask = run.active, condition(run)
        run.active = entry & mask
        if run.active.any():
            chosen(run)
        ended, run.active = run.active, entry & ~mask
        if other is not None and run.active.any():
            other(run)
        run.active = run.active | ended

    return branch


def _for(scope: Scope, node: Node) -> Statement:
    scope = scope.inner()
    start, condition, update = (node.child_by_field_name(name) for name in ("initializer", "condition", "update"))
    begin = None
    if start is not None:
        begin = statement(scope, start) if start.type == "declaration" else _evaluated(expression(scope, start))
    test = expression(scope, condition) if condition is not None else None
    advance = _evaluated(expression(scope, update)) if update is not None else None
    loop = _loop(scope.site(node), test, statement(scope.inner(), field_of(node, "body")), advance)
    return _sequence([begin, loop] if begin is not None else [loop])


def _evaluated(evaluate: Expression) -> Statement:
    def step(run: Run) -> None:
        evaluate(run)

    return step


def _while(scope: Scope, node: Node) -> Statement:
    test = expression(scope, field_of(node, "condition"))
    body = statement(scope.inner(), field_of(node, "body"))
    return _loop(scope.site(node), test, body, None, tests_first=node.type == "while_statement")


def _loop(
    site: Site, test: Expression | None, body: Statement, advance: Statement | None, *, tests_first: bool = True
) -> Statement:
    def loop(run: Run) -> None:
        outer = run.broken, run.continued
        run.forget_jumps()
        done = np.zeros_like(run.active)
        for round_ in range(MOST_ITERATIONS):
            if test is not None and (tests_first or round_ > 0):
                goes_on = np.broadcast_to(test(run), run.active.shape)
                done, run.active = done | (run.active & ~goes_on), run.active & goes_on
            if not run.active.any():
                break
            body(run)
            run.active = run.active | run.continued
            run.continued = np.zeros_like(run.active)
            if advance is not None and run.active.any():
                advance(run)
        else:
            raise InputError(f"{site.file}:{site.line}: a loop has not ended after {MOST_ITERATIONS} rounds.")
        run.active = done | run.broken
        run.broken, run.continued = outer

    return loop


def _jump(kind: str) -> Callable[[Scope, Node], Statement]:
    def leave(run: Run) -> None:
        setattr(run, kind, getattr(run, kind) | run.active)
        run.active = np.zeros_like(run.active)

    return lambda scope, node: leave


def _switch(scope: Scope, node: Node) -> Statement:
    selector = expression(scope, field_of(node, "condition"))
    cases = [_case(scope.inner(), child) for child in field_of(node, "body").named_children]

    def branch(run: Run) -> None:
        entry, broken, chosen = run.active, run.broken, selector(run)
        run.broken = np.zeros_like(entry)
        matched = [np.broadcast_to(chosen == label(run), entry.shape) if label else None for label, _ in cases]
        anything = np.logical_or.reduce([m for m in matched if m is not None] or [np.zeros_like(entry)])
        run.active = np.zeros_like(entry)
        for (_, body), match in zip(cases, matched, strict=True):
            run.active = run.active | (entry & (~anything if match is None else match))
            body(run)
        passed_by = ~anything if all(match is not None for match in matched) else np.zeros_like(entry)
        run.active = run.active | run.broken | (entry & passed_by)
        run.broken = broken

    return branch


def _case(scope: Scope, node: Node) -> tuple[Expression | None, Statement]:
    """The label, None for `default`, and what follows it."""
    label = node.child_by_field_name("value")
    body = [child for child in node.named_children if label is None or child.id != label.id]
    return expression(scope, label) if label is not None else None, _sequence([statement(scope, s) for s in body])


STATEMENTS: dict[str, Callable[[Scope, Node], Statement]] = {
    "compound_statement": _block,
    "declaration": _declaration,
    "expression_statement": _expression,
    "return_statement": _return,
    "if_statement": _if,
    "for_statement": _for,
    "while_statement": _while,
    "do_statement": _while,
    "break_statement": _jump("broken"),
    "continue_statement": _jump("continued"),
    "switch_statement": _switch,
}
