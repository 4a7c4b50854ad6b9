"""Keys of the tree: what leaves hand on, and a tree's inputs."""

from typing import Any, ClassVar

from py_trees.common import Status

from regrasp.behaviors.leaf import Leaf, LeafPort
from regrasp.interfaces.cause import CauseCode


class SetKey(Leaf):
    """Writes a text to a key, such as key="{mode}"; always SUCCESS."""

    INPUT_PORTS: ClassVar[dict[str, Any]] = {"value": LeafPort(data_type=str, description="the text")}
    OUTPUT_PORTS: ClassVar[dict[str, Any]] = {"key": LeafPort(data_type=str, description="the key, in braces")}
    RETURNS = frozenset({Status.SUCCESS})

    def work(self) -> Status:
        """See the class."""
        self._set_output("key", self.get_input("value"))
        return Status.SUCCESS


class CheckKey(Leaf):
    """SUCCESS when a key, such as key="{mode}", holds this text, else FAILURE. An input of the tree is a key, too."""

    INPUT_PORTS: ClassVar[dict[str, Any]] = {
        "key": LeafPort(data_type=str, description="the key, in braces"),
        "equals": LeafPort(data_type=str, description="the text that it is compared with"),
    }
    OUTPUT_PORTS: ClassVar[dict[str, Any]] = {}
    RETURNS = frozenset({Status.SUCCESS, Status.FAILURE})

    def work(self) -> Status:
        """See the class."""
        held, wanted = self.get_input("key"), self.get_input("equals")
        if held == wanted:
            return Status.SUCCESS
        return self.fail(CauseCode.KEY_DIFFERS, f"the key holds {held!r}, not {wanted!r}")
