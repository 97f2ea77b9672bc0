"""Files of other programs, with values that are known."""

import struct
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from comparisons.image_files import REC_709, ImageFile, layers_of, read_image
from scenes import srgb
from scenes.errors import ImageError
from scenes.exr import write_exr
from scenes.image import Image

COLOURS = np.array([[[0.0, 0.25, 0.5], [1.0, 0.125, 0.75]]] * 3, dtype=np.float32)
"""(3, 2, 3), exact in half precision too; all rows are the same."""

ROWS = np.arange(3, dtype=np.float32)[:, None, None] + COLOURS
"""Every row differs: what comes upside down is noticed."""


def write_channels(path: Path, channels: dict[str, Any], **header: Any) -> Path:
    """An EXR as other programs write it."""
    import OpenEXR

    plain = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage} | header
    OpenEXR.File(plain, {name: np.ascontiguousarray(plane) for name, plane in channels.items()}).write(str(path))
    return path


def rgb(pixels: Any, layer: str = "") -> dict[str, Any]:
    return {layer + name: pixels[..., i] for i, name in enumerate("RGB")}


def write_png(path: Path, codes: Any, *, bits: int) -> Path:
    """Portable Network Graphics (Second Edition), section 5, without filters: independent of who reads it."""
    height, width = codes.shape[:2]
    colour_type = {1: 0, 2: 4, 3: 2, 4: 6}[codes.reshape(height, width, -1).shape[2]]
    rows = codes.astype(">u2" if bits == 16 else "u1").reshape(height, -1)

    def chunk(kind: bytes, content: bytes) -> bytes:
        return struct.pack(">I", len(content)) + kind + content + struct.pack(">I", zlib.crc32(kind + content))

    header = struct.pack(">IIBBBBB", width, height, bits, colour_type, 0, 0, 0)
    data = zlib.compress(b"".join(b"\0" + row.tobytes() for row in rows))
    content = chunk(b"IHDR", header) + chunk(b"IDAT", data) + chunk(b"IEND", b"")
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + content)
    return path


@pytest.fixture
def read(tmp_path: Path) -> Callable[..., ImageFile]:
    return lambda path, channels=3, **options: read_image(path, channels, tmp_path / "kernels", **options)


ACES = (0.7347, 0.2653, 0.0, 1.0, 0.0001, -0.077, 0.32168, 0.33767)


def test_colours_of_another_space_are_refused(tmp_path: Path, read: Callable[..., ImageFile]) -> None:
    aces = write_channels(tmp_path / "aces.exr", rgb(COLOURS), chromaticities=ACES)
    with pytest.raises(ImageError, match=r"white lie at \(0\.7347, 0\.2653\).*--color-space linear"):
        read(aces)
    assert np.array_equal(read(aces, color_space="linear").pixels, COLOURS), "the user knows better"
    ours = write_channels(tmp_path / "ours.exr", rgb(COLOURS), chromaticities=REC_709)
    assert np.array_equal(read(ours).pixels, COLOURS)


def test_a_depth_has_no_colour_space(tmp_path: Path, read: Callable[..., ImageFile]) -> None:
    depth = write_channels(tmp_path / "depth.exr", {"Z": COLOURS[..., 0]}, chromaticities=ACES)
    assert np.array_equal(read(depth, 1, is_depth=True).pixels[..., 0], COLOURS[..., 0])


@pytest.mark.parametrize("kind", ["float32", "float16"])
def test_an_exr_is_linear(tmp_path: Path, read: Callable[..., ImageFile], kind: str) -> None:
    file = read(write_channels(tmp_path / "a.exr", rgb(ROWS.astype(kind))))
    assert np.array_equal(file.pixels, ROWS)
    assert file.pixels.dtype == np.float32
    assert (file.encoding, file.alpha) == ("linear", None)


def test_a_tiled_exr_is_read(tmp_path: Path, read: Callable[..., ImageFile]) -> None:
    import OpenEXR

    tiles = {"type": OpenEXR.tiledimage, "tiles": OpenEXR.TileDescription()}
    assert np.array_equal(read(write_channels(tmp_path / "a.exr", rgb(ROWS), **tiles)).pixels, ROWS)


def test_an_exr_of_our_own_is_read(tmp_path: Path, read: Callable[..., ImageFile]) -> None:
    path = tmp_path / "a.exr"
    write_exr(path, Image(np.ascontiguousarray(ROWS[..., :2])))
    assert np.array_equal(read(path, 2).pixels, ROWS[..., :2])


def test_alpha_is_kept_apart(tmp_path: Path, read: Callable[..., ImageFile]) -> None:
    alpha = np.full((3, 2), 0.5, dtype=np.float32)
    file = read(write_channels(tmp_path / "a.exr", rgb(ROWS) | {"A": alpha}))
    assert file.alpha is not None
    assert np.array_equal(file.alpha, alpha)
    assert np.array_equal(file.pixels, ROWS)


def test_layers_are_asked_for(tmp_path: Path, read: Callable[..., ImageFile]) -> None:
    channels = rgb(ROWS, "View.Combined.") | rgb(2 * ROWS, "View.Diffuse.") | {"View.Depth.Z": ROWS[..., 0]}
    path = write_channels(tmp_path / "a.exr", channels)
    with pytest.raises(ImageError, match=r"'View.Combined' .*'View.Diffuse' .*--layer"):
        read(path)
    assert np.array_equal(read(path, layer="View.Diffuse").pixels, 2 * ROWS)
    assert np.array_equal(read(path, 1, is_depth=True).pixels[..., 0], ROWS[..., 0])
    with pytest.raises(ImageError, match=r"'Diffuse' names none"):
        read(path, layer="Diffuse")


