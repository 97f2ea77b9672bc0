"""An image of a user's own engine against the truth."""

import argparse
import warnings
from pathlib import Path

from comparisons.options import Commands, Say, add_store, say_all


def register(commands: Commands) -> None:
    compare = commands.add(
        "compare",
        compare_image,
        "how wrong is the image of another engine?",
        "lightgauge compare knot.exr --scene small-room-knot --quantity indirect_radiance",
        "lightgauge compare knot.exr --depth knot-z.exr --scene small-room-knot --quantity indirect_radiance "
        "--budget nrmse=0.05",
    )
    compare.add_argument("image", metavar="IMAGE", type=Path, help="an EXR, PNG, Radiance HDR or PFM file")
    compare.add_argument("--scene", metavar="SCENE", required=True, help="a name or a path to a TOML file")
    compare.add_argument("--quantity", metavar="QUANTITY", required=True, help="what it shows; see `lightgauge list`")
    compare.add_argument(
        "--budget",
        metavar="METRIC=[MIN..]MAX",
        action="append",
        default=[],
        help="what is allowed, such as nrmse=0.05 or energy_bias=-0.02..0.04; may be repeated; without any, the error "
        "is measured and not judged",
    )
    compare.add_argument(
        "--depth", metavar="FILE", type=Path, help="the engine's depth, by which it is seen that both see the same"
    )
    compare.add_argument("--layer", metavar="LAYER", help="of an EXR that holds several images")
    compare.add_argument("--depth-layer", metavar="LAYER", help="of the depth's EXR")
    compare.add_argument(
        "--color-space", choices=("srgb", "linear"), help="of the file's values; default: srgb for PNG, else linear"
    )
    compare.add_argument(
        "--fit-exposure", action="store_true", help="judge the image times the one factor that suits it best"
    )
    compare.add_argument(
        "-o",
        dest="folder",
        metavar="FOLDER",
        type=Path,
        default=Path("comparison"),
        help="for pictures and the report; default: comparison",
    )
    add_store(compare)


def compare_image(options: argparse.Namespace, say: Say) -> int:
    from comparisons.answers.compare import Asked, compare
    from comparisons.doctor import require_writable
    from comparisons.progress import steps
    from reference.store import Store

    require_writable(options.store, "store", "--store")
    warnings.filterwarnings("ignore", module="colour")
    asked = Asked(
        image=options.image,
        scene=options.scene,
        quantity=options.quantity,
        budgets=tuple(options.budget),
        layer=options.layer,
        color_space=options.color_space,
        depth=options.depth,
        depth_layer=options.depth_layer,
        fit_exposure=options.fit_exposure,
        folder=options.folder,
    )
    store = Store(options.store)
    with steps(say) as step:
        store.waiting = step
        lines, status = compare(asked, store, step)
    say_all(say, lines)
    return status
