"""An image of another engine, held against the truth: can it be judged, is it aligned, how wrong is it, and why."""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from comparisons.baseline import measured_text, read_accepted
from comparisons.diagnosis import Diagnosis, diagnose
from comparisons.gate import fit_exposure
from comparisons.image_files import ImageFile
from comparisons.metrics import Estimate, Samples, check_image, evaluate
from comparisons.metrics.shift_px import shift_px
from comparisons.report.numbers import format_count, format_number, format_percent
from comparisons.sequential import ALPHA_PER_SIDE, Decision, looks
from realtime.techniques import MODULES as TECHNIQUES
from realtime.techniques import technique
from reference.estimator import Reference, Truth
from reference.quantities import quantity
from reference.quantity import Quantity
from scenes.errors import ImageError
from scenes.image import Bool, Float32, Float64
from scenes.model import Perspective, Scene

RELATIVE_PRECISION = 0.05
ABSOLUTE_PRECISION = 0.005
"""What is measured without a budget is known to that share of itself, or of the truth's mean if that is more."""

OPAQUE = 1 - 1 / 255
"""An alpha from here on is 1 within the last digit of 8 bits."""

FARTHEST = 1e9
"""Programs write 1e10, the largest float or infinity for the depth of what is not there."""

ALIGNED_PX = 0.05
ALIGNED_DEPTH = 0.01
"""Nine tenths of the depths must agree to that share. The rest are edges within the subject, where a depth at the
pixel's centre is not the mean over the pixel."""

ALIGNED_COVERAGE = 0.01
"""That share of the judged pixels may have no depth: on a silhouette, one sample may miss what covers the pixel."""

CLIPPED_SHARE = 1e-3
BEYOND_DISPLAY = 1.1
"""Truth that is surely so bright cannot be shown by values up to 1."""

SURELY = 3.0
"""Standard errors."""


@dataclass(frozen=True)
class Measurement:
    """What was measured without a budget: metrics by their name, on the `decision`'s truth, which has no criteria."""

    decision: Decision
    estimates: dict[str, Estimate]


def metrics_for(found: Quantity, *, is_exact: bool) -> tuple[str, ...]:
    """What is measured of a quantity if nobody asks for something else. The first one says how much truth it takes."""
    if found.display == "radiance":
        return "nrmse", "rel_mse_eps1e-2", "energy_bias", "flip"
    if not is_exact:
        return "rmse", "signed_bias"
    if found.display == "depth":
        return "rel_rms", "p99_abs", "max_abs"
    return "rms", "p99_abs", "max_abs"


def require_size(file: ImageFile, sensor: Perspective) -> None:
    """Refuse an image of another size than the scene's."""
    height, width = file.pixels.shape[:2]
    if (width, height) == (sensor.width, sensor.height):
        return
    if (height, width) == (sensor.width, sensor.height):
        advice = "Width and height are swapped: render with the scene's aspect"
    elif width * sensor.height == height * sensor.width:
        advice = "The aspect fits: render at that resolution; a resized image would be judged with its resizing"
    else:
        advice = "Render with that resolution and aspect; `lightgauge export` writes the camera"
    raise ImageError(
        f"{file.path}: found {width} x {height} pixels; the scene has {sensor.width} x {sensor.height}. {advice}."
    )


def require_judgeable(file: ImageFile, scene: Scene, mask: Bool) -> None:
    """Refuse an image that says nothing about the judged pixels: of another size, not finite, black, or see-through.

    Raises
    ------
    ImageError
        What is wrong, at how many pixels, and at which first.
    """
    require_size(file, scene.sensor)
    count = int(mask.sum())
    wrong = mask & ~np.isfinite(file.pixels).all(axis=2)
    if wrong.any():
        raise ImageError(
            f"{file.path}: {int(wrong.sum())} of {count} judged pixels are NaN or infinite, the first at "
            f"{_first(wrong)}; all must be finite. Mend what renders them: an average would spread them, not hide them."
        )
    lit = (file.pixels != 0).any(axis=2)
    if not (lit & mask).any():
        raise ImageError(
            f"{file.path}: all {count} judged pixels are black. See that the file holds the image, in the layer that "
            "was read, and that lights are on."
        )
    if file.alpha is not None:
        _require_opaque(file, file.alpha, mask & lit)


