"""What a benchmark measured, as it stands in bench.json: plain numbers, and the machine that they come from."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from typing import Any

from scenes.errors import InputError

SCHEMA = 1
FILE_NAME = "bench.json"


@dataclass(frozen=True)
class Interval:
    """A value and its 95 % interval."""

    value: float
    low: float
    high: float


@dataclass(frozen=True)
class FrameCost:
    """What a frame takes once everything is compiled, uploaded and baked.

    seconds : median over `frames` frames with its 95 % interval, by `clock`
    wall_seconds : median by the wall clock, with all that the CPU does
    clock : "GPU timer queries", or "wall clock around finish()"
    start_seconds : compile, upload and bake, apart: what is spent once
    passes : median of each pass by its name
    peak_bytes : textures, buffers and renderbuffers alive at once
    """

    seconds: Interval
    wall_seconds: float
    frames: int
    clock: str
    start_seconds: Mapping[str, float]
    passes: Mapping[str, float]
    peak_bytes: int


@dataclass(frozen=True)
class Point:
    """A technique with some settings on a scene: its error by `metric` and what a frame costs.

    swept : names the settings that differ from their defaults; empty for the defaults, "sensor" for another resolution
    is_fitted : the image was multiplied by the factor that fits the truth best before it was judged
    spp : samples a pixel of the truth, 0 where that is exact
    note : why the interval is wide or cannot be trusted, empty if it can
    """

    scene: str
    effect: str
    quantity: str
    technique: str
    settings: Mapping[str, Any]
    swept: str
    width: int
    height: int
    metric: str
    error: Interval
    cost: FrameCost
    is_fitted: bool = False
    spp: int = 0
    note: str = ""


@dataclass(frozen=True)
class Traced:
    """The path tracer's image of a scene at `spp`: its error by the same metric, from the noise of its samples alone.

    `seconds` is the time of one image of the judged pixels, by the wall clock, once its kernels are compiled, from so
    many `images`. An exact truth, such as one by ray casts, has 0 spp and no error.
    """

    scene: str
    effect: str
    quantity: str
    integrator: str
    variant: str
    width: int
    height: int
    spp: int
    metric: str
    error: Interval
    seconds: Interval
    peak_bytes: int
    images: int = 0


@dataclass(frozen=True)
class Slope:
    """The power law error = coefficient * spp ** exponent of the path tracer; `r2` as in `Scaling`."""

    scene: str
    quantity: str
    metric: str
    width: int
    height: int
    exponent: Interval
    coefficient: float
    r2: float


@dataclass(frozen=True)
class Scaling:
    """The power law time = coefficient * size ** exponent of a technique over `axis`: "pixels", "triangles", "lights".

    `sizes` and `seconds` are what was measured; `r2` is how much of the variance of the logarithms the law explains.
    """

    scene: str
    technique: str
    axis: str
    sizes: tuple[float, ...]
    seconds: tuple[float, ...]
    exponent: Interval
    coefficient: float
    r2: float


@dataclass(frozen=True)
class Ablation:
    """A part of a technique switched off: the error with and without it, and the time.

    `added` is the difference of the errors (without minus with) from the same samples of truth. `picture` is what
    `comparisons.bench.stills.strip` makes.
    """

    scene: str
    effect: str
    technique: str
    settings: Mapping[str, Any]
    part: str
    how: str
    metric: str
    error_with: Interval
    error_without: Interval
    added: Interval
    seconds_with: float
    seconds_without: float
    picture: str = ""


@dataclass(frozen=True)
class Bench:
    """Everything that one run measured. `skipped` says what was left out and why."""

    environment: Mapping[str, Any]
    started: str
    points: tuple[Point, ...] = ()
    traced: tuple[Traced, ...] = ()
    slopes: tuple[Slope, ...] = ()
    scaling: tuple[Scaling, ...] = ()
    ablations: tuple[Ablation, ...] = ()
    claims: tuple[str, ...] = ()
    skipped: tuple[Mapping[str, str], ...] = field(default=())

    def to_json(self) -> dict[str, Any]:
        return {"schema": SCHEMA, **asdict(self)}


def bench_of(plain: Mapping[str, Any]) -> Bench:
    """The benchmark whose `to_json` this is.

    Raises
    ------
    InputError
        It has another schema, or lacks or misstates something.
    """
    from pydantic import TypeAdapter, ValidationError

    if plain.get("schema") != SCHEMA:
        raise InputError(
            f"This benchmark has schema {plain.get('schema')!r}, but this version reads schema {SCHEMA}. Run "
            "`lightgauge bench` again to get one that it can read."
        )
    try:
        return TypeAdapter(Bench).validate_python(plain)
    except ValidationError as error:
        first = error.errors()[0]
        place = ".".join(map(str, first["loc"]))
        raise InputError(
            f"This benchmark is not as `lightgauge bench` writes it: {place}: {first['msg']}. Run it again, or undo "
            "what was changed in the file."
        ) from error
