"""Where the origin lies: near what is seen, since single precision is finest around zero."""

import numpy as np

from scenes.model import Scene
from scenes.placing import moved, vec3

FAR_OFF = 16.0
"""In viewing distances: up to there float32 rounds a place by less than a thousandth of a pixel, and the scene is drawn
where it is.
"""


def near_origin(scene: Scene) -> Scene:
    """The scene moved so that the sensor looks at the origin, if that is far off.

    Thorne 2005, "Using a floating origin to improve fidelity and performance of large, distributed virtual worlds".
    """
    target = np.array(scene.sensor.target)
    distance = float(np.linalg.norm(target - scene.sensor.origin))
    return moved(scene, vec3(-target)) if np.linalg.norm(target) > FAR_OFF * distance else scene