def _require_opaque(file: ImageFile, alpha: Float32, judged: Bool) -> None:
    thin = judged & ~(alpha >= OPAQUE)
    if not thin.any():
        return
    y, x = np.argwhere(thin)[0]
    is_multiplied = bool((file.pixels[thin].max(axis=1) <= alpha[thin] * (1 + 1e-3) + 1 / 255).all())
    what = (
        "its colours do not exceed alpha, so that they look premultiplied: composited over black they stay as they are"
        if is_multiplied
        else "its colours exceed alpha, so that they look straight, not premultiplied"
    )
    raise ImageError(
        f"{file.path}: alpha is not 1 at {int(thin.sum())} of {int(judged.sum())} judged pixels, the first at "
        f"{_first(thin)} with {alpha[y, x]:.3g}; {what}. Alpha is never applied here: composite the image over black, "
        "or render opaque, and save it without alpha. Where the subject should cover the pixel, see that it is there."
    )


def _first(where: Bool) -> str:
    y, x = np.argwhere(where)[0]
    return f"x {x}, y {y}"


def alignment(depth: ImageFile, reference: Reference) -> str:
    """See by its depth that the engine sees the subject where it is; a sentence about how well.

    Only pixels that the subject covers completely are looked at: what surrounds it may be another room.

    Raises
    ------
    ImageError
        It does not: what the depth looks like instead.
    """
    sensor = reference.scene.sensor
    require_size(depth, sensor)
    truth = reference.truth("depth", 1).accumulators[0]
    mask = reference.subject_mask
    given = depth.pixels[..., 0].astype(np.float64)
    is_there = np.isfinite(given) & (given > 0) & (given < FARTHEST)
    if not (is_there & mask).any():
        raise ImageError(
            f"{depth.path}: no pixel of the subject has a depth; it must be positive and finite there. Save the linear "
            "distance to the camera."
        )
    along_ray = np.where(is_there, given, 0.0)
    kinds = {"viewing axis": along_ray, "ray, which was converted": along_ray * _cosine_to_axis(sensor)}
    samples, used = Samples(truth[None], mask), is_there & mask
    found = {kind: diagnose(distance[..., None], samples, read_as=None) for kind, distance in kinds.items()}
    kind = min(kinds, key=lambda name: _differences(found[name].mended, truth, used)[1])
    image, diagnosis = kinds[kind][..., None], found[kind]
    half, most = _differences(image, truth, used)
    moved = _moved_by(image, Samples(truth[None], used))
    missing = float((mask & ~is_there).sum() / mask.sum())
    facts = (
        f"distance along the {kind}; half of the depths within {format_percent(half)}, nine tenths within "
        f"{format_percent(most)}{_moved_text(moved)}; {format_count(int(used.sum()))} of "
        f"{format_count(int(mask.sum()))} pixels of the subject have a depth"
    )
    is_close = most <= ALIGNED_DEPTH and (moved or 0.0) <= ALIGNED_PX and missing <= ALIGNED_COVERAGE
    if is_close and not diagnosis.sentences:
        return facts
    raise ImageError(
        f"{depth.path}: this is not the depth of scene '{reference.scene.name}' in {reference.scene.length_unit} "
        f"({facts}). Both sides must see the same before their light is compared. "
        f"{_likely(diagnosis, _differences(diagnosis.mended, truth, used)[1])}"
    )


def _moved_text(moved: float | None) -> str:
    if moved is None:
        return ""
    return f"; moved by {format_number(moved)} px" if math.isfinite(moved) else "; no shift aligns them"


def _likely(diagnosis: Diagnosis, left: float) -> str:
    """What explains a depth that does not fit, if `left`, what remains of it, is little."""
    if diagnosis.sentences and left <= ALIGNED_DEPTH:
        return f"Likely: {'; '.join(diagnosis.sentences)}."
    return (
        "No turn, move or factor explains it: see that camera and geometry are the exported ones, and that depth is "
        "the linear distance, not what a depth buffer holds."
    )


def _differences(image: Float64, truth: Float32, used: Bool) -> tuple[float, float]:
    """Relative difference of depths (H, W, 1) that half of the pixels in use and nine tenths of them do not exceed."""
    half, most = np.quantile(np.abs(image[used] / truth[used] - 1), [0.5, 0.9])
    return float(half), float(most)


