"""A leaf that does as written, for trees made by hand."""

import py_trees
from py_trees.common import Status

from regrasp.interfaces.cable.cause import CableCause
from regrasp.interfaces.cause import Cause

R, S, F = Status.RUNNING, Status.SUCCESS, Status.FAILURE


class Script(py_trees.behaviour.Behaviour):  # type: ignore[misc]  # py_trees is untyped to mypy here
    """Returns one status a tick, the last one for ever; a failure adds its numbered cause to `causes` if given."""

    def __init__(self, name: str, *statuses: Status, causes: list[Cause] | None = None) -> None:
        super().__init__(name)
        self.statuses, self.causes = list(statuses), causes

    def update(self) -> Status:
        status = self.statuses.pop(0) if len(self.statuses) > 1 else self.statuses[0]
        if status is F and self.causes is not None:
            self.causes.append(Cause(CableCause.SLIPPED, f"{self.name} {len(self.causes)} mm", self.name))
        return status
