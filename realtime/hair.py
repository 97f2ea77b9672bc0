"""Hair in the world: the skin under it deformed, hairs grown from their roots, points along them.

What passes hand on, for whoever draws or lights hair:

scalps       : one `Skinned` for each hair of the scene: its surface, its roots (baked)
strands      : `Strands`, the control points of all hairs, one hair of the scene after the other
hair_samples : `HairSamples`, points along all hairs with their tangents
hair_radiance: buffer with a vec4 for each of these points: the radiance towards the sensor, the mean over the fibre's
    width. Passes that light hair write it; those of realtime/hair_ribbons.py read it
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from realtime.capture import large_buffer
from realtime.frame import Frame, columns
from realtime.graph import Pass
from realtime.hair_roots import Scalp, placed_bones, places_in, root_rows, scalp_of, the_hair
from realtime.technique import Parameter
from scenes.errors import InputError
from scenes.grooming import groom
from scenes.image import Float64
from scenes.limbs import Skin
from scenes.topology import Integers

if TYPE_CHECKING:
    import moderngl

SEGMENTS = Parameter("segments", 16, (4, 8, 16, 32), "straight pieces that each hair is drawn as", (1, 256))
POINT_BYTES = 16
SAMPLE_BYTES = 32


@dataclass(frozen=True)
class Skinned:
    """A scalp on the GPU; `positions` and `normals` are those of the deformed surface once it is deformed.

    vertices : rows of hair/skin.comp, and `starts` and `corners` what hair/normals.comp reads; none if nothing deforms
    """

    scalp: Scalp
    positions: moderngl.Buffer
    normals: moderngl.Buffer
    vertices: moderngl.Buffer | None = None
    starts: moderngl.Buffer | None = None
    corners: moderngl.Buffer | None = None

    def bind(self) -> None:
        """Bind what hair/roots.glsl reads but the roots."""
        self.positions.bind_to_storage_buffer(1)
        self.normals.bind_to_storage_buffer(2)


@dataclass(frozen=True)
class Strands:
    """All hairs of a scene; `count` may be 0.

    points : (N, 4) vec4: control points in the world, w the radius
    colors : (N,) vec4: the factor on a hair's light, w the index of the scene's hair that it is of
    """

    points: moderngl.Buffer
    colors: moderngl.Buffer
    count: int

    def bind(self) -> None:
        """Bind what hair/strands.glsl declares."""
        self.points.bind_to_storage_buffer(6)
        self.colors.bind_to_storage_buffer(7)


@dataclass(frozen=True)
class HairSamples:
    """Points along all hairs: `per_hair` on each, evenly spaced in the parameter of its curve from root to tip.

    buffer : two vec4 each: position and radius; unit tangent towards the tip
    """

    buffer: moderngl.Buffer
    per_hair: int

    def bind(self) -> None:
        """Bind what hair/samples.glsl declares."""
        self.buffer.bind_to_storage_buffer(5)


def scalp_passes() -> list[Pass]:
    """Write `scalps`, then deform them into `deformed`: each frame anew, as what moves would need."""
    return [
        Pass("scalps", _upload_scalps, writes=("scalps",), is_baked=True),
        Pass("deform skin", _deform, reads=("scalps",), writes=("deformed",)),
    ]


def hair_points_passes(handedness: bool = True) -> list[Pass]:
    """Write `strands`: roots on the deformed surface, frames recomputed from it, control points from these.

    Without `handedness` hair on a mirrored chart is not mirrored.
    """
    return [
        *scalp_passes(),
        Pass("roots", _upload_roots, reads=("scalps",), writes=("roots",), is_baked=True),
        Pass("grow", lambda f: _grow(f, handedness), reads=("deformed", "roots"), writes=("strands",)),
    ]


def samples_pass() -> Pass:
    """Write `hair_samples`, by the setting of SEGMENTS."""
    return Pass("sample hair", _sample, reads=("strands",), writes=("hair_samples",))


def _upload_scalps(frame: Frame) -> None:
    of_each = {hair.on: scalp_of(frame.scene, frame.meshes, hair) for hair in the_hair(frame.scene)}
    frame.resources["scalps"] = {name: _uploaded(frame, scalp) for name, scalp in of_each.items()}


def _uploaded(frame: Frame, scalp: Scalp) -> Skinned:
    positions, normals = (_vec4_buffer(frame, values) for values in (scalp.positions, scalp.normals))
    if scalp.skin is None:
        return Skinned(scalp, positions, normals)
    skin = scalp.skin
    rows = np.zeros((len(scalp.positions), 2, 4), dtype=np.float32)
    rows[:, 0, :3], rows[:, 0, 3], rows[:, 1, :3] = scalp.positions, skin.weights[:, 1], scalp.morph
    starts, corners = faces_around(skin)
    buffer = frame.context.buffer
    return Skinned(
        scalp, positions, normals, buffer(rows.tobytes()), buffer(starts.tobytes()), buffer(corners.tobytes())
    )


def _vec4_buffer(frame: Frame, values: Float64) -> moderngl.Buffer:
    rows = np.zeros((len(values), 4), dtype=np.float32)
    rows[:, :3] = values
    return frame.context.buffer(rows.tobytes())


def faces_around(skin: Skin) -> tuple[Integers, Integers]:
    """For each vertex where its faces begin (V + 1,), and of each face the corners (K, 4), from the vertex on.

    The faces are those around the vertex' place: all that it has with the others there.
    """
    faces = np.concatenate([np.roll(skin.rest.faces.astype(np.uint32), -k, axis=1) for k in range(3)])
    order = np.argsort(skin.places[faces[:, 0]], kind="stable")
    at = skin.places[faces[order, 0]]
    begin, end = (np.searchsorted(at, skin.places, side) for side in ("left", "right"))
    starts = np.concatenate([[0], np.cumsum(end - begin)]).astype(np.uint32)
    within = np.arange(starts[-1]) - np.repeat(starts[:-1], end - begin)
    around = faces[order[np.repeat(begin, end - begin) + within]]
    return starts, np.ascontiguousarray(np.column_stack([around, around[:, 0]]), dtype=np.uint32)


def _deform(frame: Frame) -> None:
    scalps: Mapping[str, Skinned] = frame.resources["scalps"]
    for skinned in scalps.values():
        if skinned.vertices is not None:
            _deform_one(frame, skinned)
    frame.resources["deformed"] = scalps


def _deform_one(frame: Frame, skinned: Skinned) -> None:
    count = len(skinned.scalp.positions)
    skinned.bind()
    for binding, buffer in ((0, skinned.vertices), (3, skinned.starts), (4, skinned.corners)):
        assert buffer is not None, "what deforms has all three"
        buffer.bind_to_storage_buffer(binding)
    frame.dispatch(frame.program("hair/skin.comp"), count, group=(64, 1), count=count, **bone_uniforms(skinned.scalp))
    frame.dispatch(frame.program("hair/normals.comp"), count, group=(64, 1), count=count)


def bone_uniforms(scalp: Scalp) -> dict[str, Any]:
    """A scalp's pose, as shaders that skin take it."""
    lower, upper = placed_bones(scalp)
    amount = scalp.skin.amount if scalp.skin else 0.0
    return {"lower_bone": columns(lower), "upper_bone": columns(upper), "amount": amount}


