"""Budgets that are written for one OpenGL renderer, and have met no such renderer."""

from collections import Counter
from collections.abc import Collection, Iterable, Iterator, Mapping

from scenes.checks import Check


def idle_overrides(checks: Iterable[Check], gl_renderers: Collection[str]) -> dict[str, int]:
    """The `by_renderer` names that are in none of the renderers that drew, and how many budgets have each.

    Nothing is idle where nothing was drawn.
    """
    overrides = [bounds for check in checks for criterion in check.criteria for bounds in criterion.by_renderer]
    idle = Counter(b.renderer for b in overrides if not any(b.apply_to(name) for name in gl_renderers))
    return dict(sorted(idle.items())) if gl_renderers else {}


def idle_lines(idle: Mapping[str, int]) -> Iterator[str]:
    """What `idle_overrides` found, in words."""
    for renderer, count in idle.items():
        yield f'{count} budget{"" if count == 1 else "s"} by_renderer "{renderer}" matched nothing that drew here.'
