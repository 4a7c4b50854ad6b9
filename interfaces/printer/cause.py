"""Why a leaf of the printer task fails, besides what every task knows."""

from enum import StrEnum


class PrinterCause(StrEnum):
    """The causes."""

    BOND_HOLDS = "bond_holds"  # the part was twisted, and did not come off its plate
    CLAMP_EMPTY = "clamp_empty"  # the clamp closed on nothing
    HANDLE_NOT_FOUND = "handle_not_found"  # no camera showed the handle of the door
    PART_ADRIFT = "part_adrift"  # the part drifts out of the tray, or is not in it
    PLACE_OCCUPIED = "place_occupied"  # something stands where the robot wants to put what it holds
    PLATE_STUCK = "plate_stuck"  # part and plate were pulled, and the plate did not come out of the printer
    PREEMPTED = "preempted"  # another goal took the device
    TARGET_NOT_SEEN = "target_not_seen"  # no picture showed the part, or its gripping section
    TARGET_TOO_FAST = "target_too_fast"  # the part moves faster than the hand follows
