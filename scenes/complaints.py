"""What is wrong with a scene file, in words: each error of the schema as "found X; allowed: Y"."""

import difflib
from collections.abc import Iterable
from functools import cache
from typing import Any, NamedTuple

from pydantic import ValidationError
from pydantic_core import ErrorDetails

from scenes.inherit import EXTENDS
from scenes.lines import KeyPath
from scenes.model import Scene

Schema = dict[str, Any]

JSON_TYPES: dict[str, type | tuple[type, ...]] = {
    "array": list,
    "boolean": bool,
    "integer": int,
    "number": (int, float),
    "object": dict,
    "string": str,
}
BOUNDS = {"exclusiveMinimum": "> ", "minimum": ">= ", "exclusiveMaximum": "< ", "maximum": "<= "}
FILLED_IN = ("name", "folder")  # by the loader, from the path of the file
LONGEST_VALUE = 60


class Complaint(NamedTuple):
    """Something at a key path that is not allowed."""

    path: KeyPath
    found: str
    allowed: str


class Place(NamedTuple):
    """What pydantic's location means: the key path in the file, and the schema and the value there."""

    path: KeyPath
    schema: Schema
    value: Any
    is_another_branch: bool


def complaints_of(error: ValidationError, document: dict[str, Any]) -> list[Complaint]:
    """One complaint for each key path at which pydantic found errors in a document."""
    complaints: dict[KeyPath, Complaint] = {}
    for details in error.errors(include_url=False):
        complaint = _complaint(details, document)
        if complaint is not None:
            complaints.setdefault(complaint.path, complaint)
    return list(complaints.values())


def unknown_key(path: KeyPath, options: Iterable[str]) -> Complaint:
    """A complaint about a key that is not among the options."""
    names = list(options)
    return Complaint(path, "an unknown key" + suggestion(str(path[-1]), names), ", ".join(names))


def suggestion(name: str, options: Iterable[str]) -> str:
    """` (did you mean "…"?)` with the option that looks most like a name, or nothing when none does."""
    close = difflib.get_close_matches(name, list(options), n=1)
    return f' (did you mean "{close[0]}"?)' if close else ""


def shown(value: Any) -> str:
    """A value as TOML writes it, shortened."""
    if value is None:
        return "nothing"
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, dict):
        return "a table"
    if isinstance(value, list):
        text = f"[{', '.join(map(shown, value))}]"
    else:
        text = f'"{value}"' if isinstance(value, str) else str(value)
    return text if len(text) <= LONGEST_VALUE else f"{text[:LONGEST_VALUE]}…"


def top_level_keys() -> list[str]:
    """The keys that a scene file may have outside of any table."""
    return [EXTENDS, *(key for key in _scene_schema()["properties"] if key not in FILLED_IN)]


def _complaint(details: ErrorDetails, document: dict[str, Any]) -> Complaint | None:
    kind, location = details["type"], details["loc"]
    if location[-1] == "[key]":
        return _bad_key(_place(location[:-2], document), str(location[-2]))
    place = _place(location, document)
    path, schema, value = place[:3]
    if place.is_another_branch and kind.endswith("_type"):
        return None
    if kind == "extra_forbidden":
        return unknown_key(
            path, top_level_keys() if len(path) == 1 else _place(location[:-1], document).schema["properties"]
        )
    if kind.startswith("union_tag"):
        tags, tag = schema["discriminator"]["mapping"], value.get("type")
        return Complaint((*path, "type"), shown(tag) + suggestion(str(tag), tags), _listed(tags))
    if kind == "missing" and isinstance(path[-1], int):
        path, schema, value = _place(location[:-1], document)[:3]
    if kind == "too_short" and len(value) >= schema["minItems"]:
        return None  # pydantic counts only the elements that have no errors of their own
    if kind == "value_error":
        return Complaint(path, "values that do not go together", str(details["ctx"]["error"]))
    return Complaint(path, shown(value), _described(schema))


