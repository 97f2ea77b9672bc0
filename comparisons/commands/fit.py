"""Fit a technique's constants on some scenes and test them on others."""

import argparse
import warnings
from pathlib import Path

from comparisons.options import Commands, Say, add_store, add_techniques, say_all
from scenes.errors import InputError


def register(commands: Commands) -> None:
    fit = commands.add(
        "fit",
        fit_constants,
        "fit the constants of a technique to the truth of some scenes, and test them on others",
        "lightgauge fit indirect.talk --on 'small-room-*' --test large-room-ellipsoid --exposure",
        "lightgauge fit 'translucency.talk[lookup=slab]' --on skin-ear skin-wedge --test skin-figurine "
        "--parameters power=0.1..16",
        "lightgauge fit 'layered.talk[damping=0]' --on 'suit-blend-light*' --test 'suit-blend-held*' "
        "--metric rel_mse_eps1e-2 --look suit.toml",
        "lightgauge fit shadow.soft_talk --on shadow-room-2cm shadow-room-5cm shadow-room-10cm",
    )
    fit.add_argument("subject", metavar="TECHNIQUE", help="NAME, or NAME[setting=value] with settings that stay")
    fit.add_argument(
        "--on", metavar="SCENE", nargs="+", required=True, help="training scenes: names, paths, folders or patterns"
    )
    fit.add_argument(
        "--test",
        metavar="SCENE",
        nargs="+",
        default=[],
        help="scenes held out; without any, each training scene is held out in its turn",
    )
    fit.add_argument(
        "--parameters",
        metavar="NAMES",
        default="",
        help="what to fit, separated by commas: NAME or NAME=LOW..HIGH; default: the constants that the technique "
        "declares as tuned by eye",
    )
    fit.add_argument("--exposure", action="store_true", help="fit one factor on all images too")
    fit.add_argument("--metric", metavar="METRIC", default="nrmse", help="nrmse (default) or rel_mse_eps1e-2")
    fit.add_argument("--spp", metavar="N", type=int, default=256, help="truth of at least N samples a pixel; 256")
    fit.add_argument(
        "--evaluations",
        metavar="N",
        type=int,
        help="settings after which the search ends, but for a first look around; default: 40 for each parameter",
    )
    fit.add_argument(
        "-o", dest="file", metavar="FILE", type=Path, default=Path("fit.json"), help="the result; default: fit.json"
    )
    fit.add_argument(
        "--look", metavar="FILE", type=Path, help="write all sliders of the technique as a look of your own: FILE.toml"
    )
    add_techniques(fit)
    add_store(fit)


def fit_constants(options: argparse.Namespace, say: Say) -> int:
    from comparisons.answers.fit import Asked, fit_lines
    from comparisons.doctor import require_writable
    from comparisons.own import load_techniques
    from comparisons.progress import steps
    from reference.store import Store

    if options.file.is_dir():
        raise InputError(f"'{options.file}' is a folder. Name a file with -o, such as {options.file / 'fit.json'}.")
    load_techniques(options.techniques)
    require_writable(options.store, "store", "--store")
    require_writable(options.file.parent, "folder", "-o")
    if options.look is not None:
        require_writable(options.look.parent, "folder", "--look")
    warnings.filterwarnings("ignore", module="colour")
    asked = Asked(
        subject=options.subject,
        on=tuple(options.on),
        test=tuple(options.test),
        parameters=tuple(name for name in options.parameters.split(",") if name.strip()),
        with_exposure=options.exposure,
        metric=options.metric,
        spp=options.spp,
        evaluations=options.evaluations,
        file=options.file,
        look=options.look,
    )
    store = Store(options.store)
    with steps(say) as step:
        store.waiting = step
        lines, status = fit_lines(asked, store, step)
    say_all(say, lines)
    return status
