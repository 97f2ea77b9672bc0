from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from numpy.typing import NDArray

from scenes.errors import CorruptImage, ImageError
from scenes.exr import channel_names, checksum, read_exr, write_exr
from scenes.image import Float32, Image

PIXELS = np.random.default_rng(0).random((5, 7, 3), dtype=np.float32)
PROVENANCE = {"scene": "room", "spp": 1024, "seeds": [1, 2], "note": "café"}

in_one_folder = settings(deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
any_pixels = hnp.arrays(
    np.float32,
    st.tuples(st.integers(1, 9), st.integers(1, 9), st.integers(1, 12)),
    elements=st.floats(width=32, allow_nan=True, allow_infinity=True),
)
views = st.sampled_from(
    [
        lambda a: a,
        lambda a: a[::-1],
        lambda a: a[:, ::-1],
        lambda a: a[..., ::-1],
        lambda a: a[: (len(a) + 1) // 2, ::2],
        lambda a: a.transpose(1, 0, 2),
        np.asfortranarray,
    ]
)


def foreign_exr(path: Path, channels: dict[str, NDArray[Any]], header: dict[str, Any] | None = None) -> Path:
    """A file as another program writes it, without our attribute."""
    import OpenEXR

    attributes = {"compression": OpenEXR.PIZ_COMPRESSION, "type": OpenEXR.scanlineimage}
    OpenEXR.File({**attributes, **(header or {})}, channels).write(str(path))
    return path


@in_one_folder
@given(pixels=any_pixels, view=views)
def test_every_array_comes_back_bit_for_bit_however_it_lies_in_memory(
    tmp_path: Path, pixels: Float32, view: Any
) -> None:
    path = tmp_path / "image.exr"
    image = Image(view(pixels), {"view": "any"})
    write_exr(path, image)
    back = read_exr(path)
    assert back.pixels.dtype == np.float32
    assert back.pixels.shape == image.pixels.shape
    assert back.pixels.tobytes() == np.ascontiguousarray(image.pixels).tobytes()
    assert back.provenance == image.provenance


def test_provenance_comes_back(tmp_path: Path) -> None:
    write_exr(tmp_path / "image.exr", Image(PIXELS, PROVENANCE))
    assert read_exr(tmp_path / "image.exr").provenance == PROVENANCE


@pytest.mark.parametrize(
    ("count", "names"), [(1, {"Y"}), (2, {"C000", "C001"}), (3, {"R", "G", "B"}), (4, {"R", "G", "B", "A"})]
)
def test_files_hold_the_channels_that_viewers_look_for(tmp_path: Path, count: int, names: set[str]) -> None:
    import OpenEXR

    path = tmp_path / "image.exr"
    write_exr(path, Image(np.zeros((2, 3, count), dtype=np.float32)))
    with OpenEXR.File(str(path), separate_channels=True) as file:
        assert set(file.channels()) == names == set(channel_names(count))
        assert file.header()["compression"] == OpenEXR.ZIP_COMPRESSION
        assert {channel.pixels.dtype for channel in file.channels().values()} == {np.dtype(np.float32)}


def test_numbered_channels_sort_in_their_order() -> None:
    assert list(channel_names(12)) == sorted(channel_names(12))


def test_checksum_covers_shape_pixels_and_provenance() -> None:
    flat = np.zeros((2, 6, 1), dtype=np.float32)
    checksums = {
        checksum(flat, {}),
        checksum(flat.reshape(3, 4, 1), {}),
        checksum(flat, {"spp": 1}),
        checksum(flat + np.float32(1e-30), {}),
    }
    assert len(checksums) == 4


@settings(max_examples=150, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
def test_a_damaged_byte_is_noticed_or_harmless(tmp_path: Path, data: st.DataObject) -> None:
    """Some bytes of the header mean nothing to the pixels; damage to the attribute's name loses all the provenance."""
    path = tmp_path / "image.exr"
    write_exr(path, Image(PIXELS, PROVENANCE))
    content = bytearray(path.read_bytes())
    position = data.draw(st.integers(0, len(content) - 1))
    content[position] ^= data.draw(st.integers(1, 255))
    path.write_bytes(content)
    try:
        back = read_exr(path)
    except ImageError:
        return
    np.testing.assert_array_equal(back.pixels, PIXELS)
    assert back.provenance in (PROVENANCE, {})


def test_changed_pixels_are_noticed(tmp_path: Path) -> None:
    import OpenEXR

    path = tmp_path / "image.exr"
    write_exr(path, Image(PIXELS, PROVENANCE))
    with OpenEXR.File(str(path), separate_channels=True) as file:
        header = dict(file.header())
        channels = {name: channel.pixels.copy() for name, channel in file.channels().items()}
    channels["G"][2, 3] += np.float32(1e-6)
    OpenEXR.File(header, channels).write(str(path))
    with pytest.raises(CorruptImage, match="checksum"):
        read_exr(path)


@pytest.mark.parametrize("kept", [0.0, 0.01, 0.3, 0.5, 0.99])
def test_a_file_cut_short_is_corrupt(tmp_path: Path, kept: float) -> None:
    path = tmp_path / "image.exr"
    write_exr(path, Image(PIXELS, PROVENANCE))
    content = path.read_bytes()
    path.write_bytes(content[: int(kept * len(content))])
    with pytest.raises(CorruptImage):
        read_exr(path)


def test_a_missing_file_is_not_called_corrupt(tmp_path: Path) -> None:
    with pytest.raises(ImageError, match="No such file") as caught:
        read_exr(tmp_path / "none.exr")
    assert not isinstance(caught.value, CorruptImage)


def test_a_file_of_another_program_has_no_provenance_and_rgb_first(tmp_path: Path) -> None:
    planes = {name: np.full((4, 6), i, dtype=np.float16) for i, name in enumerate("ZABRG")}
    image = read_exr(foreign_exr(tmp_path / "other.exr", planes))
    assert image.provenance == {}
    assert image.pixels.dtype == np.float32
    np.testing.assert_array_equal(image.pixels[0, 0], [3, 4, 2, 1, 0])  # R, G, B, A, Z


def test_layers_come_one_after_the_other(tmp_path: Path) -> None:
    planes = {name: np.full((2, 2), i, dtype=np.float32) for i, name in enumerate(["n.Z", "n.X", "n.Y", "B", "G", "R"])}
    image = read_exr(foreign_exr(tmp_path / "layers.exr", planes))
    np.testing.assert_array_equal(image.pixels[0, 0], [5, 4, 3, 1, 2, 0])


def test_a_crop_is_refused(tmp_path: Path) -> None:
    window = (np.array([0, 0], dtype=np.int32), np.array([9, 9], dtype=np.int32))
    path = foreign_exr(tmp_path / "crop.exr", {"Y": np.zeros((4, 4), dtype=np.float32)}, {"displayWindow": window})
    with pytest.raises(ImageError, match="whole frame"):
        read_exr(path)


@pytest.mark.parametrize("shape", [(4, 4), (0, 4, 3), (4, 4, 0)])
def test_arrays_that_are_no_image_are_refused(tmp_path: Path, shape: tuple[int, ...]) -> None:
    with pytest.raises(ImageError, match="height, width, channels"):
        write_exr(tmp_path / "image.exr", Image(np.zeros(shape, dtype=np.float32)))
    assert list(tmp_path.iterdir()) == []


def test_a_folder_that_is_missing_is_said(tmp_path: Path) -> None:
    with pytest.raises(ImageError, match="cannot be written"):
        write_exr(tmp_path / "none" / "image.exr", Image(PIXELS))


def test_a_failed_write_leaves_the_old_file_and_nothing_else(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "image.exr"
    write_exr(path, Image(PIXELS))

    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Path, "replace", full)
    with pytest.raises(ImageError, match="No space left"):
        write_exr(path, Image(PIXELS + 1))
    assert list(tmp_path.iterdir()) == [path]
    np.testing.assert_array_equal(read_exr(path).pixels, PIXELS)
