"""What would run for a scene, and what would not."""

import argparse

from comparisons.options import Commands, Say, say_all


def register(commands: Commands) -> None:
    explain = commands.add(
        "explain", explain_scene, "what a scene runs, what it skips, and why", "lightgauge explain small-room-knot"
    )
    explain.add_argument("scene", help="a name from `lightgauge list`, or a path to a TOML file")


def explain_scene(options: argparse.Namespace, say: Say) -> int:
    from comparisons.explain import explanation
    from comparisons.request import request_of
    from comparisons.validate import validate
    from scenes.load import find_scene, load_scene

    scene = load_scene(find_scene(options.scene))
    validate([request_of(scene, options.scene)])
    say_all(say, explanation(scene))
    return 0
