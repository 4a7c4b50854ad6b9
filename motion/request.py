"""A motion under way, as the leaves poll it."""

from regrasp.interfaces.request import Request

MotionRequest = Request[None]  # a motion of an arm or its jaw; `cancel` stops the arm
