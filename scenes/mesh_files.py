"""Triangle meshes from files: PLY, OBJ, STL and GLB."""

from pathlib import Path
from typing import Literal, NamedTuple

import numpy as np

from scenes.errors import SceneError
from scenes.image import Float64
from scenes.mesh import Surface
from scenes.procedural import make_surface, normalised
from scenes.topology import Integers, angle_weighted_normals, edge_faults, face_vectors, signed_volume, weld

SUFFIXES = (".ply", ".obj", ".stl", ".glb")
DRACO_HINT = "A GLB with Draco compression gives this too: export it without compression."


class Soup(NamedTuple):
    """Triangles as a file gives them: positions (V, 3), uvs (V, 2), faces (F, 3)."""

    positions: Float64
    uvs: Float64
    faces: Integers


def load_mesh(path: Path, shading: Literal["smooth", "flat"], closed: bool) -> Surface:
    """The triangles of a file, with normals of our own, so that both renderers shade the same surface.

    Vertices at the same place count as one, whatever the file says. `smooth` gives each place the mean of its faces'
    normals, weighted by each face's angle there (Thürmer and Wüthrich 1998, "Computing vertex normals from polygonal
    facets"); `flat` gives each face vertices of its own. Texture coordinates are kept; without any they are zero.

    Raises
    ------
    SceneError
        The file is missing, of another format, empty, not finite or without area; or, though `closed` demands a solid,
        it has a hole or is inside out.
    """
    soup = _read(path)
    _require_usable(path, soup)
    places = weld(soup.positions.astype(np.float32))
    corners = places[soup.faces]
    collapsed = (corners == np.roll(corners, 1, axis=1)).any(axis=1)
    soup = soup._replace(faces=soup.faces[~collapsed])
    if closed:
        _require_solid(path, soup, places)
    visible = np.linalg.norm(face_vectors(soup.positions, soup.faces), axis=1) > 0
    if not visible.any():
        raise SceneError(
            f"{path}: every face is degenerate, so that nothing is left of the mesh; allowed are faces that have an "
            f"area. {DRACO_HINT}"
        )
    soup = soup._replace(faces=soup.faces[visible])
    return _flat(soup) if shading == "flat" else _smooth(path, soup, places)


def _read(path: Path) -> Soup:
    if path.suffix.lower() not in SUFFIXES:
        raise SceneError(
            f"{path}: found a mesh file that ends in {path.suffix or 'nothing'!r}; allowed are {', '.join(SUFFIXES)}. "
            "Convert it to one of these."
        )
    if not path.is_file():
        raise SceneError(
            f"{path}: there is no such mesh file; paths are relative to the scene's folder. Correct the path."
        )
    import trimesh

    try:
        scene = trimesh.load_scene(path, process=False)
        placed = [(scene.graph[node][0], scene.geometry[scene.graph[node][1]]) for node in scene.graph.nodes_geometry]
        parts = [_part(np.asarray(to_world), mesh) for to_world, mesh in placed if isinstance(mesh, trimesh.Trimesh)]
    except Exception as error:  # the parsers raise whatever the damage makes them stumble over
        raise SceneError(
            f"{path}: cannot be read as a {path.suffix[1:].upper()} file ({type(error).__name__}: {error}). "
            "The file may be damaged or of another format than its name says; export it again."
        ) from error
    return _joined(parts)


def _part(to_world: Float64, mesh: "trimesh.Trimesh") -> Soup:  # type: ignore[name-defined]  # noqa: F821
    """One mesh of a file in the file's coordinates, wound so that a mirroring transform keeps the outside outside."""
    with np.errstate(invalid="ignore", over="ignore"):  # what is not finite is refused later, with a count
        positions = np.asarray(mesh.vertices, dtype=np.float64) @ to_world[:3, :3].T + to_world[:3, 3]
    faces = np.asarray(mesh.faces, dtype=np.int64)
    stored = getattr(mesh.visual, "uv", None)
    uvs = np.zeros((len(positions), 2)) if stored is None else np.asarray(stored, dtype=np.float64)[:, :2]
    mirrored = np.linalg.det(to_world[:3, :3]) < 0
    return Soup(positions, uvs, faces[:, ::-1] if mirrored else faces)


