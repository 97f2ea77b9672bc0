"""What the store of truth holds; prune or merge it."""

import argparse
from pathlib import Path

from comparisons.options import Commands, Say, add_store, say_all


def register(commands: Commands) -> None:
    store = commands.add(
        "store", look_after, "what the store of truth holds; prune or merge it", "lightgauge store --prune 500M"
    )
    change = store.add_mutually_exclusive_group()
    change.add_argument("--prune", metavar="SIZE", help="remove what was used least recently until it fits, e.g. 500M")
    change.add_argument("--merge", metavar="FOLDER", type=Path, help="take over what another store holds")
    add_store(store)


def look_after(options: argparse.Namespace, say: Say) -> int:
    from comparisons.answers.store import inventory_lines, merge_lines, parse_size, prune
    from reference.store import Store

    store = Store(options.store)
    if options.prune is not None:
        say_all(say, prune(store, parse_size(options.prune)))
    elif options.merge is not None:
        say_all(say, merge_lines(store, options.merge))
    else:
        say_all(say, inventory_lines(store))
    return 0
