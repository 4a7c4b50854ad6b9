"""What holds a body until it is pulled off: a rigid constraint whose reaction is measured, and a catch.

They are physical models with stated numbers. None depends on the gripper, so none helps the robot.
"""

import math
import operator
from collections import deque
from dataclasses import dataclass

import numpy as np
import pybullet as p
from scipy.spatial.transform import RigidTransform

from regrasp.interfaces.arrays import FloatArray
from regrasp.sim.bodies import BodyLink

_WORLD = -1  # PyBullet's id of it in constraints


@dataclass(frozen=True)
class HoldParameters:
    """The constraint that holds a body."""

    constraint_force: float = 1e4  # N, limit of the constraint itself: far above the forces at which it is released
    force_window: int = 5  # physics steps over which its reaction is averaged: a solver's spike releases nothing


class Hold:
    """A fixed constraint between a link and the world, or the base of another body.

    `at` is the pose world_from_link, or base_from_link with `base`, the id of the other body. The reaction is that at
    the point `pivot` (3,) m of the link's inertial frame.
    """

    def __init__(
        self,
        link: BodyLink,
        at: RigidTransform,
        base: int = _WORLD,
        pivot: tuple[float, float, float] = (0.0, 0.0, 0.0),
        parameters: HoldParameters = HoldParameters(),
    ) -> None:
        self._client, self._max_force = link.client, parameters.constraint_force
        # The link is the constraint's parent, the world or the other body its child.
        self._constraint: int | None = p.createConstraint(
            link.body,
            link.link,
            base,
            -1,
            p.JOINT_FIXED,
            [0, 0, 0],
            pivot,
            at.apply(pivot).tolist(),
            [0, 0, 0, 1],
            at.rotation.as_quat().tolist(),
            physicsClientId=link.client,
        )
        p.changeConstraint(self._constraint, maxForce=self._max_force, physicsClientId=link.client)
        self._wrenches: deque[tuple[float, ...]] = deque(maxlen=parameters.force_window)

    def move(self, position: list[float], quaternion: list[float]) -> None:
        """Move the constraint to that pose in the world, and the link with it; for laying out a world before a run."""
        p.changeConstraint(
            self._constraint,
            position,
            jointChildFrameOrientation=quaternion,
            maxForce=self._max_force,
            physicsClientId=self._client,
        )

    def force(self) -> list[float]:
        """Add the last step's constraint force, and return the mean (3,) N over the window, in the world frame."""
        return self.wrench()[:3]

    def wrench(self) -> list[float]:
        """As `force`, with the torque behind it: (6,) N and N m.

        The force is in the world's axes and the torque in the link's, as PyBullet solves them (measured).
        """
        self._wrenches.append(p.getConstraintState(self._constraint, physicsClientId=self._client))
        return [sum(along) / len(self._wrenches) for along in zip(*self._wrenches, strict=True)]

    def release(self) -> None:
        """Remove the constraint."""
        if self._constraint is not None:
            p.removeConstraint(self._constraint, physicsClientId=self._client)
            self._constraint = None


class Catch:
    """A catch, which lets go of what it holds once that is pulled against `axis` (3,) with `force` N.

    `axis` is the direction in which the body goes in. A force across it, as a closing gripper makes, does not release
    the body. With `axis` None a force of that size in any direction does. `getConstraintState` gives the constraint's
    reaction in the world frame (measured), so a pull along -axis reads as a force along +axis.
    """

    def __init__(self, hold: Hold, axis: FloatArray | None, force: float) -> None:
        self._hold: Hold | None = hold
        self._axis = None if axis is None else (axis / np.linalg.norm(axis)).tolist()
        self._limit = force

    @property
    def holds(self) -> bool:
        """Whether the body is still in."""
        return self._hold is not None

    def release(self) -> None:
        """Let the body go."""
        if self._hold is not None:
            self._hold.release()
            self._hold = None

    def stick(self, force: float) -> None:
        """Let go at this force (N) from now on."""
        self._limit = force

    def step(self) -> None:
        """Check the force; call after every physics step."""
        if self._hold is None:
            return
        force = self._hold.force()
        pull = math.hypot(*force) if self._axis is None else sum(map(operator.mul, force, self._axis))
        if pull > self._limit:
            self.release()
