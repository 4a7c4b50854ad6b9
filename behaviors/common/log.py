"""A remark in the log."""

from typing import Any, ClassVar

from py_trees.common import Status

from regrasp.behaviors.leaf import Leaf, LeafPort


class Log(Leaf):
    """Writes a message into the run's log; always SUCCESS."""

    INPUT_PORTS: ClassVar[dict[str, Any]] = {"message": LeafPort(data_type=str, description="a text, or a key's value")}
    OUTPUT_PORTS: ClassVar[dict[str, Any]] = {}
    RETURNS = frozenset({Status.SUCCESS})

    def work(self) -> Status:
        """See the class."""
        self.say("remark", message=self.get_input("message"))
        return Status.SUCCESS
