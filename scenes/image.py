"""An image with its provenance."""

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scenes.errors import RenderError

Float32 = NDArray[np.float32]
Float64 = NDArray[np.float64]
Bool = NDArray[np.bool_]


@dataclass(frozen=True)
class Image:
    """Linear, scene-referred float32 pixels (H, W, C), row 0 at the top, and where they come from."""

    pixels: Float32
    provenance: dict[str, Any] = field(default_factory=dict)


def require_finite(pixels: Float32, what: str) -> Float32:
    """The pixels, contiguous; raises RenderError when one of them is NaN or infinite."""
    wrong = int(np.count_nonzero(~np.isfinite(pixels)))
    if wrong:
        raise RenderError(
            f"The {what} has {wrong} values that are NaN or infinite; all must be finite, so it is not used. Mend what "
            "renders it."
        )
    return np.ascontiguousarray(pixels)
