"""What would run for a scene, and what would not."""

import argparse

from comparisons.options import Commands, Say, add_own, say_all


def register(commands: Commands) -> None:
    explain = commands.add(
        "explain", explain_scene, "what a scene runs, what it skips, and why", "lightgauge explain small-room-knot"
    )
    explain.add_argument("scene", help="a name from `lightgauge list`, or a path to a TOML file")
    add_own(explain)


def explain_scene(options: argparse.Namespace, say: Say) -> int:
    from comparisons.explain import explanation
    from comparisons.own import load_techniques
    from comparisons.request import request_of
    from comparisons.validate import validate
    from scenes.load import find_scene, load_scene

    own = load_techniques(options.techniques, options.budgets)
    scene = own.added_to(load_scene(find_scene(options.scene)))
    validate([request_of(scene, options.scene)])
    say_all(say, explanation(scene))
    say_all(say, own.notes([options.scene], [scene.name], [scene]))
    return 0
