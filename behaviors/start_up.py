"""Before the work: correct the rear camera's depth by the known panel, and see what stands in the cell."""

from behaviors.leaf import Steps, StepsLeaf


class StartUp(StepsLeaf):
    """Waits for the rear camera, corrects its depth scale, and maps the obstacles that it sees."""

    def steps(self) -> Steps:
        """See the class."""
        perception, motion = self.services.perception, self.services.motion
        while perception.frame("rear") is None:
            yield None
        scale = perception.correct_depth("rear")
        perception.look("rear")  # the plugged end, while no hand hides it
        voxels = perception.map_obstacles("rear")
        motion.set_obstacles(perception.occupancy.occupied_points(), perception.occupancy.h)
        self.say("looked around", depth_scale=round(scale, 4), occupied_voxels=voxels)
