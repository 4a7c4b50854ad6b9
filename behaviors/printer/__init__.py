"""Leaves of the printer task."""

from regrasp.behaviors.leaf import WithServices
from regrasp.behaviors.printer.actions import (
    ArmBack,
    GripHandle,
    LookAtHandle,
    OpenGripper,
    RailToHandle,
    ReachHandle,
    SlideDoor,
)

LEAVES: dict[str, type[WithServices]] = {
    leaf.__name__: leaf
    for leaf in (ArmBack, GripHandle, LookAtHandle, OpenGripper, RailToHandle, ReachHandle, SlideDoor)
}
