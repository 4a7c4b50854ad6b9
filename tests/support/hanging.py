"""`python hanging.py ARGUMENTS...`: the command line with leaves that hang, in this process and in its children."""

import contextlib
import signal
import time
from importlib import import_module
from typing import Any, ClassVar

import own_leaves
from py_trees.common import Status

from regrasp.behaviors.leaf import Leaf


class Hangs(Leaf):
    """Never comes back from its first tick; with `deaf` no signal reaches it, as in a library's own loop."""

    INPUT_PORTS: ClassVar[dict[str, Any]] = {}
    OUTPUT_PORTS: ClassVar[dict[str, Any]] = {}
    DEAF: ClassVar[bool] = False

    def work(self) -> Status:
        """See the class."""
        if self.DEAF:
            signal.pthread_sigmask(signal.SIG_BLOCK, signal.valid_signals())
        while True:
            time.sleep(0.01)


class HangsDeaf(Hangs):
    """See `Hangs`."""

    DEAF = True


class Goes(Leaf):
    """Goes on for ever."""

    INPUT_PORTS: ClassVar[dict[str, Any]] = {}
    OUTPUT_PORTS: ClassVar[dict[str, Any]] = {}

    def work(self) -> Status:
        """See the class."""
        return Status.RUNNING


class Swallows(Leaf):
    """Goes on for ever; an exception that a signal raises in its tick is lost, as in a finaliser."""

    INPUT_PORTS: ClassVar[dict[str, Any]] = {}
    OUTPUT_PORTS: ClassVar[dict[str, Any]] = {}

    def work(self) -> Status:
        """See the class."""
        with contextlib.suppress(KeyboardInterrupt):
            time.sleep(0.2)
        return Status.RUNNING


def put(path: str, value: Any) -> None:
    """Set an attribute by its dotted path."""
    module, _, name = path.rpartition(".")
    setattr(import_module(module), name, value)


own_leaves.put_in({"Hangs": Hangs, "HangsDeaf": HangsDeaf, "Goes": Goes, "Swallows": Swallows}, put)

if __name__ == "__main__":
    from regrasp.app.__main__ import main

    main()
