"""What holds the connector besides a hand: a socket with a pull-out force, and a snap-in clip.

Both are physical models with stated numbers, not helpers of the robot: neither knows of the gripper.
"""

from collections import deque

import numpy as np
import pybullet as p
from numpy.typing import NDArray
from scipy.spatial.transform import RigidTransform

from regrasp.interfaces.cell import Clip

FloatArray = NDArray[np.float64]

STAND_FORCE = 3.0  # N that a stand's spring clip holds; choice: a light pull, twice what a slack cable presses with
STIFF = 1e4  # N: the constraints' own limit, far over what the models release at
FORCE_WINDOW = 5  # physics steps over which a force is averaged, so that one step's solver spike does not count
LIP_TRAVEL = 0.010  # m over which the clip's force grows to its full value
LIP_TORQUE = 0.3  # N m: the clip's largest aligning torque; 15 N on lips 0.02 apart
CLICK_SPEED = 0.02  # m/s: the clip's lips close on an end that is about at rest in it ...
CLICK_TIME = 0.2  # s: ... for so long
REARM = 1.5  # an end that was pulled out must leave by so many capture distances before the clip takes it again


class Hold:
    """The connector's link fixed to the world until it is pulled too hard."""

    def __init__(self, client: int, body: int, link: int, at: RigidTransform) -> None:
        self._client = client
        # Child frame in the world; the parent frame is the link's centre.
        self._constraint: int | None = p.createConstraint(
            body,
            link,
            -1,
            -1,
            p.JOINT_FIXED,
            [0, 0, 0],
            [0, 0, 0],
            at.translation.tolist(),
            [0, 0, 0, 1],
            at.rotation.as_quat().tolist(),
            physicsClientId=client,
        )
        p.changeConstraint(self._constraint, maxForce=STIFF, physicsClientId=client)
        self._forces: deque[FloatArray] = deque(maxlen=FORCE_WINDOW)

    def move(self, to: RigidTransform) -> None:
        """Drag the held link's target (used only to lay the cable before a run)."""
        p.changeConstraint(
            self._constraint,
            to.translation.tolist(),
            jointChildFrameOrientation=to.rotation.as_quat().tolist(),
            maxForce=STIFF,
            physicsClientId=self._client,
        )

    def force(self) -> FloatArray:
        """Mean force (3,) N over the last steps, in the axes that `getConstraintState` uses; zero before the first."""
        self._forces.append(np.array(p.getConstraintState(self._constraint, physicsClientId=self._client)[:3]))
        return np.asarray(np.mean(self._forces, axis=0))

    def release(self) -> None:
        """Let go."""
        if self._constraint is not None:
            p.removeConstraint(self._constraint, physicsClientId=self._client)
            self._constraint = None


class SocketHold:
    """A plugged end: held stiffly until it is drawn back along `axis` (3,), the plug's way in, with `pull_out_force` N.

    A force across the axis, as a closing jaw makes, does not free it; without an axis, on a stand, so large a force in
    any direction does. Measured: `getConstraintState` gives the world force that the constraint answers with, so a pull
    along -axis reads as a force along +axis.
    """

    def __init__(self, hold: Hold, axis: FloatArray | None, pull_out_force: float) -> None:
        self._hold: Hold | None = hold
        self._axis = None if axis is None else axis / np.linalg.norm(axis)
        self._limit = pull_out_force

    @property
    def holds(self) -> bool:
        """Whether the end is still plugged in."""
        return self._hold is not None

    def step(self) -> None:
        """Look at the force after a physics step."""
        if self._hold is None:
            return
        force = self._hold.force()
        if float(np.linalg.norm(force) if self._axis is None else force @ self._axis) > self._limit:
            self._hold.release()
            self._hold = None


class ClipHold:
    """The stow clip: rubber lips that close on an end resting in their mouth and then draw it to the seat.

    Their force grows to `hold_force` over `LIP_TRAVEL` and stays there; an end drawn out past `capture_distance` is
    free. They align the end's axis with a torque that grows likewise; turning about the end's own axis is free.
    """

    def __init__(self, client: int, body: int, link: int, clip: Clip, mass: float, across: float, step: float) -> None:
        self._client, self._body, self._link, self._clip, self._dt = client, body, link, clip, step
        self._seat = clip.world_from_seat
        self._axis = self._seat.rotation.apply([1.0, 0.0, 0.0])
        self._cos = float(np.cos(np.deg2rad(clip.capture_angle_deg)))
        self._stiffness = clip.hold_force / LIP_TRAVEL
        self._torsion = LIP_TORQUE / float(np.sin(np.deg2rad(clip.capture_angle_deg)))
        # Half of critical damping of the end alone on the lips.
        self._damping = float(np.sqrt(self._stiffness * mass))
        self._torsion_damping = float(np.sqrt(self._torsion * across))
        self._resting = 0.0
        self._armed = True
        self.holds = False

    def step(self, connector: RigidTransform, velocity: FloatArray, rate: FloatArray) -> None:
        """Pull, take or release the end; call before a physics step with its pose, velocity (m/s) and rate (rad/s)."""
        offset = self._seat.translation - connector.translation
        distance = float(np.linalg.norm(offset))
        axis = connector.rotation.apply([1.0, 0.0, 0.0])
        if self.holds and distance > self._clip.capture_distance:
            self.holds, self._armed = False, False
        if self.holds:
            self._pull(connector, offset, velocity, axis, rate)
            return
        self._armed = self._armed or distance > REARM * self._clip.capture_distance
        inside = self._armed and distance < self._clip.capture_distance and float(axis @ self._axis) > self._cos
        resting = inside and float(np.linalg.norm(velocity)) < CLICK_SPEED
        self._resting = self._resting + self._dt if resting else 0.0
        if self._resting >= CLICK_TIME:
            self.holds, self._resting = True, 0.0

    def _pull(
        self, connector: RigidTransform, offset: FloatArray, velocity: FloatArray, axis: FloatArray, rate: FloatArray
    ) -> None:
        force = _limited(self._stiffness * offset, self._clip.hold_force) - self._damping * velocity
        turning = rate - axis * float(rate @ axis)
        torque = _limited(self._torsion * np.cross(axis, self._axis), LIP_TORQUE) - self._torsion_damping * turning
        at = connector.translation.tolist()
        p.applyExternalForce(self._body, self._link, force.tolist(), at, p.WORLD_FRAME, physicsClientId=self._client)
        p.applyExternalTorque(self._body, self._link, torque.tolist(), p.WORLD_FRAME, physicsClientId=self._client)


def _limited(vector: FloatArray, limit: float) -> FloatArray:
    size = float(np.linalg.norm(vector))
    return vector if size <= limit else vector * (limit / size)
