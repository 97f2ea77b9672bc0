import numpy as np
import pytest

from scenes import heads
from scenes.errors import SceneError
from scenes.heads import EYE, SOCKET_RADIUS, distance, head
from scenes.topology import face_vectors, is_watertight, signed_volume

HEIGHT, CELLS = 80.0, 72
HEAD = head(HEIGHT, CELLS)


def test_a_head_is_watertight_and_faces_outward() -> None:
    assert is_watertight(HEAD)
    assert signed_volume(HEAD) > 0


def test_its_height_is_that_from_chin_to_crown_within_a_few_per_cent() -> None:
    crown = HEAD.positions[:, 1].max()
    ahead = HEAD.positions[HEAD.positions[:, 2] > 0]
    assert (crown - ahead[:, 1].min()) / HEIGHT == pytest.approx(1, abs=0.06)


def test_it_is_mirror_symmetric() -> None:
    low, high = HEAD.positions.min(axis=0), HEAD.positions.max(axis=0)
    assert low[0] == pytest.approx(-high[0], rel=0.01)
    points = np.random.default_rng(1).uniform(-0.5, 0.5, (3, 1000))
    mirrored = points * [[-1], [1], [1]]
    np.testing.assert_array_equal(distance(*points), distance(*mirrored))


def test_normals_are_unit_vectors_on_the_side_of_the_faces() -> None:
    np.testing.assert_allclose(np.linalg.norm(HEAD.normals, axis=1), 1, atol=1e-6)
    vectors = face_vectors(HEAD.positions, HEAD.faces)
    along = np.einsum("fkc,fc->f", HEAD.normals[HEAD.faces], vectors)
    assert np.mean(along > 0) > 0.995


@pytest.mark.parametrize("side", [-1, 1])
def test_a_ball_of_the_sockets_size_meets_nothing_of_the_head(side: int) -> None:
    gap = np.linalg.norm(HEAD.positions / HEIGHT - np.array(EYE) * [side, 1, 1], axis=1)
    assert gap.min() > SOCKET_RADIUS - 0.5 / CELLS


def test_the_eyes_look_out_between_the_lids_but_are_held_by_them() -> None:
    x, y, z = EYE
    ahead = np.linspace(0, 0.3, 200)
    assert (distance(np.full(200, x), np.full(200, y), z + ahead) > 0).all()
    up = distance(np.full(200, x), y + ahead * np.sin(1.1), z + ahead * np.cos(1.1))
    assert (up < 0).any()


def test_ears_are_thin_and_stand_out_from_the_skull() -> None:
    outward = np.array([np.cos(heads.EAR_TURN), 0, -np.sin(heads.EAR_TURN)])
    centre = np.array(heads.EAR_CENTRE) + 0.06 * outward
    away = np.array([np.sin(heads.EAR_TURN), 0, np.cos(heads.EAR_TURN)])
    t = np.linspace(-0.08, 0.08, 801)
    inside = distance(*(centre[:, None] + np.outer(away, t))) < 0
    assert inside.sum() * (t[1] - t[0]) == pytest.approx(heads.EAR_THICKNESS, rel=0.2)


def test_the_scalp_is_a_rectangle_of_the_chart_without_a_seam() -> None:
    """Where hair grows, the chart goes from brow to nape and from side to side, and looks outward."""
    uvs = HEAD.uvs[HEAD.faces]
    scalp = ((uvs > (0.36, 0.25)) & (uvs < (0.8, 0.75))).all(axis=(1, 2))
    assert scalp.sum() > 1000
    a, b, c = uvs[scalp].astype(np.float64).transpose(1, 0, 2)
    turned = (b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]
    assert (turned > 0).all()
    assert np.ptp(uvs[scalp], axis=1).max() < 0.2
    crown = HEAD.uvs[HEAD.positions[:, 1].argmax()]
    np.testing.assert_allclose(crown, (0.5, 0.5), atol=0.03)


def test_no_face_spans_the_seam() -> None:
    near_poles = np.abs(HEAD.uvs[HEAD.faces, 1] - 0.5).max(axis=1) > 0.4
    assert np.ptp(HEAD.uvs[HEAD.faces, 0], axis=1)[~near_poles].max() < 0.5


def test_too_few_cells_are_refused() -> None:
    with pytest.raises(SceneError, match="Use at least 67 cells"):
        head(HEIGHT, 60)
    assert is_watertight(head(HEIGHT, 67))
