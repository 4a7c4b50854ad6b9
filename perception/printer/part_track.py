"""Follows the printed part's gripping section with the hand's camera, whether it stands or drifts."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.spatial.transform import RigidTransform

from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.frame import RgbdFrame
from regrasp.interfaces.outline import Outline
from regrasp.interfaces.printer.cell import PrinterKnown
from regrasp.interfaces.printer.target import TargetEstimate
from regrasp.interfaces.wall_time import counts_as
from regrasp.perception.printer.hand_view import HandView, HandViewParameters, Pads
from regrasp.perception.printer.section_view import NoSection, SectionView, SectionViewParameters
from regrasp.perception.service import Perception


@dataclass(frozen=True)
class PartTrackParameters:
    """The filter, and how the hand's and the section's views are measured."""

    acceleration: float = 0.03  # m/s2, standard deviation for 1 s of what may push the part; choice
    start_speed: float = 0.01  # m/s, standard deviation of what is not known to move
    yaw_rate: float = 0.02  # rad/s, standard deviation for 1 s; choice
    gate: float = 5.0  # standard deviations off the prediction, and ...
    gate_least: float = 0.010  # m at least, from which on a picture is an outlier
    outliers: int = 3  # one after the other that begin a new track: the part was knocked; choice
    hand: HandViewParameters = field(default_factory=HandViewParameters)
    section: SectionViewParameters = field(default_factory=SectionViewParameters)


class PartTracker:
    r"""A Kalman filter of the section's place and velocity in the world, by what the hand's camera sees.

    What it tells is right relative to the hand: the place in the world is off by as much as the arm's kinematics are.
    With :math:`x = (p, v)` for each axis, interval h and acceleration's deviation s,

    .. math:: F = \begin{pmatrix} 1 & h \\ 0 & 1 \end{pmatrix}, \quad
        Q = s^2 h \begin{pmatrix} h^2/3 & h/2 \\ h/2 & 1 \end{pmatrix}

    (Bar-Shalom, Li, Kirubarajan 2001, "Estimation with Applications to Tracking and Navigation", 6.2.2).

    `tool_of` gives world_from_tool at a frame's exposure and `gap` the jaw's, by the encoders. `say` is told when the
    section is first seen, and when it was knocked.
    """

    def __init__(
        self,
        perception: Perception,
        known: PrinterKnown,
        tool_of: Callable[[RgbdFrame], RigidTransform],
        gap: Callable[[], float],
        since: float,
        parameters: PartTrackParameters = PartTrackParameters(),
        say: Callable[..., None] = lambda event, **values: None,
    ) -> None:
        self._perception, self._camera, self._tool_of, self._gap = perception, known.printer.camera, tool_of, gap
        self._since, self._parameters, self._say = since, parameters, say
        self._section = SectionView(known.printer.part, parameters.section)
        self._pads = Pads.of(known.arm(known.printer.hand).robot)
        self._hand: HandView | None = None
        self._stamp: float | None = None
        self._place: FloatArray = np.zeros((2, 3))  # of the front's middle: m, and m/s
        self._covariance: FloatArray = np.zeros((2, 2))
        self._yaw, self._yaw_variance = 0.0, 1.0
        self._outliers: list[tuple[float, FloatArray]] = []  # in a row: stamps, and places (3,) m
        self._number = -1
        self.why, self.trouble = "there is no picture yet", self._perception.trouble(self._camera)

    @counts_as("perception")
    def update(self) -> TargetEstimate | None:
        """Take the newest picture in if it is new; the section as estimated now, None before it was seen."""
        frame = self._perception.frame(self._camera)
        if frame is not None and frame.stamp >= self._since and frame.number != self._number:
            self._number = frame.number
            # A picture that a camera repeats while the hand moves on shows a part that seems to go before it.
            if self._perception.trouble(self._camera) is None and not self._perception.repeats(self._camera):
                self._take(frame)
        self.trouble = self._perception.trouble(self._camera)
        return self._estimate()

    def _take(self, frame: RgbdFrame) -> None:
        world_from_tool = self._tool_of(frame)
        camera_from_tool, mount_deviation = self._mount(frame, world_from_tool)
        seen = self._section.find(frame, camera_from_tool)
        if isinstance(seen, NoSection):
            self.why = seen.why
            return
        self._perception.found(self._camera, Outline("gripping section, as fitted", frame.stamp, seen.outline))
        tool = world_from_tool.as_matrix()
        way = tool[:3, :3] @ [np.cos(seen.yaw), np.sin(seen.yaw), 0.0]
        yaw = float(np.arctan2(way[1], way[0]))
        deviation = float(np.hypot(seen.deviation, mount_deviation))
        self._measure(frame.stamp, tool[:3, :3] @ seen.front + tool[:3, 3], deviation, yaw, seen.yaw_deviation)

    def _mount(self, frame: RgbdFrame, world_from_tool: RigidTransform) -> tuple[FloatArray, float]:
        """Where the camera sits, camera_from_tool (4, 4), and its standard deviation in m: as measured if it can be."""
        as_known = world_from_tool.inv() * self._perception.pose_of(frame)
        if self._pads is None:
            return as_known.inv().as_matrix(), self._parameters.hand.mount_deviation
        if self._hand is None:
            self._hand = HandView(as_known, self._pads, self._parameters.hand)
        self._hand.feed(frame, self._gap())
        return self._hand.camera_from_tool, float(self._hand.deviation.max())

    def _measure(self, stamp: float, place: FloatArray, deviation: float, yaw: float, yaw_deviation: float) -> None:
        values = self._parameters
        if self._stamp is not None:
            h = stamp - self._stamp
            step = np.array([[1.0, h], [0.0, 1.0]])
            spread = values.acceleration**2 * h * np.array([[h * h / 3, h / 2], [h / 2, 1.0]])
            predicted = step @ self._place
            covariance = step @ self._covariance @ step.T + spread
            off = place - predicted[0]
            limit = max(values.gate * float(np.sqrt(covariance[0, 0] + deviation**2)), values.gate_least)
            if float(np.linalg.norm(off)) > limit and len(self._outliers) < values.outliers:
                self._outliers.append((stamp, place))
                self.why = f"it seems to have jumped by {1e3 * float(np.linalg.norm(off)):.0f} mm"
                return
            if len(self._outliers) < values.outliers:
                gain = covariance[:, 0] / (covariance[0, 0] + deviation**2)
                self._place = predicted + gain[:, None] * off
                self._covariance = covariance - np.outer(gain, covariance[0])
                self._yaw_variance += values.yaw_rate**2 * h
                share = self._yaw_variance / (self._yaw_variance + yaw_deviation**2)
                self._yaw += share * float(np.arctan2(np.sin(yaw - self._yaw), np.cos(yaw - self._yaw)))
                self._yaw_variance *= 1.0 - share
                self._stamp, self._outliers = stamp, []
                return
        self._say("saw the part" if self._stamp is None else "the part jumped", position=place.round(4).tolist())
        self._place = np.array([place, np.zeros(3)])
        self._covariance = np.diag([deviation**2, values.start_speed**2])
        if self._outliers:  # one that was knocked lies where the outliers were, one that goes fast went on from there
            before, there = self._outliers[0]
            self._place[1] = (place - there) / (stamp - before)
            self._covariance[1, 1] += 2.0 * (deviation / (stamp - before)) ** 2
        self._yaw, self._yaw_variance, self._stamp, self._outliers = yaw, yaw_deviation**2, stamp, []

    def _estimate(self) -> TargetEstimate | None:
        if self._stamp is None:
            return None
        x, y = np.cos(self._yaw), np.sin(self._yaw)
        pose = np.array([[x, -y, 0.0, 0.0], [y, x, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [0.0, 0.0, 0.0, 1.0]])
        pose[:3, 3] = self._place[0]
        return TargetEstimate(
            self._stamp,
            pose,
            self._place[1],
            float(np.sqrt(self._covariance[0, 0])),
            float(np.sqrt(self._yaw_variance)),
        )


def line_through(estimates: Sequence[TargetEstimate]) -> tuple[list[float], list[float]]:
    """Place (3,) m and velocity (3,) m/s of a target that moves evenly, by estimates of it at two times or more.

    Least squares through all places; the place is that at the last estimate's time.
    """
    stamps = np.array([estimate.stamp for estimate in estimates])
    places = np.array([estimate.pose[:3, 3] for estimate in estimates])
    velocity, place = np.polyfit(stamps - stamps[-1], places, 1)
    return place.tolist(), velocity.tolist()
