"""Where does it break? Techniques and shader functions, from mild to harsh."""

import argparse
from pathlib import Path

from comparisons.options import Commands, Say, add_techniques, say_all


def register(commands: Commands) -> None:
    stress = commands.add(
        "stress",
        find_breaks,
        "put techniques and shader functions under stress: where does each break?",
        "lightgauge stress                                   everything, table in ./stress",
        "lightgauge stress 'indirect.*' --stress rotation    some techniques under one stress",
        "lightgauge stress shadow.soft --stress rotation --at 90    one magnitude alone: a failure again",
        "lightgauge stress --technique mine.frag             a technique of your own",
        "lightgauge stress lib/fresnel.glsl:F_talk --input '{\"cos_i\": 0.5}'    a function step by step",
    )
    stress.add_argument(
        "subjects",
        nargs="*",
        metavar="TECHNIQUE|FUNCTION",
        help="a technique, a shader function as FILE:FUNCTION, or a pattern such as 'shadow.*'; all if none",
    )
    stress.add_argument(
        "--stress",
        dest="stresses",
        metavar="NAME",
        action="append",
        default=[],
        help="put under this stress alone, such as offset or 'scale-*'; repeatable",
    )
    stress.add_argument(
        "--at", metavar="MAGNITUDE", type=float, help="try this magnitude alone, within the range of the stress"
    )
    stress.add_argument(
        "--input",
        metavar="JSON",
        help="run one function on this input, and show every step; --stress fp16: judge half precision",
    )
    add_techniques(stress)
    stress.add_argument(
        "-o", dest="folder", metavar="FOLDER", type=Path, default=Path("stress"), help="default: stress"
    )


def find_breaks(options: argparse.Namespace, say: Say) -> int:
    if options.input is not None:
        from comparisons.answers.shader_function import run_function

        lines, status = run_function(options.subjects, options.stresses, options.input)
        say_all(say, lines)
        return status

    from comparisons.answers.stress import chosen, run_stress
    from comparisons.doctor import require_writable
    from comparisons.own import load_techniques
    from comparisons.progress import steps

    own = load_techniques(options.techniques)
    asked = chosen(options.subjects or list(own.names), options.stresses, options.at)
    require_writable(options.folder, "output folder", "-o")
    with steps(say) as step:
        lines, status = run_stress(asked, options.folder, step)
    say_all(say, lines)
    return status
