"""What the schema of a scene cannot say: names that must exist, files that must be there, things that must not repeat.

All of it looks at the document as parsed, and passes over what the schema complains about anyway, so that a user sees
every problem at once.
"""

import json
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, TypeVar, get_args

from pydantic import ValidationError

from scenes.complaints import Complaint, shown, suggestion
from scenes.eyes import eye_problem
from scenes.geometry import TEXTURE_SUFFIXES
from scenes.grooming import HAIRY
from scenes.lines import KeyPath
from scenes.materials import Material
from scenes.media import MEDIA
from scenes.mesh_files import SUFFIXES as MESH_SUFFIXES
from scenes.procedural import knot_problem
from scenes.shapes import Eye, Shape, ShapeBase, TorusKnot

Document = dict[str, Any]
Row = tuple[KeyPath, dict[str, Any]]

ENVIRONMENT_SUFFIXES = (".exr",)
RESERVED_NAME = "emitter-"


def cross_check(document: Document, folder: Path) -> list[Complaint]:
    """Every problem between the parts of a document, or between it and the files in its folder."""
    rules: list[Callable[[Document], Iterator[Complaint]]] = [
        _material_names,
        _media,
        _open_bodies,
        _eyes,
        _shape_names,
        _subject,
        _area_lights,
        _hair,
        _fibres,
        _knots,
        _repeated_checks,
    ]
    return [complaint for rule in rules for complaint in rule(document)] + list(_files(document, folder))


def _rows(document: Document, key: str, kind: str | None = None) -> list[Row]:
    """The tables in an array of tables or in a table of tables, those of one type if `kind` is given."""
    value = document.get(key)
    items: list[tuple[Any, Any]] = (
        list(enumerate(value)) if isinstance(value, list) else list(value.items()) if isinstance(value, dict) else []
    )
    tables = [((key, place), table) for place, table in items if isinstance(table, dict)]
    return [row for row in tables if kind is None or row[1].get("type") == kind]


def _texts(rows: list[Row], key: str) -> Iterator[tuple[KeyPath, str]]:
    for path, table in rows:
        if isinstance(table.get(key), str):
            yield (*path, key), table[key]


def _tags(union: Any) -> tuple[str, ...]:
    """The types that tell the tables of a discriminated union apart."""
    tables = get_args(get_args(union)[0])
    return tuple(tag for table in tables for tag in get_args(table.model_fields["type"].annotation))


MATERIAL_TYPES, SHAPE_TYPES = _tags(Material), _tags(Shape)


def _material_types(document: Document) -> dict[str, str]:
    """The types of materials by name, without those of no known type: the schema has complaints about these."""
    materials = _texts(_rows(document, "materials"), "type")
    return {str(path[-2]): kind for path, kind in materials if kind in MATERIAL_TYPES}


def _shape_types(document: Document) -> dict[str, str]:
    """As `_material_types`, for shapes."""
    shapes = [table for _, table in _rows(document, "shapes") if isinstance(table.get("name"), str)]
    return {table["name"]: table["type"] for table in shapes if table.get("type") in SHAPE_TYPES}


def _shape_list(document: Document) -> list[str]:
    return list(dict.fromkeys(name for _, name in _texts(_rows(document, "shapes"), "name")))


def _material_list(document: Document) -> list[str]:
    return [str(path[-1]) for path, _ in _rows(document, "materials")]


def _unknown(path: KeyPath, kind: str, name: str, known: list[str]) -> Complaint:
    return Complaint(
        path,
        f'the unknown {kind} "{name}"' + suggestion(name, known),
        ", ".join(known) or f"none, as no {kind} is defined",
    )


def _repeated(names: Iterator[tuple[KeyPath, str]], what: str) -> Iterator[Complaint]:
    seen: set[str] = set()
    for path, name in names:
        if name in seen:
            yield Complaint(path, f'{what} "{name}" a second time', "each only once")
        seen.add(name)


def _wall_materials(document: Document) -> Iterator[tuple[KeyPath, str]]:
    for path, table in _rows(document, "shapes"):
        walls = table.get("walls")
        if isinstance(walls, dict):
            yield from (use for wall in walls for use in _texts([((*path, "walls"), walls)], wall))


def _material_names(document: Document) -> Iterator[Complaint]:
    known = _material_list(document)
    shapes = _rows(document, "shapes")
    named = [*_texts(shapes, "material"), *_texts(_rows(document, "shapes", "eye"), "iris")]
    used = [*named, *_wall_materials(document)]
    yield from (_unknown(path, "material", name, known) for path, name in used if name not in known)


def _media(document: Document) -> Iterator[Complaint]:
    media = _texts(_rows(document, "materials", "translucent"), "medium")
    yield from (_unknown(path, "medium", name, list(MEDIA)) for path, name in media if name not in MEDIA)


