"""Measure how honest the error bars are."""

import argparse
from pathlib import Path

from comparisons.options import Commands, Say, add_store, say_all
from scenes.errors import InputError


def register(commands: Commands) -> None:
    calibrate = commands.add(
        "calibrate",
        measure,
        "measure how honest the error bars are, on truths that are known exactly (some minutes)",
        "lightgauge calibrate -o docs/calibration.md",
    )
    calibrate.add_argument(
        "-o", dest="file", metavar="FILE", type=Path, default=Path("calibration.md"), help="default: calibration.md"
    )
    calibrate.add_argument(
        "--repetitions", metavar="N", type=int, default=200, help="of each simulated experiment; default: 200"
    )
    add_store(calibrate)


def measure(options: argparse.Namespace, say: Say) -> int:
    from comparisons.answers.calibrate import calibration_lines
    from comparisons.doctor import require_writable
    from comparisons.progress import steps
    from reference.store import write_text

    if options.repetitions < 2:
        raise InputError(f"--repetitions is {options.repetitions}. At least 2 are needed, 200 are usual.")
    if options.file.is_dir():
        raise InputError(
            f"'{options.file}' is a folder. Name a file with -o, such as {options.file / 'calibration.md'}."
        )
    require_writable(options.file.absolute().parent, "output folder", "-o")
    require_writable(options.store, "store", "--store")
    with steps(say) as step:
        lines = list(calibration_lines(options.store / "kernels", options.repetitions, step))
    write_text(options.file, "\n".join([*lines, ""]))
    say_all(say, lines)
    return 0
