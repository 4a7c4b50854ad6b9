"""The base class of the printer's leaves."""

from typing import Any

from py_trees.common import Status

from regrasp.behaviors.leaf import StepsLeaf
from regrasp.behaviors.printer.services import PrinterServices
from regrasp.interfaces.printer.actions import Action
from regrasp.interfaces.request import Request


class PrinterLeaf(StepsLeaf):
    """A leaf of the arm that works at the printer. While an action is under way, its feedback is the leaf's."""

    services: PrinterServices

    @property
    def hand(self) -> str:
        """The arm's name."""
        return self.services.known.printer.hand

    def with_arm(self, request: Request[Any]) -> Action[str, Any]:
        """A request that moves the arm or its rail; it preempts what else moves them."""
        return self.services.arm_and_rail.take(request, str)

    def with_hand(self, request: Request[Any]) -> Action[str, Any]:
        """A request that moves the arm and the jaw."""
        return self.services.jaw.take(self.with_arm(request), str)

    def work(self) -> Status:
        """See `StepsLeaf`."""
        status = super().work()
        if status is Status.RUNNING and isinstance(self._request, Action):
            self.feedback_message = str(self._request.feedback())
        return status
