"""The image of a check as it was drawn, kept beside its pictures for later comparisons."""

from pathlib import Path

from scenes.digest import digest_of, scene_parts
from scenes.errors import ImageError
from scenes.exr import read_exr, write_exr
from scenes.image import Float32, Image
from scenes.model import Scene

SHOWS = "shows"
"""The key of an image's provenance under which stands the digest of its scene."""


def write_linear(folder: Path, stem: str, image: Image, scene: Scene) -> str:
    """Write `images/STEM-linear.exr` under `folder`: the image as it was drawn, with what tells its scene from others.

    Parameters
    ----------
    folder : the report's folder.
    stem : a file name without folders, different for each check.
    image : linear values of the quantity, before any exposure is fitted.

    Returns
    -------
    The path relative to `folder`.
    """
    (folder / "images").mkdir(parents=True, exist_ok=True)
    path = f"images/{stem}-linear.exr"
    write_exr(folder / path, Image(image.pixels, image.provenance | {SHOWS: digest_of(scene_parts(scene))}))
    return path


def read_linear(path: Path, scene: Scene) -> Float32:
    """The pixels that `write_linear` wrote.

    Raises
    ------
    ImageError
        The file is missing or damaged, or shows another scene than this one is now.
    """
    image = read_exr(path)
    if image.provenance.get(SHOWS) != digest_of(scene_parts(scene)):
        raise ImageError(
            f"'{path}' does not show the scene '{scene.name}' as it is now; the truth of this one says nothing about "
            "it. Run the checks again with this scene."
        )
    return image.pixels
