"""The exceptions of the whole project. Each message says what was found, what is allowed, what to do.

LightgaugeError
├── InputError            exit status 3: the user can mend it by changing an argument or a file
│   ├── SceneError        a scene file, or something it points at
│   └── ImageError        an image file or array
│       └── CorruptImage  the pixels do not match the checksum written beside them
└── MachineError          exit status 4: this machine lacks something, or a renderer failed
    ├── NoGraphics        no OpenGL context
    ├── NoCompiler        no usable LLVM for Dr.Jit
    ├── NoCluster         no connection to what should render
    └── RenderError       a renderer produced nothing usable
        └── FlaggedPixels at some pixels, which it names
"""

import difflib
from collections.abc import Iterable
from typing import Any, Self


class LightgaugeError(Exception):
    """Base of every error that the command line reports in one paragraph."""

    exit_status = 4


class InputError(LightgaugeError):
    exit_status = 3


class SceneError(InputError):
    pass


class ImageError(InputError):
    pass


class CorruptImage(ImageError):
    pass


class MachineError(LightgaugeError):
    exit_status = 4


class NoGraphics(MachineError):
    pass


class NoCompiler(MachineError):
    pass


class NoCluster(MachineError):
    pass


class RenderError(MachineError):
    pass


class FlaggedPixels(RenderError):
    """`flagged` (H, W) bool, row 0 at the top: the pixels at which there is no value."""

    def __init__(self, message: str, flagged: Any) -> None:
        super().__init__(message)
        self.flagged = flagged

    def __reduce__(self) -> tuple[type[Self], tuple[str, Any]]:
        return type(self), (str(self), self.flagged)


def unknown_name(kind: str, name: str, known: Iterable[str]) -> InputError:
    """The error for a name that does not exist: it lists those that do, and the closest."""
    names = list(known)
    close = difflib.get_close_matches(name, names, 1)
    hint = f" Did you mean '{close[0]}'?" if close else ""
    return InputError(f"Unknown {kind} '{name}'. Known: {', '.join(names)}.{hint}")
