"""The code that a verdict depends on, besides what draws the image: `realtime.code` has that."""

import importlib.metadata
from collections.abc import Iterable
from functools import cache
from pathlib import Path

from comparisons.metrics import metric_named
from realtime.code import shader_code
from realtime.shader import GLSL
from scenes.digest import PACKAGES_FOLDER, code_digest, digest_of, used_by

PACKAGES = ("comparisons", "reference", "scenes")
REGISTRIES = ("comparisons.metrics", "reference.quantities")
JUDGE = "comparisons.judgement"

LIBRARIES = ("numpy", "scipy", "scikit-image", "colour-science", "flip-evaluator", "moderngl", "trimesh")
"""Distributions that draw, measure and judge; what renders the truth counts with that."""

RENDERING_PACKAGES = ("scenes", "realtime", "reference")


@cache
def judging_code(metrics: tuple[str, ...]) -> str:
    """Digest of all code that judges a drawn image by some metrics, and makes the pictures; comments do not matter.

    Raises
    ------
    InputError
        One of the metrics does not exist.
    """
    asked = [metric_named(name) for name in metrics]
    described = [(m.name, m.unit, m.function.__qualname__, m.noise_power, m.is_signed) for m in asked]
    return digest_of(described, code_digest(*sorted(modules_of(metrics))))


def modules_of(metrics: Iterable[str]) -> frozenset[Path]:
    """The Python files that judge a drawn image by some metrics."""
    measuring = (metric_named(name).function.__module__ for name in metrics)
    return used_by((JUDGE, *measuring), PACKAGES, REGISTRIES)


@cache
def library_versions() -> dict[str, str]:
    """The versions of `LIBRARIES`, without importing them."""
    return {name: importlib.metadata.version(name) for name in LIBRARIES}


@cache
def rendering_code() -> str:
    """Digest of all code that draws images and renders truths, whichever they are."""
    python = [path for name in RENDERING_PACKAGES for path in PACKAGES_FOLDER.joinpath(name).rglob("*.py")]
    shaders = [shader_code(path) for path in sorted(GLSL.rglob("*")) if path.is_file()]
    return digest_of(code_digest(*sorted(python)), shaders)
