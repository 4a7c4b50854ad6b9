"""The cable task's signals: the connector as it is, and as it was seen last."""

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from regrasp.app.run.signals import POSE, pose_values
from regrasp.app.task.signals import Signal, SignalGroup
from regrasp.sim.cable.ground_truth import CableTruth

if TYPE_CHECKING:
    from regrasp.behaviors.cable.services import CableServices
    from regrasp.sim.cable.objects import CableObjects
    from regrasp.sim.world import World

_UPPER = np.triu_indices(6)


def cable_signals(world: "World[CableObjects]", services: "CableServices") -> list[SignalGroup]:
    """The connector's signals."""
    truth = CableTruth(world)
    signals = (
        Signal("connector_true", POSE, 12, "world_from_connector"),
        Signal("connector_held_true", "0 or 1", 1, "whether both pads touch the connector"),
        Signal("connector.seen_at", "s", 1, "exposure of the frame in which it was seen last"),
        Signal("connector", POSE, 12, "world_from_connector by that frame"),
        Signal(
            "connector.covariance",
            "m2, m rad, rad2",
            21,
            "of that estimate's position and small rotation about the world's axes: the upper triangle, row by row",
        ),
    )

    def sample() -> Sequence[float]:
        last = services.perception.last
        seen = [math.nan] * 34
        if last is not None:
            seen = [last.stamp, *pose_values(last.world_from_connector), *last.covariance[_UPPER].tolist()]
        return *pose_values(truth.connector_pose()), float(truth.held()), *seen

    return [SignalGroup(signals, sample)]
