"""The base class of the printer's leaves."""

from py_trees.common import Status

from regrasp.behaviors.leaf import StepsLeaf
from regrasp.behaviors.printer.services import PrinterServices
from regrasp.interfaces.printer.actions import Action


class PrinterLeaf(StepsLeaf):
    """A leaf of the arm that works at the printer. While an action is under way, its feedback is the leaf's."""

    services: PrinterServices

    @property
    def hand(self) -> str:
        """The arm's name."""
        return self.services.known.printer.hand

    def work(self) -> Status:
        """See `StepsLeaf`."""
        status = super().work()
        if status is Status.RUNNING and isinstance(self._request, Action):
            self.feedback_message = str(self._request.feedback())
        return status
