"""What the files of a check are called."""

from collections.abc import Iterable, Iterator


def stem_of(check_id: str) -> str:
    """A file name without a suffix, from the characters that every file system and address takes.

    >>> stem_of("room/indirect.talk[c_height=7.0,fitted]")
    'room-indirect.talk-c_height-7.0-fitted-'
    """
    return "".join(c if c.isalnum() or c in "-_." else "-" for c in check_id)


def stems_of(check_ids: Iterable[str]) -> tuple[str, ...]:
    """The names of the files of checks that are shown together: of each page, and of each one's pictures."""
    return tuple(different(map(stem_of, check_ids)))


def different(stems: Iterable[str]) -> Iterator[str]:
    """The stems in their order, a number behind those that were there before."""
    taken: set[str] = set()
    for stem in stems:
        name, number = stem, 2
        while name.casefold() in taken:
            name, number = f"{stem}-{number}", number + 1
        taken.add(name.casefold())
        yield name
