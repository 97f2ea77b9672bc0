"""What there is to run."""

import argparse

from comparisons.options import Commands, Say, add_techniques


def register(commands: Commands) -> None:
    listing = commands.add("list", list_all, "scenes, techniques, quantities and metrics", "lightgauge list")
    add_techniques(listing)


def list_all(options: argparse.Namespace, say: Say) -> int:
    from comparisons.metrics import METRICS
    from comparisons.own import load_techniques
    from realtime.techniques import MODULES as TECHNIQUES
    from realtime.techniques import technique
    from reference.quantities import MODULES as QUANTITIES
    from reference.quantities import quantity
    from scenes.load import library_scenes, load_scene

    own = load_techniques(options.techniques)
    sections = {
        "scenes": {name: load_scene(path).title for name, path in library_scenes().items()},
        "techniques": {name: technique(name).summary for name in (*TECHNIQUES, *own.names)},
        "quantities": {name: f"[{quantity(name).unit}] {quantity(name).summary}" for name in QUANTITIES},
        "metrics": {name: metric.summary for name, metric in METRICS.items()},
    }
    for title, entries in sections.items():
        say(f"{title}:")
        width = max(len(name) for name in entries)
        for name, summary in entries.items():
            say(f"  {name:{width}}  {summary}")
    return 0
