"""What the overview says, worked out from the results of a run: the template only places these texts and lengths."""

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from comparisons.overrides import idle_lines
from comparisons.report.check import PARITY, SEVERITY, CheckView, Results, check_of
from comparisons.report.costs import CostPlot, costs_of
from comparisons.report.course import Changes, changes_of
from comparisons.report.criterion import use_of
from comparisons.report.glance import Group, groups_of, in_columns
from comparisons.report.names import stems_of
from comparisons.report.numbers import format_seconds
from comparisons.report.sentence import rest_of, sentence_of
from reference.quantities import EFFECTS
from scenes.errors import InputError

if TYPE_CHECKING:
    from comparisons.history import History

SCHEMA = 1
MOST_URGENT = 6
"""How many checks that do not pass stand above everything else."""


@dataclass(frozen=True)
class Facet:
    """A property that checks are filtered by, and how many checks have each of its values."""

    name: str
    options: tuple[tuple[str, int], ...]


@dataclass(frozen=True)
class Overview:
    """`checks` are those of light, worst verdict first, `parity` the others; `urgent` are the first that do not pass.

    `glance` holds columns of groups.
    """

    sentence: str
    rest: str
    verdict: str
    counts: tuple[tuple[str, int], ...]
    urgent: tuple[CheckView, ...]
    broken: tuple[tuple[str, str], ...]
    glance: tuple[tuple[Group, ...], ...]
    checks: tuple[CheckView, ...]
    parity: tuple[CheckView, ...]
    facets: tuple[Facet, ...]
    costs: tuple[CostPlot, ...]
    changes: Changes | None
    jobs: int
    store_note: str
    summary: tuple[str, ...]
    environment: Mapping[str, str]

    @property
    def more_urgent(self) -> int:
        """Checks that do not pass either, but are not among `urgent`."""
        return sum(count for verdict, count in self.counts if verdict != "PASS") - len(self.urgent)

    @property
    def all(self) -> tuple[CheckView, ...]:
        return self.checks + self.parity


def overview_of(results: Results, history: "History | None" = None) -> Overview:
    """Everything the report shows.

    Raises
    ------
    InputError
        `results` has another schema, or lacks what a check cannot do without.
    """
    if results.get("schema") != SCHEMA:
        raise InputError(
            f"These results have schema {results.get('schema')!r}, but this version reads schema {SCHEMA}. "
            "Run the checks again to get results that it can show."
        )
    views = _checks_of(results.get("checks") or [])
    broken = tuple((str(one.get("argument")), str(one.get("message"))) for one in results.get("broken") or [])
    counts = {verdict: sum(view.verdict == verdict for view in views) for verdict in SEVERITY}
    light = tuple(view for view in views if not view.is_parity)
    effects = _effects(views)
    return Overview(
        sentence=sentence_of(views, len(broken)),
        rest=rest_of(counts, len(broken)),
        verdict=_worst(counts, len(broken)),
        counts=tuple((verdict, count) for verdict, count in counts.items() if count),
        urgent=tuple(view for view in views if view.verdict != "PASS")[:MOST_URGENT],
        broken=broken,
        glance=in_columns(groups_of(light, effects)),
        checks=light,
        parity=tuple(view for view in views if view.is_parity),
        facets=_facets(views, effects),
        costs=costs_of(light, effects),
        changes=changes_of(views, history),
        jobs=results.get("jobs") or 1,
        store_note=results.get("store_note") or "",
        summary=_summary(results),
        environment={key: str(value) for key, value in (results.get("environment") or {}).items() if value is not None},
    )


def keys_of(view: CheckView) -> dict[str, Any]:
    """What the browser filters and sorts a check by, and how it names it."""
    raw, headline, seconds = view.raw, view.headline, view.raw.get("seconds") or {}
    metric = None if headline is None else headline.metric
    deciding: Results = next((c for c in raw.get("criteria") or [] if c["metric"] == metric), {})
    bounds = (deciding.get("max"), deciding.get("min"))
    words = (raw["id"], view.title, view.effect, raw["quantity"], view.how, view.verdict, raw.get("message") or "")
    return {
        "name": view.name,
        "title": f"{raw['scene']}, {raw['technique']}",
        "parity": view.is_parity,
        "text": " ".join(words).lower(),
        "effect": view.effect,
        "scene": raw["scene"],
        "technique": raw["technique"],
        "verdict": view.verdict,
        "severity": SEVERITY[view.verdict],
        "error": None if deciding.get("value") is None else abs(deciding["value"]),
        "budget": next((bound for bound in bounds if bound is not None), None),
        "use": None if headline is None else headline.use,
        "realtime": seconds.get("realtime"),
        "truth": seconds.get("reference"),
        "spp": raw.get("spp"),
        "saved": view.saved,
        "change": None if view.change is None else view.change.factor,
    }


def _checks_of(raws: Sequence[Results]) -> list[CheckView]:
    """Worst verdict first; of those that do not pass, the one that takes most of its budget."""
    names = stems_of(str(raw.get("id")) for raw in raws)
    views = [check_of(number, raw, name) for number, (raw, name) in enumerate(zip(raws, names, strict=True), start=1)]
    return sorted(
        views, key=lambda view: (SEVERITY[view.verdict], 0.0 if view.verdict == "PASS" else -use_of(view.headline))
    )


def _worst(counts: Mapping[str, int], broken: int) -> str:
    """What a run as a whole is: a scene that could not be read is an ERROR, though no check has that verdict."""
    found = {**counts, "ERROR": counts["ERROR"] + broken}
    return next((verdict for verdict in ("FAIL", *SEVERITY) if found[verdict]), "INCONCLUSIVE")


def _effects(views: Iterable[CheckView]) -> tuple[str, ...]:
    """The effects at hand, in the order of the registry, those that it does not know behind; parity last."""
    found = dict.fromkeys(view.effect for view in views)
    return (*sorted(found, key=lambda effect: (effect == PARITY, _rank(effect))),)


def _rank(effect: str) -> int:
    return list(EFFECTS).index(effect) if effect in EFFECTS else len(EFFECTS)


def _facets(views: Sequence[CheckView], effects: Sequence[str]) -> tuple[Facet, ...]:
    counted = {
        "effect": Counter(view.effect for view in views),
        "scene": Counter(view.raw["scene"] for view in views),
        "technique": Counter(view.raw["technique"] for view in views),
        "verdict": Counter(view.verdict for view in views),
    }
    orders = {"effect": effects, "verdict": [verdict for verdict in SEVERITY if counted["verdict"][verdict]]}
    return tuple(
        Facet(name, tuple((value, counts[value]) for value in orders.get(name, sorted(counts))))
        for name, counts in counted.items()
    )


def _summary(results: Results) -> tuple[str, ...]:
    environment = results.get("environment") or {}
    jobs = results.get("jobs") or 1
    parts = (
        f"lightgauge {environment['lightgauge']}" if environment.get("lightgauge") else "",
        f"commit {environment['commit']}" if environment.get("commit") else "",
        str(environment.get("gl_renderer") or ""),
        f"{environment['cpu_count']} CPU cores" if environment.get("cpu_count") else "",
        f"shard {results['shard']}" if results.get("shard") else "",
        f"{jobs} jobs at a time" if jobs > 1 else "",
        str(results.get("started") or ""),
        *idle_lines(results.get("idle_overrides") or {}),
        f"took {format_seconds(results.get('seconds'))}" if results.get("seconds") is not None else "",
    )
    return tuple(part for part in parts if part)
