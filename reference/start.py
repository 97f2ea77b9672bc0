"""The only place where Mitsuba is started."""

import importlib.metadata
import os
import subprocess
import sys
from functools import cache
from pathlib import Path
from types import ModuleType

from scenes.errors import InputError, NoCompiler

VARIANTS = ("llvm_ad_rgb", "cuda_ad_rgb")
"""What Mitsuba may compute with, the default first: processors, or an NVIDIA GPU."""

CHOICE = "LIGHTGAUGE_VARIANT"
"""The environment variable that names one of them. Truths of different ones are kept apart."""

THREADS = "LIGHTGAUGE_THREADS"
"""The environment variable that says how many threads Dr.Jit may use; one for each core if it is not set."""

_WHAT_TO_DO = (
    "Dr.Jit needs LLVM 17 or newer: run `make setup`, which installs the one from the PyPI package karellen-llvm-core, "
    "or set DRJIT_LIBLLVM_PATH to a libLLVM shared library of that age."
)


def variant() -> str:
    """What Mitsuba computes with in this process.

    Raises
    ------
    InputError
        The environment names something else than `VARIANTS`.
    """
    wanted = os.environ.get(CHOICE, VARIANTS[0])
    if wanted not in VARIANTS:
        raise InputError(
            f"{CHOICE} is '{wanted}'; allowed are {' and '.join(VARIANTS)}: RGB, and computing with whole arrays at a "
            f"time, is what all truths here are made of. Unset it to render with {VARIANTS[0]}."
        )
    return wanted


def packaged_llvm() -> Path | None:
    """The libLLVM of the package karellen-llvm-core, used where it lies; None when that package is absent."""
    try:
        files = importlib.metadata.files("karellen-llvm-core") or []
    except importlib.metadata.PackageNotFoundError:
        return None
    found = [Path(str(f.locate())) for f in files if f.name.startswith("libLLVM.so.")]
    return found[0] if found and found[0].exists() else None


def choose_llvm() -> Path:
    """The library to use: the user's own if DRJIT_LIBLLVM_PATH names one that works, else the packaged one.

    A library of the user's is tried in a process of its own, because LLVM 15 and 16 abort the process they run in.

    Raises
    ------
    NoCompiler
        There is no library, or the one that was named does not work.
    """
    wanted = os.environ.get("DRJIT_LIBLLVM_PATH")
    packaged = packaged_llvm()
    if wanted is None or (packaged is not None and Path(wanted) == packaged):
        if packaged is None:
            raise NoCompiler(f"No usable LLVM: the package karellen-llvm-core is not installed. {_WHAT_TO_DO}")
        return packaged
    if not Path(wanted).is_file():
        raise NoCompiler(f"No usable LLVM: DRJIT_LIBLLVM_PATH is '{wanted}', which is not a file. {_WHAT_TO_DO}")
    probe = f"import drjit, mitsuba as mi; mi.set_variant('{VARIANTS[0]}'); print(drjit.minimum(mi.Float([1, 2]), 1))"
    outcome = subprocess.run([sys.executable, "-c", probe], capture_output=True, timeout=120, check=False)
    if outcome.returncode != 0:
        raise NoCompiler(f"No usable LLVM: a test kernel failed with DRJIT_LIBLLVM_PATH='{wanted}'. {_WHAT_TO_DO}")
    return Path(wanted)


@cache
def mitsuba(kernel_cache: Path | None = None) -> ModuleType:
    """The module `mitsuba`, with its variant set; kernels are kept in `kernel_cache` across processes.

    Raises
    ------
    NoCompiler
        No usable LLVM, or where a GPU is asked for, none.
    InputError
        `variant` refuses the choice.
    """
    chosen = variant()
    if chosen.startswith("llvm"):
        os.environ["DRJIT_LIBLLVM_PATH"] = str(choose_llvm())
    if kernel_cache is not None:
        kernel_cache.mkdir(parents=True, exist_ok=True)
        os.environ.setdefault("DRJIT_CACHE_DIR", str(kernel_cache))
    try:
        import drjit
        import mitsuba

        mitsuba.set_variant(chosen)
        if THREADS in os.environ:
            drjit.set_thread_count(int(os.environ[THREADS]))
    except (ImportError, NameError) as error:
        if not chosen.startswith("llvm"):
            raise NoCompiler(
                f"Mitsuba does not start with {CHOICE}={chosen} ({error}). That needs an NVIDIA GPU whose driver works "
                f"(see nvidia-smi). Unset {CHOICE} to render with {VARIANTS[0]}, which needs none."
            ) from error
        raise NoCompiler(
            f"Mitsuba does not start ({error}). {_WHAT_TO_DO} On Debian it also needs libatomic1."
        ) from error
    mitsuba.set_log_level(mitsuba.LogLevel.Error)
    started: ModuleType = mitsuba
    return started
