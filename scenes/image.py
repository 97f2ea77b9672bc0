"""An image with its provenance."""

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

Float32 = NDArray[np.float32]
Float64 = NDArray[np.float64]
Bool = NDArray[np.bool_]


@dataclass(frozen=True)
class Image:
    """Linear, scene-referred float32 pixels (H, W, C), row 0 at the top, and where they come from."""

    pixels: Float32
    provenance: dict[str, Any] = field(default_factory=dict)
