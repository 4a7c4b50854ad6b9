"""Has the connector left the hand? The thesis's distance test (Hwang 2024, section 3.4.1), and a test of its place."""

import numpy as np

from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.evidence import Evidence


def distance_slip(gripper: FloatArray, connector: FloatArray, limit: float = 0.2) -> Evidence:
    """Whether the `connector`'s estimated position (3,) is further than `limit` m from the `gripper`'s centre (3,).

    The default is the thesis's (section 3.4.1).
    """
    value = float(np.linalg.norm(connector - gripper))
    sentence = f"connector {value:.3f} m from the gripper's centre (at most {limit:.3f} m)"
    return Evidence(value > limit, "distance", value, limit, sentence)


def seen_at(connector: FloatArray, point: FloatArray, radius: float) -> Evidence:
    """Whether the `connector`'s estimated position (3,) is within `radius` m of a `point` (3,), as a clip's seat."""
    value = float(np.linalg.norm(connector - point))
    sentence = f"connector {value:.3f} m from the place looked at (at most {radius:.3f} m)"
    return Evidence(value <= radius, "place", value, radius, sentence)
