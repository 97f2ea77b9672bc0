"""The talk's hair: guides in texture space with a basis each, and hairs between them in the world.

The talk, "There is one basis (matrix) for each point on the surface"; "encode a basis in each morph target, then
proceed to morph & skin"; "use the basis as a matrix to transform the guides to World Space". So nothing makes a basis
orthonormal again after the deformation.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from realtime.frame import Frame
from realtime.graph import Pass
from realtime.hair import bone_uniforms, new_strands
from realtime.hair_charts import film_points
from realtime.hair_roots import Places, Scalp, film_places, places_in, scalp_of, the_hair
from scenes.errors import InputError
from scenes.grooming import Groom, groom, shape_at
from scenes.image import Bool, Float64
from scenes.procedural import normalised
from scenes.shapes import Hair
from scenes.topology import angle_weighted_normals

if TYPE_CHECKING:
    import moderngl

GUIDE = np.dtype(
    [
        ("rest_weight", "f4", 4),
        ("morph", "f4", 4),
        ("basis", "f4", (3, 4)),
        ("basis_morph", "f4", (3, 4)),
        ("points", "f4", (4, 4)),
    ]
)
"""A row of hair/guides.comp."""

GUIDE_BYTES = 7 * 16
"""Of a guide in the world."""

BETWEEN = np.dtype([("guides", "u4", 4), ("place", "f4", 4), ("own", "f4", (3, 4)), ("color_radius", "f4", 4)])
"""A row of hair/guides.glsl."""


@dataclass(frozen=True)
class Guided:
    """The guides of one hair on the GPU, those on a mirrored copy of the chart after the others.

    stored : as they are in texture space; `made` : in the world, `count` of each
    """

    hair: Hair
    scalp: Scalp
    grown: Groom
    stored: moderngl.Buffer
    made: moderngl.Buffer
    count: int


def guide_passes() -> list[Pass]:
    """Write `guides` in texture space, then take them to the world: `moved_guides`."""
    return [
        Pass("guides", _upload, writes=("guides",), is_baked=True),
        Pass("move guides", _move, reads=("guides",), writes=("moved_guides",)),
    ]


def hairs_between_passes() -> list[Pass]:
    """Write `strands`: hairs interpolated between guides in the world."""
    return [
        *guide_passes(),
        Pass("hairs", _upload_hairs, reads=("guides",), writes=("hairs",), is_baked=True),
        Pass("interpolate", _interpolate, reads=("moved_guides", "hairs"), writes=("strands",)),
    ]


def chart_between_passes(tangent: bool) -> list[Pass]:
    """Write `image` over the chart: where the hair ends that is rooted at a pixel's place, or the tangent there."""
    return [
        *guide_passes(),
        Pass("hairs of pixels", _upload_film, reads=("guides",), writes=("film_hairs",), is_baked=True),
        Pass("chart", lambda f: _draw_chart(f, tangent), reads=("moved_guides", "film_hairs"), writes=("image",)),
    ]


def _upload(frame: Frame) -> None:
    frame.resources["guides"] = tuple(_guided(frame, hair) for hair in the_hair(frame.scene))


def _guided(frame: Frame, hair: Hair) -> Guided:
    scalp, grown = scalp_of(frame.scene, frame.meshes, hair), groom(frame.scene, hair)
    rows = np.concatenate([_guide_rows(scalp, places, grown.guides) for places in _copies(hair, scalp, grown)])
    make = frame.context.buffer
    return Guided(hair, scalp, grown, make(rows.tobytes()), make(reserve=len(rows) * GUIDE_BYTES), len(rows))


def _copies(hair: Hair, scalp: Scalp, grown: Groom) -> list[Places]:
    """Where the guides stand, and where they stand on the mirrored copy of the chart, if there is one.

    Raises
    ------
    InputError
        Some stand where the chart has no face.
    """
    places, count = places_in(scalp, grown.guide_uv), len(grown.guide_uv)
    copies = [film_places(places, np.full(count, mirrored)) for mirrored in (False, True)]
    found = [copy for copy in copies if len(copy.point)]
    if not found or any(len(copy.point) < count for copy in found):
        raise InputError(
            f"Found guides of hair '{hair.name}' where '{hair.on}' has no face in (u, v). Choose a region that its "
            "texture coordinates cover up to its border."
        )
    return found


def _guide_rows(scalp: Scalp, places: Places, guides: Float64) -> NDArray[Any]:
    rows = np.zeros(len(places.point), dtype=GUIDE)
    rest, basis = _placed(scalp, places)
    rows["rest_weight"][:, :3], rows["basis"][..., :3] = rest, basis
    rows["points"][..., :3] = guides
    if scalp.skin is not None:
        skin = scalp.skin
        rows["rest_weight"][:, 3] = np.sum(places.weights * skin.weights[places.corners, 1], axis=1)
        positions = scalp.positions + scalp.morph
        normals = normalised(angle_weighted_normals(positions, skin.rest.faces, skin.places)[skin.places])
        root, morphed = _placed(replace(scalp, positions=positions, normals=normals), places)
        rows["morph"][:, :3], rows["basis_morph"][..., :3] = root - rest, morphed - basis
    return rows


