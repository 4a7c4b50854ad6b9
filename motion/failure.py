"""The error of motion planning and execution: no motion was found, or an arm cannot carry it out."""

from regrasp.interfaces.cause import CauseCode


class PlanningError(Exception):
    """No motion was found, or it could not be carried out; `code` is the cause, the message says why, with numbers."""

    def __init__(self, code: str, message: str) -> None:
        super().__init__(message)
        self.code = code


class GraspEmptyError(PlanningError):
    """The jaw closed on nothing."""

    def __init__(self, message: str) -> None:
        super().__init__(CauseCode.GRASP_EMPTY, message)
