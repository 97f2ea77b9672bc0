"""The stresses of techniques: what is done to a scene, how harshly, and the law that its image must keep."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from comparisons.stress import metamorphic, transforms
from comparisons.stress.laws import OF_BASE, Subject, Tolerance
from comparisons.stress.metamorphic import Law
from scenes.model import AreaLight, EnvironmentLight, PointLight, SphereLight
from scenes.shapes import Eye, Relief, Room

BLACK = Tolerance(1e-6, f"maximum over the mean {OF_BASE}", "float32 rounds to that")
BOUND = Tolerance(1e-2, "excess over the bound", "what a finite number of samples may add")
SAMPLING = Tolerance(4.0, "standard errors of so few samples", "one image in 16000 is farther off by chance")
STRIP = Tolerance(5e-2, f"of the mean {OF_BASE}, beyond its middle rows", "rows differ by more than that")


@dataclass(frozen=True)
class Stress:
    """Something done to a scene, from mild to harsh.

    what : in a sentence
    magnitude : what its numbers count
    magnitudes : rising or falling
    law : how far an image is from what must hold
    unfit : why a subject cannot be put under it; empty if it can
    tolerance : of the law; that of the quantity if None
    """

    what: str
    magnitude: str
    magnitudes: tuple[float, ...]
    law: Law
    unfit: Callable[[Subject], str] = lambda subject: ""
    tolerance: Tolerance | None = None

    def __str__(self) -> str:
        return f"{self.what} [{self.magnitude}]" if self.magnitude else self.what

    @property
    def is_rising(self) -> bool:
        return self.magnitudes[-1] >= self.magnitudes[0]


def _kinds(subject: Subject) -> set[type]:
    return {type(light) for light in subject.case.scene.emitters}


def _unless(holds: Callable[[Subject], bool], why: str) -> Callable[[Subject], str]:
    return lambda subject: "" if holds(subject) else why


def _needs_shapes(subject: Subject) -> str:
    kinds = [type(shape) for shape in subject.case.scene.shapes if shape.name in subject.case.scene.subject]
    if Relief in kinds:
        return "a relief is given by its heights, not by triangles"
    return "an eye is given by its radii, not by triangles" if Eye in kinds else ""


NEVER_BOUNCED = ("indirect_radiance", "iris_radiance", "transmitted_radiance", "displaced_radiance", "albedo")
"""Quantities that are zero where nothing reflects or scatters."""


def _frame_without_emitters(subject: Subject) -> bool:
    return subject.quantity == "frame_radiance" and not _kinds(subject) & {AreaLight}


_lit = _unless(lambda s: bool(s.case.scene.emitters), "the scene has no emitter, and the quantity needs none")
_lens = _unless(lambda s: transforms.has_open_lens(s.case.scene), "the camera is a pinhole")
_turns = _unless(lambda s: EnvironmentLight not in _kinds(s), "an environment map has no rotation")

STRESSES: Mapping[str, Stress] = {
    "scale-up": Stress("the whole scene grows", "times", (10, 100, 1e3, 1e4), metamorphic.scale),
    "scale-down": Stress("the whole scene shrinks", "times", (0.1, 1e-2, 1e-3), metamorphic.scale),
    "offset": Stress(
        "everything is moved away from the origin",
        "viewing distances",
        (1, 10, 100, 1e3, 1e4, 1e5, 1e6),
        metamorphic.offset,
    ),
    "rotation": Stress(
        "everything is turned about an odd axis", "degrees", (7, 33, 90, 123.4), metamorphic.rotation, _turns
    ),
    "bright": Stress("every emitter is stronger", "times", (1e2, 1e4, 1e6), metamorphic.exposure, _lit),
    "dim": Stress("every emitter is weaker", "times", (1e-2, 1e-4, 1e-6), metamorphic.exposure, _lit),
    "aperture": Stress("the lens closes to a pinhole", "times", (1e-3, 1e-4, 1e-6, 0), metamorphic.pinhole, _lens),
    "small-light": Stress(
        "balls of light shrink to points of the same power",
        "viewing distances",
        (1e-3, 1e-4, 1e-5, 1e-6),
        metamorphic.small_light,
        _unless(lambda s: bool(_kinds(s) & {PointLight, SphereLight}), "no emitter is a point or a ball"),
    ),
    "no-emitter": Stress(
        "all emitters are switched off: black",
        "",
        (0,),
        metamorphic.black(transforms.unlit),
        _unless(lambda s: s.is_radiance, "the quantity is not made of light"),
        BLACK,
    ),
    "no-bounce": Stress(
        "nothing reflects or scatters: black",
        "reflectance",
        (0,),
        metamorphic.black(lambda scene: transforms.reflecting(scene, 0.0)),
        _unless(
            lambda s: s.quantity in NEVER_BOUNCED or _frame_without_emitters(s),
            "the quantity holds light that no surface has reflected, or none at all",
        ),
        BLACK,
    ),
    "white-sky": Stress(
        "nothing absorbs, under a sky of one radiance: energy is never created",
        "radiance",
        (1e-3, 1, 1e3),
        metamorphic.white_sky,
        _unless(
            lambda s: s.quantity in ("eye_radiance", "iris_radiance", "transmitted_radiance"),
            "the quantity does not bound what a subject alone sends out",
        ),
        BOUND,
    ),
    "white-room": Stress(
        "in a closed room whose walls glow, everything reflects more: energy is never created",
        "reflectance",
        (0.5, 0.8, 0.9, 0.95),
        metamorphic.glowing_room,
        _unless(
            lambda s: s.quantity == "indirect_radiance" and any(isinstance(x, Room) for x in s.case.scene.shapes),
            "the quantity is no indirect light in a closed room",
        ),
        BOUND,
    ),
    "wide-lens": Stress(
        "the lens opens: blur is never brighter than what it blurs",
        "times",
        (1, 2, 4, 8),
        metamorphic.wide_lens,
        _unless(
            lambda s: s.quantity == "defocus_radiance" and _kinds(s) == {AreaLight},
            "the quantity is not seen through a lens, or not only shapes emit",
        ),
        BOUND,
    ),
    "grazing-view": Stress(
        "the camera moves around the subject, until it has turned by a right angle less this",
        "degrees",
        (10, 1, 0.1, 0.01),
        metamorphic.continuous(transforms.seen_from),
    ),
    "grazing-light": Stress(
        "the lights move around the subject, until they have turned by a right angle less this",
        "degrees",
        (10, 1, 0.1, 0.01),
        metamorphic.continuous(transforms.lit_from),
        _unless(lambda s: any(map(transforms.is_movable, s.case.scene.emitters)), "no light can be moved alone"),
    ),
    "slivers": Stress(
        "faces are cut into triangles this flat, with vertices that no face uses and faces without area between them",
        "of the height of a face",
        (1e-2, 1e-4, 1e-6, 0),
        metamorphic.slivers,
        _needs_shapes,
    ),
    "far-card": Stress(
        "a black card too small to be seen stands far behind the subject",
        "viewing distances",
        (10, 100, 1e3, 1e5, 1e7),
        metamorphic.unchanged(transforms.with_far_card),
    ),
    "depth-bits": Stress(
        "depth is stored in fewer bits",
        "bits",
        (24, 16),
        metamorphic.depth_bits,
        _unless(
            lambda s: s.has_parameter("depth_bits") or s.has_parameter("depth_format"),
            "the technique has no depth format to set",
        ),
    ),
    "clip-ratio": Stress(
        "the far clip plane moves away from the near one",
        "far over near",
        (1e3, 1e4, 1e5, 1e6),
        metamorphic.setting("far_over_near", float),
        _unless(lambda s: s.has_parameter("far_over_near"), "the technique has no clip planes to set"),
    ),
    "few-pixels": Stress(
        "the image has few pixels", "pixels a side", (31, 5, 2, 1), metamorphic.few_pixels, tolerance=SAMPLING
    ),
    "strip": Stress(
        "the image is one row of many pixels", "pixels", (255, 1024, 4096), metamorphic.strip, tolerance=STRIP
    ),
}
