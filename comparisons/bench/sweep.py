"""What is measured: each technique at its defaults, at settings of checks, and with one parameter changed at a time.

Beside that, each technique is drawn at its defaults for a sensor of half and of twice the resolution, each with a truth
of its own: an error at another resolution answers another question, so such points are compared among themselves only.
"""

from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass

from comparisons.bench.sizes import resized
from comparisons.metrics import metric_named
from comparisons.parity import QUANTITIES as PARITY_QUANTITIES
from comparisons.result import check_id
from comparisons.selection import names_of
from realtime.technique import Technique
from realtime.techniques import MODULES, OWN, technique
from reference.quantities import effect_of
from scenes.checks import Check, SettingValue
from scenes.model import Scene

SENSOR = "sensor"
"""What is swept where the resolution is another one."""

RESOLUTIONS = (0.5, 2.0)
"""Times the scene's own width and height."""


@dataclass(frozen=True)
class Variant:
    """A technique with the settings that differ from its defaults; `swept` as in `comparisons.bench.result.Point`."""

    technique: str
    settings: dict[str, SettingValue]
    swept: str
    is_fitted: bool = False

    @property
    def name(self) -> str:
        return check_id(self.technique, self.settings, self.is_fitted)


@dataclass(frozen=True)
class Batch:
    """What is measured together: variants of techniques for one quantity of a scene at one resolution, by one metric.

    `is_traced` says that the path tracer runs beside them.
    """

    scene: Scene
    effect: str
    quantity: str
    metric: str
    variants: tuple[Variant, ...]
    is_traced: bool

    @property
    def name(self) -> str:
        sensor = self.scene.sensor
        return f"{self.scene.name}, {self.quantity}, {sensor.width} x {sensor.height}"


def batches(
    scene: Scene, checks: Iterable[Check], effect: str, keep: Callable[[Iterable[str]], bool], with_sizes: bool
) -> list[Batch]:
    """All batches of an effect's quantities that a scene judges, the own resolution first.

    Parameters
    ----------
    checks : those of the scene; parity is passed over
    keep : says by the names of a technique whether it is meant
    with_sizes : whether other resolutions are measured too
    """
    judged = [check for check in checks if check.quantity not in PARITY_QUANTITIES]
    found = []
    for quantity in dict.fromkeys(check.quantity for check in judged if effect_of(check.quantity) == effect):
        own = [check for check in judged if check.quantity == quantity]
        used = [t for t in approximating(quantity, own) if keep(names_of(f"{scene.name}/{t.name}", quantity))]
        if not used:
            continue
        metric = error_metric(own)
        swept = tuple(variant for t in used for variant in variants_of(t, own))
        found.append(Batch(scene, effect, quantity, metric, swept, is_traced=True))
        if with_sizes:
            plain = tuple(Variant(t.name, {}, SENSOR) for t in used)
            found += [
                Batch(other, effect, quantity, metric, plain, is_traced=False) for other in _at_other_sizes(scene)
            ]
    return sorted(found, key=lambda batch: not batch.is_traced)


def approximating(quantity: str, checks: Sequence[Check]) -> list[Technique]:
    """The techniques for a quantity: those of the checks first, then all others that are known."""
    named = (*(check.technique for check in checks), *MODULES, *OWN)
    return [one for one in map(technique, dict.fromkeys(named)) if one.approximates == quantity]


def error_metric(checks: Sequence[Check]) -> str:
    """The metric that most checks of a quantity judge its error by first; biases are passed over."""
    first = [next((m for m in _metrics(check) if not metric_named(m).is_signed), "") for check in checks]
    counted = Counter(metric for metric in first if metric)
    return counted.most_common(1)[0][0] if counted else "rmse"


def _metrics(check: Check) -> Iterator[str]:
    return (criterion.metric for criterion in check.criteria)


def variants_of(technique: Technique, checks: Iterable[Check]) -> list[Variant]:
    """The defaults, the settings of checks, and each value of each parameter's sweep; none of them twice."""
    defaults = {p.name: p.default for p in technique.parameters}
    own = [check for check in checks if check.technique == technique.name]
    tried = [
        Variant(technique.name, {}, ""),
        *(Variant(technique.name, _changed(check.settings, defaults), "", check.fit_exposure) for check in own),
        *(
            Variant(technique.name, {p.name: value}, "")
            for p in technique.parameters
            for value in p.sweep
            if value != p.default
        ),
    ]
    named = {
        variant.name: Variant(technique.name, variant.settings, ", ".join(variant.settings), variant.is_fitted)
        for variant in tried
    }
    return list(named.values())


def _changed(settings: dict[str, SettingValue], defaults: dict[str, SettingValue]) -> dict[str, SettingValue]:
    return {name: value for name, value in settings.items() if value != defaults.get(name)}


def _at_other_sizes(scene: Scene) -> Iterator[Scene]:
    for factor in RESOLUTIONS:
        yield at_size(scene, *(max(1, round(factor * side)) for side in (scene.sensor.width, scene.sensor.height)))


def at_size(scene: Scene, width: int, height: int) -> Scene:
    """The scene with a sensor of other pixels."""
    return scene.model_copy(update={"sensor": resized(scene.sensor, width, height)})
