"""Images over the chart of a scene's first hair: a pixel stands for the root at its place."""

from __future__ import annotations

import numpy as np

from realtime.frame import Frame
from realtime.graph import Pass
from realtime.hair import Skinned
from realtime.hair_roots import Scalp, film_places, places_in, root_rows, the_hair
from scenes.errors import InputError
from scenes.grooming import film_uv, shape_at
from scenes.image import Bool, Float64


def film_roots_pass() -> Pass:
    """Write `film_roots`, the root at each pixel, row by row from the bottom."""
    return Pass("roots of pixels", _upload, reads=("scalps",), writes=("film_roots",), is_baked=True)


def chart_pass(tangent: bool, handedness: bool = True) -> Pass:
    """Write `image`: where the hair ends that is rooted at a pixel's place, or the tangent there."""
    defines = ({"TANGENT": 1} if tangent else {}) | ({} if handedness else {"NO_HANDEDNESS": 1})
    return Pass("chart", lambda frame: _draw(frame, defines), reads=("deformed", "film_roots"), writes=("image",))


def film_points(frame: Frame, scalp: Scalp) -> tuple[Float64, Bool]:
    """(u, v) at the pixels (H * W, 2), row by row from the bottom, and which mean the mirrored copy of the chart."""
    sensor = frame.scene.sensor
    uv, mirrored = film_uv(scalp.shape, frame.scene.hair[0], sensor.width, sensor.height)
    from_bottom = np.arange(len(uv)).reshape(sensor.height, sensor.width)[::-1].reshape(-1)
    return uv[from_bottom], mirrored[from_bottom]


def _upload(frame: Frame) -> None:
    hair = the_hair(frame.scene)[0]
    scalp = frame.resources["scalps"][hair.on].scalp
    uv, mirrored = film_points(frame, scalp)
    places = film_places(places_in(scalp, uv), mirrored)
    if len(places.point) < len(uv):
        raise InputError(
            f"Found {len(uv) - len(places.point)} of {len(uv)} places of the region of hair '{hair.name}' where "
            f"'{hair.on}' has no face in (u, v). Choose a region that its texture coordinates cover."
        )
    rows = root_rows(scalp, places, shape_at(frame.scene, hair, uv), np.ones((len(uv), 3)), hair.radius)
    frame.resources["film_roots"] = frame.context.buffer(rows.tobytes())


def _draw(frame: Frame, defines: dict[str, int]) -> None:
    skinned: Skinned = frame.resources["deformed"][frame.scene.hair[0].on]
    skinned.bind()
    frame.resources["film_roots"].bind_to_storage_buffer(0)
    image = frame.texture(frame.size, 4)
    image.bind_to_image(0, read=False, write=True)
    frame.dispatch(frame.program("hair/chart.comp", **defines), *frame.size)
    frame.resources["image"] = image
