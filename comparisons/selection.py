"""Which scenes and which of their checks are meant by the arguments of a command."""

from collections.abc import Sequence

from comparisons.request import Request, request_of
from scenes.errors import InputError
from scenes.load import find_scene, library_scenes, load_scene


def select(arguments: Sequence[str], keep: str) -> list[Request]:
    """The scenes that the arguments name, all shipped ones if there are none, with the checks that contain `keep`.

    Raises
    ------
    InputError
        A scene cannot be read, or no check is left.
    """
    names = list(arguments) or list(library_scenes())
    once = {find_scene(name).resolve(): name for name in reversed(names)}
    requests = [
        request_of(load_scene(find_scene(name)), name, lambda check_id: keep in check_id)
        for name in reversed(once.values())
    ]
    kept = [r for r in requests if r.checks]
    if not kept:
        raise InputError(
            f"No check of {', '.join(names)} contains '{keep}'. See `lightgauge list` and `lightgauge explain SCENE`."
        )
    return kept
