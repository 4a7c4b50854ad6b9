"""Before the work: see what stands in the cell."""

from dataclasses import dataclass
from typing import ClassVar

from regrasp.behaviors.leaf import LeafFailed, LeafSteps, StepsLeaf
from regrasp.interfaces.cause import CauseCode


@dataclass(frozen=True)
class StartUpParameters:
    """How long the leaf waits for the cameras."""

    camera_timeout: float = 2.0  # s that the cameras have to give sound frames; choice


class StartUp(StepsLeaf):
    """Waits for every camera that is fixed in the cell, looks around, and maps the obstacles that they see.

    FAILURE when a camera is not to be trusted: the obstacles would be unknown.
    """

    parameters: ClassVar[StartUpParameters] = StartUpParameters()

    def steps(self) -> LeafSteps:
        """See the class."""
        perception = self.services.perception
        end = self.services.clock.now() + self.parameters.camera_timeout
        for camera in perception.fixed_cameras:
            while perception.frame(camera) is None or perception.trouble(camera) is not None:
                if self.services.clock.now() > end:
                    why = perception.trouble(camera) or f"the {camera} camera shows no picture"
                    raise LeafFailed(CauseCode.CAMERA_FAILED, f"{why}; nothing was mapped")
                yield None
        voxels = perception.look_around()
        self.services.take_over_map()
        self.say("looked around", occupied_voxels=voxels)
