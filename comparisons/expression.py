"""Expressions that choose checks by name, as in pytest: `-k "indirect and not (probe or fitted)"`."""

import re
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass

from scenes.errors import InputError

Keep = Callable[[Iterable[str]], bool]
"""Whether something that goes by these names is meant."""

OPERATORS = ("and", "or", "not", "(", ")")
TOKEN = re.compile(r"""[()]|"[^"]*"|'[^']*'|[^\s()"']+|["']""")
"""A parenthesis, a text in quotes, a word, or a quote without its end."""


@dataclass(frozen=True)
class Token:
    text: str
    column: int

    @property
    def is_word(self) -> bool:
        return self.text not in OPERATORS

    @property
    def word(self) -> str:
        return self.text[1:-1] if self.text[0] in "\"'" else self.text


END = ""
"""The text of what follows the last token."""


def keep_of(expression: str) -> Keep:
    """What a `-k` expression means.

    A word is held by names of which one contains it, whatever its case; `and`, `or`, `not` and parentheses join words.
    All other characters belong to words, so a name like `indirect.talk[c_height=7.0,fitted]` is one; a name with
    blanks or parentheses can be put in quotes. An empty expression keeps everything.

    Raises
    ------
    InputError
        The expression is none; the message says at which column.

    >>> keep = keep_of("indirect and not (probe or fitted)")
    >>> keep(["room/indirect.talk", "indirect light"]), keep(["room/indirect.talk[fitted]", "indirect light"])
    (True, False)
    """
    if not expression.strip():
        return lambda names: True
    return _Parser(expression).parsed()


def quoted(name: str) -> str:
    """The expression that means a name as it is written."""
    tokens = list(TOKEN.finditer(name))
    if [token.group() for token in tokens] == [name] and Token(name, 1).is_word:
        return name
    return f"'{name}'" if '"' in name else f'"{name}"'


class _Parser:
    """Recursive descent: or < and < not < word."""

    def __init__(self, expression: str) -> None:
        self._expression = expression
        self._tokens = self._read()
        self._next = next(self._tokens)

    def parsed(self) -> Keep:
        keep = self._or()
        if self._next.text != END:
            raise self._fault("'and', 'or' or the end")
        return keep

    def _read(self) -> Iterator[Token]:
        for found in TOKEN.finditer(self._expression):
            yield Token(found.group(), found.start() + 1)
        yield Token(END, len(self._expression) + 1)

    def _took(self, text: str) -> bool:
        if self._next.text != text:
            return False
        self._next = next(self._tokens)
        return True

    def _or(self) -> Keep:
        operands = [self._and()]
        while self._took("or"):
            operands.append(self._and())
        return operands[0] if len(operands) == 1 else lambda names: any(keep(names) for keep in operands)

    def _and(self) -> Keep:
        operands = [self._not()]
        while self._took("and"):
            operands.append(self._not())
        return operands[0] if len(operands) == 1 else lambda names: all(keep(names) for keep in operands)

    def _not(self) -> Keep:
        if self._took("not"):
            negated = self._not()
            return lambda names: not negated(names)
        if self._took("("):
            inner = self._or()
            if not self._took(")"):
                raise self._fault("'and', 'or' or ')'")
            return inner
        return self._word()

    def _word(self) -> Keep:
        token = self._next
        if token.text == END or not token.is_word:
            raise self._fault("a word, 'not' or '('")
        if token.text in ('"', "'"):
            raise self._fault(f"a text that ends with {token.text} too")
        self._took(token.text)
        word = token.word.casefold()
        return lambda names: any(word in name.casefold() for name in names)

    def _fault(self, allowed: str) -> InputError:
        token = self._next
        found = f"'{token.text}'" if token.text else "the end"
        return InputError(
            f"-k '{self._expression}': found {found} at column {token.column}; allowed: {allowed}. Join words with "
            'and, or, not and parentheses, such as -k "indirect and not (probe or fitted)".'
        )
