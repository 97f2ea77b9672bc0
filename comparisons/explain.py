"""What would run for a scene and what would not, in words, without rendering anything."""

from collections.abc import Iterator

from comparisons.parity import checks_of
from comparisons.request import id_of
from realtime.render import plan_of
from realtime.techniques import technique
from reference.quantities import quantity
from scenes.checks import Bounds
from scenes.features import features_of
from scenes.geometry import geometry_of
from scenes.model import Scene


def explanation(scene: Scene) -> Iterator[str]:
    """Lines of text: the scene, its features, and for each check its passes, skips, integrator and budget."""
    sensor = scene.sensor
    yield f"{scene.name}: {scene.title}"
    if scene.description:
        yield f"  {scene.description}"
    yield f"  sensor    {sensor.type}, {sensor.width} x {sensor.height}, {sensor.fov_deg:g} deg along {sensor.fov_axis}"
    yield f"  subject   {', '.join(scene.subject)}"
    meshes = geometry_of(scene)
    triangles = sum(len(m.surface.faces) for m in meshes)
    yield f"  geometry  {len(meshes)} meshes, {triangles} triangles"
    features = features_of(scene, meshes)
    present = [name for name in vars(features) if getattr(features, name) is True]
    yield f"  features  {', '.join(name.replace('_', ' ') for name in present) or 'none'}"
    for check in checks_of(scene):
        used = technique(check.technique)
        asked = quantity(check.quantity)
        yield ""
        yield f"  {id_of(check)} approximates {check.quantity}"
        if why := asked.refuses(features):
            yield f"    refused  {check.quantity} is not defined here: {why}"
            continue
        plan = plan_of(used, scene, features, dict(check.settings))
        integrator = asked.integrator(features)
        yield f"    truth    {integrator.name}: {integrator.why}"
        yield f"    passes   {' > '.join(step.name for step in plan.passes)}"
        for skip in plan.skipped:
            yield f"    skipped  {skip.what}: {skip.why}"
        for criterion in check.criteria:
            yield f"    budget   {inequality(criterion.metric, criterion)}: {criterion.reason}"
            for other in criterion.by_renderer:
                yield f"      on {other.renderer}  {inequality(criterion.metric, other)}: {other.reason}"


def inequality(metric: str, bounds: Bounds) -> str:
    """The bounds of a metric as they are read."""
    least = f"{bounds.min:g} <= " if bounds.min is not None else ""
    most = f" <= {bounds.max:g}" if bounds.max is not None else ""
    return f"{least}{metric}{most}"
