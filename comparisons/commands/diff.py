"""Which of two techniques, settings or runs is closer to the truth."""

import argparse
import warnings

from comparisons.options import Commands, Say, add_store, add_techniques, say_all


def register(commands: Commands) -> None:
    diff = commands.add(
        "diff",
        compare_two,
        "which of two techniques, settings or finished runs is closer to the truth?",
        "lightgauge diff indirect.probe indirect.irradiance --scene small-room-knot",
        "lightgauge diff 'indirect.talk[c_height=0.0,fitted]' 'indirect.talk[c_height=7.0,fitted]' "
        "--scene small-room-knot",
        "lightgauge diff report-before report-after",
    )
    for side in ("a", "b"):
        diff.add_argument(side, metavar=side.upper(), help="TECHNIQUE, TECHNIQUE[setting=value,fitted], or a run")
    diff.add_argument(
        "--scene", metavar="SCENE", help="a name or a path to a TOML file; needed unless A and B are runs"
    )
    diff.add_argument("--metric", metavar="METRIC", default="nrmse", help="nrmse (default) or rel_mse_eps1e-2")
    add_techniques(diff)
    add_store(diff)


def compare_two(options: argparse.Namespace, say: Say) -> int:
    from comparisons.answers.diff import diff_lines
    from comparisons.doctor import require_writable
    from comparisons.own import load_techniques
    from comparisons.progress import steps
    from reference.store import Store

    load_techniques(options.techniques)
    require_writable(options.store, "store", "--store")
    warnings.filterwarnings("ignore", module="colour")
    store = Store(options.store)
    with steps(say) as step:
        store.waiting = step
        lines, status = diff_lines(options.a, options.b, options.scene, options.metric, store, step)
    say_all(say, lines)
    return status