def _joined(parts: list[Soup]) -> Soup:
    if not parts:
        return Soup(np.zeros((0, 3)), np.zeros((0, 2)), np.zeros((0, 3), dtype=np.int64))
    starts = np.cumsum([0] + [len(part.positions) for part in parts[:-1]])
    return Soup(
        np.concatenate([part.positions for part in parts]),
        np.concatenate([part.uvs for part in parts]),
        np.concatenate([start + part.faces for start, part in zip(starts, parts, strict=True)]),
    )


def _require_usable(path: Path, soup: Soup) -> None:
    if len(soup.positions) == 0 or len(soup.faces) == 0:
        raise SceneError(
            f"{path}: found {len(soup.positions)} vertices and {len(soup.faces)} triangles; at least one triangle is "
            f"needed. {DRACO_HINT}"
        )
    if soup.faces.min() < 0 or soup.faces.max() >= len(soup.positions):
        raise SceneError(
            f"{path}: a face refers to vertex {soup.faces.max()}, but the last one is {len(soup.positions) - 1}. "
            "The file is damaged; export it again."
        )
    with np.errstate(over="ignore"):  # a number beyond float32 becomes the infinity that is looked for
        numbers = np.column_stack([soup.positions, soup.uvs]).astype(np.float32)
    broken = np.flatnonzero(~np.isfinite(numbers).all(axis=1))
    if len(broken) > 0:
        raise SceneError(
            f"{path}: {len(broken)} of {len(soup.positions)} vertices hold NaN or infinity, the first is vertex "
            f"{broken[0]}; allowed are finite numbers. Repair the mesh in the program that made it."
        )


def _require_solid(path: Path, soup: Soup, places: Integers) -> None:
    faults = edge_faults(places[soup.faces])
    if faults.open or faults.flipped:
        raise SceneError(
            f"{path}: found {faults.open} open edges and {faults.flipped} edges between faces wound against each "
            "other; closed = true allows neither. Close the mesh, or say closed = false."
        )
    if signed_volume(make_surface(soup.positions, np.zeros_like(soup.positions), soup.uvs, soup.faces)) < 0:
        raise SceneError(
            f"{path}: the faces look inward; closed = true allows a solid whose faces look outward. Flip the faces, or "
            "say closed = false for something seen from inside."
        )


def _flat(soup: Soup) -> Surface:
    normals = np.repeat(normalised(face_vectors(soup.positions, soup.faces)), 3, axis=0)
    corners = soup.faces.reshape(-1)
    return make_surface(soup.positions[corners], normals, soup.uvs[corners], np.arange(len(corners)).reshape(-1, 3))


def _smooth(path: Path, soup: Soup, places: Integers) -> Surface:
    """Vertices that share a place share a normal; they stay apart only where their texture coordinates differ."""
    sums = angle_weighted_normals(soup.positions, soup.faces, places)
    used = np.unique(places[soup.faces])
    cancelled = np.linalg.norm(sums[used], axis=1) < 1e-6  # an angle sum of 1e-6 rad has no direction left in float32
    if cancelled.any():
        raise SceneError(
            f"{path}: at {cancelled.sum()} of {len(used)} vertices the faces lie back to back, so that no smooth "
            'normal exists. Say shading = "flat", or remove the doubled faces.'
        )
    keys = np.column_stack([places.astype(np.float64), soup.uvs])[soup.faces.reshape(-1)]
    unique, first, inverse = np.unique(keys, axis=0, return_index=True, return_inverse=True)
    vertices = soup.faces.reshape(-1)[first]
    normals = normalised(sums[unique[:, 0].astype(np.int64)])
    return make_surface(soup.positions[vertices], normals, soup.uvs[vertices], inverse.reshape(-1, 3))
