import json
import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from scenes import procedural
from scenes.errors import SceneError
from scenes.image import Float64
from scenes.mesh import Surface
from scenes.mesh_files import load_mesh
from scenes.topology import Integers, face_vectors, is_watertight, signed_volume, surface_area

SUFFIXES = (".ply", ".obj", ".stl", ".glb")
TETRAHEDRON = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], dtype=np.float64)
TETRAHEDRON_FACES = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])


def export(path: Path, positions: Float64, faces: Integers, uvs: Float64 | None = None) -> Path:
    import trimesh

    visuals: Any = trimesh.visual
    visual = None if uvs is None else visuals.TextureVisuals(uv=uvs)
    trimesh.Trimesh(positions, faces, visual=visual, process=False).export(path)
    return path


def tetrahedron_obj(path: Path, *, positions: Float64 = TETRAHEDRON, faces: Integers = TETRAHEDRON_FACES) -> Path:
    """An OBJ file as it is, which no exporter would write: for damaged ones."""
    lines = [f"v {x} {y} {z}" for x, y, z in positions] + [f"f {a} {b} {c}" for a, b, c in faces + 1]
    path.write_text("\n".join(lines) + "\n", encoding="ascii")
    return path


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_every_format_gives_the_same_closed_smooth_surface(tmp_path: Path, suffix: str) -> None:
    made = procedural.ellipsoid((1.0, 0.5, 0.7), 3)
    loaded = load_mesh(
        export(tmp_path / f"mesh{suffix}", made.positions.astype(np.float64), made.faces), "smooth", True
    )
    assert len(loaded.positions) == len(made.positions)
    assert is_watertight(loaded)
    assert signed_volume(loaded) == pytest.approx(signed_volume(made), rel=1e-5)
    nearest = np.linalg.norm(loaded.positions[:, None] - made.positions[None], axis=2).argmin(axis=1)
    np.testing.assert_allclose(loaded.positions, made.positions[nearest], atol=1e-6)
    np.testing.assert_allclose(loaded.normals, made.normals[nearest], atol=0.02)
    np.testing.assert_array_equal(loaded.uvs, 0)


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_flat_shading_gives_each_face_its_own_normal(tmp_path: Path, suffix: str) -> None:
    made = procedural.sphere(1.0, 1)
    path = export(tmp_path / f"mesh{suffix}", made.positions.astype(np.float64), made.faces)
    loaded = load_mesh(path, "flat", True)
    assert len(loaded.positions) == 3 * len(made.faces)
    face_normals = procedural.normalised(face_vectors(loaded.positions, loaded.faces))
    np.testing.assert_allclose(loaded.normals[loaded.faces], np.repeat(face_normals[:, None], 3, axis=1), atol=1e-5)


def test_smooth_normals_of_a_cube_ignore_how_its_faces_are_split(tmp_path: Path) -> None:
    """Angle weights: the faces' diagonals end at some corners and not at others, yet all normals are diagonal."""
    box = procedural.box((2.0, 2.0, 2.0))
    loaded = load_mesh(export(tmp_path / "box.ply", box.positions.astype(np.float64), box.faces), "smooth", True)
    assert len(loaded.positions) == 8
    np.testing.assert_allclose(loaded.normals, loaded.positions / np.sqrt(3), atol=1e-6)


@pytest.mark.parametrize("suffix", [".ply", ".obj", ".glb"])
def test_texture_coordinates_are_kept_and_normals_cross_their_seams(tmp_path: Path, suffix: str) -> None:
    box = procedural.box((2.0, 2.0, 2.0))
    path = export(tmp_path / f"box{suffix}", box.positions.astype(np.float64), box.faces, box.uvs.astype(np.float64))
    loaded = load_mesh(path, "smooth", True)
    np.testing.assert_allclose(loaded.normals, loaded.positions / np.sqrt(3), atol=1e-6)
    assert corners_with_uvs(loaded) == corners_with_uvs(box)
    assert is_watertight(loaded)


def corners_with_uvs(surface: Surface) -> list[tuple[float, ...]]:
    rows = np.concatenate([surface.positions, surface.uvs], axis=1)[surface.faces.reshape(-1)]
    return sorted(map(tuple, rows.round(5).tolist()))


def test_the_nodes_of_a_glb_are_placed_and_mirrored_ones_keep_their_outside(tmp_path: Path) -> None:
    import trimesh

    box = procedural.box((1.0, 1.0, 1.0))
    scene: Any = trimesh.Scene()
    mesh = trimesh.Trimesh(box.positions, box.faces, process=False)
    scene.add_geometry(mesh, transform=np.diag([2.0, 1.0, 1.0, 1.0]))
    mirrored = np.diag([-1.0, 1.0, 1.0, 1.0])
    mirrored[0, 3] = 5.0
    scene.add_geometry(mesh, transform=mirrored)
    scene.export(tmp_path / "two.glb")
    loaded = load_mesh(tmp_path / "two.glb", "flat", True)
    assert signed_volume(loaded) == pytest.approx(3)
    np.testing.assert_allclose([loaded.positions[:, 0].min(), loaded.positions[:, 0].max()], [-1, 5.5])


def test_collapsed_faces_are_left_out(tmp_path: Path) -> None:
    faces = np.concatenate([TETRAHEDRON_FACES, [[0, 0, 1], [2, 3, 2]]])
    loaded = load_mesh(tetrahedron_obj(tmp_path / "mesh.obj", faces=faces), "smooth", True)
    assert len(loaded.faces) == 4
    assert surface_area(loaded) == pytest.approx(1.5 + np.sqrt(3) / 2)


