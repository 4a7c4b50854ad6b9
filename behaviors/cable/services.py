"""The services of the cable's leaves."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

from regrasp.behaviors.services import Services
from regrasp.interfaces.cable.services import CableMotionService, CablePerceptionService

if TYPE_CHECKING:
    from regrasp.interfaces.cable.cell import CableKnown


@dataclass
class CableServices(Services):
    """The services of one run with a cable."""

    known: "CableKnown"
    motion: CableMotionService
    perception: CablePerceptionService
