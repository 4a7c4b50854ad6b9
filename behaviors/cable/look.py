"""Looking with the camera that searches from a viewpoint, which the search and the closer look share."""

from collections.abc import Generator
from dataclasses import dataclass
from typing import ClassVar

from regrasp.behaviors.cable.hand import CableLeaf
from regrasp.interfaces.cable.motion import View
from regrasp.interfaces.cable.sight import Sightings
from regrasp.interfaces.request import Request


@dataclass(frozen=True)
class LookParameters:
    """When the camera looks."""

    settle_time: float = 0.1  # s after a motion; frames exposed while the arm still swings do not count


class LookLeaf(CableLeaf):
    """A leaf in which the arm that carries the camera looks round."""

    looking: ClassVar[LookParameters] = LookParameters()

    @property
    def search_arm(self) -> str:
        """The arm that carries the camera."""
        return self.services.known.search_mount.arm

    def go_and_look(self, view: View, seconds: float) -> Generator[Request[None] | None, None, Sightings]:
        """Move the camera to a view, look for `seconds`, and map the obstacles that it sees.

        Raises PlanningError to the caller when no motion leads there.
        """
        yield from self.ask(self.services.motion.go_to_view(view))
        settle, take_over = self.looking.settle_time, self.services.take_over_map
        watch = self.services.perception.watch(self.search, seconds, settle=settle, on_mapped=take_over)
        return (yield from self.ask(watch))
