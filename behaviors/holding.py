"""Is there something in the hand?"""

from typing import Any, ClassVar

from py_trees.common import Status

from behaviors.leaf import Leaf


class Holding(Leaf):
    """SUCCESS when the robot believes that its right hand holds the connector, else FAILURE (which needs no cause)."""

    INPUT_PORTS: ClassVar[dict[str, Any]] = {}
    OUTPUT_PORTS: ClassVar[dict[str, Any]] = {}
    RETURNS = frozenset({Status.SUCCESS, Status.FAILURE})

    def work(self) -> Status:
        """See the class."""
        return Status.SUCCESS if self.services.belief.held is not None else Status.FAILURE
