"""How the connector lies in the hand: what a camera sees of it there corrects what was believed."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import RigidTransform, Rotation

from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.cable.sight import Estimate, InHand
from regrasp.perception.pose.fusion import fuse


@dataclass(frozen=True)
class InHandParameters:
    """When what is seen is trusted."""

    whole_share: float = 0.9  # of the length; choice: the visible part's middle is then within 5 mm of the whole's
    min_extent: float = 0.04  # m; a shorter visible part says too little of the axis
    max_shift: float = 0.06  # m; what is seen further off its believed place in the hand is a false detection


def connector_in_hand(
    seen: Sequence[Estimate],
    length: float,
    tool: RigidTransform,
    held: RigidTransform,
    least_turn_deg: float = 0.0,
    parameters: InHandParameters = InHandParameters(),
) -> InHand | None:
    """How a connector of `length` m lies in the hand at `tool` (world_from_tool); None where too little of it is seen.

    `held` is tool_from_connector as believed. One that seems to have turned by less than `least_turn_deg` has not: then
    only where its tip is seen counts.
    """
    long = [e for e in seen if e.extent >= parameters.min_extent]
    if not long:
        return None
    best = fuse(long)
    # Where the fingers hide a part, the visible rest seems to end there. Unless the whole length shows it is not
    # known where on the connector that rest lies.
    whole = best.extent > parameters.whole_share * length
    found = pose_in_hand(tool.inv() * best.world_from_connector, held, whole=whole)
    shift = float(np.linalg.norm(found.translation - held.translation))
    cosine = connector_axis(found) @ connector_axis(held)
    turn = float(np.rad2deg(np.arccos(np.clip(cosine, -1.0, 1.0))))
    if turn < least_turn_deg:
        tip = [0.5 * length, 0.0, 0.0]
        place = held.translation + found.apply(tip) - held.apply(tip)
        found = RigidTransform.from_components(place, held.rotation)
    return InHand(found, whole, shift, turn, shift < parameters.max_shift)


def pose_in_hand(seen: RigidTransform, held: RigidTransform, *, whole: bool) -> RigidTransform:
    """tool_from_connector of a connector that was `held` so and is now `seen` so, the `whole` of it or a part."""
    if connector_axis(seen) @ connector_axis(held) < 0:  # a finger was taken for the cable: none turns round in a jaw
        seen = seen * RigidTransform.from_rotation(Rotation.from_euler("z", 180, degrees=True))
    return seen if whole else _turned_in_the_jaw(held, seen)


def _turned_in_the_jaw(held: RigidTransform, seen: RigidTransform) -> RigidTransform:
    """tool_from_connector when only a part of the connector is `seen`: its axis is known, its centre on it is not.

    A cable turns the connector between the pads and does not draw it through. So the pads stay at the place along the
    connector where they are by `held`.
    """
    axis = connector_axis(seen)
    nearest = seen.translation - (seen.translation @ axis) * axis
    pads_at = -float(held.translation @ connector_axis(held))
    return RigidTransform.from_components(nearest - pads_at * axis, seen.rotation)


def connector_axis(pose: RigidTransform) -> FloatArray:
    """The connector's axis (3,), from cable to tip, in the pose's target frame."""
    return np.asarray(pose.rotation.apply([1.0, 0.0, 0.0]))
