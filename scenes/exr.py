"""The only reader and writer of EXR files."""

import contextlib
import hashlib
import io
import json
import uuid
from pathlib import Path
from typing import Any

import numpy as np

from scenes.errors import CorruptImage, ImageError
from scenes.image import Float32, Image

ATTRIBUTE = "lightgauge"
VIEWABLE_CHANNELS = {1: ("Y",), 3: ("R", "G", "B"), 4: ("R", "G", "B", "A")}
CHANNEL_ORDER = "RGBAXYZ"
LARGEST_SIDE = 32768


def channel_names(count: int) -> tuple[str, ...]:
    """What the channels are called in a file: Y, RGB and RGBA open in any viewer, other counts are numbered."""
    return VIEWABLE_CHANNELS.get(count, tuple(f"C{i:03d}" for i in range(count)))


def write_exr(path: Path, image: Image) -> None:
    """Write (H, W, C) pixels as ZIP-compressed float32, with their provenance and checksum in one JSON attribute.

    Whoever reads sees the old file or the new one, never a part: it is written beside its place and then moved.

    Raises
    ------
    ImageError
        The pixels are not (H, W, C) with at least one of each, or the file cannot be written.
    """
    import OpenEXR

    pixels = np.ascontiguousarray(image.pixels, dtype=np.float32)
    if pixels.ndim != 3 or 0 in pixels.shape:
        raise ImageError(
            f"{path}: found pixels of shape {pixels.shape}; allowed is (height, width, channels), each at least 1."
        )
    names = channel_names(pixels.shape[2])
    note = {"channels": names, "provenance": image.provenance, "sha256": checksum(pixels, image.provenance)}
    header = {
        "compression": OpenEXR.ZIP_COMPRESSION,
        "type": OpenEXR.scanlineimage,
        ATTRIBUTE: json.dumps(note, sort_keys=True, allow_nan=False),
    }
    content = io.BytesIO()
    channels = {name: np.ascontiguousarray(pixels[:, :, i]) for i, name in enumerate(names)}
    OpenEXR.File(header, channels).write(content)
    beside = path.with_name(f".{path.name}.{uuid.uuid4().hex}.tmp")
    try:
        beside.write_bytes(content.getvalue())
        beside.replace(path)
    except OSError as error:
        raise ImageError(
            f"{path}: cannot be written ({error.strerror}). Choose a folder that exists, is writable and has room."
        ) from error
    finally:
        beside.unlink(missing_ok=True)


def checksum(pixels: Float32, provenance: dict[str, Any]) -> str:
    """SHA-256, 64 hexadecimal digits, of shape and provenance as JSON, then the little-endian pixels in C order."""
    described = json.dumps([pixels.shape, provenance], sort_keys=True, allow_nan=False).encode()
    return hashlib.sha256(described + np.ascontiguousarray(pixels, dtype="<f4").tobytes()).hexdigest()


def read_exr(path: Path) -> Image:
    """Pixels (H, W, C) float32, row 0 at the top, with their provenance: {} for a file of another program.

    The channels come in the order in which `write_exr` got them. Those of another program come as R, G, B, A, X, Y, Z,
    then the rest by name, layer after layer. Of a file with several parts the first is read.

    Raises
    ------
    ImageError
        The file is missing, or holds something other than a plain image: deep, subsampled or cropped data.
    CorruptImage
        The file cannot be parsed, or its pixels or provenance do not match the checksum beside them.
    """
    try:
        content = path.read_bytes()
    except OSError as error:
        raise ImageError(f"{path}: cannot be read ({error.strerror}). Give the path of an EXR file.") from error
    header, _ = _parsed(path, content, header_only=True)
    _require_full_frame(path, header)
    note = _note(path, header)
    _, channels = _parsed(path, content, header_only=False)
    names = sorted(channels, key=_viewing_order) if note is None else note["channels"]
    planes = [channels.get(name) for name in names]
    if not planes or any(plane is None for plane in planes):
        raise CorruptImage(f"{path}: channels are missing or unreadable; the file is damaged. Make it again.")
    pixels = _stacked(path, planes, ours=note is not None)
    if note is None:
        return Image(pixels)
    if checksum(pixels, note["provenance"]) != note["sha256"]:
        raise CorruptImage(f"{path}: the content does not match its checksum; the file is damaged. Make it again.")
    return Image(pixels, note["provenance"])


