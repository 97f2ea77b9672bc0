"""A limb at rest against the cylinder that it is, and deformed against what each bone alone does."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from scenes.image import Float64
from scenes.limbs import BLEND_RADII, BULGE_RADII, Skin, deform, limb
from scenes.procedural import rotation_xyz
from scenes.shapes import Limb
from scenes.topology import face_vectors, is_watertight, signed_volume, weld

RADIUS, LENGTH = 10.0, 60.0


def skin(**changes: Any) -> Skin:
    sizes = {"radius": RADIUS, "length": LENGTH, "detail": 32}
    return limb(Limb.model_validate({"type": "limb", "name": "limb", "material": "skin", **sizes, **changes}))


def rest(made: Skin) -> Float64:
    return made.rest.positions.astype(np.float64)


@pytest.mark.parametrize("chart", ["plain", "mirrored"])
@pytest.mark.parametrize(("bend_deg", "bulge"), [(0.0, 0.0), (60.0, 0.0), (90.0, 0.3), (-120.0, 1.0)])
def test_it_is_closed_however_it_is_moved(chart: str, bend_deg: float, bulge: float) -> None:
    made = skin(chart=chart, bend_deg=bend_deg, bulge=bulge)
    assert is_watertight(made.rest)
    assert is_watertight(made.deformed)
    assert signed_volume(made.deformed) > 0


def test_its_volume_is_that_of_a_capsule() -> None:
    """Less what polygons of 128 sides cut off."""
    exact = np.pi * RADIUS**2 * (LENGTH + 4 / 3 * RADIUS)
    assert signed_volume(skin(detail=128).rest) == pytest.approx(exact, rel=1e-3)


def test_normals_of_the_straight_part_are_those_of_a_cylinder() -> None:
    """Weights by angle: with those by area, rows of unequal height beside the ends would turn them."""
    made = skin()
    side = np.abs(made.positions[:, 1]) < LENGTH / 2 - 1
    across = made.positions[side] * (1, 0, 1)
    np.testing.assert_allclose(made.normals[side], across / np.linalg.norm(across, axis=1)[:, None], atol=1e-12)


@pytest.mark.parametrize("chart", ["plain", "mirrored"])
def test_places_are_those_of_the_positions(chart: str) -> None:
    made = skin(chart=chart)
    welded = weld(made.rest.positions)
    pairs = {(int(a), int(b)) for a, b in zip(made.places, welded, strict=True)}
    assert len(pairs) == made.places.max() + 1 == welded.max() + 1


@given(st.floats(-120, 120), st.floats(-0.5, 1))
@settings(max_examples=50, deadline=None)
def test_beyond_the_blend_skin_moves_with_one_bone(bend_deg: float, bulge: float) -> None:
    made = skin(bend_deg=bend_deg, bulge=bulge, detail=16)
    far = np.abs(rest(made)[:, 1]) >= max(BLEND_RADII, BULGE_RADII) * RADIUS
    upper = rest(made)[:, 1] > 0
    turned = rest(made) @ rotation_xyz((bend_deg, 0.0, 0.0)).T
    np.testing.assert_allclose(made.positions[far & upper], turned[far & upper], atol=1e-5)
    np.testing.assert_allclose(made.positions[far & ~upper], rest(made)[far & ~upper], atol=1e-5)
    np.testing.assert_allclose(made.weights.sum(axis=1), 1)


def test_the_bulge_is_its_part_of_the_radius_at_the_joint() -> None:
    made = skin(bulge=0.4, length=40.0)
    distance = np.hypot(made.positions[:, 0], made.positions[:, 2])
    assert distance.max() == pytest.approx(1.4 * RADIUS, rel=1e-3)
    ends = np.abs(rest(made)[:, 1]) >= 20
    np.testing.assert_array_equal(made.morph[ends], 0)


@given(st.floats(-0.5, 2))
@settings(max_examples=50, deadline=None)
def test_bones_that_do_not_move_leave_the_morph_alone(amount: float) -> None:
    made = skin(detail=8)
    still = np.tile(np.eye(3, 4), (2, 1, 1))
    moved = deform(rest(made), made.morph, made.weights, still, amount)
    np.testing.assert_allclose(moved, rest(made) + amount * made.morph, atol=1e-12)


def test_skin_does_not_fold_back_at_ninety_degrees() -> None:
    made = skin(bend_deg=90.0, bulge=0.3, detail=64)
    faces = made.deformed.faces
    outward = np.sum(face_vectors(made.positions, faces) * made.normals[faces].mean(axis=1), axis=1)
    assert (outward > 0).all()


def test_the_mirrored_chart_gives_both_halves_the_same_texture() -> None:
    made = skin(chart="mirrored")
    by_place = {
        tuple(np.round(p, 3) + 0.0): tuple(uv) for p, uv in zip(made.rest.positions, made.rest.uvs, strict=True)
    }
    for place, uv in by_place.items():
        assert by_place[-place[0] + 0.0, place[1], place[2]] == pytest.approx(uv, abs=1e-6)


def test_faces_of_the_left_half_are_mirrored_and_none_is_degenerate() -> None:
    made = skin(chart="mirrored")
    corners = made.rest.uvs[made.rest.faces].astype(np.float64)
    (du1, dv1), (du2, dv2) = (corners[:, 1] - corners[:, 0]).T, (corners[:, 2] - corners[:, 0]).T
    is_left = made.rest.positions[made.rest.faces][:, :, 0].mean(axis=1) < 0
    np.testing.assert_array_equal(du1 * dv2 - du2 * dv1 < 0, is_left)
    assert (np.abs(du1 * dv2 - du2 * dv1) > 1e-5).all()


def test_vertices_on_the_mirror_are_split() -> None:
    """The tangent turns over there, so that the two sides may not share one."""
    front = [tuple(p) for p in skin(chart="mirrored").rest.positions if p[0] == 0 and p[2] > 0]
    assert len(front) == 2 * len(set(front))
    plain = [tuple(p) for p in skin().rest.positions if p[0] == 0 and p[2] > 0]
    assert len(plain) == len(set(plain))
