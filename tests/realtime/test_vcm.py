"""The virtual cube map itself: where a direction lies in it, what is drawn into it, and what is not."""

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from realtime import vcm
from realtime.camera import FACES
from realtime.frame import Frame
from scenes.errors import InputError
from scenes.geometry import geometry_of
from scenes.image import Float64
from scenes.model import Scene

if TYPE_CHECKING:
    import moderngl

MakeScene = Callable[..., Scene]
FrameWith = Callable[..., Frame]

SIDE, MARGIN, NEAR, FAR = 512, 4, 0.1, 10.0
PLACE = np.array([0.3, -0.2, 0.5])
SLIDE = (
    ((1, 1), (-1, 1), (1, -1), (-1, -1)),
    ((-1, 1), (1, 1), (-1, -1), (1, -1)),
    ((-1, -1), (1, -1), (-1, 1), (1, 1)),
    ((-1, 1), (1, 1), (-1, -1), (1, -1)),
    ((-1, 1), (-1, -1), (1, 1), (1, -1)),
    ((1, 1), (1, -1), (-1, 1), (-1, -1)),
)
"""The talk's table: the corners of the faces +X -X +Y -Y +Z -Z at (u0, v0), (u0, v1), (u1, v0), (u1, v1)."""


def unpacked(texels: Float64) -> Float64:
    """Coordinates (..., 2) of the remap cube's texels."""
    return texels[..., ::2] + texels[..., 1::2] / vcm.PACKING


def ways_to_light(remap_side: int, edge_to_edge: bool) -> Float64:
    """(6, S, S, 3), by the specification's table of cube map faces."""
    reach = 1.0 if edge_to_edge else 1 - 1 / remap_side
    t, s = np.meshgrid(*[np.linspace(-reach, reach, remap_side)] * 2, indexing="ij")
    forward, right, up = (np.array([face[k] for face in FACES], dtype=float)[:, None, None] for k in range(3))
    ways: Float64 = forward + s[None, ..., None] * right + t[None, ..., None] * up
    return ways


@pytest.mark.parametrize("face", range(6))
def test_the_slide_puts_columns_and_rows_along_the_two_axes_that_follow(face: int) -> None:
    """Its table of corners, in which no face is an exception."""
    forward, right, up = (np.array(axis, dtype=float) for axis in FACES[face])
    axis = face // 2
    corners = [(-1, -1), (-1, 1), (1, -1), (1, 1)]
    for (x, y), (u, v) in zip(SLIDE[face], corners, strict=True):
        d = forward + x * right + y * up
        assert (d[(axis + 1) % 3], d[(axis + 2) % 3]) == (u, v)


@pytest.mark.parametrize("edge_to_edge", [False, True])
def test_the_remap_cube_leads_to_where_the_cameras_draw(edge_to_edge: bool) -> None:
    """A point on each texel's way, projected by the tile's camera, against the coordinates that the texel holds."""
    remap = vcm.remap_faces(16, SIDE, MARGIN, edge_to_edge).astype(float)
    ways = ways_to_light(16, edge_to_edge)
    cameras = vcm.tile_cameras(PLACE, SIDE, MARGIN, NEAR, FAR)
    for face, camera in enumerate(cameras):
        points = PLACE - 3.0 * ways[face]
        clip = np.concatenate([points, np.ones((16, 16, 1))], axis=-1) @ camera.matrix.T
        assert (clip[..., 3] > 0).all()
        window = (clip[..., :2] / clip[..., 3:] + 1) / 2 * SIDE + vcm.tile_corner(face, SIDE)
        np.testing.assert_allclose(unpacked(remap[face]) * SIDE * np.array([3, 2]), window, atol=0.06)


