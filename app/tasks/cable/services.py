"""The services of a robot that handles a cable."""

from typing import Any

from regrasp.behaviors.cable.services import CableServices
from regrasp.motion.cable.service import CableMotion
from regrasp.perception.cable.service import CablePerception
from regrasp.sim.cable.objects import CableObjects

from regrasp.app.run.compose import anomaly_log, planner_seed
from regrasp.sim.world import World


def cable_services(world: World[CableObjects], seed: int, log: Any) -> CableServices:
    """Motion and perception on the world's devices. `log` is a structlog logger.

    They get the known part of the cell only, and no ground truth. What a pick compiles is loaded now.
    """
    known = world.objects.cell.known
    grippers = {name: arm.gripper for name, arm in world.arms.items()}
    motion = CableMotion(known, world.arms, grippers, world, planner_seed(seed), on_anomaly=anomaly_log(log))
    perception = CablePerception(known, world.cameras, world, motion.camera_pose, motion.spheres)
    motion.warm_up()
    return CableServices(known, world, motion, perception, log)
