"""Readings of an arm's encoders and of a gripper's."""

from dataclasses import dataclass

from regrasp.interfaces.arrays import FloatArray


@dataclass(frozen=True, eq=False)
class JointReading:
    """An arm's encoders and drives at `stamp` s: positions (n,) rad, velocities, efforts (n,) N m; a rail's m and N."""

    stamp: float
    positions: FloatArray
    velocities: FloatArray
    efforts: FloatArray


@dataclass(frozen=True)
class GripperReading:
    """A gripper's finger encoder at `stamp` s: `gap` is the distance between the pads in metres."""

    stamp: float
    gap: float