def _upload_roots(frame: Frame) -> None:
    roots = []
    for hair in the_hair(frame.scene):
        scalp, grown = frame.resources["scalps"][hair.on].scalp, groom(frame.scene, hair)
        places = places_in(scalp, grown.uv)
        if len(places.point) == 0:
            raise InputError(
                f"No root of the hair '{hair.name}' lies on a face of '{hair.on}' in (u, v). Choose a region that its "
                "texture coordinates cover."
            )
        rows = root_rows(scalp, places, grown.shape, grown.color, hair.radius)
        roots.append((frame.context.buffer(rows.tobytes()), len(rows)))
    frame.resources["roots"] = tuple(roots)


def new_strands(frame: Frame, count: int) -> Strands:
    """Room for hairs, the same in each frame."""
    make = frame.context.buffer
    points, colors = frame.once(
        ("strands", count), lambda: (make(reserve=max(4 * count, 1) * POINT_BYTES), make(reserve=max(count, 1) * 16))
    )
    return Strands(points, colors, count)


def _grow(frame: Frame, handedness: bool) -> None:
    roots = frame.resources["roots"]
    strands = new_strands(frame, sum(count for _, count in roots))
    shader = frame.program("hair/grow.comp", **({} if handedness else {"NO_HANDEDNESS": 1}))
    first = 0
    for system, (hair, (buffer, count)) in enumerate(zip(frame.scene.hair, roots, strict=True)):
        skinned: Skinned = frame.resources["deformed"][hair.on]
        skinned.bind()
        strands.bind()
        buffer.bind_to_storage_buffer(0)
        origin = skinned.scalp.shape.position
        frame.dispatch(shader, count, group=(64, 1), count=count, first=first, origin=origin, system=system)
        first += count
    frame.resources["strands"] = strands


def _sample(frame: Frame) -> None:
    strands: Strands = frame.resources["strands"]
    segments = int(frame.settings["segments"])
    count = strands.count * (segments + 1)
    samples = HairSamples(
        large_buffer(
            frame,
            max(count, 1) * SAMPLE_BYTES,
            f"Hair of {strands.count} curves in {segments} segments needs a list",
            "Set segments lower.",
        ),
        segments + 1,
    )
    strands.bind()
    samples.bind()
    frame.dispatch(frame.program("hair/samples.comp", SEGMENTS=segments), count, group=(64, 1), count=count)
    frame.resources["hair_samples"] = samples
