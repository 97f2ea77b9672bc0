"""Shaders whose every operation is put into a function's hands."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import Enum

from tree_sitter import Node

from comparisons.glsl.syntax import Syntax, walk


class Kind(Enum):
    """What a site is: an operation that makes a number, or the reading of one that an operation takes."""

    OPERATION = "operation"
    READ = "read"
    CONSTANT = "constant"


@dataclass(frozen=True)
class Site:
    """An expression with a value of its own: where it is in the text, counted from line 1."""

    kind: Kind
    line: int
    text: str


Wrapper = Callable[[Site, str], str]
"""Gets a site and its text, in which what is inside it may be wrapped already; gives what is to stand there."""

ARITHMETIC = frozenset("+-*/")
_COMPARISONS = frozenset(("<", ">", "<=", ">=", "==", "!="))
_BY_REFERENCE = re.compile(r"(image|atomic|texture|texel|interpolateAt)")
"""Built-in functions whose first argument is a name, not a value."""
_CONSTANT_ARGUMENTS = re.compile(r"texture\w*(Gather|Offset)|texelFetchOffset")
"""Those that want constants after the second argument."""
_QUESTIONS = frozenset(("isnan", "isinf"))
"""What asks whether a value is finite takes it for granted no longer: it reads nothing."""
_WRITES = {"modf": (1,), "frexp": (1,), "uaddCarry": (2,), "usubBorrow": (2,), "umulExtended": (2, 3)}
_WRITES["imulExtended"] = _WRITES["umulExtended"]
_DIRECTIVE = re.compile(r"^[ \t]*#[^\n]*\n", re.MULTILINE)


def wrap(syntax: Syntax, wrapper: Wrapper) -> str:
    """The text with each site as `wrapper` wants it; lines stay where they are.

    Sites are arithmetic, calls of built-in functions, and what these and comparisons read. Left as they are: what is
    written to or handed to out parameters; what the language wants constant, such as sizes of arrays and initial values
    of constants; `++` and `--`; and calls of the shader's own functions, whose bodies hold sites themselves.
    """
    return _Rewriting(syntax, wrapper).text()


def enclosed(text: str, first: str, last: str = "") -> str:
    """A shader with `first`, which has no line of its own, before its first declaration, and `last` after all.

    With `last`, which then has to define `main`, the shader's own main is called `lg_main`.
    """
    start = max((found.end() for found in _DIRECTIVE.finditer(text)), default=0)
    body = re.sub(r"\bmain(?=\s*\()", "lg_main", text[start:]) if last else text[start:]
    return text[:start] + first + body + last


class _Rewriting:
    def __init__(self, syntax: Syntax, wrapper: Wrapper) -> None:
        self.syntax = syntax
        self.wrapper = wrapper
        self.structs = frozenset(syntax.structs())
        self.functions: dict[str, list[tuple[str, ...]]] = {}
        for function in syntax.functions():
            self.functions.setdefault(function.name, []).append(tuple(p.qualifier for p in function.parameters))

    def text(self) -> str:
        root = self.syntax.root
        start = root.children[0].start_byte if root.children else root.start_byte
        return self.syntax.text[:start].decode() + self._children(root) + self.syntax.text[root.end_byte :].decode()

    def _children(self, node: Node, operand: bool = False, apart: Sequence[Node] = ()) -> str:
        """A node with its children rewritten, but for those `apart`, and what stands between them as it is."""
        at = node.children[0].start_byte if node.children else node.start_byte
        parts = []
        for child in node.children:
            parts.append(self.syntax.text[at : child.start_byte].decode())
            parts.append(self.syntax.words(child) if child in apart else self._rewritten(child, operand))
            at = child.end_byte
        parts.append(self.syntax.text[at : node.end_byte].decode())
        return "".join(parts)

    def _rewritten(self, node: Node, operand: bool = False) -> str:
        """`operand`: whether an operation takes the node's value."""
        if node.type in _UNTOUCHED or (not node.child_count and node.type not in ("identifier", "number_literal")):
            return self.syntax.words(node)
        return _METHODS.get(node.type, _Rewriting._statement)(self, node, operand)

    def _statement(self, node: Node, operand: bool) -> str:
        return self._children(node)

    def _site(self, kind: Kind, node: Node, inside: str) -> str:
        return self.wrapper(Site(kind, node.start_point.row + 1, self.syntax.words(node)), inside)

    def _binary(self, node: Node, operand: bool) -> str:
        operator = node.children[1].type
        inside = self._children(node, operand=operator in ARITHMETIC or operator in _COMPARISONS)
        return self._site(Kind.OPERATION, node, inside) if operator in ARITHMETIC else inside

    def _choice(self, node: Node, operand: bool) -> str:
        condition, *values = node.named_children
        chosen = self._between(*values).join(self._rewritten(value, operand) for value in values)
        return self._rewritten(condition) + self._between(condition, values[0]) + chosen

    def _between(self, left: Node, right: Node) -> str:
        return self.syntax.text[left.end_byte : right.start_byte].decode()

    def _assignment(self, node: Node, operand: bool) -> str:
        """`a += b` becomes `a = a + (b)`, unless to find `a` twice is not the same as once."""
        left, sign, right = node.children
        place, operator = self._place(left), sign.type[:-1]
        is_pure = not any(
            n.type in ("call_expression", "update_expression", "assignment_expression") for n in walk(left)
        )
        if operator in ARITHMETIC and is_pure:
            taken = self._site(Kind.READ, left, place)
            sum_ = f"{taken} {operator} ({self._rewritten(right, operand=True)})"
            return f"{place} = {self._site(Kind.OPERATION, node, sum_)}"
        return f"{place} {sign.type} {self._rewritten(right)}"

    def _number(self, node: Node, operand: bool) -> str:
        words = self.syntax.words(node)
        return self._site(Kind.CONSTANT, node, words) if operand else words

    def _unary(self, node: Node, operand: bool) -> str:
        return self._children(node, operand=True)

    def _update(self, node: Node, operand: bool) -> str:
        return self._place(node)

    def _case(self, node: Node, operand: bool) -> str:
        value = node.child_by_field_name("value")
        return self._children(node, apart=(value,) if value else ())

    def _function(self, node: Node, operand: bool) -> str:
        body = node.child_by_field_name("body")
        return self._children(node, apart=[child for child in node.children if child != body])

    def _read(self, node: Node, operand: bool) -> str:
        base = node
        while base.type in ("field_expression", "subscript_expression"):
            base = base.children[0]
        inside = self._place(node)
        return self._site(Kind.READ, node, inside) if operand and base.type == "identifier" else inside

    def _place(self, node: Node) -> str:
        """What may be written to: only the indices in it are read."""
        match node.type:
            case "field_expression":
                base = node.children[0]
                return self._place(base) + self.syntax.text[base.end_byte : node.end_byte].decode()
            case "subscript_expression":
                base = node.children[0]
                at, parts = base.end_byte, [self._place(base)]
                for child in node.children[1:]:
                    parts.append(self.syntax.text[at : child.start_byte].decode() + self._rewritten(child))
                    at = child.end_byte
                return "".join(parts)
            case "identifier":
                return self.syntax.words(node)
            case "update_expression":
                return "".join(self._place(c) if c.is_named else self.syntax.words(c) for c in node.children)
        return self._rewritten(node)

    def _call(self, node: Node, operand: bool) -> str:
        called, listed = node.children
        name = self.syntax.words(called)
        arguments = listed.named_children
        if called.type != "identifier":
            return self._place(called) + self.syntax.words(listed)
        is_own = name in self.functions or name in self.structs or "[" in name
        takes = not is_own and name not in _QUESTIONS
        places, constants = self._special(name, len(arguments))
        at, parts = listed.start_byte, [name]
        for i, argument in enumerate(arguments):
            parts.append(self.syntax.text[at : argument.start_byte].decode())
            if i in constants:
                parts.append(self.syntax.words(argument))
            else:
                parts.append(self._place(argument) if i in places else self._rewritten(argument, takes))
            at = argument.end_byte
        parts.append(self.syntax.text[at : listed.end_byte].decode())
        inside = "".join(parts)
        is_used = node.parent is None or node.parent.type != "expression_statement"
        return self._site(Kind.OPERATION, node, inside) if is_used and not is_own else inside

    def _special(self, name: str, count: int) -> tuple[set[int], set[int]]:
        """Which arguments are written to or named, and which have to be constant."""
        if name in self.functions:
            alike = [qualifiers for qualifiers in self.functions[name] if len(qualifiers) == count]
            return {i for qualifiers in alike for i, q in enumerate(qualifiers) if q != "in"}, set()
        places = {0} if _BY_REFERENCE.match(name) else set(_WRITES.get(name, ()))
        return places, set(range(2, count)) if _CONSTANT_ARGUMENTS.match(name) else set()

    def _declaration(self, node: Node, operand: bool) -> str:
        is_global = node.parent is not None and node.parent.type == "translation_unit"
        is_constant = any(c.type == "type_qualifier" and self.syntax.words(c) == "const" for c in node.children)
        if is_global or is_constant:
            return self.syntax.words(node)
        return self._children(node, apart=[c for c in node.children if c.type == "identifier"])


_UNTOUCHED = frozenset(("struct_specifier", "array_declarator", "field_declaration_list"))
_METHODS: dict[str, Callable[[_Rewriting, Node, bool], str]] = {
    "binary_expression": _Rewriting._binary,
    "unary_expression": _Rewriting._unary,
    "assignment_expression": _Rewriting._assignment,
    "call_expression": _Rewriting._call,
    "conditional_expression": _Rewriting._choice,
    "parenthesized_expression": _Rewriting._children,
    "identifier": _Rewriting._read,
    "field_expression": _Rewriting._read,
    "subscript_expression": _Rewriting._read,
    "number_literal": _Rewriting._number,
    "update_expression": _Rewriting._update,
    "declaration": _Rewriting._declaration,
    "case_statement": _Rewriting._case,
    "function_definition": _Rewriting._function,
}
"""How nodes are rewritten, by type; statements are as what is in them."""
