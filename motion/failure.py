"""The error of motion planning and execution: no motion was found, or an arm cannot carry it out."""

from typing import TYPE_CHECKING

from regrasp.interfaces.cause import CauseCode
from regrasp.interfaces.request import RequestError

if TYPE_CHECKING:
    from regrasp.motion.robots.contact_guard import Touch

# Causes after which there may be another way: by another arm, or with another map.
NO_WAY = (CauseCode.NO_COLLISION_FREE_GOAL, CauseCode.PLANNING_FAILED, CauseCode.MOTION_BLOCKED)


class PlanningError(RequestError):
    """No motion was found, or it could not be carried out."""


class TouchError(PlanningError):
    """An arm touched something on its way; `touch` is what it felt."""

    def __init__(self, message: str, touch: "Touch") -> None:
        super().__init__(CauseCode.MOTION_BLOCKED, message)
        self.touch = touch


class StoppedShortError(PlanningError):
    """A path was found, but the arm did not come to its end."""

    def __init__(self, message: str) -> None:
        super().__init__(CauseCode.MOTION_BLOCKED, message)


class GraspEmptyError(PlanningError):
    """The jaw closed on nothing."""

    def __init__(self, message: str) -> None:
        super().__init__(CauseCode.GRASP_EMPTY, message)


class JawBlockedError(GraspEmptyError):
    """The jaw met something beside the thing that it was to close on: it stands at `gap` m."""

    def __init__(self, message: str, gap: float) -> None:
        super().__init__(message)
        self.gap = gap
