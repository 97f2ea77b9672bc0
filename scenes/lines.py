"""Where each key of a TOML document stands, which tomllib does not tell."""

import re
import tomllib

KeyPath = tuple[str | int, ...]

BASIC_STRING = r'"(?:[^"\\\n]|\\.)*"'
LITERAL_STRING = r"'[^'\n]*'"
KEY_PART = rf"(?:[A-Za-z0-9_-]+|{BASIC_STRING}|{LITERAL_STRING})"
KEY = re.compile(rf"{KEY_PART}(?:[ \t]*\.[ \t]*{KEY_PART})*")
STRING = re.compile(rf'"""(?:[^\\]|\\.)*?"{{3,5}}|\'\'\'.*?\'{{3,5}}|{BASIC_STRING}|{LITERAL_STRING}', re.DOTALL)
BARE_KEY = re.compile(r"[A-Za-z0-9_-]+(?:\.[A-Za-z0-9_-]+)*")
BLANK = re.compile(r"(?:[ \t\r\n]|#[^\n]*)*")
SCALAR = re.compile(r"[^,\]}#\n]+")
OPENING = re.compile(r"\[\[?")
PUNCTUATION = re.compile(r"[=,\[\]{}]")


def key_lines(text: str) -> dict[KeyPath, int]:
    """The line, counted from 1, of every key and array element of a document that tomllib accepts.

    A path is the keys and indices from the top: ("shapes", 0, "radius"). A table stands where its header does; one that
    only a longer key implies stands where it is first met.
    """
    return _Scanner(text).document()


def line_of(lines: dict[KeyPath, int], path: KeyPath) -> int:
    """The line of a path, or of the nearest thing that encloses it, or else 1."""
    return next((lines[path[:n]] for n in range(len(path), 0, -1) if path[:n] in lines), 1)


class _Scanner:
    """Walks once through a valid document; `at` is the position of the next character."""

    def __init__(self, text: str) -> None:
        self.text = text
        self.at = 0
        self.lines: dict[KeyPath, int] = {}
        self.tables: dict[KeyPath, int] = {}  # the length so far of each array of tables

    def document(self) -> dict[KeyPath, int]:
        table: KeyPath = ()
        while not self._follows(""):
            if self._follows("["):
                table = self._header()
            else:
                self._pair(table)
        return self.lines

    def _header(self) -> KeyPath:
        """Read `[a.b]` or `[[a.b]]` and give the path of the table that it opens."""
        brackets = len(self._take(OPENING))
        path = self._key(())
        line = self._line()
        for _ in range(brackets):
            self._take(PUNCTUATION)
        if brackets == 1:
            return path
        index = self.tables.get(path, 0)
        self.tables[path] = index + 1
        self.lines[(*path, index)] = line
        return (*path, index)

    def _pair(self, table: KeyPath) -> None:
        path = self._key(table)
        self._take(PUNCTUATION)
        self._value(path)

    def _key(self, path: KeyPath) -> KeyPath:
        """Read a dotted key inside a table; a part that names an array of tables means its latest table."""
        parts = _parts(self._take(KEY))
        line = self._line()
        for part in parts:
            if path in self.tables:
                path = (*path, self.tables[path] - 1)
            path = (*path, part)
            self.lines.setdefault(path, line)
        return path

    def _value(self, path: KeyPath) -> None:
        if self._follows("["):
            self._take(PUNCTUATION)
            index = 0
            while not self._follows("]"):
                self.lines[(*path, index)] = self._line()
                self._value((*path, index))
                self._take_comma()
                index += 1
            self._take(PUNCTUATION)
        elif self._follows("{"):
            self._take(PUNCTUATION)
            while not self._follows("}"):
                self._pair(path)
                self._take_comma()
            self._take(PUNCTUATION)
        else:
            self._take(STRING if self.text[self.at] in "\"'" else SCALAR)

    def _take_comma(self) -> None:
        if self._follows(","):
            self._take(PUNCTUATION)

    def _follows(self, character: str) -> bool:
        """Skip blanks and comments; whether `character` comes next, where "" stands for the end."""
        self._skip_blank()
        return self.text[self.at : self.at + 1] == character

    def _skip_blank(self) -> None:
        blank = BLANK.match(self.text, self.at)
        self.at = blank.end() if blank else self.at

    def _take(self, pattern: re.Pattern[str]) -> str:
        """Skip blanks and comments, then read what the pattern matches."""
        self._skip_blank()
        found = pattern.match(self.text, self.at)
        assert found is not None, f"valid TOML has {pattern.pattern} at {self.text[self.at : self.at + 20]!r}"
        self.at = found.end()
        return found.group()

    def _line(self) -> int:
        return self.text.count("\n", 0, self.at) + 1


def _parts(key: str) -> list[str]:
    """The parts of a dotted key, with quotes and escapes resolved by the parser itself."""
    if BARE_KEY.fullmatch(key):
        return key.split(".")
    table = tomllib.loads(f"{key} = 0")
    parts: list[str] = []
    while isinstance(table, dict):
        ((part, table),) = table.items()
        parts.append(part)
    return parts
