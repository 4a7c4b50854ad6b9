"""The error of everything in this room that looks for a motion."""

from regrasp.interfaces.cause import CauseCode


class PlanningError(Exception):
    """No motion was found; `code` is the cause, the message says why with the numbers."""

    def __init__(self, code: CauseCode, message: str) -> None:
        super().__init__(message)
        self.code = code
