"""A scene with all its files, as one piece of data that can travel to another machine."""

import hashlib
import json
import uuid
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from scenes.digest import digest_of, file_content, with_files_by_content
from scenes.model import Scene


@dataclass(frozen=True)
class Parcel:
    """`text` is the scene as JSON, whose files are named by their content; `files` are their bytes, by that name."""

    text: str
    files: Mapping[str, bytes] = field(compare=False, repr=False)

    @property
    def key(self) -> str:
        """SHA-256 of all of it, 64 hexadecimal digits."""
        return digest_of(self.text)


def packed(scene: Scene) -> Parcel:
    """What draws a scene and what its truth depends on. Its checks stay behind.

    Raises
    ------
    SceneError
        A file that the scene points at cannot be read.
    """
    files: dict[str, bytes] = {}

    def digest(path: str) -> str:
        content = file_content(scene.folder / path)
        found = hashlib.sha256(content).hexdigest()
        files[f"{found}{Path(path).suffix.lower()}"] = content
        return found

    parts = with_files_by_content(scene.model_dump(mode="json", exclude={"checks", "folder"}), digest)
    return Parcel(json.dumps(parts, sort_keys=True), files)


def unpacked(parcel: Parcel, folder: Path) -> Scene:
    """The scene again, with its files in `folder`, which any number of processes may share."""
    folder.mkdir(parents=True, exist_ok=True)
    for name, content in parcel.files.items():
        if not (folder / name).exists():
            beside = folder / f".{name}.{uuid.uuid4().hex}.tmp"
            beside.write_bytes(content)
            beside.replace(folder / name)
    return Scene.model_validate_json(json.dumps(json.loads(parcel.text) | {"folder": str(folder)}))
