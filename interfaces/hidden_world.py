"""The part of a cell file that only the simulated world knows. SI units."""

from typing import Annotated

from pydantic import Field

from regrasp.interfaces.fields import (
    Deviation,
    Direction,
    Force,
    Fraction,
    Friction,
    Model,
    UnsignedDegrees,
)


class Errors(Model):
    """Errors of calibration and sensors. Each is drawn once for a seed unless its comment says otherwise."""

    camera_position: Deviation  # of each axis of a camera's position
    camera_angle_deg: UnsignedDegrees  # standard deviation of a camera's rotation error about a random axis
    depth_scale: Annotated[float, Field(ge=0, le=0.5)]  # standard deviation of the factor on depth
    arm_tool: Deviation  # mean position error of the tool that the joint offsets cause
    finger_noise: Deviation  # of every reading of the gap
    finger_backlash: Deviation  # full width, metres
    finger_resolution: Annotated[float, Field(ge=1e-9, le=0.1)]  # of the gap's reading, metres
    finger_rate: Annotated[int, Field(ge=1, le=480)]  # Hz
    depth_subpixel: Annotated[float, Field(ge=0, le=10)]  # standard deviation of disparity in every frame, pixels
    depth_fixed_share: Fraction  # share of the depth noise's variance that is the same in all frames


class Light(Model):
    """One directional light that casts shadows, and ambient light."""

    direction: Direction  # from the scene to the light
    ambient: Fraction
    diffuse: Fraction
    direction_jitter_deg: UnsignedDegrees  # standard deviation, drawn once for a seed
    brightness_jitter: Fraction  # standard deviation of the factor on ambient and diffuse, drawn once for a seed


class GripperSpec(Model):
    """What is true of the grippers in this world in place of what their robots' files say."""

    pad_thickness: Annotated[float, Field(ge=1e-4, le=0.02)] | None = None  # metres, of pads that are added
    max_force: Force | None = None  # of each finger
    speed: Annotated[float, Field(ge=1e-3, le=10)] | None = None  # m/s of each finger
    friction: Friction | None = None  # of the pads


class HiddenWorld(Model):
    """What only the simulated world knows: physics, errors, light. A task adds its section under the task's name."""

    step_rate: Annotated[int, Field(ge=240, le=4800, multiple_of=240)]  # physics steps a second
    solver_iterations: Annotated[int, Field(ge=10, le=500)]
    gripper: GripperSpec = GripperSpec()
    errors: Errors
    light: Light
