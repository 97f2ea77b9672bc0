"""Images of other programs: EXR, PNG, Radiance HDR and PFM as linear pixels.

What a file is, its first bytes tell, not its name. EXR, HDR and PFM hold linear values and PNG holds sRGB code values,
unless the user says otherwise.
"""

import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np

from scenes import srgb
from scenes.digest import file_digest
from scenes.errors import ImageError
from scenes.exr import chromaticities, read_channels
from scenes.image import Float32

ColorSpace = Literal["srgb", "linear"]
Kind = Literal["EXR", "PNG", "HDR", "PFM"]

SIGNATURES: tuple[tuple[bytes, Kind], ...] = (
    (b"\x76\x2f\x31\x01", "EXR"),
    (b"\x89PNG\r\n\x1a\n", "PNG"),
    (b"#?RADIANCE", "HDR"),
    (b"#?RGBE", "HDR"),
    (b"PF", "PFM"),
    (b"Pf", "PFM"),
)
OTHER_SIGNATURES = (
    (b"\xff\xd8\xff", "a JPEG, which is lossy"),
    (b"II*\x00", "a TIFF"),
    (b"MM\x00*", "a TIFF"),
    (b"DDS ", "a DDS texture"),
    (b"\xabKTX", "a KTX texture"),
    (b"BM", "a BMP"),
    (b"GIF8", "a GIF"),
    (b"RIFF", "a WebP"),
)

DEPTH_NAMES = frozenset({"z", "depth", "distance"})
GREY_TOLERANCE = 1e-6
"""Channels of a grey picture may differ by that share: programs that store one value three times store it exactly."""

REC_709 = (0.64, 0.33, 0.30, 0.60, 0.15, 0.06, 0.3127, 0.3290)
"""ITU-R BT.709-6 (2015): x and y of red, green, blue and of the white point."""
SAME_PRIMARIES = 0.005
"""Programs round the coordinates; other spaces differ by ten times as much in some of them."""


@dataclass(frozen=True)
class ImageFile:
    """An image as another program wrote it.

    pixels   : (H, W, C) float32, linear, row 0 at the top; neither alpha nor anything else is applied
    alpha    : (H, W) float32, if the file has it
    encoding : what its values were taken for
    most     : the largest value that such a file can hold
    summary  : what was read, in words
    digest   : SHA-256 of the file
    """

    path: Path
    pixels: Float32
    alpha: Float32 | None
    encoding: ColorSpace
    most: float
    summary: str
    digest: str


@dataclass(frozen=True)
class Layer:
    """Channels of a file that belong together, by their full names."""

    name: str
    channels: tuple[str, ...]
    alpha: str | None = None

    @property
    def is_depth(self) -> bool:
        return len(self.channels) == 1 and bool(DEPTH_NAMES & set(self.channels[0].lower().split(".")))

    def __str__(self) -> str:
        channels = ", ".join((*self.channels, *([self.alpha] if self.alpha else [])))
        return f"layer '{self.name}' ({channels})" if self.name else f"channels {channels}"


