"""A scene as glTF, for other engines."""

import argparse
from pathlib import Path

from comparisons.options import Commands, Say, say_all


def register(commands: Commands) -> None:
    export = commands.add(
        "export",
        export_scene,
        "a scene as glTF, for an engine of your own",
        "lightgauge export small-room-knot -o knot.glb",
    )
    export.add_argument("scene", help="a name from `lightgauge list`, or a path to a TOML file")
    export.add_argument(
        "-o", dest="file", metavar="FILE", type=Path, help="ends in .glb or .gltf; default: SCENE.glb here"
    )


def export_scene(options: argparse.Namespace, say: Say) -> int:
    from comparisons.answers.export import export

    say_all(say, export(options.scene, options.file))
    return 0
