"""The robot's belief about the cable, as plain values for the record."""

from typing import TYPE_CHECKING, Any

from regrasp.app.task.belief import arms, pose

if TYPE_CHECKING:
    from regrasp.behaviors.services import Services


def belief(services: "Services") -> dict[str, Any]:
    """What the robot knows now from its cameras and joint readings; lengths are rounded to 0.1 mm.

    `held` is tool_from_connector of the hand, `connector` world_from_connector as last found for a grasp.
    """
    known, last = services.belief, services.perception.track.last
    return {
        "held": known.held and pose(known.held),
        "connector": known.connector and pose(known.connector),
        "sure": known.sure,
        "found_by": known.found_by,
        "last_seen": last
        and {"at": round(last.stamp, 3), "camera": last.camera, "position": last.position.round(4).tolist()},
        "arms": arms(services),
        "occupied_voxels": len(services.perception.occupancy.occupied_points()),
        "vain_searches": known.vain_searches,
        "notices": [[round(notice.at, 6), notice.by] for notice in known.notices],
    }