def read_image(
    path: Path,
    channels: int,
    kernels: Path,
    *,
    is_depth: bool = False,
    layer: str | None = None,
    color_space: ColorSpace | None = None,
) -> ImageFile:
    """Read an image of so many channels, apart from alpha.

    Parameters
    ----------
    channels : of what the image shows. A grey picture of three equal channels passes for one of one channel.
    kernels : where Mitsuba, which reads PNG, HDR and PFM, keeps its compiled kernels.
    is_depth : the image shows depth, which tells apart what a file of several layers offers.
    layer : of an EXR file; if not given, the only one that fits.
    color_space : of the values in the file; if not given, `srgb` for PNG and `linear` for all else.

    Raises
    ------
    ImageError
        The file is missing, damaged, of another kind or without such channels, or holds no such values.
    """
    kind = _kind_of(path)
    if kind == "EXR":
        planes, most, form = read_channels(path), np.inf, "EXR"
    else:
        if layer is not None:
            raise ImageError(f"{path}: found a {kind} file, which has no layers. Leave out --layer.")
        planes, most, form = _bitmap(path, kind, kernels)
    encoding: ColorSpace = color_space or ("srgb" if kind == "PNG" else "linear")
    chosen = _chosen(path, planes, channels, layer, is_depth)
    if kind == "EXR" and len(chosen.channels) == 3 and color_space is None:
        _require_rec709(path)
    pixels = np.stack([planes[name] for name in chosen.channels[:channels]], axis=2)
    summary = f"{form}, channels {', '.join(chosen.channels)}, {encoding}"
    return ImageFile(
        path=path,
        pixels=_decoded(path, pixels) if encoding == "srgb" else pixels,
        alpha=planes[chosen.alpha] if chosen.alpha else None,
        encoding=encoding,
        most=most,
        summary=summary,
        digest=file_digest(path),
    )


def _kind_of(path: Path) -> Kind:
    try:
        with path.open("rb") as file:
            start = file.read(16)
    except OSError as error:
        raise ImageError(
            f"{path}: cannot be read ({error.strerror}). Give the path of an EXR, PNG, HDR or PFM file."
        ) from error
    for signature, kind in SIGNATURES:
        if start.startswith(signature):
            return kind
    other = next((what for signature, what in OTHER_SIGNATURES if start.startswith(signature)), "another kind of file")
    raise ImageError(
        f"{path}: found {other}; allowed are EXR, PNG of 8 or 16 bits, Radiance HDR and PFM. Save the image as one of "
        "these; EXR keeps the most."
    )


def _bitmap(path: Path, kind: Kind, kernels: Path) -> tuple[dict[str, Float32], float, str]:
    """The channels of a file that Mitsuba reads, in [0, 1] if they are integers; its largest value; what it is."""
    from reference.start import mitsuba

    mi = mitsuba(kernels)
    try:
        bitmap = mi.Bitmap(str(path))
        values = np.array(bitmap)
    except (RuntimeError, ValueError, MemoryError) as error:
        raise ImageError(
            f"{path}: cannot be read as a {kind} file ({error}). It is damaged, or of a variety that is not known. "
            "Save it again, or as EXR."
        ) from error
    values = values.reshape(*values.shape[:2], -1)
    if not values.size:
        raise ImageError(f"{path}: found a {kind} file without pixels. Save it again.")
    is_integer = np.issubdtype(values.dtype, np.integer)
    top = float(np.iinfo(values.dtype).max) if is_integer else 1.0
    scaled = (values / top / _exposure(path, kind)).astype(np.float32)
    names = {1: "Y", 2: "YA", 3: "RGB", 4: "RGBA"}[values.shape[2]]
    form = f"{kind} of {8 * values.dtype.itemsize} bits" if is_integer else kind
    return {name: scaled[..., i] for i, name in enumerate(names)}, 1.0 if is_integer else np.inf, form


def _exposure(path: Path, kind: Kind) -> float:
    """What the values of a Radiance file were multiplied by, as its header says; Mitsuba leaves that alone."""
    if kind != "HDR":
        return 1.0
    header = path.read_bytes().partition(b"\n\n")[0].decode("ascii", errors="replace")
    return float(np.prod([float(found) for found in re.findall(r"(?m)^EXPOSURE= *([0-9.eE+-]+) *$", header)]))


def _require_rec709(path: Path) -> None:
    """Refuse colours that a file says are of another space: they would be judged as if they were not."""
    found = chromaticities(path)
    if found is not None and not np.allclose(found, REC_709, rtol=0, atol=SAME_PRIMARIES):
        pairs = " ".join(f"({x:g}, {y:g})" for x, y in zip(found[::2], found[1::2], strict=True))
        raise ImageError(
            f"{path}: found colours whose red, green, blue and white lie at {pairs}; allowed are linear Rec. 709 "
            "primaries with the white point D65. Convert the image, or say --color-space linear if its values are "
            "these all the same, or no colours."
        )


