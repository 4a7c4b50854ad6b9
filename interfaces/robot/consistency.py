"""What in a robot file contradicts itself or its URDF, although each value is well formed."""

from collections.abc import Iterator

import numpy as np

from regrasp.interfaces.quote import nearest, quoted
from regrasp.interfaces.robot.parts import ParallelGripper
from regrasp.interfaces.robot.robot import Robot

Where = tuple[str | int, ...]  # a place in the file
Found = tuple[Where, str]  # where, and what
_CLOSE = 1e-6  # m by which a limit may be rounded
_ON_LINE = 1e-6  # m and rad by which axes of joints may be off one line


def inconsistencies(robot: Robot) -> list[Found]:
    """What is wrong. Raises RobotError: the URDF cannot be read, or lacks what the chain or the spheres are made of."""
    if found := [*_doubled_joints(robot), *_pairs(robot), *_unknown_links(robot)]:
        return found
    _ = robot.chain, robot.body
    if robot.mount is not None:
        _ = robot.mounted
    return [*_base(robot), *_still(robot), *_finger_limits(robot)]


def _doubled_joints(robot: Robot) -> Iterator[Found]:
    seen = {robot.rail.name} if robot.rail else set()
    for i, joint in enumerate(robot.joints):
        if joint.name in seen:
            yield ("joints", i, "name"), f"two joints are named {joint.name}; give each a name of its own"
        seen.add(joint.name)


def _pairs(robot: Robot) -> Iterator[Found]:
    seen = set[frozenset[str]]()
    for n, (a, b) in enumerate(robot.self_collision):
        if a == b:
            yield ("self_collision", n), f"{a} is paired with itself; name two links"
        elif frozenset((a, b)) in seen:
            yield ("self_collision", n), f"the pair {a}, {b} stands twice; keep one"
        seen.add(frozenset((a, b)))


def _unknown_links(robot: Robot) -> Iterator[Found]:
    links = robot.tree.links
    named: list[tuple[Where, str]] = [(("cover", "links", link), link) for link in robot.cover.links]
    named += [(("untouchable", n), link) for n, link in enumerate(robot.untouchable)]
    for path, link in named:
        if link not in links:
            yield path, f"the URDF has no link {quoted(link)}; {nearest(link, links)}"


def _base(robot: Robot) -> Iterator[Found]:
    moving = [joint.name for joint in robot.tree.way_to(robot.base_link) if joint.kind != "fixed"]
    if robot.rail is not None:
        moving.remove(robot.rail.name)
    if moving:
        yield ("base_link",), f"{robot.base_link} is moved by {', '.join(moving)}; name a link before the first joint"


def _still(robot: Robot) -> Iterator[Found]:
    last = _turning_on_the_spot(robot)
    for n, link in enumerate(robot.still):
        index = robot.link_place(link)[0]
        if index > last:
            moved_by = robot.joint_names[last]
            message = f"{link} does not only turn on the spot: {moved_by} moves it along; write still without it"
            yield ("still", n), message


def _finger_limits(robot: Robot) -> Iterator[Found]:
    """Positions of sliding fingers that their joints do not reach."""
    if not isinstance(robot.gripper, ParallelGripper):
        return
    jaw = robot.parallel_jaw
    for key, gap in (("opening", robot.gripper.opening), ("closed", robot.gripper.closed)):
        for side, joint in enumerate(jaw.joints):
            nearest_gap, farthest = jaw.reach(side)
            if not nearest_gap - _CLOSE <= gap <= farthest + _CLOSE:
                lower, upper = joint.limits.get("lower", 0.0), joint.limits.get("upper", 0.0)
                stands = (
                    f"{joint.name} would stand at {jaw.positions(gap)[joint.name]:g} m with the pads {gap:g} m apart"
                )
                right = (
                    f"these pads can be {max(nearest_gap, 0.0):.4g} to {farthest:.4g} m apart: correct {key} or pads"
                )
                if farthest <= 0:
                    right = "these pads always touch: correct their face and thickness"
                yield ("gripper", key), f"{stands}, beyond the URDF's {lower:g} to {upper:g}; {right}"
                break


def _turning_on_the_spot(robot: Robot) -> int:
    """The last of the chain's links that all joints before it turn about one line; 0 is the base."""
    chain, offset = robot.chain, np.zeros(3)
    for i in range(len(chain)):
        offset = offset + chain.origins[i] if i else offset
        off_line = np.linalg.norm(np.cross(offset, chain.axes[0]))
        off_axis = np.linalg.norm(np.cross(chain.axes[i], chain.axes[0]))
        if chain.slides[i] or off_line > _ON_LINE or off_axis > _ON_LINE:
            return i
    return len(chain)
