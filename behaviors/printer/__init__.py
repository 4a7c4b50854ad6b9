"""Leaves of the printer task."""

from regrasp.behaviors.leaf import WithServices
from regrasp.behaviors.printer import desk, door, part, primitives, transfer

_LEAVES: tuple[type[WithServices], ...] = (
    primitives.AnalyzeImage,
    primitives.MoveBy,
    primitives.MoveGripper,
    primitives.MoveJoints,
    primitives.MoveRail,
    primitives.MoveToPose,
    primitives.PressGripper,
    door.ArmBack,
    part.ApproachPart,
    part.CatchPart,
    part.HandBeforePart,
    part.RailToPart,
    part.TakePart,
    door.FindDoor,
    door.GripHandle,
    door.LookAtHandle,
    desk.LookAtPlace,
    desk.WatchPart,
    door.RailToHandle,
    door.ReachHandle,
    door.SlideDoor,
    transfer.ClampPlate,
    transfer.DrawOutPart,
    transfer.ForgetHeld,
    transfer.GripPart,
    transfer.MoveHeld,
    transfer.OpenClamp,
    transfer.PartOverTray,
    transfer.PlateOverClamp,
    transfer.ReleasePart,
    transfer.TwistPart,
)

LEAVES: dict[str, type[WithServices]] = {leaf.__name__: leaf for leaf in _LEAVES}
