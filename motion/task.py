"""A motion under way, as the leaves poll it."""

from regrasp.interfaces.task import Task

MotionTask = Task[None]  # a motion of an arm or its jaw; `cancel` stops the arm
