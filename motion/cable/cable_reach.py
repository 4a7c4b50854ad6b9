"""Whether the cable lets its end go where a socket holds it."""

from dataclasses import dataclass

import numpy as np

from regrasp.interfaces.cable.cause import CableCause
from regrasp.interfaces.cable.cell import CableKnown, Socket
from regrasp.motion.cable.cable_path import natural_poses
from regrasp.motion.failure import PlanningError


@dataclass(frozen=True)
class CableReachParameters:
    """How far a socket may be from where the cable's end lies by itself, m."""

    stretch: float = 0.01  # further; choice: by so much the cable's course is a guess
    # Nearer. Unplugging presses the cable together by 0.05. By 0.12 it bends so far that it turns the connector in the
    # jaw, with 0.5 N m without gravity and 1.5 with the stiff cable of the Earth tests.
    slack: float = 0.09


def check_cable_reaches(
    known: CableKnown, socket: Socket, parameters: CableReachParameters = CableReachParameters()
) -> None:
    """Raises PlanningError CABLE_TOO_SHORT or CABLE_TOO_LONG unless the cable lets its end lie in that socket.

    A cable bent to the side by that much ends at a certain distance along its straight course (`natural_poses`). It
    bears no pull beyond that, and a much shorter way buckles it.
    """
    half = np.array([0.5 * known.cable.connector.length, 0.0, 0.0])
    anchor, course = known.cable.anchor
    end = socket.world_from_plug(known.cable.connector.length).apply(-half) - anchor
    natural = natural_poses(known, (end - (end @ course) * course)[None])[0]
    missing = float((end - (natural[:3, 3] - natural[:3, :3] @ half - anchor)) @ course)
    way, length = float(np.linalg.norm(end)), known.cable.length
    told = f"a plug in {socket.name} ends {way:.3f} m from the cable's fixed end, and the cable is {length:.3f} m"
    if missing > parameters.stretch or way > length:
        raise PlanningError(CableCause.CABLE_TOO_SHORT, f"{told} long: it does not reach")
    if missing < -parameters.slack:
        message = f"{told} long: pressed together by {-missing:.3f} m it would turn the plug in the hand"
        raise PlanningError(CableCause.CABLE_TOO_LONG, message)
