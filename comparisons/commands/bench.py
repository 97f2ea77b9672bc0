"""Run time against error: what a millisecond buys."""

import argparse
import warnings
from pathlib import Path

from comparisons.bench.scenes import SCENES, spelt
from comparisons.options import Commands, Say, add_keep, add_store, add_techniques, say_all

PARTS = ("points", "scaling", "ablation")


def register(commands: Commands) -> None:
    bench = commands.add(
        "bench",
        measure,
        "measure run time against error: techniques and the path tracer, in turns on this machine",
        "lightgauge bench indirect-light -o bench",
        "lightgauge bench eye --size 1280x1024 --only points",
        "lightgauge bench --scene mine.toml -k indirect.grid",
        "lightgauge bench --from bench/bench.json     the page again",
        "LIGHTGAUGE_VARIANT=cuda_ad_rgb lightgauge bench     the path tracer on an NVIDIA GPU",
    )
    bench.add_argument(
        "effects",
        nargs="*",
        metavar="EFFECT",
        help=f"{', '.join(map(spelt, SCENES))}, or how one begins; all if none",
    )
    bench.add_argument(
        "--scene",
        dest="scenes",
        metavar="SCENE",
        action="append",
        default=[],
        help="in place of the scenes that stand for an effect: a name or a path to a TOML file; repeatable",
    )
    add_keep(bench)
    add_techniques(bench)
    bench.add_argument("-o", dest="folder", metavar="FOLDER", type=Path, default=Path("bench"), help="default: bench")
    add_store(bench)
    bench.add_argument(
        "--size", metavar="WxH", default="", help="measure at this resolution, in place of half, once and twice the own"
    )
    bench.add_argument(
        "--frames", metavar="N", type=int, default=101, help="time N frames of a point at most; default: 101"
    )
    bench.add_argument(
        "--seconds-per-point",
        dest="seconds",
        metavar="S",
        type=float,
        default=1.0,
        help="time a point for about S seconds at most, or one frame if that takes longer; default: 1",
    )
    bench.add_argument(
        "--only", metavar="PART", action="append", choices=PARTS, help=f"of {', '.join(PARTS)}; repeatable"
    )
    bench.add_argument(
        "--from", dest="source", metavar="FILE", type=Path, help="measure nothing: write the page of this bench.json"
    )


def measure(options: argparse.Namespace, say: Say) -> int:
    from comparisons.answers.bench import closing_lines, page_again, run_bench
    from comparisons.bench.ask import Asked
    from comparisons.bench.measure import Pace
    from comparisons.doctor import require_writable
    from comparisons.own import load_techniques
    from comparisons.progress import steps
    from reference.store import Store

    if options.source:
        require_writable(options.folder, "output folder", "-o")
        say_all(say, page_again(options.source, options.folder))
        return 0
    load_techniques(options.techniques)
    asked = Asked(
        tuple(options.effects),
        tuple(options.scenes),
        options.keep,
        options.size,
        Pace(options.seconds, options.frames),
        tuple(options.only or PARTS),
    )
    require_writable(options.folder, "output folder", "-o")
    require_writable(options.store, "store", "--store")
    warnings.filterwarnings("ignore", module="colour")
    with steps(say) as step:
        store = Store(options.store, waiting=step)
        bench = run_bench(asked, options.folder, store, step, say)
    say_all(say, closing_lines(bench, options.folder))
    return 0
