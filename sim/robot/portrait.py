"""A picture of a robot asleep, and of the spheres that stand for it in collision checks."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pybullet as p
from numpy.typing import NDArray
from scipy.spatial.transform import RigidTransform, Rotation

from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.fields import Color, Vector
from regrasp.interfaces.frame import Intrinsics
from regrasp.interfaces.robot.robot import Robot
from regrasp.interfaces.robot.urdf import pose_of
from regrasp.sim.render.renderer import LightState, make_renderer
from regrasp.sim.render.visuals import Visuals
from regrasp.sim.robot.load import joint_numbers, load_robot_body


@dataclass(frozen=True)
class PortraitParameters:
    """What a portrait looks like; all is choice."""

    size: int = 640  # pixels, of each half
    field_deg: float = 35.0
    seen_from: Vector = (1.0, -0.8, 0.6)  # direction from the robot to the camera, of any length
    light_from: Vector = (0.6, -0.9, 1.0)  # direction from the robot to the light, of any length
    largest: float = 0.25  # m; of a larger sphere only a cap stands for something: it need not fit into the picture
    around: float = 0.1  # m around the links' origins that are in the picture if there are no such spheres
    axes: tuple[float, float] = (
        0.08,
        0.006,
    )  # m, length and thickness of the bars along x, y and z of the tool's frame
    axis_colors: tuple[Color, Color, Color] = ((0.9, 0.1, 0.1), (0.1, 0.7, 0.1), (0.1, 0.2, 0.9))
    still: Color = (0.55, 0.55, 0.58)  # of spheres that nothing around can meet
    colors: tuple[Color, ...] = ((0.85, 0.45, 0.2), (0.2, 0.5, 0.8))  # of the other links' spheres, in turn


def portrait(robot: Robot, parameters: PortraitParameters = PortraitParameters()) -> NDArray[np.uint8]:
    """The picture (size, 2 size, 3) RGB: the robot with its tool's frame at the left, its spheres at the right."""
    spheres = _placed_spheres(robot)
    small = spheres[spheres[:, 3] <= parameters.largest]
    framed = small if len(small) else _around_links(robot, parameters.around)
    middle = 0.5 * (framed[:, :3].min(axis=0) + framed[:, :3].max(axis=0))
    radius = float(np.max(np.linalg.norm(framed[:, :3] - middle, axis=1) + framed[:, 3]))
    camera = _camera(middle, radius, parameters)
    return np.hstack(
        [
            _drawn(lambda client: _place_robot_and_tool(client, robot, parameters), camera, parameters),
            _drawn(lambda client: _place_spheres(client, robot, spheres, parameters), camera, parameters),
        ]
    )


def _positions(robot: Robot) -> dict[str, float]:
    """Positions of the URDF's joints with the robot asleep and the jaw open."""
    asleep = dict(zip(robot.urdf_joints, (robot.signs * robot.asleep).tolist(), strict=True))
    return asleep | robot.gripper_positions(robot.gripper.opening)


def _placed_spheres(robot: Robot) -> FloatArray:
    """Centres and radii (n, 4), m, of the spheres in the URDF's root frame."""
    positions, rows = _positions(robot), []
    for link, group in robot.spheres.items():
        pose = robot.tree.frame(link, positions)
        for x, y, z, radius in group:
            rows.append([*(pose[:3, :3] @ (x, y, z) + pose[:3, 3]), radius])
    return np.array(rows, float).reshape(-1, 4)


def _around_links(robot: Robot, radius: float) -> FloatArray:
    """Balls (n, 4), m, around the origins of all links in the URDF's root frame."""
    positions = _positions(robot)
    return np.array([[*robot.tree.frame(link, positions)[:3, 3], radius] for link in robot.tree.links])


def _place_robot_and_tool(client: int, robot: Robot, parameters: PortraitParameters) -> None:
    body, _ = load_robot_body(client, robot, RigidTransform.from_matrix(robot.tree.frame(robot.base_link)))
    joints = joint_numbers(client, body)
    for name, position in _positions(robot).items():
        p.resetJointState(body, joints[name], position, physicsClientId=client)
    tool = robot.tree.frame(robot.tool.link, _positions(robot)) @ pose_of(robot.tool.xyz, robot.tool.rpy)
    _place_axes(client, RigidTransform.from_matrix(tool), parameters)


def _place_axes(client: int, root_from_frame: RigidTransform, parameters: PortraitParameters) -> None:
    """Bars from a frame's origin along its axes."""
    length, thickness = parameters.axes
    turn = root_from_frame.rotation.as_quat().tolist()
    for axis, color in enumerate(parameters.axis_colors):
        half, middle = np.full(3, 0.5 * thickness), np.zeros(3)
        half[axis] = middle[axis] = 0.5 * length
        place = root_from_frame.apply(middle).tolist()
        shape = p.createVisualShape(
            p.GEOM_BOX, halfExtents=half.tolist(), rgbaColor=[*color, 1], physicsClientId=client
        )
        p.createMultiBody(0, -1, shape, place, turn, physicsClientId=client)


def _place_spheres(client: int, robot: Robot, spheres: FloatArray, parameters: PortraitParameters) -> None:
    for (x, y, z, radius), link in zip(spheres.tolist(), robot.body.links.tolist(), strict=True):
        moving = link >= robot.body.first_moving
        color = parameters.colors[link % len(parameters.colors)] if moving else parameters.still
        shape = p.createVisualShape(p.GEOM_SPHERE, radius=radius, rgbaColor=[*color, 1], physicsClientId=client)
        p.createMultiBody(0, -1, shape, [x, y, z], physicsClientId=client)


def _drawn(
    place: Callable[[int], None], world_from_camera: RigidTransform, parameters: PortraitParameters
) -> NDArray[np.uint8]:
    client = p.connect(p.DIRECT)
    try:
        place(client)
        visuals = Visuals(client)
        renderer = make_renderer(visuals)
        intrinsics = Intrinsics.from_fov(parameters.size, parameters.size, float(np.deg2rad(parameters.field_deg)))
        light = LightState(parameters.light_from, 0.5, 0.5)
        picture = renderer.render_color(visuals.snapshot(), world_from_camera, intrinsics, light)
        renderer.close()
    finally:
        p.disconnect(client)
    return picture


def _camera(middle: FloatArray, radius: float, parameters: PortraitParameters) -> RigidTransform:
    """world_from_camera (x right, y down, z forward): it looks at the middle of what fits into a ball of `radius` m."""
    away = np.array(parameters.seen_from) / np.linalg.norm(parameters.seen_from)
    right = np.cross(-away, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right)
    turn = np.column_stack([right, np.cross(-away, right), -away])
    distance = radius / np.sin(np.deg2rad(parameters.field_deg) / 2)
    return RigidTransform.from_components(middle + distance * away, Rotation.from_matrix(turn))