def _open_bodies(document: Document) -> Iterator[Complaint]:
    """Translucent rooms, rectangles and reliefs. A mesh file may be open: its faces are counted where it is seen."""
    open_shapes = [row for kind in ("rectangle", "room", "relief") for row in _rows(document, "shapes", kind)]
    translucent = _translucent_materials(document)
    for path, name in [*_texts(open_shapes, "material"), *_wall_materials(document)]:
        if name in translucent:
            yield Complaint(
                path, f'the translucent material "{name}" on what is not closed', "a diffuse one, or a closed shape"
            )


def _eyes(document: Document) -> Iterator[Complaint]:
    eyes = _rows(document, "shapes", "eye")
    kinds = _material_types(document)
    for key in ("material", "iris"):
        for path, name in _texts(eyes, key):
            if kinds.get(name, "diffuse") != "diffuse":
                found = f'the {kinds[name]} material "{name}"'
                yield Complaint(path, found, "a diffuse one, as parts of an eye have")
    for path, table in eyes:
        eye = _valid(Eye, table)
        problem = eye_problem(eye) if eye is not None else None
        if problem is not None:
            yield Complaint(path, *problem)


def _translucent_materials(document: Document) -> set[str]:
    return {str(path[-1]) for path, _ in _rows(document, "materials", "translucent")}


def _shapes_that_cannot_shine(document: Document) -> dict[str, str]:
    """Names of shapes that are eyes or not diffuse, and why each of them cannot be a lamp."""
    kinds = _material_types(document)
    reasons = {name: "which is an eye" for _, name in _texts(_rows(document, "shapes", "eye"), "name")}
    for path, table in _rows(document, "shapes"):
        used = [*_texts([(path, table)], "material"), *_wall_materials({"shapes": [table]})]
        others = sorted({kinds.get(name, "diffuse") for _, name in used} - {"diffuse"})
        if others:
            reasons |= {name: f"whose material is {others[0]}" for _, name in _texts([(path, table)], "name")}
    return reasons


ShapeType = TypeVar("ShapeType", bound=ShapeBase)


def _valid(kind: type[ShapeType], table: dict[str, Any]) -> ShapeType | None:
    """A shape, or None if the schema has complaints about it, which say why."""
    try:
        return kind.model_validate_json(json.dumps(table, default=str))
    except ValidationError:
        return None


def _shape_names(document: Document) -> Iterator[Complaint]:
    names = list(_texts(_rows(document, "shapes"), "name"))
    yield from _repeated(iter(names), "the name")
    for path, name in names:
        if name.startswith(RESERVED_NAME):
            yield Complaint(
                path,
                f'the name "{name}"',
                f'names that do not begin with "{RESERVED_NAME}", as disk and line lights do',
            )


def _subject(document: Document) -> Iterator[Complaint]:
    subject = document.get("subject")
    if not isinstance(subject, list):
        return
    known = _shape_list(document)
    named = [(("subject", i), name) for i, name in enumerate(subject) if isinstance(name, str)]
    yield from (_unknown(path, "shape", name, known) for path, name in named if name not in known)
    yield from _repeated(iter(named), "the shape")


def _area_lights(document: Document) -> Iterator[Complaint]:
    known = _shape_list(document)
    unfit = _shapes_that_cannot_shine(document)
    lit = list(_texts(_rows(document, "emitters", "area"), "shape"))
    for path, name in lit:
        if name not in known:
            yield _unknown(path, "shape", name, known)
        elif name in unfit:
            found = f'an area light on "{name}", {unfit[name]}'
            yield Complaint(path, found, "shapes of diffuse material that are no eyes")
    yield from _repeated(iter(lit), "an area light on")


def _hair(document: Document) -> Iterator[Complaint]:
    """Hair grows on a shape that has a chart, of a fibre, from a region that has an area."""
    hair = _rows(document, "hair")
    shapes, shape_types = _shape_list(document), _shape_types(document)
    materials, material_types = _material_list(document), _material_types(document)
    yield from _repeated(_texts(hair, "name"), "the hair")
    for path, name in _texts(hair, "on"):
        if name not in shapes:
            yield _unknown(path, "shape", name, shapes)
        elif (kind := shape_types.get(name, HAIRY[0])) not in HAIRY:
            yield Complaint(path, f'"{name}", a shape of the type "{kind}"', f"shapes of {', '.join(HAIRY)}")
    for path, name in _texts(hair, "material"):
        if name not in materials:
            yield _unknown(path, "material", name, materials)
        elif (kind := material_types.get(name, "fibre")) != "fibre":
            yield Complaint(path, f'the {kind} material "{name}"', "a fibre, which is what hair is made of")
    for path, table in hair:
        region = table.get("region")
        if isinstance(region, list) and len(region) == 4 and (region[0] == region[2] or region[1] == region[3]):
            yield Complaint((*path, "region"), f"the region {shown(region)} without an area", "two opposite corners")


