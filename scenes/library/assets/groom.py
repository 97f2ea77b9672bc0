"""Make the textures that control hair, groom-*.png: python -m scenes.library.assets.groom."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

SIZE = 64
Bytes = NDArray[np.uint8]


def density() -> Bytes:
    """Linear probabilities (64, 64), row 0 at the top: a tenth on the left, all on the right."""
    u, _ = _chart()
    return _bytes(0.1 + 0.9 * u)


def kill() -> Bytes:
    """White where no hair grows: a disk in the upper left."""
    u, v = _chart()
    return _bytes(np.hypot(u - 0.3, v - 0.7) < 0.15)


def length() -> Bytes:
    """Linear factors: 1 at the bottom, less at the top, least in a parting that runs from left to right."""
    u, v = _chart()
    return _bytes((1 - 0.5 * v) * (1 - 0.6 * np.exp(-(((v - 0.35 - 0.1 * u) / 0.06) ** 2))))


def color() -> Bytes:
    """sRGB colours (64, 64, 3): oblique stripes, white and reddish."""
    u, v = _chart()
    stripe = 0.5 + 0.5 * np.sin(2 * np.pi * (3 * u + v))
    return _bytes(stripe[..., None] * (1.0, 1.0, 1.0) + (1 - stripe[..., None]) * (0.9, 0.5, 0.3))


MAPS: dict[str, Callable[[], Bytes]] = {
    "groom-density": density,
    "groom-kill": kill,
    "groom-length": length,
    "groom-color": color,
}


def _chart() -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """(u, v) at the texels' centres, v upward."""
    rows, columns = (np.indices((SIZE, SIZE)) + 0.5) / SIZE
    return columns, 1 - rows


def _bytes(values: NDArray[np.float64] | NDArray[np.bool_]) -> Bytes:
    return np.round(255 * values.astype(np.float64)).astype(np.uint8)


def write(folder: Path) -> None:
    """Write the maps as 8-bit PNG files."""
    import PIL.Image

    for name, made in MAPS.items():
        PIL.Image.fromarray(made()).save(folder / f"{name}.png", optimize=True)


if __name__ == "__main__":
    write(Path(__file__).parent)
