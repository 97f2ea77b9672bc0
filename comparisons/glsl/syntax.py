"""Shader text as a tree."""

from __future__ import annotations

import re
import warnings
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache

import tree_sitter_glsl
from tree_sitter import Language, Node, Parser

from scenes.errors import RenderError

NUMBERS = r"(?:float|double|int|uint|bool|[biud]?vec[234]|d?mat[234](?:x[234])?)"
"""Names of the types that expressions compute with."""

_HIDDEN = re.compile(
    r"\blayout\s*\([^()]*\)(\s*(in|out|uniform|buffer)\s*;)?|\b(highp|mediump|lowp|precise|const(?=\s+in\b))\b"
)
_ARRAY_TYPE = re.compile(r"\b([A-Za-z_]\w*)(\[\s*\w*\s*\])(?=\s*(?:\(|[A-Za-z_]))")
_CONSTRUCTOR = re.compile(r"\b(?:float|double|int|uint|bool)(?=\s*\()")


@dataclass(frozen=True)
class Parameter:
    """`qualifier` is in, out or inout."""

    name: str
    type: str
    qualifier: str = "in"


@dataclass(frozen=True)
class Function:
    """A function and the node of its body."""

    name: str
    returns: str
    parameters: tuple[Parameter, ...]
    body: Node


@dataclass(frozen=True)
class Syntax:
    """The tree of a text. The nodes are those of tree-sitter's grammar of GLSL; offsets count bytes of `text`."""

    text: bytes
    root: Node

    def words(self, node: Node) -> str:
        """The text of a node."""
        return self.text[node.start_byte : node.end_byte].decode()

    def functions(self) -> tuple[Function, ...]:
        """All functions that have a body, in the order of the text; those that are overloaded more than once."""
        return tuple(self._function(node) for node in self.root.children if node.type == "function_definition")

    def structs(self) -> dict[str, tuple[tuple[str, str], ...]]:
        """The types of each struct's fields and their names, by the struct's name."""
        return {
            self.words(_field(node, "name")): tuple(self._fields(_field(node, "body")))
            for node in walk(self.root)
            if node.type == "struct_specifier" and node.child_by_field_name("body")
        }

    def _fields(self, body: Node) -> Iterator[tuple[str, str]]:
        for declaration in body.named_children:
            kind = self.words(_field(declaration, "type"))
            for declarator in declaration.children_by_field_name("declarator"):
                yield self.typed(kind, declarator)

    def typed(self, kind: str, declarator: Node) -> tuple[str, str]:
        """Type and name of what a declarator declares: of `x[3]` after `vec3`, 'vec3[3]' and 'x'."""
        while declarator.type == "init_declarator":
            declarator = _field(declarator, "declarator")
        size = ""
        while declarator.type == "array_declarator":
            inner = _field(declarator, "declarator")
            size = self.text[inner.end_byte : declarator.end_byte].decode() + size
            declarator = inner
        return kind + size, self.words(declarator)

    def _function(self, node: Node) -> Function:
        declarator = _field(node, "declarator")
        return Function(
            self.words(_field(declarator, "declarator")),
            self.words(_field(node, "type")),
            tuple(self._parameters(_field(declarator, "parameters"))),
            _field(node, "body"),
        )

    def _parameters(self, listed: Node) -> Iterator[Parameter]:
        for node in listed.named_children:
            declarator = node.child_by_field_name("declarator")
            kind = self.words(_field(node, "type"))
            if node.type != "parameter_declaration" or kind == "void":
                continue
            kind, name = self.typed(kind, declarator) if declarator else (kind, "")
            qualifier = next((child.type for child in node.children if child.type in ("in", "out", "inout")), "in")
            yield Parameter(name, kind, qualifier)


def parse(text: str) -> Syntax:
    """The tree of a shader without directives other than #version, #extension and #pragma.

    Raises
    ------
    RenderError
        The text is none that the grammar knows.
    """
    written = text.encode()
    tree = _parser().parse(_plain(text).encode())
    for node in walk(tree.root_node):
        if node.is_error or node.is_missing or node.type in ("cast_expression", "pointer_expression"):
            line = text.splitlines()[node.start_point.row].strip()
            raise RenderError(f"Line {node.start_point.row + 1} of a shader is no GLSL that is understood: {line}")
    return Syntax(written, tree.root_node)


def walk(node: Node) -> Iterator[Node]:
    """A node and all below it, in the order of the text."""
    yield node
    for child in node.children:
        yield from walk(child)


def _field(node: Node, name: str) -> Node:
    found = node.child_by_field_name(name)
    if found is None:
        raise RenderError(f"A {node.type} of a shader has no {name}: {node.text!r}")
    return found


def _plain(text: str) -> str:
    """A text of the same length in which the grammar, which is that of C with GLSL's words, finds nothing amiss.

    Layouts, precisions and directives are blank, array types are plain names, and constructors of scalars are calls.
    """
    text = re.sub(r"^\s*#.*$", _blank, text, flags=re.MULTILINE)
    text = _HIDDEN.sub(_blank, text)
    text = _ARRAY_TYPE.sub(lambda found: found[1] + "_" * len(found[2]), text)
    return _CONSTRUCTOR.sub(lambda found: found[0].upper(), text)


def _blank(found: re.Match[str]) -> str:
    return re.sub(r"\S", " ", found[0])


@cache
def _parser() -> Parser:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)  # the grammar hands over its address as a number
        return Parser(Language(tree_sitter_glsl.language()))
