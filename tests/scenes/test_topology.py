from dataclasses import replace

import numpy as np

from scenes import procedural
from scenes.geometry import is_convex
from scenes.mesh import Surface
from scenes.topology import EdgeFaults, edge_faults, is_watertight, signed_volume, surface_area, weld


def faults(surface: Surface) -> EdgeFaults:
    return edge_faults(weld(surface.positions)[surface.faces])


def test_places_ignore_the_sign_of_zero() -> None:
    places = weld(np.array([[0.0, 1, 2], [-0.0, 1, 2], [0, 1, 3]], dtype=np.float32))
    assert places[0] == places[1] != places[2]


def test_a_missing_face_leaves_three_open_edges() -> None:
    sphere = procedural.sphere(1.0, 2)
    assert faults(replace(sphere, faces=sphere.faces[1:])) == EdgeFaults(open=3, flipped=0)


def test_a_flipped_face_disagrees_with_its_three_neighbours() -> None:
    sphere = procedural.sphere(1.0, 2)
    faces = sphere.faces.copy()
    faces[0] = faces[0, ::-1]
    assert faults(replace(sphere, faces=faces)) == EdgeFaults(open=0, flipped=3)


def test_a_sheet_is_open_along_its_rim() -> None:
    assert faults(procedural.rectangle((1.0, 2.0))) == EdgeFaults(open=4, flipped=0)
    assert not is_watertight(procedural.disk(1.0))


def test_two_solids_that_touch_along_an_edge_are_closed() -> None:
    box = procedural.box((1.0, 1.0, 1.0))
    beside = box.positions + np.array([1, 1, 0], dtype=np.float32)
    both = procedural.make_surface(
        np.concatenate([box.positions, beside]),
        np.concatenate([box.normals, box.normals]),
        np.concatenate([box.uvs, box.uvs]),
        np.concatenate([box.faces, box.faces + 24]),
    )
    assert is_watertight(both)
    assert signed_volume(both) == 2
    assert surface_area(both) == 12
    assert not is_convex(both)


def test_volume_changes_its_sign_with_the_winding_and_not_with_the_place() -> None:
    box = procedural.box((1.0, 2.0, 3.0))
    far = replace(box, positions=box.positions + np.float32(1024))
    assert signed_volume(far) == 6
    assert signed_volume(replace(box, faces=box.faces[:, ::-1])) == -6


def test_convex_solids() -> None:
    assert is_convex(procedural.sphere(1.0, 3))
    assert is_convex(procedural.ellipsoid((1.0, 3.0, 0.2), 4))
    assert is_convex(procedural.box((1.0, 2.0, 3.0)))


def test_what_is_not_a_convex_solid() -> None:
    box = procedural.box((1.0, 2.0, 3.0))
    assert not is_convex(procedural.torus_knot(2, 3, 1.0, 0.2, 64, 8))
    assert not is_convex(procedural.displaced_icosphere(1.0, 0.2, 8.0, 0, 4))
    assert not is_convex(procedural.rectangle((1.0, 1.0)))
    assert not is_convex(replace(box, faces=box.faces[2:]))
    assert not is_convex(replace(box, faces=box.faces[:, ::-1]))
