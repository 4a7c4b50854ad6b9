"""Before the work: see what stands in the cell."""

from dataclasses import dataclass
from typing import ClassVar

from regrasp.behaviors.leaf import LeafFailed, LeafSteps, StepsLeaf
from regrasp.interfaces.cause import CauseCode


@dataclass(frozen=True)
class StartUpParameters:
    """How long the leaf waits for the camera."""

    camera_timeout: float = 2.0  # s that the camera has to give sound frames; choice


class StartUp(StepsLeaf):
    """Waits for the rear camera, and maps the obstacles that it sees.

    FAILURE when the camera is not to be trusted: the obstacles would be unknown.
    """

    parameters: ClassVar[StartUpParameters] = StartUpParameters()

    def steps(self) -> LeafSteps:
        """See the class."""
        perception, motion = self.services.perception, self.services.motion
        end = self.services.clock.now() + self.parameters.camera_timeout
        while perception.frame("rear") is None or perception.trouble("rear") is not None:
            if self.services.clock.now() > end:
                raise LeafFailed(CauseCode.CAMERA_FAILED, f"{perception.trouble('rear')}; nothing was mapped")
            yield None
        perception.look("rear")  # the plugged end, while no hand hides it
        voxels = perception.map_obstacles("rear")
        motion.set_obstacles(perception.occupancy.occupied_points(), perception.occupancy.voxel_size)
        self.say("looked around", occupied_voxels=voxels)
