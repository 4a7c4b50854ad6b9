"""What the leaves ask of the hand that plugs the connector into a socket."""

from collections.abc import Generator, Iterator
from dataclasses import replace

import numpy as np
from scipy.spatial.transform import RigidTransform

from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.cable.cause import CableCause
from regrasp.interfaces.cable.cell import Socket
from regrasp.interfaces.cable.motion import PluggedIn
from regrasp.interfaces.cause import CauseCode
from regrasp.interfaces.request import Request
from regrasp.motion.cable.cable_reach import check_cable_reaches
from regrasp.motion.cable.plugging import Plugging
from regrasp.motion.cable.seating import poses_before, seated_pose
from regrasp.motion.cable.service import CableMotion
from regrasp.motion.failure import PlanningError
from regrasp.motion.request import MotionRequest
from regrasp.motion.robots.tool_force import tool_force


class SocketMotion(CableMotion):
    """Requests to the hand that plugs the connector in, besides those of `CableMotion`."""

    def check_socket(self, name: str) -> None:
        """Raises PlanningError CABLE_TOO_SHORT or CABLE_TOO_LONG unless the cable's end may lie in that socket."""
        check_cable_reaches(self.known, self.known.cable.socket(name), self.parameters.cable_reach)

    def carry_to_socket(self, held: RigidTransform, name: str) -> MotionRequest:
        """Bring the held connector (tool_from_connector) before a socket, from where it goes straight in.

        It fails with OUT_OF_REACH when no hand pose there is free.
        """
        socket, seating, values = self.known.cable.socket(name), self.parameters.seating, self.parameters.unplug
        # As a plug is drawn out, and then away from the panel, which is before the hand.
        before = -values.draw_outs[0] * held.rotation.apply([1.0, 0.0, 0.0])
        away = before - [values.retreat, 0.0, 0.0]

        def steps() -> Iterator[None]:
            spheres, block = self.held_spheres(held), [socket.upright_box()]
            models = self.model(self.hand, held=spheres), self.model(self.hand, held=spheres, without=block)
            seat, q, corners = self._plug(socket), self.joints(self.hand), [away, before]
            margins = (replace(seating, margin=margin) for margin in self.parameters.clearances.near_margins)
            found = (poses_before(models, q, seat, held, corners, each) for each in margins)
            goals = next(filter(None, found), None)
            if goals is None:
                message = f"no free hand pose brings the held connector into socket {socket.name}"
                raise PlanningError(CauseCode.OUT_OF_REACH, message)
            onward = [RigidTransform.from_translation(corner - away) for corner in (before, np.zeros(3))]
            yield from self._done(self.carry(self.hand, goals, held, onward=onward, speed=seating.speed_to))
            yield from self._done(self._forward(values.retreat))

        return self._together(self.hand, steps())

    def plug_in(self, held: RigidTransform, name: str) -> Request[PluggedIn]:
        """Push the held connector (tool_from_connector) into the socket before it, by force sensing; see `Plugging`.

        It fails with NOT_PLUGGED where no try goes in.
        """
        socket, tip = self.known.cable.socket(name), held.apply([0.5 * self.known.cable.connector.length, 0.0, 0.0])
        plug, kin = self._plug(socket), self.kinematics[self.hand]

        def go(pose: RigidTransform) -> Generator[None, None, FloatArray]:
            slow = self.parameters.plugging.speed
            yield from self._done(self.straight(self.hand, pose, speed=slow, pressing=True))
            return self.arms[self.hand].reading().efforts

        def force(efforts: FloatArray) -> FloatArray:
            q = self.joints(self.hand)
            return tool_force(kin, q, efforts, kin.tool(q).apply(tip))

        def steps() -> Generator[None, None, PluggedIn]:
            goal = seated_pose(self.tool(self.hand), plug, held, self.parameters.seating.fine_rolls)
            values = self.parameters.plugging
            found = yield from Plugging(go, force, goal, plug, socket.depth, values).insert()
            if found is None:
                message = f"the plug went into socket {socket.name} nowhere within {1e3 * values.radius:.0f} mm"
                raise PlanningError(CableCause.NOT_PLUGGED, message)
            return found

        return self._together(self.hand, steps())

    def leave_socket(self, name: str) -> MotionRequest:
        """Draw the open hand back from a plugged connector, and bring it to its sleep pose clear of the cable."""

        def steps() -> Iterator[None]:
            yield from self._done(self._forward(-self.parameters.unplug.retreat))
            yield from self._sleep_clear_of(self._plug(self.known.cable.socket(name)))

        return self._together(self.hand, steps())

    def _forward(self, way: float) -> MotionRequest:
        """Move the hand so many metres straight along its own axis; a panel is near, and it is not checked."""
        return self.shift(self.hand, self.tool(self.hand).rotation.apply([way, 0.0, 0.0]), checked=False)

    def _plug(self, socket: Socket) -> RigidTransform:
        """world_from_connector plugged into that socket."""
        return socket.world_from_plug(self.known.cable.connector.length)
