"""The services of a robot that handles a cable."""

from typing import Any

from regrasp.app.run.compose import connected
from regrasp.behaviors.cable.services import CableServices
from regrasp.motion.cable.socket_motion import SocketMotion
from regrasp.perception.cable.service import CablePerception
from regrasp.sim.cable.objects import CableObjects
from regrasp.sim.world import World


def cable_services(world: World[CableObjects], seed: int, log: Any) -> CableServices:
    """Motion and perception with what concerns the cable, see `connected`."""
    return connected(CableServices, SocketMotion, CablePerception, world, seed, log)
