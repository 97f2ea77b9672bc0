"""What may depend on what, read from the source."""

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
MAY_IMPORT = {
    "scenes": {"scenes"},
    "realtime": {"scenes", "realtime"},
    "reference": {"scenes", "reference"},
    "comparisons": {"scenes", "realtime", "reference", "comparisons"},
}
HEAVY = {"mitsuba", "drjit", "moderngl", "trimesh", "colour", "skimage", "flip_evaluator"}
ENDS_THE_PROCESS = {"exit", "quit", "_exit", "abort"}


def sources(package: str) -> list[Path]:
    return sorted((ROOT / package).rglob("*.py"))


def parsed(path: Path) -> ast.Module:
    return ast.parse(path.read_text(encoding="utf-8"), str(path))


def imported(node: ast.AST) -> Iterator[str]:
    """The top-level packages that an import statement names."""
    if isinstance(node, ast.Import):
        yield from (alias.name.partition(".")[0] for alias in node.names)
    elif isinstance(node, ast.ImportFrom):
        yield "." if node.level else str(node.module).partition(".")[0]


def all_imports(tree: ast.AST) -> set[str]:
    return {name for node in ast.walk(tree) for name in imported(node)}


def imports_when_loaded(node: ast.AST) -> set[str]:
    """What is imported by importing the module: not what stands in a function or under `if TYPE_CHECKING`."""
    if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef, ast.Lambda)):
        return set()
    children: list[ast.AST] = list(ast.iter_child_nodes(node))
    if isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING":
        children = list(node.orelse)
    return {*imported(node), *(name for child in children for name in imports_when_loaded(child))}


def prints_or_exits(tree: ast.AST) -> set[str]:
    """Calls that print or end the process, and mentions of SystemExit."""
    found = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Call):
            owner, _, method = ast.unparse(node.func).rpartition(".")
            writes = owner in {"sys.stdout", "sys.stderr"} and method.startswith("write")
            if writes or method in ENDS_THE_PROCESS or (owner, method) == ("", "print"):
                found.add(f"{owner}.{method}")
        elif isinstance(node, ast.Name) and node.id == "SystemExit":
            found.add(node.id)
    return found


@pytest.mark.parametrize("package", MAY_IMPORT)
def test_a_package_imports_only_what_lies_below_it(package: str) -> None:
    assert sources(package)
    for path in sources(package):
        own = all_imports(parsed(path)) & {*MAY_IMPORT, ".", "tests"}
        assert own <= MAY_IMPORT[package], path


def test_the_packages_of_the_project_are_these() -> None:
    assert {path.parent.name for path in ROOT.glob("*/__init__.py")} == set(MAY_IMPORT)


@pytest.mark.parametrize("package", MAY_IMPORT)
def test_only_the_command_line_prints_and_exits(package: str) -> None:
    talking = [path.relative_to(ROOT).as_posix() for path in sources(package) if prints_or_exits(parsed(path))]
    assert talking == (["comparisons/cli.py"] if package == "comparisons" else [])


@pytest.mark.parametrize("package", MAY_IMPORT)
def test_what_is_slow_to_import_waits_for_its_use(package: str) -> None:
    for path in sources(package):
        allowed = {"drjit"} if path.is_relative_to(ROOT / "reference" / "integrators") else set()
        assert imports_when_loaded(parsed(path)) & HEAVY <= allowed, path


@pytest.mark.parametrize(
    ("text", "named"),
    [
        ("import realtime.camera as c", {"realtime"}),
        ("from reference.store import Store", {"reference"}),
        ("def f():\n    from realtime import camera", {"realtime"}),
        ("from . import camera", {"."}),
        ("import os, reference.store", {"os", "reference"}),
    ],
)
def test_an_import_is_found_wherever_it_stands(text: str, named: set[str]) -> None:
    assert all_imports(ast.parse(text)) == named


@pytest.mark.parametrize(
    ("text", "named"),
    [
        ("import mitsuba", {"mitsuba"}),
        ("try:\n    import drjit\nexcept ImportError:\n    pass", {"drjit"}),
        ("class A:\n    import moderngl", {"moderngl"}),
        ("if x:\n    from trimesh import load", {"trimesh"}),
        ("if TYPE_CHECKING:\n    import moderngl\nelse:\n    import colour", {"colour"}),
        ("def f():\n    import mitsuba", set()),
        ("class A:\n    def f(self):\n        import mitsuba", set()),
    ],
)
def test_an_import_counts_if_loading_the_module_runs_it(text: str, named: set[str]) -> None:
    assert imports_when_loaded(ast.parse(text)) == named


@pytest.mark.parametrize(
    ("text", "talks"),
    [
        ("print(1)", True),
        ("sys.exit(1)", True),
        ("os._exit(1)", True),
        ("raise SystemExit", True),
        ("raise SystemExit(3)", True),
        ("sys.stderr.write('x')", True),
        ("sys.stderr.isatty()", False),
        ("fingerprint(1)", False),
        ("context.__exit__()", False),
    ],
)
def test_every_way_to_print_or_exit_is_seen(text: str, talks: bool) -> None:
    assert bool(prints_or_exits(ast.parse(text))) is talks
