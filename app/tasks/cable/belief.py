"""The robot's belief about the cable, as plain values for the record."""

from typing import TYPE_CHECKING, Any

from regrasp.app.task import belief as every
from regrasp.behaviors.cable.keys import FOUND, HELD, NOTICES, VAIN_SEARCHES
from regrasp.behaviors.keys import value_of

if TYPE_CHECKING:
    from regrasp.behaviors.cable.services import CableServices


def belief(services: "CableServices") -> dict[str, Any]:
    """What the robot knows now from its cameras and joint readings; lengths are rounded to 0.1 mm.

    `held` is tool_from_connector of the hand, `connector` world_from_connector as last found for a grasp.
    """
    held, found, last = value_of(HELD, None), value_of(FOUND, None), services.perception.last
    known = every.belief(services)
    return {
        "held": None if held is None else every.pose(held),
        "connector": None if found is None else every.pose(found.world_from_connector),
        "sure": found is not None and found.whole,
        "found_by": None if found is None else found.camera,
        "last_seen": None
        if last is None
        else {"at": round(last.stamp, 3), "camera": last.camera, "position": last.position.round(4).tolist()},
        **known,
        "vain_searches": value_of(VAIN_SEARCHES),
        "notices": [[round(notice.at, 6), notice.by] for notice in value_of(NOTICES)],
    }
