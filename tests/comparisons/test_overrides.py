"""Budgets for a renderer that has not drawn."""

from comparisons.overrides import idle_lines, idle_overrides
from scenes.checks import Check, Criterion, RendererBounds

LLVMPIPE, H200 = "llvmpipe (LLVM 15.0.6, 256 bits), OpenGL 4.5", "NVIDIA H200/PCIe/SSE2, OpenGL 4.3"


def check_for(*renderers: str) -> Check:
    others = tuple(RendererBounds(renderer=name, max=0.2, reason="measured there") for name in renderers)
    criterion = Criterion(metric="nrmse", max=0.1, reason="a bound for a test", by_renderer=others)
    return Check(quantity="depth", technique="raster.depth", criteria=(criterion,))


def test_a_name_that_met_no_renderer_is_said_once_with_its_number() -> None:
    checks = [check_for("NVIDIA", "Radeon"), check_for("nvidia", "Radeon"), check_for()]
    idle = idle_overrides(checks, {H200})
    assert idle == {"Radeon": 2}
    assert list(idle_lines(idle)) == ['2 budgets by_renderer "Radeon" matched nothing that drew here.']


def test_every_renderer_that_drew_counts() -> None:
    assert idle_overrides([check_for("NVIDIA", "llvmpipe")], {LLVMPIPE, H200}) == {}


def test_nothing_is_said_where_nothing_was_drawn() -> None:
    assert idle_overrides([check_for("NVIDIA")], set()) == {}
