"""Make tiles.png, a texture that no mirroring or turning maps onto itself: python -m scenes.library.assets.tiles."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

SIZE = 64
TILE = 8
MARK = 16


def tiles() -> NDArray[np.uint8]:
    """SRGB code values (64, 64, 3), row 0 at the top.

    Red grows to the right and green upwards, every other tile is darker, and the lower left corner is blue.
    """
    rows, columns = np.indices((SIZE, SIZE))
    is_dark = (rows // TILE + columns // TILE) % 2 == 1
    red = 60 + 180 * columns / (SIZE - 1)
    green = 60 + 180 * (SIZE - 1 - rows) / (SIZE - 1)
    shaded = np.where(is_dark, 0.6, 1.0)[..., None] * np.stack([red, green, np.full_like(red, 90)], axis=-1)
    is_mark = (rows >= SIZE - MARK) & (columns < MARK)
    return np.where(is_mark[..., None], np.array([40, 60, 220]), shaded).round().astype(np.uint8)


def write(path: Path) -> None:
    """Write the texture as an 8-bit PNG file."""
    import PIL.Image

    PIL.Image.fromarray(tiles()).save(path, optimize=True)


if __name__ == "__main__":
    write(Path(__file__).with_suffix(".png"))
