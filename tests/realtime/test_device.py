from typing import TYPE_CHECKING

import pytest

from realtime.device import Device

if TYPE_CHECKING:
    import moderngl


@pytest.fixture
def device(gl: "moderngl.Context") -> Device:
    return Device(gl)


def test_bytes_are_counted_by_format_and_forgotten_with_what_has_them(device: Device) -> None:
    kept = [
        device.buffer(bytes(100)),
        device.buffer(reserve=28),
        device.texture((8, 4), 3, dtype="f2"),
        device.depth_texture((8, 4)),
        device.renderbuffer((8, 4), 4, samples=4),
        device.depth_renderbuffer((8, 4), samples=4),
        device.texture_cube((4, 4), 4, dtype="f1"),
        device.texture3d((4, 4, 4), 4, dtype="f4"),
        device.texture_array((4, 4, 2), 1, dtype="u4"),
    ]
    expected = 100 + 28 + 32 * 6 + 32 * 4 + 4 * 32 * 4 + 4 * 32 * 4 + 6 * 16 * 4 + 64 * 16 + 32 * 4
    assert (device.alive, device.peak) == (expected, expected)
    kept.clear()
    assert (device.alive, device.peak) == (0, expected)


def test_the_peak_is_of_what_is_alive_at_once(device: Device) -> None:
    for _ in range(3):
        device.buffer(reserve=1000)
    assert device.peak == 1000


def test_a_framebuffer_keeps_what_it_draws_into(device: Device) -> None:
    framebuffer = device.framebuffer([device.texture((4, 4), 1)])
    assert device.alive == 16
    del framebuffer
    assert device.alive == 0


def test_mip_levels_add_a_third(device: Device) -> None:
    texture = device.texture((32, 16), 1, dtype="f2")
    device.count_mipmaps(texture)
    assert device.alive == 1024 + 341


def test_what_is_set_reaches_the_context(device: Device, gl: "moderngl.Context") -> None:
    device.wireframe = True
    assert gl.wireframe
    device.wireframe = False
    assert not gl.wireframe
