"""Plug the connector into a socket by force sensing, leave it there, and look whether it stays."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar

from regrasp.behaviors.cable.hand import CableLeaf, HandLeaf, LookInHand
from regrasp.behaviors.cable.keys import HELD
from regrasp.behaviors.cable.stow import LetGo, LookAtStow
from regrasp.behaviors.keys import Keys
from regrasp.behaviors.leaf import LeafPort, LeafSteps
from regrasp.interfaces.cable.cause import CableCause
from regrasp.interfaces.cable.sight import Estimate
from regrasp.interfaces.evidence import Evidence

if TYPE_CHECKING:
    from scipy.spatial.transform import RigidTransform

SOCKET: dict[str, Any] = {
    "socket": LeafPort(
        data_type=str,
        names="free_socket",
        description="a socket of the cell that holds no cable; plugged_into: the one that held the connector at first",
    )
}


@dataclass(frozen=True)
class ReplugParameters:
    """How the connector is looked at in the hand."""

    look_time: float = 0.8  # s of looking; choice
    least_turn_deg: float = 10.0  # of the connector in the hand; a part of it that is seen tells its axis to 6 degrees


class CheckSocket(CableLeaf):
    """FAILURE where the cable is too short for its end to lie in the `socket`, or so long that it would buckle."""

    INPUT_PORTS: ClassVar[dict[str, Any]] = SOCKET

    def steps(self) -> LeafSteps:
        """See the class."""
        self.services.motion.check_socket(self.get_input("socket"))
        yield from ()


class CarryToSocket(HandLeaf):
    """Plans the held connector's path to a place in front of the `socket` and follows it."""

    NEEDS: ClassVar[Keys] = (HELD,)
    INPUT_PORTS: ClassVar[dict[str, Any]] = SOCKET

    def steps(self) -> LeafSteps:
        """See the class."""
        yield self.services.motion.carry_to_socket(self.held(), self.get_input("socket"))


class Replug(LookInHand):
    """Looks how the connector lies in the hand, and pushes it into the `socket` before it by force sensing.

    Where it meets the socket's face it tries beside that. It is in when a gentle pull does not move it; the jaw is
    still closed then.
    """

    NEEDS: ClassVar[Keys] = (HELD,)
    INPUT_PORTS: ClassVar[dict[str, Any]] = SOCKET
    parameters: ClassVar[ReplugParameters] = ReplugParameters()

    def steps(self) -> LeafSteps:
        """See the class."""
        yield from self.look_in_hand(self.parameters.look_time, self.parameters.least_turn_deg)
        plugged = yield from self.ask(self.services.motion.plug_in(self.held(), self.get_input("socket")))
        across, felt = plugged.across.round(4).tolist(), round(plugged.strongest, 1)
        self.say("plugged in", tries=plugged.tries, across=across, strongest=felt)


class LetGoOfPlug(LetGo):
    """As `LetGo`, of a connector in the `socket`."""

    INPUT_PORTS: ClassVar[dict[str, Any]] = SOCKET

    def leave(self) -> LeafSteps:
        """See `LetGo`."""
        yield self.services.motion.leave_socket(self.get_input("socket"))


class LookAtPlug(LookAtStow):
    """Looks at the `socket`; FAILURE when the connector is not there, so that the tree can recover it."""

    PLACE: ClassVar[str] = "the socket"
    STATE: ClassVar[str] = "plugged"
    CAUSE: ClassVar[CableCause] = CableCause.NOT_PLUGGED
    INPUT_PORTS: ClassVar[dict[str, Any]] = SOCKET

    @property
    def seat(self) -> "RigidTransform":
        """See `LookAtStow`."""
        cable = self.services.known.cable
        return cable.socket(self.get_input("socket")).world_from_plug(cable.connector.length)

    def seated(self, estimate: Estimate) -> Evidence:
        """See `LookAtStow`."""
        return self.services.perception.plugged(estimate, self.get_input("socket"))