def test_depth_never_passes_for_another_quantity(tmp_path: Path, read: Callable[..., ImageFile]) -> None:
    path = write_channels(tmp_path / "a.exr", rgb(ROWS) | {"Z": ROWS[..., 0]})
    assert np.array_equal(read(path).pixels, ROWS)
    with pytest.raises(ImageError, match="the quantity has 1 channel"):
        read(path, 1)


def test_parts_are_layers(tmp_path: Path, read: Callable[..., ImageFile]) -> None:
    import OpenEXR

    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    planes = {name: np.ascontiguousarray(plane) for name, plane in rgb(ROWS).items()}
    parts = [OpenEXR.Part(header | {"name": name}, dict(planes)) for name in ("beauty", "diffuse")]
    path = tmp_path / "a.exr"
    OpenEXR.File(parts).write(str(path))
    assert np.array_equal(read(path, layer="diffuse").pixels, ROWS)


def test_a_grey_picture_passes_for_one_channel(tmp_path: Path, read: Callable[..., ImageFile]) -> None:
    grey = np.repeat(ROWS[..., :1], 3, axis=2)
    assert np.array_equal(read(write_channels(tmp_path / "a.exr", rgb(grey)), 1).pixels, grey[..., :1])
    with pytest.raises(ImageError, match="channels R, G, B; the quantity has 1 channel"):
        read(write_channels(tmp_path / "b.exr", rgb(ROWS)), 1)


@pytest.mark.parametrize(("bits", "most"), [(8, 255), (16, 65535)])
def test_a_png_is_decoded_from_srgb(tmp_path: Path, read: Callable[..., ImageFile], bits: int, most: int) -> None:
    codes = np.array([[[0, 1, most // 2]], [[most, most // 3, 7]]])
    path = write_png(tmp_path / "a.png", codes, bits=bits)
    file = read(path)
    assert np.allclose(file.pixels, srgb.decode(codes / most), rtol=1e-6)
    assert (file.encoding, file.most) == ("srgb", 1.0)
    assert np.allclose(read(path, color_space="linear").pixels, codes / most, rtol=1e-6)


def test_a_png_with_alpha(tmp_path: Path, read: Callable[..., ImageFile]) -> None:
    file = read(write_png(tmp_path / "a.png", np.array([[[255, 128, 0, 51]]]), bits=8))
    assert file.alpha is not None
    assert file.alpha[0, 0] == pytest.approx(0.2)
    assert file.pixels[0, 0] == pytest.approx(srgb.decode(np.array([255, 128, 0]) / 255))


def test_a_radiance_file_keeps_a_hundredth(tmp_path: Path, read: Callable[..., ImageFile]) -> None:
    """Mantissas of 8 bits share an exponent: (128, 64, 32) with 129 are 128, 64 and 32 256ths of 2."""
    path = tmp_path / "a.hdr"
    pixels = bytes([128, 64, 32, 129, 200, 100, 0, 140])
    path.write_bytes(b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 2\n" + pixels)
    assert np.allclose(read(path).pixels, np.array([[[1, 0.5, 0.25], [3200, 1600, 0]]]), rtol=0.01)
    path.write_bytes(b"#?RADIANCE\nEXPOSURE=2.0\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 2\n" + pixels)
    assert np.allclose(read(path).pixels[0, 0], [0.5, 0.25, 0.125], rtol=0.01)


def test_a_pfm_starts_with_the_lowest_row(tmp_path: Path, read: Callable[..., ImageFile]) -> None:
    path = tmp_path / "a.pfm"
    path.write_bytes(b"PF\n2 3\n-1.0\n" + ROWS[::-1].astype("<f4").tobytes())
    assert np.array_equal(read(path).pixels, ROWS)


@pytest.mark.parametrize(
    ("content", "says"),
    [
        (b"\xff\xd8\xff\xe0", "a JPEG, which is lossy"),
        (b"hello", "another kind of file"),
        (b"\x89PNG\r\n\x1a\n", "cannot be read as a PNG file"),
        (b"\x76\x2f\x31\x01", "cannot be read as an EXR file"),
    ],
)
def test_other_files_are_refused(tmp_path: Path, read: Callable[..., ImageFile], content: bytes, says: str) -> None:
    path = tmp_path / "a.exr"
    path.write_bytes(content)
    with pytest.raises(ImageError, match=says):
        read(path)


def test_what_is_no_srgb_is_refused(tmp_path: Path, read: Callable[..., ImageFile]) -> None:
    with pytest.raises(ImageError, match="outside 0 to 1, such as"):
        read(write_channels(tmp_path / "a.exr", rgb(ROWS)), color_space="srgb")


def test_a_crop_is_refused(tmp_path: Path, read: Callable[..., ImageFile]) -> None:
    window = (np.array([1, 1], dtype=np.int32), np.array([2, 3], dtype=np.int32))
    path = write_channels(tmp_path / "a.exr", rgb(ROWS), dataWindow=window)
    with pytest.raises(ImageError, match="Save the whole frame"):
        read(path)


def test_channels_are_sorted_into_layers() -> None:
    names = ["A", "B", "G", "R", "Z", "N.X", "N.Y", "N.Z", "uv.U", "uv.V", "View.Depth.V", "C000", "C001"]
    found = {layer.name: layer.channels for layer in layers_of(names)}
    assert found == {
        "": ("R", "G", "B"),
        "Z": ("Z",),
        "C000": ("C000",),
        "C001": ("C001",),
        "N": ("N.X", "N.Y", "N.Z"),
        "uv": ("uv.U", "uv.V"),
        "View.Depth.V": ("View.Depth.V",),
    }
