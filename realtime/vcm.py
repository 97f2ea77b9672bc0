"""The virtual cube map: six square tiles of depth in one 2D texture, drawn from a light.

The layout is that of NVIDIA's talk on the GeForce 7800 GTX demos ("Luna", "Mad Mod Mike", 2005), hidden slides on hard
omnidirectional shadows. The tile of an axis k is column k, in row 0 for ways *to* the light with a positive component
along k and in row 1 for the others; columns of texels run along axis k + 1 and rows along axis k + 2, cyclically. That
is what the slide's table of corners says for all six faces. Half of the tiles are mirrored images: cull no faces.
"""

from __future__ import annotations

import ctypes
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from realtime.camera import FACES, Camera, perspective_matrix, view_matrix
from realtime.frame import Frame
from realtime.graph import Pass, Skip
from realtime.shader import set_uniforms
from scenes.errors import InputError
from scenes.image import Float64
from scenes.mesh import Mesh
from scenes.model import PointLight, Scene, SphereLight

if TYPE_CHECKING:
    import moderngl

COLUMNS, ROWS = 3, 2

MARGIN_OF_FAR = 1e-3
"""The far plane lies this part behind the farthest vertex, so that rounding does not clip what lies there."""

PACKING = 8
"""The talk's f: a coordinate is stored as floor(f t) / f and frac(f t)."""

_TEXTURE_2D, _DEPTH_COMPONENT, _FLOAT = 0x0DE1, 0x1902, 0x1406
_SEAMLESS_CUBE_MAPS = 0x884F
_INTERNAL_FORMATS = {"D16": 0x81A5, "D24": 0x81A6, "D32F": 0x8CAC}

DEPTH_FORMATS = tuple(_INTERNAL_FORMATS)

ROUNDING = {"D16": 2.0**-16, "D24": 2.0**-22, "D32F": 2.0**-22}
"""How far a stored depth in [0, 1] and one computed in a shader may differ: by a step of D16, else by a few roundings
of the float32 in which both are computed.
"""


@dataclass(frozen=True)
class VirtualCubeMap:
    """`texture` holds 3 x 2 tiles of `side` texels, each with `margin` texels beyond 90 degrees on every side.

    Depths are those of points between `near` and `far` along the axis of their tile from the light's `place`.
    """

    texture: moderngl.Texture
    side: int
    margin: int
    place: Float64
    near: float
    far: float


def the_omni_light(scene: Scene) -> tuple[int, Float64]:
    """Which emitter is the scene's only point or sphere light, and its centre.

    Raises
    ------
    InputError
        There is none, or more than one.
    """
    found = [(i, e) for i, e in enumerate(scene.emitters) if isinstance(e, PointLight | SphereLight)]
    if len(found) != 1:
        remedy = "Leave one of them in the scene." if found else "Add one, or leave out the check."
        raise InputError(
            f"Scene '{scene.name}' has {len(found)} point or sphere lights; a shadow technique needs exactly one. "
            f"{remedy}"
        )
    index, light = found[0]
    return index, np.array(light.position, dtype=float)


def tangent_of_half_angle(side: int, margin: int) -> float:
    """Of the tiles' field of view. NVIDIA 2005: fov = 2 atan((N / 2) / (N / 2 - b))."""
    return (side / 2) / (side / 2 - margin)


def tile_corner(face: int, side: int) -> tuple[int, int]:
    """Lower left texel of the tile that ways to the light with the major axis `face` (+X -X +Y -Y +Z -Z) select."""
    return face // 2 * side, face % 2 * side