def _bad_key(table: Place, key: str) -> Complaint:
    names = table.schema.get("propertyNames") or {
        "type": "string",
        "pattern": next(iter(table.schema["patternProperties"])),
    }
    return Complaint((*table.path, key), f'the key "{key}"' + suggestion(key, names.get("enum", [])), _described(names))


def _place(location: tuple[str | int, ...], document: dict[str, Any]) -> Place:
    """Follow a location, in which the tags and the branches of unions stand between the keys."""
    path: KeyPath = ()
    schema, value, is_another_branch = _scene_schema(), document, False
    for part in location:
        is_another_branch = False
        branches = _branches(schema)
        if "discriminator" in schema:
            schema = _resolved({"$ref": schema["discriminator"]["mapping"][part]})
        elif len(branches) > 1:
            fitting = [branch for branch in branches if _fits(value, branch)]
            is_another_branch = len(fitting) > 0
            schema = fitting[0] if fitting and "enum" not in fitting[0] else schema  # a text may be meant for a table
        else:
            path = (*path, part)
            schema = _child(branches[0], part)
            value = _element(value, part)
    return Place(path, schema, value, is_another_branch)


@cache
def _scene_schema() -> Schema:
    return Scene.model_json_schema()


def _resolved(schema: Schema) -> Schema:
    reference = schema.get("$ref")
    return _scene_schema()["$defs"][reference.rpartition("/")[2]] if reference else schema


def _branches(schema: Schema) -> list[Schema]:
    """The schema's alternatives apart from null, which TOML cannot write; itself when it has none."""
    return [_resolved(branch) for branch in schema.get("anyOf", [schema]) if branch.get("type") != "null"]


def _child(schema: Schema, part: str | int) -> Schema:
    if isinstance(part, int):
        elements = schema.get("prefixItems", [])
        return _resolved(elements[part] if part < len(elements) else schema.get("items", {}))
    named = schema.get("properties", {}).get(part) or schema.get("additionalProperties")
    return _resolved(named or next(iter(schema.get("patternProperties", {}).values()), {}))


def _element(value: Any, part: str | int) -> Any:
    if isinstance(value, list) and isinstance(part, int):
        return value[part] if part < len(value) else None
    return value.get(part) if isinstance(value, dict) else None


def _fits(value: Any, schema: Schema) -> bool:
    is_number = schema["type"] in {"integer", "number"}
    return isinstance(value, JSON_TYPES[schema["type"]]) and not (is_number and isinstance(value, bool))


def _described(schema: Schema) -> str:
    """What a schema allows."""
    schema = _resolved(schema)
    branches = _branches(schema)
    if len(branches) > 1:
        return " or ".join(map(_described, branches))
    if "discriminator" in schema:
        return f"a table whose type is {_listed(schema['discriminator']['mapping'])}"
    schema = branches[0]
    if "enum" in schema or "const" in schema:
        return _listed(schema.get("enum", [schema.get("const")]))
    match schema["type"]:
        case "array":
            return _described_array(schema)
        case "object":
            return f"a table with {', '.join(schema['properties'])}" if "properties" in schema else "a table"
        case "string":
            return _described_text(schema)
        case "boolean":
            return "true or false"
        case number:
            limits = " and ".join(f"{sign}{schema[bound]}" for bound, sign in BOUNDS.items() if bound in schema)
            return f"{'an integer' if number == 'integer' else 'a finite number'} {limits}".rstrip()


def _described_array(schema: Schema) -> str:
    elements = schema.get("prefixItems")
    if elements:
        return f"an array of {len(elements)}, each {_described(elements[0])}"
    limits = [("at least", schema.get("minItems", 0)), ("at most", schema.get("maxItems", 0))]
    size = " and ".join(f"{which} {count}" for which, count in limits if count)
    return f"an array{f' of {size}' if size else ''}, each {_described(schema['items'])}"


def _described_text(schema: Schema) -> str:
    if "pattern" in schema:
        return "a name of letters, digits, - and _ that begins with a letter or a digit"
    least = schema.get("minLength", 0)
    return f"a text of at least {least} characters" if least else "a text"


def _listed(options: Iterable[str]) -> str:
    return ", ".join(f'"{option}"' for option in options)