def _placed(scalp: Scalp, places: Places) -> tuple[Float64, Float64]:
    """Positions (N, 3), and tangents, bitangents and normals as rows (N, 3, 3), of places on a surface."""
    corners, uvs = scalp.positions[places.corners], scalp.uvs[places.corners]
    edges, v = corners[:, 1:] - corners[:, :1], uvs[:, 1:, 1] - uvs[:, :1, 1]
    sign = np.where(places.mirrored, -1.0, 1.0)[:, None]
    along_u = sign * (v[:, 1:] * edges[:, 0] - v[:, :1] * edges[:, 1])
    normal = normalised(np.sum(places.weights[:, :, None] * scalp.normals[places.corners], axis=1))
    tangent = normalised(along_u - np.sum(along_u * normal, axis=1, keepdims=True) * normal)
    basis = np.stack([tangent, sign * np.cross(normal, tangent), normal], axis=1)
    return np.sum(places.weights[:, :, None] * corners, axis=1), basis


def _move(frame: Frame) -> None:
    shader = frame.program("hair/guides.comp")
    for guided in frame.resources["guides"]:
        guided.stored.bind_to_storage_buffer(0)
        guided.made.bind_to_storage_buffer(1)
        frame.dispatch(shader, guided.count, group=(64, 1), count=guided.count, **bone_uniforms(guided.scalp))
    frame.resources["moved_guides"] = frame.resources["guides"]


def between_rows(guided: Guided, uv: Float64, shape: Float64, color: Float64, mirrored: Bool) -> NDArray[Any]:
    """Rows of hair/guides.glsl for hairs (N,) rooted at uv (N, 2), with control points (N, 4, 3) in texture space."""
    side = guided.hair.guides
    ends = np.array(guided.hair.region).reshape(2, 2)
    low, high = ends.min(axis=0), ends.max(axis=0)
    place = (uv - low) / (high - low) * (side - 1)
    cell = np.clip(np.floor(place).astype(int), 0, side - 2)
    first = cell[:, 0] + side * cell[:, 1]
    around = first[:, None] + (0, 1, side, side + 1)
    (fu, fv) = (place - cell).T
    weights = np.stack([(1 - fu) * (1 - fv), fu * (1 - fv), (1 - fu) * fv, fu * fv], axis=1)
    rows = np.zeros(len(uv), dtype=BETWEEN)
    rows["guides"] = around + (mirrored * (guided.count - side * side))[:, None]
    rows["place"][:, :2] = place - cell
    own = shape - np.einsum("ng,ngki->nki", weights, guided.grown.guides[around])
    rows["own"][..., :3] = own[:, 1:]
    rows["color_radius"] = np.column_stack([color, np.full(len(uv), guided.hair.radius)])
    return rows


def _upload_hairs(frame: Frame) -> None:
    hairs = []
    for guided in frame.resources["guides"]:
        places, grown = places_in(guided.scalp, guided.grown.uv), guided.grown
        at = places.point
        rows = between_rows(guided, grown.uv[at], grown.shape[at], grown.color[at], places.mirrored)
        hairs.append((frame.context.buffer(rows.tobytes()), len(rows)))
    frame.resources["hairs"] = tuple(hairs)


def _interpolate(frame: Frame) -> None:
    hairs, moved = frame.resources["hairs"], frame.resources["moved_guides"]
    strands = new_strands(frame, sum(count for _, count in hairs))
    shader = frame.program("hair/grow_between.comp")
    first = 0
    for system, (guided, (buffer, count)) in enumerate(zip(moved, hairs, strict=True)):
        guided.made.bind_to_storage_buffer(1)
        buffer.bind_to_storage_buffer(0)
        strands.bind()
        origin = guided.scalp.shape.position
        frame.dispatch(shader, count, group=(64, 1), count=count, first=first, origin=origin, system=system)
        first += count
    frame.resources["strands"] = strands


def _upload_film(frame: Frame) -> None:
    guided: Guided = frame.resources["guides"][0]
    uv, mirrored = film_points(frame, guided.scalp)
    shape = shape_at(frame.scene, guided.hair, uv)
    rows = between_rows(guided, uv, shape, np.ones((len(uv), 3)), mirrored)
    frame.resources["film_hairs"] = frame.context.buffer(rows.tobytes())


def _draw_chart(frame: Frame, tangent: bool) -> None:
    frame.resources["moved_guides"][0].made.bind_to_storage_buffer(1)
    frame.resources["film_hairs"].bind_to_storage_buffer(0)
    image = frame.texture(frame.size, 4)
    image.bind_to_image(0, read=False, write=True)
    frame.dispatch(frame.program("hair/chart_between.comp", **({"TANGENT": 1} if tangent else {})), *frame.size)
    frame.resources["image"] = image
