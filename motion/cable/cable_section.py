"""The cable as a thing to take hold of: a piece of it that counts as a cylinder."""

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import RigidTransform, Rotation

from regrasp.interfaces.arrays import FloatArray


@dataclass(frozen=True)
class CableSection:
    """A piece of the cable, in m: implements `regrasp.motion.grasping.approach.Cylinder`."""

    length: float
    radius: float


@dataclass(frozen=True)
class PullingParameters:
    """Where the cable is gripped, and how far it is lifted. All values are choices."""

    straight: float = 0.08  # m of the cable that count as straight
    # m along the cable from the connector; where it lies is known the less, the further
    places: tuple[float, ...] = (0.07, 0.09, 0.11, 0.13, 0.15, 0.17, 0.20, 0.23, 0.26)
    lifts: tuple[float, ...] = (0.25, 0.20, 0.15, 0.10, 0.05)  # m up; the first to which a way is free
    loose: float = 0.03  # m straight up first, with all the force that the drives have
    aside: tuple[float, ...] = (0.0, -0.08, 0.08)  # m in x and in y that it may be moved besides
    # m in x, y and z to which a lifted end may be brought on that cannot be taken
    onward: tuple[float, ...] = (-0.24, -0.16, -0.08, 0.0, 0.08, 0.16, 0.24)
    speed: float = 0.15  # share of the joints' speed: the cable's pull grows slowly then
    room: float = 0.12  # m round and below such a place beyond which more does not count
    apart: float = 0.10  # m from where it was before
    asked: int = 24  # places of which it is asked whether another arm can take the end there
    at_once: int = 8  # places of which one plan chooses, those with the most room first
    turn: float = 1.5  # rad, the most that a joint may turn for that: the jaw does not turn over


def section_of_cable(course: FloatArray, place: float) -> RigidTransform:
    """world_from_section, `place` m from the last of a cable's points (n, 3) m; x points along the cable to that."""
    back = course[::-1]
    along = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(back, axis=0), axis=1)))
    n = int(np.clip(np.searchsorted(along, place), 1, len(back) - 2))
    way = back[n - 1] - back[n + 1]
    return RigidTransform.from_components(back[n], Rotation.align_vectors(way[None], [[1.0, 0.0, 0.0]])[0])
