"""Scene files: TOML to `Scene`. Every error names the file, the line, the key, what was found and what is allowed."""

import difflib
import json
import re
from pathlib import Path

from pydantic import ValidationError

from scenes.complaints import FILLED_IN, Complaint, complaints_of, top_level_keys, unknown_key
from scenes.crosscheck import cross_check
from scenes.errors import SceneError
from scenes.inherit import Source, home_of, merged, sources
from scenes.lines import KeyPath
from scenes.model import Scene

LIBRARY = Path(__file__).parent / "library"
BARE_KEY = re.compile(r"[A-Za-z0-9_-]+")


def library_scenes() -> dict[str, Path]:
    """The shipped scenes by name, in alphabetical order."""
    return {path.stem: path for path in sorted(LIBRARY.glob("*.toml"))}


def find_scene(name_or_path: str) -> Path:
    """The file of a scene, given its name in the library or the path of a TOML file.

    Raises
    ------
    SceneError
        It is neither; the message lists the names.
    """
    path = Path(name_or_path)
    if path.suffix == ".toml" or len(path.parts) > 1:
        return path
    scenes = library_scenes()
    if name_or_path in scenes:
        return scenes[name_or_path]
    raise SceneError(
        f'found the unknown scene "{name_or_path}"; allowed is the path of a TOML file, or one of '
        f"{', '.join(scenes)}.{_close_to(name_or_path)}"
    )


def _close_to(name: str) -> str:
    """A sentence that names the library's scenes of similar names, or nothing."""
    close = difflib.get_close_matches(name, library_scenes(), n=3)
    return f" Close to it: {', '.join(close)}." if close else ""


def load_scene(path: Path) -> Scene:
    """The scene in a TOML file; its name is the file's, and paths in it are relative to the file's folder.

    It may extend another: see `scenes.inherit`.

    Raises
    ------
    SceneError
        One line a problem: `FILE:LINE: key: found X; allowed: Y`.
    """
    found = sources(path, _read)
    document = merged(found)
    written = {key: value for key, value in document.items() if key not in FILLED_IN}
    complaints = [unknown_key((key,), top_level_keys()) for key in FILLED_IN if key in document]
    complaints += cross_check(written, path.parent)
    filled = {**written, "name": path.stem, "folder": str(path.parent)}
    try:
        scene = Scene.model_validate_json(json.dumps(filled, default=_as_table))
    except ValidationError as error:
        complaints += complaints_of(error, filled)
    if complaints:
        raise SceneError(_report(found, complaints))
    return scene


def _read(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8")
    except OSError as error:
        raise SceneError(
            f"{path}: the scene cannot be read ({error.strerror}). Give the path of a TOML file, or a name from the "
            f"library.{_close_to(path.stem)}"
        ) from error
    except UnicodeDecodeError as error:
        raise SceneError(
            f"{path}: found bytes that are not UTF-8 ({error.reason}); save the scene as UTF-8."
        ) from error


def _as_table(moment: object) -> dict[str, str]:
    """JSON for a TOML date or time, which no key takes: a table is refused everywhere, a text might pass for a name."""
    return {"date": str(moment)}


def _report(found: list[Source], complaints: list[Complaint]) -> str:
    homes = [(home_of(found, complaint.path), complaint) for complaint in complaints]
    placed = [(found.index(home), home.line(complaint.path), home.path, complaint) for home, complaint in homes]
    return "\n".join(
        f"{path}:{line}: {dotted(complaint.path)}: found {complaint.found}; allowed: {complaint.allowed}"
        for _, line, path, complaint in sorted(placed, key=lambda item: item[:2])
    )


def dotted(path: KeyPath) -> str:
    """A key path as a reader would write it: shapes[0].radius."""
    parts = [f"[{part}]" if isinstance(part, int) else f".{_key(part)}" for part in path]
    return "".join(parts).removeprefix(".")


def _key(part: str) -> str:
    return part if BARE_KEY.fullmatch(part) else json.dumps(part, ensure_ascii=False)
