"""What a finished part of a benchmark is kept under."""

from comparisons.bench.plan import scaling_part
from scenes.load import find_scene, load_scene


def test_techniques_of_one_module_are_kept_apart() -> None:
    scene = load_scene(find_scene("shadow-room"))
    names = ("shadow.vcm", "shadow.vcm_literal", "shadow.vcm_analytic")
    assert len({scaling_part(scene, name).key for name in names}) == len(names)