def _cosine_to_axis(sensor: Perspective) -> Float64:
    """(H, W), of the angle between the viewing axis and the ray through a pixel's centre."""
    tangent = np.tan(np.radians(sensor.fov_deg) / 2) / (sensor.width if sensor.fov_axis == "x" else sensor.height)
    x = (2 * np.arange(sensor.width) + 1 - sensor.width) * tangent
    y = (2 * np.arange(sensor.height) + 1 - sensor.height) * tangent
    cosine: Float64 = 1 / np.sqrt(1 + x**2 + y[:, None] ** 2)
    return cosine


def _moved_by(image: Float64, samples: Samples) -> float | None:
    """In pixels, infinite if no shift aligns the two; None if this depth cannot tell."""
    try:
        found = shift_px(image, samples)
    except ImageError:
        return None
    return math.inf if found.note else found.value


def measure(
    image: Float32, names: Sequence[str], truth_at: Callable[[int], Truth], limit: int, *, fitted: bool
) -> Measurement:
    """Double the samples of the truth until the first metric is known well enough, or `limit` of them are spent.

    Parameters
    ----------
    image : (H, W, C), linear.
    names : of metrics.
    truth_at : gives the truth with at least that many samples a pixel.
    fitted : whether the image is first multiplied by the factor that suits it best.
    """
    planned = looks(limit)
    for spp in planned:
        truth = truth_at(spp)
        samples = Samples(truth.accumulators, truth.mask, ALPHA_PER_SIDE / len(planned))
        exposure = fit_exposure(image, samples) if fitted else 1.0
        exposed = (image * exposure).astype(np.float32)
        first = evaluate(names[0], exposed, samples)
        if truth.is_exact or _is_known(first):
            break
    estimates = {name: evaluate(name, exposed, samples) for name in names[1:]}
    return Measurement(Decision(truth, samples, exposed, exposure, ()), {names[0]: first} | estimates)


def _is_known(estimate: Estimate) -> bool:
    wanted = max(RELATIVE_PRECISION * abs(estimate.value), ABSOLUTE_PRECISION)
    return estimate.valid and (estimate.high - estimate.low) / 2 <= wanted


def hints(file: ImageFile, image: Float32, truth: Truth, found: Quantity) -> Iterator[str]:
    """What an image looks like that would explain its error: sentences.

    image : (H, W, C) the pixels of the file as they were judged.
    """
    samples = Samples(truth.accumulators, truth.mask)
    read_as = file.encoding if found.display in ("radiance", "unit") and found.channels == 3 else None
    diagnosis = diagnose(check_image(image, samples), samples, read_as=read_as)
    if diagnosis.sentences:
        fitted = (
            "; --fit-exposure judges the rest alone" if diagnosis.factor != 1 and found.display == "radiance" else ""
        )
        what = "that" if len(diagnosis.sentences) == 1 else "both" if len(diagnosis.sentences) == 2 else "all of that"
        yield from diagnosis.sentences
        yield f"without {what}, the error falls to 1 / {format_number(diagnosis.falls_by)}{fitted}"
    if found.display == "radiance":
        yield from _clipped(file, samples)


def _clipped(file: ImageFile, samples: Samples) -> Iterator[str]:
    judged = file.pixels[samples.mask]
    if judged.max() > 1:
        return
    beyond = float(((samples.mean - SURELY * samples.standard_error)[samples.mask] > BEYOND_DISPLAY).mean())
    at_most = float((judged == 1).mean())
    if beyond > CLIPPED_SHARE:
        most = format_number(float(samples.mean[samples.mask].max()))
        yield (
            f"no value exceeds 1, but the truth does at {format_percent(beyond)} of the judged values, up to {most}: "
            "the image is clipped or tone-mapped; save scene-referred values as EXR"
        )
    elif at_most > CLIPPED_SHARE:
        yield f"{format_percent(at_most)} of the judged values are exactly 1, as if they were clipped"


def shipped(scene: Scene, name: str, metrics: Sequence[str]) -> Iterator[str]:
    """What the shipped techniques for a quantity reach on a scene, as far as that was accepted: a line each."""
    unit = quantity(name).unit_in(scene)
    for check_id, accepted in read_accepted(scene.folder).items():
        scene_name, _, check = check_id.partition("/")
        drawn_by = check.partition("[")[0]
        if scene_name != scene.name or drawn_by not in TECHNIQUES or technique(drawn_by).approximates != name:
            continue
        known = [f"{m} {measured_text(m, accepted.criteria[m], unit)}" for m in metrics if m in accepted.criteria]
        if known:
            yield f"{check}: {', '.join(known)}"
