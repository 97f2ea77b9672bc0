"""docs/your-scene.md: its example, run as a reader would."""

import re
import shutil
import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Any

from scenes.checks import Check
from scenes.load import load_scene

Run = Callable[..., Any]

DOCS = Path(__file__).parents[2] / "docs"
EXAMPLE = DOCS / "examples" / "knot-under-a-lamp.toml"


def test_the_example_holds_its_budgets(here: Path, lightgauge: Run) -> None:
    shutil.copy(EXAMPLE, here / "mine.toml")
    outcome = lightgauge("run", "mine.toml", "-o", "out")
    assert (outcome.status, outcome.err) == (0, "")
    assert "mine/indirect.probe" in outcome.out


def test_the_budgets_of_the_page_can_be_written() -> None:
    text = (DOCS / "your-scene.md").read_text(encoding="utf-8")
    shown = re.findall(r"```toml\n(.*?)```", text, re.DOTALL)
    assert len(shown) == 2
    for block in shown:
        criteria = block if block.startswith("criteria") else f"criteria = [\n{block}]"
        written = tomllib.loads(criteria)["criteria"]
        for criterion in written:
            criterion["by_renderer"] = tuple(criterion.get("by_renderer", ()))
        check = {"quantity": "depth", "technique": "raster.depth", "criteria": tuple(written)}
        assert len(Check.model_validate(check).criteria) == 1


def test_the_budget_that_the_page_explains_is_the_example_s() -> None:
    criterion = load_scene(EXAMPLE).checks[0].criteria[0]
    text = (DOCS / "your-scene.md").read_text(encoding="utf-8")
    assert f'max = {criterion.max:g}, reason = "{criterion.reason}"' in text
