"""Contact detection on a moving arm: the drives' efforts against those that its rigid-body dynamics ask for."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.reading import JointReading
from regrasp.motion.robots.dynamics import ArmDynamics


@dataclass(frozen=True, eq=False)
class ContactLimits:
    """What counts as a touch.

    Without a contact the simulated arms differ from their model by 0.05 N m at most. The limits leave room for the
    friction of real drives.
    """

    # of the joints' greatest efforts: 0.1 is 1.1 N m at a ViperX's waist, 2 to 4 N at its hand
    share: float
    # s, time constant with which an effort that lasts becomes the usual one: what grows more slowly is no touch
    adaptation: float = 0.25
    # Where something pulls at the hand, m, and the unit vector along which it may pull as it likes, (6,) in the tool
    # frame; None: nowhere.
    pull: FloatArray | None = None
    pull_near: float = 15.0  # N that it may pull where something is near: what random scenes showed; choice
    back_off: bool = True  # after a touch the arm goes back the way that it came; not where it would take a thing along
    elastic: bool = False  # something elastic may hold the arm back: one that falls behind is blocked, not broken
    far: float | None = None  # the share where nothing is near that could be touched; None: the same
    # of the joints' greatest efforts, what the drives may use beyond what the motion itself asks for; None: all. In a
    # physics step a rigid thing is pressed with all that they may use.
    most: float | None = None


@dataclass(frozen=True)
class ContactGuardParameters:
    """What counts as a touch of an arm: one that moves freely, holds or pulls an elastic thing, or presses."""

    # A block in the way of 20 motions (seeds 100 to 119): 0.08, 0.10 and 0.12 press it with 12, 16 and 15 N at most
    # and all come to their goals; the places are found 34, 27 and 27 mm beside in the median. With an adaptation of
    # 0.25 s, and the greatest effort instead of their length, a slow forearm pressed foam with 25 N (scene 7302).
    free: ContactLimits = ContactLimits(0.10, adaptation=1.0, most=0.15)
    # The end of a cable that keeps to its natural shapes changes the efforts by 0.12 of the wrist's and 0.04 of each of
    # the other joints', sometimes by more; a slow hand presses foam for half a second before that is felt; choice.
    carrying: ContactLimits = ContactLimits(0.16, adaptation=1.0, far=0.5)
    # A hand that has let go may still hook the cable; it feels what a free one does, so near to things; choice
    leaving: ContactLimits = ContactLimits(0.10, adaptation=1.0, elastic=True, far=0.5)
    # One that is drawn out of its socket straightens its cable; this stops at 12 N at a ViperX's hand; choice
    drawing: ContactLimits = ContactLimits(0.4, elastic=True)
    # One that is bent by force changes them by up to half, but mostly so slowly that it becomes the usual effort. In 96
    # such motions (eight random scenes of 7300 to 7330) 0.18 stops 11 that touch nothing and 0.4 stops 7; where foam is
    # touched, it is pressed with 12 and 36 N in the median. An adaptation of 1 s feels slow pressing (scene 7436: 17 N
    # in place of 36), but keeps the arm from ways that the scenes 7457 and 7467 need.
    pulling: ContactLimits = ContactLimits(0.18, elastic=True, far=0.9)
    # One that is lifted by a jaw between its ends pulls with 20 N and more (scene 9013 on Earth). The arm is slow then,
    # so that the pull grows slowly. Foam, which presses with 1 N a mm more, is felt at 12 N. What is gained is kept.
    lifting: ContactLimits = ContactLimits(0.4, adaptation=1.0, elastic=True, far=0.9, back_off=False)
    # A plug that is gripped askew jams in its socket up to what the drives can do: this stops at a blow only; choice
    pressing: ContactLimits = ContactLimits(2.5)


@dataclass(frozen=True, eq=False)
class Touch:
    """What a guard felt at `stamp` s.

    The joints (n,), their velocities (n,), and the efforts (n,), N m or N, of a force from outside on them, without
    those of a cable that pulls.
    """

    stamp: float
    joints: FloatArray
    velocities: FloatArray
    efforts: FloatArray


class ContactGuard:
    r"""Implements `regrasp.interfaces.devices.Guard` for one motion of an arm.

    The efforts from outside are what inverse dynamics leave of the drives' efforts :math:`\tau`:

    .. math:: r = M(q) \ddot q + C(q, \dot q) \dot q + g(q) - \tau

    with the acceleration by the last two velocities. A touch is a difference d of :math:`r` from its own slow mean
    with :math:`\sqrt{\sum_i (d_i / l_i)^2} > 1`, where the limits l are the `limits`' share of the joints' `torques`
    (n,), N m or N: a force on the forearm turns two joints a little sooner than it turns one much. Of a taut cable,
    whose pull grows as quickly as that of a wall, the share of :math:`r` along :math:`J^T f` of its direction f is
    taken away first; where something is near, no more than a cable pulls. See Haddadin, De Luca, Albu-Schaeffer 2017,
    "Robot Collisions: A Survey", III-B.
    `gravity` is (3,) m/s2 in the world. `near` says whether joints (n,) are near anything; None: always.
    """

    def __init__(
        self,
        dynamics: ArmDynamics,
        gravity: FloatArray,
        torques: FloatArray,
        limits: ContactLimits,
        near: Callable[[FloatArray], bool] | None = None,
    ) -> None:
        self._dynamics, self._gravity, self._adaptation = dynamics, gravity, limits.adaptation
        self._limits, self._pull, self._pull_near = limits.share * torques, limits.pull, limits.pull_near
        self._torques, self._most = torques, limits.most
        self._times_far = 1.0 if limits.far is None or near is None else limits.far / limits.share
        self._near = near
        self._last: JointReading | None = None
        self._usual: FloatArray | None = None
        self._wanted: FloatArray | None = None  # efforts (n,) that the motion asked for at the last reading
        self.touch: Touch | None = None

    def __call__(self, reading: JointReading) -> bool:
        """Whether the arm must stop now."""
        last, self._last = self._last, reading
        if last is None or reading.stamp <= last.stamp:
            return False
        interval = reading.stamp - last.stamp
        accelerations = (reading.velocities - last.velocities) / interval
        wanted = self._dynamics.efforts(reading.positions, reading.velocities, accelerations, self._gravity)
        self._wanted, outside = wanted, wanted - reading.efforts
        if self._usual is None:
            self._usual = outside
        change = outside - self._usual
        felt = self._felt(reading.positions, change / self._limits)
        if felt is not None:
            self.touch = Touch(reading.stamp, reading.positions, last.velocities, felt * self._limits)
            return True
        self._usual = self._usual + min(interval / self._adaptation, 1.0) * change
        return False

    def greatest_efforts(self) -> FloatArray | None:
        """See `regrasp.interfaces.devices.Guard`."""
        if self._most is None or self._wanted is None:
            return None
        return np.asarray(np.minimum(np.abs(self._wanted) + self._most * self._torques, self._torques))

    def _felt(self, q: FloatArray, shares: FloatArray) -> FloatArray | None:
        """What is left of the efforts (n,), in shares of their limits, without a pull, if it is a touch."""
        felt = self._without_pull(q, shares, np.inf)
        square = felt @ felt
        if square > self._times_far**2:
            return felt
        if self._pull is None and square <= 1.0:
            return None
        felt = self._without_pull(q, shares, self._pull_near)
        return felt if felt @ felt > 1.0 and (self._near is None or self._near(q)) else None

    def _without_pull(self, q: FloatArray, shares: FloatArray, most: float) -> FloatArray:
        """The efforts (n,), in shares of their limits, less those of a pull of `most` N.

        The pull is the one that explains them best.
        """
        if self._pull is None:
            return shares
        along = self._dynamics.efforts_of_pull(q, self._pull) / self._limits
        force = float(along @ shares) / max(float(along @ along), 1e-12)
        return np.asarray(shares - min(max(force, -most), most) * along)
