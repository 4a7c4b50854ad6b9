"""Causes of failure: those of every task. A task adds an enumeration of its own."""

from dataclasses import dataclass
from enum import StrEnum


class CauseCode(StrEnum):
    """The causes that a leaf, a service or a run of any task may give."""

    OUT_OF_REACH = "out_of_reach"
    NO_COLLISION_FREE_GOAL = "no_collision_free_goal"
    PLANNING_FAILED = "planning_failed"
    MOTION_BLOCKED = "motion_blocked"
    GRASP_EMPTY = "grasp_empty"
    GRASP_FAILED = "grasp_failed"
    NOTHING_HELD = "nothing_held"
    CAMERA_FAILED = "camera_failed"
    ARM_FAILED = "arm_failed"
    GRIPPER_FAILED = "gripper_failed"
    SERVICE_FAILED = "service_failed"
    TOO_MANY_TRIES = "too_many_tries"
    NO_PLAN = "no_plan"
    KEY_DIFFERS = "key_differs"
    KEY_MISSING = "key_missing"
    TIMED_OUT = "timed_out"
    TIME_LIMIT = "time_limit"
    WALL_LIMIT = "wall_limit"
    INTERRUPTED = "interrupted"
    INTERNAL_ERROR = "internal_error"


class ServiceError(Exception):
    """A service failed for a reason outside the program: a lost connection, a driver's timeout. Callers handle it."""


@dataclass(frozen=True)
class Cause:
    """A cause: its code, one sentence with the numbers, and the tree path of its node ('' without a tree)."""

    code: str  # a `CauseCode`, or a task's own
    message: str
    node: str = ""