def _fibres(document: Document) -> Iterator[Complaint]:
    fibres = {str(path[-1]) for path, _ in _rows(document, "materials", "fibre")}
    shapes = [row for row in _rows(document, "shapes") if row[1].get("type") != "eye"]
    for path, name in [*_texts(shapes, "material"), *_wall_materials(document)]:
        if name in fibres:
            yield Complaint(path, f'the fibre "{name}" on a shape', "any other material: fibres are for hair")


def _knots(document: Document) -> Iterator[Complaint]:
    for path, table in _rows(document, "shapes", "torus_knot"):
        knot = _valid(TorusKnot, table)
        problem = knot_problem(knot.p, knot.q, knot.radius, knot.tube) if knot is not None else None
        if problem is not None:
            yield Complaint(path, *problem)


def _repeated_checks(document: Document) -> Iterator[Complaint]:
    first: dict[str, KeyPath] = {}
    for path, table in _rows(document, "checks"):
        what = [
            table.get("quantity"),
            table.get("technique"),
            table.get("settings", {}),
            table.get("fit_exposure", False),
        ]
        key = json.dumps(what, sort_keys=True, default=str)
        if key in first:
            earlier = f"checks[{first[key][1]}]"
            yield Complaint(
                path,
                f"the quantity, technique, settings and fit_exposure of {earlier}",
                "checks that differ in one of them; put all criteria into one check",
            )
        first.setdefault(key, path)


def _files(document: Document, folder: Path) -> Iterator[Complaint]:
    materials = _rows(document, "materials")
    textures = [
        ((*path, "reflectance"), table["reflectance"])
        for path, table in materials
        if isinstance(table.get("reflectance"), dict)
    ]
    textures += [
        ((*path, "texture"), table["texture"])
        for path, table in _rows(document, "emitters", "area")
        if isinstance(table.get("texture"), dict)
    ]
    fields = [
        ((*path, "heights"), table["heights"])
        for path, table in _rows(document, "shapes", "relief")
        if isinstance(table.get("heights"), dict)
    ]
    shares = [
        ((*path, "weight"), table["weight"])
        for path, table in _metals(materials)
        if isinstance(table.get("weight"), dict)
    ]
    shares += [
        ((*path, key), table[key])
        for path, table in _rows(document, "hair")
        for key in ("density", "kill", "length_map")
        if isinstance(table.get(key), dict)
    ]
    textures += [
        ((*path, "color"), table["color"])
        for path, table in _rows(document, "hair")
        if isinstance(table.get("color"), dict)
    ]
    for path, texture in shares:
        if texture.get("color_space", "srgb") == "srgb":
            yield Complaint((*path, "color_space"), '"srgb" for parts and factors', '"linear", as they are no colours')
    for path, texture in fields:
        if texture.get("color_space", "srgb") == "srgb":
            yield Complaint((*path, "color_space"), '"srgb" for heights', '"linear", as heights are no colours')
    for path, texture in textures:
        file = texture.get("path")
        if isinstance(file, str) and file.lower().endswith(".exr") and texture.get("color_space", "srgb") == "srgb":
            yield Complaint(
                (*path, "color_space"),
                f'"srgb" for the EXR {shown(file)}',
                '"linear", as an EXR holds linear values',
            )
    kinds = [
        ([*textures, *fields, *shares], TEXTURE_SUFFIXES),
        (_rows(document, "shapes", "mesh"), MESH_SUFFIXES),
        (_rows(document, "emitters", "environment"), ENVIRONMENT_SUFFIXES),
    ]
    for rows, suffixes in kinds:
        for path, file in _texts(rows, "path"):
            yield from _file(path, file, folder, suffixes)


def _metals(materials: list[Row]) -> Iterator[Row]:
    for path, table in materials:
        metals = table.get("metals")
        for i, metal in enumerate(metals if isinstance(metals, list) else []):
            if isinstance(metal, dict):
                yield (*path, "metals", i), metal


def _file(path: KeyPath, file: str, folder: Path, suffixes: tuple[str, ...]) -> Iterator[Complaint]:
    if Path(file).is_absolute():
        yield Complaint(path, f"the absolute path {shown(file)}", "paths relative to the scene's folder")
    elif Path(file).suffix.lower() not in suffixes:
        yield Complaint(path, f"the file {shown(file)}", f"files that end in {', '.join(suffixes)}")
    elif not (folder / file).is_file():
        yield Complaint(
            path, f"the path {shown(file)}, where there is no file", f"files that exist, relative to {folder}"
        )
