"""Draw shadow-depth-range.svg: how the error of hard shadows depends on the clip planes and on the depth format.

From the repository: .venv/bin/python docs/images/shadow_depth_range.py; takes a minute.
"""

from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory

from comparisons.metrics import Samples, evaluate
from comparisons.report.plot import Point, Series, loglog_plot
from realtime.render import Renderer
from realtime.techniques import technique
from reference.estimator import Reference
from reference.store import Store
from scenes.checks import SettingValue
from scenes.load import find_scene, load_scene
from scenes.model import Scene

RATIOS = (10.0, 100.0, 1000.0, 10000.0, 100000.0)
ZBIAS, TUNED_FOR = 7e-4, 100.0
"""The constant bias of shadow.vcm, and the ratio of clip planes that it suits."""

CURVES = (
    ("constant bias, D24", "shadow.vcm", "D24", lambda ratio: {"zbias": ZBIAS}),
    ("scaled bias, D16", "shadow.vcm", "D16", lambda ratio: {"zbias": ZBIAS * TUNED_FOR / ratio}),
    ("scaled bias, D24", "shadow.vcm", "D24", lambda ratio: {"zbias": ZBIAS * TUNED_FOR / ratio}),
    ("zero bias, D24", "shadow.vcm", "D24", lambda ratio: {"zbias": 0.0}),
    ("analytic, D16", "shadow.vcm_analytic", "D16", lambda ratio: {}),
)


def curves(scene: Scene) -> Iterator[Series]:
    """Share of the area that is wrongly lit or shadowed [%] against far / near, for each of CURVES."""
    renderer = Renderer(scene)
    with TemporaryDirectory() as folder:
        truth = Reference(scene, Store(Path(folder)), lambda what, share: None).truth("visibility", 0)
    samples = Samples(truth.accumulators, truth.mask)
    for label, name, depth_format, bias in CURVES:
        points = []
        for ratio in RATIOS:
            settings: dict[str, SettingValue] = {"far_over_near": ratio, "depth_format": depth_format, **bias(ratio)}
            image = renderer.render(technique(name), settings, timed=False).image
            points.append(Point(ratio, 100 * evaluate("misclassified", image.pixels, samples).value))
        yield Series(label, points)


if __name__ == "__main__":
    shipped = load_scene(find_scene("shadow-room"))
    title = "Hard shadows: misclassified area, shadow-room, N = 1024"
    svg = loglog_plot(title, "far plane / near plane", "misclassified [%]", list(curves(shipped)))
    (Path(__file__).parent / "shadow-depth-range.svg").write_text(svg, encoding="utf-8")
