"""What holds the connector besides a hand: a socket with a pull-out force, and a snap-in clip.

Both are physical models with stated numbers, not helpers of the robot: neither knows of the gripper.
"""

from collections import deque

import numpy as np
import pybullet as p
from numpy.typing import NDArray
from scipy.spatial.transform import RigidTransform

from interfaces.cell import Clip

STIFF = 1e4  # N: the constraints' own limit, far over what the models release at
FORCE_WINDOW = 5  # physics steps over which a force is averaged, so that one step's solver spike does not count
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
        self._forces: deque[NDArray[np.float64]] = deque(maxlen=FORCE_WINDOW)

    def move(self, to: RigidTransform) -> None:
        """Drag the held link's target (used only to lay the cable before a run)."""
        p.changeConstraint(
            self._constraint,
            to.translation.tolist(),
            jointChildFrameOrientation=to.rotation.as_quat().tolist(),
            maxForce=STIFF,
            physicsClientId=self._client,
        )

    def force(self) -> NDArray[np.float64]:
        """Mean force (3,) N over the last steps, in the axes that `getConstraintState` uses; zero before the first."""
        self._forces.append(np.array(p.getConstraintState(self._constraint, physicsClientId=self._client)[:3]))
        return np.asarray(np.mean(self._forces, axis=0))

    def release(self) -> None:
        """Let go."""
        if self._constraint is not None:
            p.removeConstraint(self._constraint, physicsClientId=self._client)
            self._constraint = None


class SocketHold:
    """A plugged end: held stiffly until the force on it exceeds `pull_out_force`."""

    def __init__(self, hold: Hold, pull_out_force: float) -> None:
        self._hold: Hold | None = hold
        self._limit = pull_out_force

    @property
    def holds(self) -> bool:
        """Whether the end is still plugged in."""
        return self._hold is not None

    def step(self) -> None:
        """Look at the force after a physics step."""
        if self._hold is not None and float(np.linalg.norm(self._hold.force())) > self._limit:
            self._hold.release()
            self._hold = None


class ClipHold:
    """The stow clip: closes on an end that rests in its mouth, lets go above `hold_force`."""

    def __init__(self, client: int, body: int, link: int, clip: Clip, step: float) -> None:
        self._client, self._body, self._link, self._clip, self._dt = client, body, link, clip, step
        self._seat = clip.world_from_seat
        self._cos = float(np.cos(np.deg2rad(clip.capture_angle_deg)))
        self._axis = self._seat.rotation.apply([1.0, 0.0, 0.0])
        self._hold: Hold | None = None
        self._resting = 0.0
        self._armed = True

    @property
    def holds(self) -> bool:
        """Whether the end is in the clip."""
        return self._hold is not None

    def step(self, connector: RigidTransform, velocity: NDArray[np.float64]) -> None:
        """Take or release the end after a physics step."""
        if self._hold is not None:
            if float(np.linalg.norm(self._hold.force())) > self._clip.hold_force:
                self._hold.release()
                self._hold, self._armed = None, False
            return
        distance = float(np.linalg.norm(connector.translation - self._seat.translation))
        self._armed = self._armed or distance > REARM * self._clip.capture_distance
        aligned = float(connector.rotation.apply([1.0, 0.0, 0.0]) @ self._axis) > self._cos
        inside = self._armed and aligned and distance < self._clip.capture_distance
        resting = inside and float(np.linalg.norm(velocity)) < CLICK_SPEED
        self._resting = self._resting + self._dt if resting else 0.0
        if self._resting >= CLICK_TIME:
            self._hold = Hold(self._client, self._body, self._link, connector)
            self._resting = 0.0