def test_a_tile_reaches_the_margin_beyond_its_quarter_turn() -> None:
    """NVIDIA 2005: fov = 2 atan((N/2) / (N/2 - b)); the edge of the 90 degrees is then b texels inside the tile."""
    assert vcm.tangent_of_half_angle(512, 4) == pytest.approx(256 / 252)
    at_edges = unpacked(vcm.remap_faces(64, SIDE, MARGIN, edge_to_edge=True).astype(float))[0] * SIDE * np.array([3, 2])
    np.testing.assert_allclose([at_edges.min(), at_edges.max()], [MARGIN, SIDE - MARGIN], atol=0.06)


def test_packed_coordinates_keep_a_tenth_of_a_texel_where_halves_lose_a_whole_one() -> None:
    """Half floats near 3071 / 3072 are 2^-11 apart: 1.5 texels. In between, filtering must not break the packing."""
    u = np.linspace(0, 1, 100_001)
    uv = np.stack([u, u], axis=-1)
    assert np.abs(unpacked(vcm.packed(uv).astype(float)) - uv).max() * 3072 < 0.1
    assert np.abs(u.astype(np.float16) - u).max() * 3072 > 0.7
    halfway = (vcm.packed(uv[:-1560]).astype(float) + vcm.packed(uv[1560:]).astype(float)) / 2
    np.testing.assert_allclose(unpacked(halfway), uv[780:-780], atol=0.1 / 3072)


def test_the_literal_coordinates_leave_their_tiles() -> None:
    """Without the division by 3 and 2 a tile spans the whole texture, and what exceeds it is clamped."""
    literal = unpacked(vcm.literal_remap_faces(64, SIDE, MARGIN).astype(float))
    np.testing.assert_allclose(literal[0].min(axis=(0, 1)), [MARGIN / SIDE + 1 / 128] * 2, atol=1e-3)
    np.testing.assert_allclose(literal[0].max(axis=(0, 1)), [1 - MARGIN / SIDE - 1 / 128] * 2, atol=1e-3)
    assert literal[5].max() == 1


@pytest.mark.parametrize("distance", [NEAR, 0.5, 3.0, FAR])
def test_q_gives_the_depth_of_the_projection(distance: float) -> None:
    x, y = vcm.projection_q(NEAR, FAR)
    camera = vcm.tile_cameras(PLACE, SIDE, MARGIN, NEAR, FAR)[0]
    clip = camera.matrix @ np.append(PLACE + distance * camera.forward, 1.0)
    assert y + x / distance == pytest.approx(clip[2] / clip[3], abs=1e-12)


def test_far_is_behind_every_vertex_in_every_tile(make_scene: MakeScene) -> None:
    meshes = geometry_of(make_scene())
    near, far = vcm.clip_planes(meshes, PLACE, 100.0)
    farthest = max(float(np.abs(m.surface.positions - PLACE).max()) for m in meshes)
    assert farthest < far < 1.01 * farthest
    assert near == far / 100


@pytest.mark.parametrize(
    ("position", "outside"),
    [
        ([0.0, 0.0, 0.0], [0, 0, 0, 0, 0, 0]),
        ([2.0, 0.0, 0.0], [1, 0, 1, 1, 1, 1]),
        ([0.0, -2.0, 0.0], [1, 1, 0, 1, 1, 1]),
        ([2.0, 2.0, 0.0], [1, 0, 1, 0, 1, 1]),
        ([30.0, 0.0, 0.0], [1, 1, 1, 1, 1, 1]),
    ],
)
def test_a_box_is_outside_of_the_tiles_that_look_away(
    make_scene: MakeScene, position: list[float], outside: list[int]
) -> None:
    """The tile +X is that of ways to the light along +X: it looks along -X. The last box is behind the far plane."""
    crate = {"name": "ball", "type": "box", "size": [0.5, 0.5, 0.5], "position": position, "material": "skin"}
    corners = vcm.box_corners(geometry_of(make_scene(shapes=[crate]))[0])
    cameras = vcm.tile_cameras(np.zeros(3), SIDE, MARGIN, NEAR, FAR)
    assert [vcm.is_outside(camera, corners) for camera in cameras] == [bool(o) for o in outside]