def read_channels(path: Path) -> dict[str, Float32]:
    """Every channel of an EXR file by its name, (H, W) float32, row 0 at the top.

    Of a file with several parts, a channel's name starts with that of its part and a dot.

    Raises
    ------
    ImageError
        The file is missing, or holds something other than plain images of one size.
    CorruptImage
        The file cannot be parsed, or is one of `write_exr` and does not match its checksum.
    """
    try:
        content = path.read_bytes()
    except OSError as error:
        raise ImageError(f"{path}: cannot be read ({error.strerror}). Give the path of an EXR file.") from error
    parts = _parts(path, content, header_only=True)
    for header, _ in parts.values():
        _require_full_frame(path, header)
    if any(ATTRIBUTE in header for header, _ in parts.values()):
        pixels = read_exr(path).pixels
        return {name: pixels[..., i] for i, name in enumerate(channel_names(pixels.shape[2]))}
    found = {
        name if len(parts) == 1 or name.startswith(f"{part}.") else f"{part}.{name}": plane
        for part, (_, channels) in _parts(path, content, header_only=False).items()
        for name, plane in channels.items()
    }
    if not found or any(plane is None for plane in found.values()):
        raise CorruptImage(f"{path}: channels are missing or unreadable; the file is damaged. Save it again.")
    pixels = _stacked(path, list(found.values()), ours=False)
    return {name: np.ascontiguousarray(pixels[..., i]) for i, name in enumerate(found)}


def chromaticities(path: Path) -> tuple[float, ...] | None:
    """x and y of red, green, blue and white that an EXR file says its colours have; None if it says nothing.

    Raises
    ------
    ImageError
        The file cannot be read.
    """
    try:
        content = path.read_bytes()
    except OSError as error:
        raise ImageError(f"{path}: cannot be read ({error.strerror}). Give the path of an EXR file.") from error
    for header, _ in _parts(path, content, header_only=True).values():
        if "chromaticities" in header:
            return tuple(float(coordinate) for coordinate in header["chromaticities"])
    return None


def _parsed(path: Path, content: bytes, *, header_only: bool) -> tuple[dict[str, Any], dict[str, Any]]:
    """The attributes and, unless `header_only`, the pixels of each channel of the first part."""
    return next(iter(_parts(path, content, header_only=header_only).values()))


def _parts(path: Path, content: bytes, *, header_only: bool) -> dict[str, tuple[dict[str, Any], dict[str, Any]]]:
    """The same of each part by its name, or its number; a channel is None where it cannot be decoded."""
    import OpenEXR

    try:
        with contextlib.redirect_stdout(io.StringIO()):  # OpenEXR prints what the checks here find out anyway
            file = OpenEXR.File(io.BytesIO(content), separate_channels=True, header_only=header_only)
        parts = [(part.header, {name: c.pixels for name, c in part.channels.items()}) for part in file.parts]
        if not parts:
            raise ValueError("it has no part")
        return {str(header.get("name") or number): (header, planes) for number, (header, planes) in enumerate(parts)}
    except (RuntimeError, ValueError, TypeError, MemoryError) as error:
        raise CorruptImage(
            f"{path}: cannot be read as an EXR file ({error}). It is damaged or of another format; make it again."
        ) from error


def _require_full_frame(path: Path, header: dict[str, Any]) -> None:
    """A crop would be compared with the wrong pixels, and a damaged size would ask for all of the memory."""
    (left, top), (right, bottom) = (map(int, corner) for corner in header["dataWindow"])
    shown = [tuple(map(int, corner)) for corner in header["displayWindow"]]
    if shown != [(left, top), (right, bottom)] or max(right - left, bottom - top) >= LARGEST_SIDE:
        ours = ATTRIBUTE in header  # write_exr knows no crops: something changed the file
        raise (CorruptImage if ours else ImageError)(
            f"{path}: its pixels cover ({left}, {top}) to ({right}, {bottom}) of a frame {shown[0]} to {shown[1]}; "
            f"allowed is a whole frame of at most {LARGEST_SIDE} pixels a side. Save the whole frame."
        )


def _note(path: Path, header: dict[str, Any]) -> dict[str, Any] | None:
    """What `write_exr` wrote beside the pixels; None in a file of another program."""
    if ATTRIBUTE not in header:
        return None
    try:
        note = json.loads(header[ATTRIBUTE])
        return {"channels": list(note["channels"]), "provenance": dict(note["provenance"]), "sha256": note["sha256"]}
    except (ValueError, TypeError, KeyError) as error:
        raise CorruptImage(f'{path}: the attribute "{ATTRIBUTE}" is damaged ({error}). Make the file again.') from error


def _viewing_order(name: str) -> tuple[str, int, str]:
    layer, _, channel = name.rpartition(".")
    known = channel in CHANNEL_ORDER
    return layer, CHANNEL_ORDER.index(channel) if known else len(CHANNEL_ORDER), channel


def _stacked(path: Path, planes: list[Any], *, ours: bool) -> Float32:
    if any(plane.dtype == object or plane.shape != planes[0].shape or plane.ndim != 2 for plane in planes):
        raise (CorruptImage if ours else ImageError)(
            f"{path}: found deep or subsampled channels; allowed is one sample a pixel in every channel. "
            "Save a plain image."
        )
    return np.ascontiguousarray(np.stack(planes, axis=2), dtype=np.float32)
