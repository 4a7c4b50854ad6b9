"""Before the work: see what stands in the cell."""

from regrasp.behaviors.leaf import Failed, Steps, StepsLeaf
from regrasp.interfaces.cause import CauseCode

PATIENCE = 2.0  # s that the camera has to give sound frames


class StartUp(StepsLeaf):
    """Waits for the rear camera, and maps the obstacles that it sees.

    FAILURE when the camera is not to be trusted: nobody would know what stands in the cell.
    """

    def steps(self) -> Steps:
        """See the class."""
        perception, motion = self.services.perception, self.services.motion
        end = self.services.clock.now() + PATIENCE
        while perception.frame("rear") is None or perception.trouble("rear") is not None:
            if self.services.clock.now() > end:
                raise Failed(CauseCode.CAMERA_FAILED, f"{perception.trouble('rear')}; nothing was mapped")
            yield None
        perception.look("rear")  # the plugged end, while no hand hides it
        voxels = perception.map_obstacles("rear")
        motion.set_obstacles(perception.occupancy.occupied_points(), perception.occupancy.voxel_size)
        self.say("looked around", occupied_voxels=voxels)
