import importlib.metadata
import os
import subprocess
import sys
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

from reference.start import CHOICE, VARIANTS, choose_llvm, mitsuba, packaged_llvm, variant
from scenes.errors import InputError, NoCompiler


def without_package(name: str) -> Any:
    raise importlib.metadata.PackageNotFoundError(name)


def test_the_packaged_llvm_is_chosen_unless_another_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("DRJIT_LIBLLVM_PATH", raising=False)
    found = choose_llvm()
    assert found == packaged_llvm()
    assert found.is_file()
    monkeypatch.setenv("DRJIT_LIBLLVM_PATH", str(found))
    assert choose_llvm() == found


def test_without_package_and_setting_there_is_no_compiler(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("DRJIT_LIBLLVM_PATH", raising=False)
    monkeypatch.setattr("importlib.metadata.files", without_package)
    with pytest.raises(NoCompiler, match=r"karellen-llvm-core is not installed.*make setup") as caught:
        choose_llvm()
    assert caught.value.exit_status == 4
    assert "\n" not in str(caught.value)


def test_a_package_without_its_library_counts_as_absent(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("DRJIT_LIBLLVM_PATH", raising=False)
    monkeypatch.setattr("importlib.metadata.files", lambda name: [])
    assert packaged_llvm() is None
    with pytest.raises(NoCompiler):
        choose_llvm()


def test_a_setting_that_names_no_file_is_refused(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("DRJIT_LIBLLVM_PATH", str(tmp_path / "libLLVM.so"))
    with pytest.raises(NoCompiler, match=r"libLLVM\.so', which is not a file"):
        choose_llvm()


def test_a_library_that_is_no_llvm_is_tried_elsewhere_and_refused(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """In a process of its own: an LLVM that is too old aborts."""
    library = tmp_path / "libLLVM.so"
    library.write_text("not a library", encoding="ascii")
    monkeypatch.setenv("DRJIT_LIBLLVM_PATH", str(library))
    with pytest.raises(NoCompiler, match="a test kernel failed with DRJIT_LIBLLVM_PATH"):
        choose_llvm()


def test_a_mitsuba_that_cannot_be_imported_is_no_compiler(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("DRJIT_LIBLLVM_PATH", "")
    monkeypatch.setattr("reference.start.choose_llvm", lambda: Path("libLLVM.so"))
    monkeypatch.setitem(sys.modules, "drjit", None)
    with pytest.raises(NoCompiler, match=r"Mitsuba does not start.*libatomic1"):
        mitsuba.__wrapped__()


def test_the_variant_is_the_default_unless_the_environment_names_another(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv(CHOICE, raising=False)
    assert variant() == "llvm_ad_rgb"
    for name in VARIANTS:
        monkeypatch.setenv(CHOICE, name)
        assert variant() == name


def test_an_unknown_variant_is_refused_with_those_that_are_allowed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(CHOICE, "scalar_rgb")
    with pytest.raises(InputError, match=r"LIGHTGAUGE_VARIANT is 'scalar_rgb'.*llvm_ad_rgb and cuda_ad_rgb"):
        variant()


def test_a_gpu_needs_no_llvm_and_its_absence_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    def no_llvm() -> Path:
        raise AssertionError("looked for an LLVM")

    monkeypatch.setenv(CHOICE, "cuda_ad_rgb")
    monkeypatch.setattr("reference.start.choose_llvm", no_llvm)
    monkeypatch.setitem(sys.modules, "drjit", None)
    with pytest.raises(NoCompiler, match=r"LIGHTGAUGE_VARIANT=cuda_ad_rgb.*NVIDIA.*Unset"):
        mitsuba.__wrapped__()


def test_mitsuba_starts_with_its_variant_and_library(mi: ModuleType) -> None:
    assert mi.variant() == variant()
    assert Path(os.environ["DRJIT_LIBLLVM_PATH"]).is_file()


def test_asking_for_a_truth_that_is_stored_imports_no_renderer() -> None:
    code = "import sys, reference.estimator, reference.quantities as q; [q.quantity(n) for n in q.MODULES];"
    code += "print(*({'mitsuba', 'drjit', 'moderngl', 'realtime'} & set(sys.modules)))"
    made = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert made.returncode == 0, made.stderr
    assert made.stdout.split() == []