def tile_cameras(place: Float64, side: int, margin: int, near: float, far: float) -> tuple[Camera, ...]:
    """The cameras of the six tiles, +X -X +Y -Y +Z -Z by the way to the light: they look the other way."""
    tangent = tangent_of_half_angle(side, margin)
    projection = perspective_matrix(tangent, tangent, near, far)
    cameras = []
    for face in range(6):
        forward, right, up = -np.roll(np.eye(3), face // 2, axis=1)
        forward = forward if face % 2 == 0 else -forward
        cameras.append(Camera(place, projection @ view_matrix(place, forward, right, up), forward))
    return tuple(cameras)


def projection_q(near: float, far: float) -> tuple[float, float]:
    """Q with depth in normalised device coordinates = Q.y + Q.x / (distance along the tile's axis).

    King, Newhall 2004, "Efficient Omnidirectional Shadow Maps".
    """
    return 2 * near * far / (near - far), (far + near) / (far - near)


def clip_planes(meshes: tuple[Mesh, ...], place: Float64, far_over_near: float) -> tuple[float, float]:
    """Near and far, far just behind the vertex farthest from `place` along an axis."""
    points = np.concatenate([m.surface.positions for m in meshes]).astype(float)
    far = (1 + MARGIN_OF_FAR) * float(np.abs(points - place).max())
    return far / far_over_near, far


def face_coordinates(remap_side: int, edge_to_edge: bool) -> Float64:
    """(6, S, S, 2): at each texel of a cube map the place in its tile, -1 to 1.

    A face that is filtered by itself is constant beyond the centres of its outermost texels. With `edge_to_edge` these
    stand for the edges of the face, and lookups squeeze the face between them; else texels stand for their centres.
    """
    reach = 1.0 if edge_to_edge else 1 - 1 / remap_side
    across = np.linspace(-reach, reach, remap_side)
    t, s = (grid[..., None] for grid in np.meshgrid(across, across, indexing="ij"))
    faces = []
    for face, axes in enumerate(FACES):
        forward, right, up = (np.array(axis, dtype=float) for axis in axes)
        faces.append(np.roll(forward + s * right + t * up, -(face // 2), axis=-1)[..., 1:])
    return np.stack(faces)


def packed(uv: Float64) -> NDArray[np.float16]:
    """Coordinates (..., 2) in [0, 1] as four half floats: u in the first two, v in the others.

    NVIDIA 2005: msb = floor(f t) / f, lsb = frac(f t). Halves alone would step by up to 1.5 texels of 3072. What is
    interpolated between texels stays exact, since msb + lsb / f is linear.
    """
    parts = np.stack([np.floor(uv * PACKING) / PACKING, uv * PACKING % 1], axis=-1)
    return parts.reshape(*uv.shape[:-1], 4).astype(np.float16)


def remap_faces(remap_side: int, side: int, margin: int, edge_to_edge: bool) -> NDArray[np.float16]:
    """The remap cube (6, S, S, 4): for ways to the light, where in the virtual cube map their depth lies."""
    corners = np.array([tile_corner(face, side) for face in range(6)])[:, None, None]
    texels = corners + side / 2 + (side / 2 - margin) * face_coordinates(remap_side, edge_to_edge)
    return packed(texels / (side * np.array([COLUMNS, ROWS])))


def literal_remap_faces(remap_side: int, side: int, margin: int) -> NDArray[np.float16]:
    """The remap cube to the slide's letter: u from b / N + 0.33333 i to (N - b) / N + 0.33333 i, v likewise with 0.5 j.

    What lacks is the division of b / N and (N - b) / N by the numbers of tiles, 3 and 2. The slide's fragment shader
    clamps to [0, 1].
    """
    corners = np.array([tile_corner(face, 1) for face in range(6)])[:, None, None] * (0.33333, 0.5)
    across = (face_coordinates(remap_side, edge_to_edge=False) + 1) / 2
    return packed(np.clip(margin / side + (side - 2 * margin) / side * across + corners, 0, 1))


def box_corners(mesh: Mesh) -> Float64:
    """The corners (8, 4) of the mesh's box, in homogeneous coordinates."""
    low, high = mesh.surface.positions.min(axis=0), mesh.surface.positions.max(axis=0)
    return np.array([[*np.where(bits, high, low), 1.0] for bits in np.ndindex(2, 2, 2)])


def is_outside(camera: Camera, corners: Float64) -> bool:
    """Whether a box lies beyond one of the six planes of the camera's frustum, |x|, |y|, |z| <= w."""
    clip = corners @ camera.matrix.T
    w = clip[:, 3:]
    return bool(((clip[:, :3] > w).all(axis=0) | (clip[:, :3] < -w).all(axis=0)).any())


def depth_texture(context: moderngl.Context, size: tuple[int, int], depth_format: str) -> moderngl.Texture:
    """A depth texture of one of DEPTH_FORMATS.

    moderngl makes 24 bits only, so the storage is specified anew (OpenGL 4.6 specification, section 8.5).
    """
    made = context.depth_texture(size)
    made.use(0)
    types = [ctypes.c_uint, *[ctypes.c_int] * 5, ctypes.c_uint, ctypes.c_uint, ctypes.c_void_p]
    address = context.mglo._context.load_opengl_function("glTexImage2D")
    specify = ctypes.CFUNCTYPE(None, *types)(address)
    specify(_TEXTURE_2D, 0, _INTERNAL_FORMATS[depth_format], *size, 0, _DEPTH_COMPONENT, _FLOAT, None)
    made.repeat_x = made.repeat_y = False
    return made


@contextmanager
def faces_apart(context: moderngl.Context, unit: int) -> Iterator[None]:
    """The cube map of a texture unit is filtered face by face, as the hardware of 2005 did.

    Beyond the outermost texel of a face there is that texel. OpenGL's default is the one at the opposite edge, which
    NVIDIA's driver obeys and Mesa's llvmpipe does not.
    """
    sampler = context.sampler(repeat_x=False, repeat_y=False, filter=(context.LINEAR, context.LINEAR))
    sampler.use(unit)
    context.disable_direct(_SEAMLESS_CUBE_MAPS)
    try:
        yield
    finally:
        context.enable_direct(_SEAMLESS_CUBE_MAPS)
        sampler.clear(unit)


def receivers_pass() -> Pass:
    """Write `position` (w: hit) and `face_normal`, that of the triangle itself, of every sample."""
    return Pass("receivers", _draw_receivers, writes=("position", "face_normal"))


def _draw_receivers(frame: Frame) -> None:
    context, size = frame.context, frame.size
    targets = [frame.texture(size, 4) for _ in range(2)]
    framebuffer = context.framebuffer(targets, context.depth_renderbuffer(size))
    framebuffer.use()
    frame.submit(framebuffer.clear)
    context.enable_only(context.DEPTH_TEST)
    names = ("raster/mesh.vert", "shadow_vcm/face.geom", "shadow_vcm/receivers.frag")
    frame.draw(frame.program(*names), frame.camera)
    frame.resources |= dict(zip(("position", "face_normal"), targets, strict=True))


def vcm_pass(side: int, margin: int, far_over_near: float, depth_format: str, linear: bool) -> Pass:
    """Write `virtual_cube_map`, with the depths of everything but the light itself.

    Depths are hyperbolic, as the projection leaves them, or `linear`: the distance along the tile's axis over `far`.
    """
    return Pass(
        "virtual cube map",
        lambda frame: _draw_tiles(frame, side, margin, far_over_near, depth_format, linear),
        writes=("virtual_cube_map",),
    )


def _draw_tiles(frame: Frame, side: int, margin: int, far_over_near: float, depth_format: str, linear: bool) -> None:
    context = frame.context
    largest = int(context.info["GL_MAX_TEXTURE_SIZE"])
    if COLUMNS * side > largest:
        raise InputError(
            f"Found side = {side}; tiles of that size need a texture {COLUMNS * side} texels wide, and this GPU allows "
            f"{largest}. Set side to {largest // COLUMNS} or less."
        )
    index, place = the_omni_light(frame.scene)
    boxes = {mesh.name: box_corners(mesh) for mesh in frame.meshes if mesh.name != f"emitter-{index}"}
    near, far = clip_planes(frame.meshes, place, far_over_near)
    texture = depth_texture(context, (COLUMNS * side, ROWS * side), depth_format)
    framebuffer = context.framebuffer([], texture)
    framebuffer.use()
    frame.submit(framebuffer.clear, depth=1.0)
    context.enable_only(context.DEPTH_TEST)
    shader = frame.program("raster/mesh.vert", "shadow_vcm/depth.frag", **({"LINEAR": 1} if linear else {}))
    set_uniforms(shader, far=far)
    drawn = 0
    for face, camera in enumerate(tile_cameras(place, side, margin, near, far)):
        framebuffer.viewport = (*tile_corner(face, side), side, side)
        seen = {name for name, corners in boxes.items() if not is_outside(camera, corners)}
        frame.draw(shader, camera, lambda mesh, seen=seen: mesh.name in seen)  # type: ignore[misc]
        drawn += len(seen)
    total = 6 * len(boxes)
    if drawn < total:
        why = "their boxes lie outside the tile's frustum"
        frame.skipped.append(Skip(f"{total - drawn} of {total} draws into the tiles", why))
    frame.resources["virtual_cube_map"] = VirtualCubeMap(texture, side, margin, place, near, far)