def _decoded(path: Path, pixels: Float32) -> Float32:
    """Linear values of sRGB code values; NaN stays."""
    outside = np.isfinite(pixels) & ((pixels < 0) | (pixels > 1))
    if outside.any():
        raise ImageError(
            f"{path}: found {int(outside.any(axis=2).sum())} pixels outside 0 to 1, such as "
            f"{float(pixels[outside][0]):g}; sRGB code values lie within. Say --color-space linear."
        )
    return srgb.decode(pixels).astype(np.float32)


def layers_of(names: Iterable[str]) -> Iterator[Layer]:
    """The channels of a file, sorted into what belongs together.

    Names are `LAYER.CHANNEL` (Kainz et al., "Technical Introduction to OpenEXR", layers). Within a layer R, G and B,
    X, Y and Z, U and V, or numbered channels form an image, with A if there is one; every other channel is its own.

    >>> [str(layer) for layer in layers_of(["R", "G", "B", "A", "ViewLayer.Depth.Z"])]
    ['channels R, G, B, A', "layer 'ViewLayer.Depth.Z' (ViewLayer.Depth.Z)"]
    """
    prefixes: dict[str, dict[str, str]] = {}
    for name in names:
        prefix, _, channel = name.rpartition(".")
        prefixes.setdefault(prefix, {})[channel.upper()] = name
    for prefix, channels in prefixes.items():
        yield from _layers_within(prefix, channels)


def _layers_within(prefix: str, channels: Mapping[str, str]) -> Iterator[Layer]:
    left = dict(channels)
    alpha = left.pop("A", None)
    numbered = sorted(name for name in left if re.fullmatch(r"C\d{3}", name))
    colour = [name for name in "RGB" if name in left]
    families = (colour, list("XYZ"), list("UV"), numbered)
    for family in families:
        if family and all(name in left for name in family):
            yield Layer(prefix, tuple(left.pop(name) for name in family), alpha)
            break
    for name in left.values():
        yield Layer(name, (name,), alpha if name.upper().endswith("Y") else None)
    if alpha is not None and len(channels) == 1:
        yield Layer(alpha, (alpha,))


def _chosen(path: Path, planes: Mapping[str, Float32], count: int, layer: str | None, is_depth: bool) -> Layer:
    """The layer that was asked for, or the only one of so many channels."""
    layers = list(layers_of(planes))
    if layer is not None:
        named = [it for it in layers if it.name == layer] or [it for it in layers if it.name.startswith(f"{layer}.")]
        if len(named) != 1:
            matching = "several" if named else "none"
            raise ImageError(f"{path}: found {_list(layers)}; '{layer}' names {matching} of them. Choose one.")
        layers = named
    fitting = [it for it in layers if len(it.channels) == count or (count == 1 and _is_grey(planes, it))]
    if layer is None:
        of_a_kind = [it for it in fitting if it.is_depth == is_depth]
        fitting = of_a_kind or (fitting if is_depth else [])
    if not fitting:
        raise ImageError(
            f"{path}: found {_list(layers)}; the quantity has {count} channel{'s' if count > 1 else ''}. Save one "
            "image with just these, without others but alpha."
        )
    unnamed = [it for it in fitting if not it.name]
    if len(fitting) > 1 and len(unnamed) != 1:
        raise ImageError(f"{path}: found {_list(fitting)}, any of which may be meant. Choose one with --layer.")
    return (unnamed or fitting)[0]


def _is_grey(planes: Mapping[str, Float32], layer: Layer) -> bool:
    first, *others = (planes[name] for name in layer.channels)
    return all(np.allclose(first, other, rtol=GREY_TOLERANCE, atol=0, equal_nan=True) for other in others)


def _list(layers: Iterable[Layer]) -> str:
    return "; ".join(map(str, layers))