def test_an_open_mesh_is_fine_unless_it_must_be_closed(tmp_path: Path) -> None:
    path = tetrahedron_obj(tmp_path / "open.obj", faces=TETRAHEDRON_FACES[1:])
    assert len(load_mesh(path, "smooth", False).faces) == 3
    with pytest.raises(SceneError, match="3 open edges and 0 edges between"):
        load_mesh(path, "smooth", True)


def test_a_solid_with_a_flipped_face_is_not_closed(tmp_path: Path) -> None:
    faces = TETRAHEDRON_FACES.copy()
    faces[0] = faces[0, ::-1]
    with pytest.raises(SceneError, match="0 open edges and 3 edges between"):
        load_mesh(tetrahedron_obj(tmp_path / "flipped.obj", faces=faces), "smooth", True)


def test_a_solid_inside_out_is_refused(tmp_path: Path) -> None:
    path = tetrahedron_obj(tmp_path / "inside_out.obj", faces=TETRAHEDRON_FACES[:, ::-1])
    with pytest.raises(SceneError, match="look inward"):
        load_mesh(path, "smooth", True)
    assert signed_volume(load_mesh(path, "smooth", False)) < 0


def test_a_missing_file_is_refused(tmp_path: Path) -> None:
    with pytest.raises(SceneError, match="no such mesh file"):
        load_mesh(tmp_path / "none.ply", "smooth", False)


def test_an_unsupported_format_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "mesh.fbx"
    path.write_bytes(b"x")
    with pytest.raises(SceneError, match=r"'\.fbx'; allowed are \.ply, \.obj, \.stl, \.glb"):
        load_mesh(path, "smooth", False)


@pytest.mark.parametrize("suffix", SUFFIXES)
@pytest.mark.parametrize("content", [b"", b"this is no mesh"])
def test_garbage_is_refused(tmp_path: Path, suffix: str, content: bytes) -> None:
    path = tmp_path / f"mesh{suffix}"
    path.write_bytes(content)
    with pytest.raises(SceneError, match=r"cannot be read as|0 triangles"):
        load_mesh(path, "smooth", False)


def test_vertices_without_faces_are_refused(tmp_path: Path) -> None:
    path = tetrahedron_obj(tmp_path / "points.obj", faces=np.zeros((0, 3), dtype=np.int64))
    with pytest.raises(SceneError, match="0 triangles"):
        load_mesh(path, "smooth", False)


def draco_glb(path: Path) -> Path:
    """A GLB whose only primitive is compressed: its accessors have no data, as an exporter with Draco writes them."""
    document = {
        "asset": {"version": "2.0"},
        "extensionsUsed": ["KHR_draco_mesh_compression"],
        "extensionsRequired": ["KHR_draco_mesh_compression"],
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [
            {
                "primitives": [
                    {
                        "attributes": {"POSITION": 0},
                        "indices": 1,
                        "extensions": {"KHR_draco_mesh_compression": {"bufferView": 0, "attributes": {"POSITION": 0}}},
                    }
                ]
            }
        ],
        "accessors": [
            {"componentType": 5126, "count": 3, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 1]},
            {"componentType": 5125, "count": 3, "type": "SCALAR"},
        ],
        "bufferViews": [{"buffer": 0, "byteLength": 4}],
        "buffers": [{"byteLength": 4}],
    }
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", 4, b"BIN\0") + b"DRAC"
    path.write_bytes(struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks)
    return path


def test_a_draco_compressed_glb_is_refused_with_its_reason(tmp_path: Path) -> None:
    with pytest.raises(SceneError, match="Draco"):
        load_mesh(draco_glb(tmp_path / "draco.glb"), "smooth", False)


@pytest.mark.parametrize("value", [np.nan, np.inf, 1e300])
def test_numbers_that_are_not_finite_in_single_precision_are_refused(tmp_path: Path, value: float) -> None:
    positions = TETRAHEDRON.copy()
    positions[2, 1] = value
    with pytest.raises(SceneError, match="1 of 4 vertices hold NaN or infinity, the first is vertex"):
        load_mesh(tetrahedron_obj(tmp_path / "mesh.obj", positions=positions), "smooth", False)


def test_a_mesh_without_area_is_refused(tmp_path: Path) -> None:
    line = np.array([[0, 0, 0], [1, 0, 0], [2, 0, 0]], dtype=np.float64)
    path = tetrahedron_obj(tmp_path / "line.obj", positions=line, faces=np.array([[0, 1, 2], [0, 1, 1]]))
    with pytest.raises(SceneError, match="nothing is left"):
        load_mesh(path, "smooth", False)


def test_faces_back_to_back_have_no_smooth_normal(tmp_path: Path) -> None:
    faces = np.array([[0, 1, 2], [2, 1, 0]])
    path = tetrahedron_obj(tmp_path / "leaf.obj", positions=TETRAHEDRON[:3], faces=faces)
    with pytest.raises(SceneError, match="back to back"):
        load_mesh(path, "smooth", False)
    assert len(load_mesh(path, "flat", False).faces) == 2


def test_a_face_beyond_the_last_vertex_is_refused(tmp_path: Path) -> None:
    header = (
        "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
        "element face 1\nproperty list uchar int vertex_indices\nend_header\n"
    )
    path = tmp_path / "mesh.ply"
    path.write_text(header + "0 0 0\n1 0 0\n0 1 0\n3 0 1 7\n", encoding="ascii")
    with pytest.raises(SceneError, match=r"vertex 7, but the last one is 2|cannot be read"):
        load_mesh(path, "smooth", False)
