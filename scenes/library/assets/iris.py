"""Make iris.png, an iris that no mirroring or turning maps onto itself: python -m scenes.library.assets.iris.

The disk spans the texture. Fibres run from the pupil outward, a lighter ring surrounds the pupil, the rim is dark, and
one sector is brown, as in eyes with sectoral heterochromia.
"""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

SIZE = 128
FIBRES = (11, 17, 29)
BLUE, AMBER, BROWN = np.array([96, 138, 168]), np.array([188, 150, 92]), np.array([110, 74, 44])


def iris() -> NDArray[np.uint8]:
    """SRGB code values (128, 128, 3), row 0 at the top."""
    y, x = (np.indices((SIZE, SIZE)) + 0.5 - SIZE / 2) / (SIZE / 2)
    r, phi = np.hypot(x, y), np.arctan2(-y, x)
    fibres = sum(np.cos(n * phi + 1.5 * np.sin(7 * r + n)) for n in FIBRES) / len(FIBRES)
    near_pupil = np.exp(-(((r - 0.42) / 0.12) ** 2))
    sector = np.exp(-(((phi - 0.9) / 0.35) ** 2))
    colour = BLUE + near_pupil[..., None] * (AMBER - BLUE)
    colour = colour + sector[..., None] * (BROWN - colour)
    rim = 1 - 0.6 / (1 + np.exp(-(r - 0.93) / 0.02))
    shaded: NDArray[np.uint8] = (
        np.clip(colour * ((1 + 0.22 * fibres) * rim)[..., None], 0, 255).round().astype(np.uint8)
    )
    return shaded


def write(path: Path) -> None:
    """Write the texture as an 8-bit PNG file."""
    import PIL.Image

    PIL.Image.fromarray(iris()).save(path, optimize=True)


if __name__ == "__main__":
    write(Path(__file__).with_suffix(".png"))
