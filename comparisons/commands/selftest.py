"""Plant faults, and see whether the checks notice."""

import argparse
import warnings

from comparisons.options import Commands, Say, add_own, add_selection, add_store, say_all


def register(commands: Commands) -> None:
    selftest = commands.add(
        "selftest",
        plant_faults,
        "plant known faults in every image: would the checks notice them?",
        "lightgauge selftest small-room-knot",
    )
    add_selection(selftest)
    add_own(selftest)
    add_store(selftest)


def plant_faults(options: argparse.Namespace, say: Say) -> int:
    from comparisons.answers.selftest import selftest_lines
    from comparisons.doctor import require_writable
    from comparisons.own import load_techniques
    from comparisons.progress import steps
    from comparisons.selection import select
    from comparisons.validate import validate
    from reference.store import Store

    requests = select(options.scenes, options.keep, load_techniques(options.techniques, options.budgets))
    validate(requests)
    require_writable(options.store, "store", "--store")
    warnings.filterwarnings("ignore", module="colour")
    store = Store(options.store)
    with steps(say) as step:
        store.waiting = step
        lines, status = selftest_lines(requests, store, step)
    say_all(say, lines)
    return status
