"""Tolerances and effort of inverse kinematics."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class InverseKinematicsParameters:
    """Tolerances of inverse kinematics; a solution that misses its pose by more is dropped."""

    position: float = 1e-4  # m, of the tool; choice: far below the arm's accuracy
    angle: float = 1e-3  # rad, of the tool
    camera_position: float = 0.002  # m, of a wrist camera; choice: it looks from 0.3 m
    camera_axis: float = float(np.deg2rad(0.5))  # rad, of a wrist camera's optical axis; choice
    distinct: float = 1e-3  # rad; solutions whose joints all differ by less are one
    roll: float = 1e-4  # rad of the last joint at which a camera's roll has converged
    roll_iterations: int = 20  # choice: bounds the time spent on a pose that it does not reach
    roll_starts: tuple[float, ...] = (0.0, 0.5 * np.pi, -0.5 * np.pi, np.pi)  # rad from which a camera's roll is sought
    # Along a rail, from which an arm is tried, and more where it reaches from none; choice: 0.27 to 0.02 m apart on 3 m
    rail_places: tuple[int, ...] = (13, 49, 193)