def crumbs(rng: np.random.Generator) -> list[dict[str, Any]]:
    """Small crates in all directions, at odd angles."""
    return [
        {
            "name": f"crate-{i}",
            "type": "box",
            "size": [0.2, 0.1, 0.15],
            "position": rng.uniform(-1.2, 1.2, 3).tolist(),
            "rotation_deg": rng.uniform(0, 360, 3).tolist(),
            "material": "white",
        }
        for i in range(12)
    ]


@pytest.mark.parametrize("name", ["shadow.vcm", "shadow.vcm_analytic"])
def test_what_is_culled_would_not_have_been_seen(
    make_scene: MakeScene, frame_with: FrameWith, name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The same depths bit by bit, and the draws that were left out are counted."""
    base = make_scene()
    shapes = [*(s.model_dump() for s in base.shapes), *crumbs(np.random.default_rng(1))]
    scene = make_scene(shapes=[{k: v for k, v in s.items() if v is not None} for s in shapes])
    culled = frame_with(scene, name, "virtual_cube_map", side=256)
    monkeypatch.setattr(vcm, "is_outside", lambda camera, corners: False)
    whole = frame_with(scene, name, "virtual_cube_map", side=256)
    assert culled.resources["virtual_cube_map"].texture.read() == whole.resources["virtual_cube_map"].texture.read()
    assert whole.skipped == []
    (skip,) = culled.skipped
    left_out, of, total = skip.what.split()[:3]
    assert (of, int(total)) == ("of", 6 * (6 + 1 + 12))
    assert int(left_out) > 60
    assert "frustum" in skip.why


@pytest.mark.parametrize(("depth_format", "step"), [("D16", 1 / 65535), ("D24", 2.0**-24), ("D32F", 2.0**-24)])
def test_a_depth_texture_rounds_as_its_format_says(gl: "moderngl.Context", depth_format: str, step: float) -> None:
    values = np.random.default_rng(2).uniform(0.5, 1, 16)
    errors = []
    for value in values:
        texture = vcm.depth_texture(gl, (4, 4), depth_format)
        framebuffer = gl.framebuffer([], texture)
        framebuffer.use()
        framebuffer.clear(depth=float(value))
        errors.append(float(np.frombuffer(texture.read(), dtype=np.float32)[0]) - value)
    assert np.abs(errors).max() <= 0.6 * step + 2.0**-24
    assert np.abs(errors).max() > 0.1 * step


def test_a_texture_too_wide_for_the_gpu_is_refused(
    gl: "moderngl.Context", make_scene: MakeScene, frame_with: FrameWith, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(gl.info, "GL_MAX_TEXTURE_SIZE", 2048)
    with pytest.raises(InputError, match="Set side to 682 or less"):
        frame_with(make_scene(), "shadow.vcm", "virtual_cube_map", side=683)


BULB = {"type": "sphere", "position": [0.7, 0.9, 0.8], "radius": 0.05, "radiance": [3.0, 3.0, 3.0]}
LAMP = {"type": "point", "position": [0.7, 0.9, 0.8], "intensity": [3.0, 3.0, 3.0]}


def test_a_sphere_light_does_not_shade_itself(make_scene: MakeScene, frame_with: FrameWith) -> None:
    """Its ball surrounds its centre, from which the tiles are drawn."""
    maps = [
        frame_with(make_scene(emitters=[light]), "shadow.vcm", "virtual_cube_map", side=128).resources
        for light in (LAMP, BULB)
    ]
    assert maps[0]["virtual_cube_map"].texture.read() == maps[1]["virtual_cube_map"].texture.read()


@pytest.mark.parametrize("emitters", [[], [LAMP, BULB], [{"type": "constant", "radiance": [1.0, 1.0, 1.0]}]])
def test_other_than_one_omnidirectional_light_is_refused(
    make_scene: MakeScene, frame_with: FrameWith, emitters: list[dict[str, Any]]
) -> None:
    with pytest.raises(InputError, match="exactly one"):
        frame_with(make_scene(emitters=emitters), "shadow.vcm_analytic", "image")
