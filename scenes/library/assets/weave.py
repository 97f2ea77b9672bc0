"""Make weave.png, the heights of a woven basket: python -m scenes.library.assets.weave."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

SIZE = 192
STRANDS = 8
WIDTH = 0.8
MARK = 16


def weave() -> NDArray[np.uint8]:
    """Linear heights (192, 192) as code values, row 0 at the top.

    Strands with round backs pass over and under one another. A ramp that rises to the right fills the lower left
    corner, so that no mirroring or turning maps the field onto itself.
    """
    rows, columns = (i + 0.5 for i in np.indices((SIZE, SIZE)))
    x, y = columns * STRANDS / SIZE, rows * STRANDS / SIZE
    sign = np.where((np.floor(x) + np.floor(y)) % 2 == 0, 1.0, -1.0)
    wave = sign * np.sin(np.pi * (x % 1)) * np.sin(np.pi * (y % 1))
    across, along = (_back(p) * (0.6 + 0.4 * s * wave) for p, s in ((x, 1.0), (y, -1.0)))
    heights = np.maximum(across, along)
    is_mark = (rows > SIZE - MARK) & (columns < 2 * MARK)
    return np.round(255 * np.where(is_mark, columns / (2 * MARK), heights)).astype(np.uint8)


def _back(place: NDArray[np.float64]) -> NDArray[np.float64]:
    """The height of a strand's round back across its course."""
    return np.sqrt(np.maximum(1 - ((place % 1 - 0.5) / (0.5 * WIDTH)) ** 2, 0.0))


def write(path: Path) -> None:
    """Write the heights as an 8-bit PNG file."""
    import PIL.Image

    PIL.Image.fromarray(weave()).save(path, optimize=True)


if __name__ == "__main__":
    write(Path(__file__).with_suffix(".png"))
