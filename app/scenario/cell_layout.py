"""Checks of a cell's layout: parts that overlap, joints past their limits, a cable that is too short."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from itertools import combinations
from typing import NamedTuple

import numpy as np
from scipy.spatial.transform import RigidTransform

from regrasp.app.files.findings import Finding
from regrasp.app.files.yaml_lines import Document, Path
from regrasp.app.scenario.placement import (
    arm_base,
    cable_at_start,
    cable_error,
    cube_depths,
    fixed_cameras,
    half_edges,
    line_depth,
    penetration_depth,
    sleeping_arm_cubes,
    socket_block,
)
from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.cable.cell import PLUGGED_INTO, CableCell, CableKnown
from regrasp.interfaces.cell import FixedMount
from regrasp.interfaces.fault import JOINT_NAMES
from regrasp.interfaces.quote import cut, quoted
from regrasp.interfaces.scene import GRAVITIES


@dataclass(frozen=True)
class CellLayoutParameters:
    """How deep the parts of a cell may reach into one another, metres."""

    overlap: float = 0.005  # the spheres that fill an arm stand out of it by less
    cable_ends: float = 0.05  # of the cable at both ends: they lie in their sockets


class Part(NamedTuple):
    """A body that does not move: where the file says so, name, centre (3,) and half edges (3, 3), metres."""

    path: Path
    name: str
    center: FloatArray
    halves: FloatArray


def layout_findings(
    document: Document, cell: CableCell, parameters: CellLayoutParameters = CellLayoutParameters()
) -> list[Finding]:
    """What is wrong with a cell although each of its values is right by itself."""
    known = cell.known
    found = [
        *_joints(document, known),
        *_overlaps(document, known, parameters.overlap),
        *_cable(document, cell),
        *_clip(document, known),
        *_sight(document, known),
    ]
    return found or [*_in_the_way(document, cell, parameters), *_plug(document, known)]  # these take a moment


def _joints(document: Document, known: CableKnown) -> Iterator[Finding]:
    from regrasp.motion.robots.kinematics import LOWER, UPPER  # late: it brings the compiler

    for i, arm in enumerate(known.arms):
        for j, (angle, low, high) in enumerate(zip(arm.sleep, LOWER, UPPER, strict=True)):
            if not low <= angle <= high:
                told = f"{angle:g} rad is past the limits of the {arm.name} arm's {JOINT_NAMES[j]}; "
                inside = f"write one from {np.ceil(100 * low) / 100:.2f} to {np.floor(100 * high) / 100:.2f}"
                yield Finding(*document.place(("known", "arms", i, "sleep", j)), told + inside)


def _overlaps(document: Document, known: CableKnown, most: float) -> Iterator[Finding]:
    """Arms, cameras, the plugged and the stowed connector in other parts of the cell."""
    parts = [*_parts(known)]
    bases = [Part(("known", "arms", i), *arm_base(arm)) for i, arm in enumerate(known.arms)]
    for part in [*parts, *bases]:
        for name, depth in _inside(known, part, bases):
            if depth > most:
                message = f"{cut(part.name)} reaches {depth:.3f} m into {name}; move one of them"
                yield Finding(*document.place(part.path), message)
    if (depth := _between_the_arms(known)) > most:
        message = f"the arms asleep reach {depth:.3f} m into each other; change their sleep or their bases"
        yield Finding(*document.place(("known", "arms")), message)
    for name, place in fixed_cameras(known):
        for part in [*parts, *bases]:
            if penetration_depth(part.halves, place - part.center) > 0:
                yield Finding(
                    *document.place(part.path), f"the {name} camera is inside {cut(part.name)}; move one of them"
                )


def _between_the_arms(known: CableKnown) -> float:
    """How deep (m) the arms asleep reach into each other, by the spheres that fill their moving links."""
    from regrasp.motion.robots.spheres import SPHERE_LINKS, SPHERES  # late: they bring the compiler

    moving = SPHERE_LINKS > 0
    radii = SPHERES[moving, 3]
    bodies = [sleeping_arm_cubes(arm)[0][moving] for arm in known.arms]
    deepest = [
        float((radii[:, None] + radii[None] - np.linalg.norm(a[:, None] - b[None], axis=2)).max())
        for a, b in combinations(bodies, 2)
    ]
    return max(deepest, default=0.0)


def _inside(known: CableKnown, part: Part, bases: list[Part]) -> Iterator[tuple[str, float]]:
    """What a part may stand in, with the depth (m) that it reaches into it."""
    for arm, base in zip(known.arms, bases, strict=True):
        if part.path == base.path:
            continue
        if part.path[1] != "arms" or part.path > base.path:  # a pair of bases once
            yield base.name, penetration_depth(np.vstack([part.halves, base.halves]), part.center - base.center)
        centers, halves = sleeping_arm_cubes(arm)
        yield f"the {arm.name} arm asleep", float(cube_depths(part.halves, part.center - centers, halves).max())
    length, radius = known.cable.connector.length, known.cable.connector.radius
    size = (length, radius * np.sqrt(2), radius * np.sqrt(2))  # the box inside the cylinder
    plugged = known.cable.socket(PLUGGED_INTO)
    poses = {
        "the plugged connector": plugged.world_from_plug(length),
        "the stowed connector": known.cable.clip.world_from_seat,
    }
    own: dict[str, Path] = {
        "the plugged connector": ("known", "cable", "sockets", known.cable.sockets.index(plugged)),
        "the stowed connector": ("known", "cable", "clip"),
    }
    for name, pose in poses.items():
        if part.path[: len(own[name])] != own[name]:
            halves = half_edges(pose.rotation.as_matrix(), size)
            yield name, penetration_depth(np.vstack([part.halves, halves]), part.center - pose.translation)


def _parts(known: CableKnown) -> Iterator[Part]:
    """Boxes, sockets and the clip's bracket."""
    for i, box in enumerate(known.boxes):
        yield Part(("known", "boxes", i), box.name, np.array(box.center), half_edges(np.eye(3), box.size))
    for i, box in enumerate(known.cable.clip.bracket):
        yield Part(
            ("known", "cable", "clip", "bracket", i), box.name, np.array(box.center), half_edges(np.eye(3), box.size)
        )
    for i, socket in enumerate(known.cable.sockets):
        yield Part(("known", "cable", "sockets", i), *socket_block(socket))


def _in_the_way(document: Document, cell: CableCell, parameters: CellLayoutParameters) -> Iterator[Finding]:
    """Boxes through which the cable hangs at the start, in either gravity; its ends are left out."""
    ends = parameters.cable_ends
    for part in _parts(cell.known):
        if part.path[1] == "sockets":
            continue
        for gravity in GRAVITIES:
            points = np.array(cable_at_start(cell, gravity))
            points = points[(along := np.linspace(0.0, cell.hidden.cable.length, len(points))) > ends]
            points = points[: -np.count_nonzero(along > cell.hidden.cable.length - ends)]
            depth = line_depth(part.halves, part.center, points, cell.hidden.cable.radius) if len(points) > 1 else 0.0
            if depth > max(parameters.overlap, cable_error(cell, gravity)):
                told = (
                    f"{cut(part.name)} reaches {depth:.3f} m into the cable at the start ({gravity} gravity); move it"
                )
                yield Finding(*document.place(part.path), told)
                break


def _sight(document: Document, known: CableKnown) -> Iterator[Finding]:
    """The rear camera watches the carrying: it must see where this begins or where it ends."""
    camera = known.camera("rear")
    if not isinstance(camera.mount, FixedMount):
        return
    pose, k = camera.mount.world_from_camera, camera.intrinsics
    plug = known.cable.socket(PLUGGED_INTO).world_from_plug(known.cable.connector.length).translation
    boxes = [part for part in _parts(known) if part.path[1] == "boxes"]
    for target in (plug, np.asarray(known.cable.clip.seat)):
        x, y, z = pose.inv().apply(target)
        in_view = z > 0 and 0 <= k.fx * x / z + k.cx < k.width and 0 <= k.fy * y / z + k.cy < k.height
        ray = np.array([pose.translation, pose.translation + 0.9 * (target - pose.translation)])  # not into its socket
        if in_view and all(line_depth(box.halves, box.center, ray, 0.0) <= 0 for box in boxes):
            return
    where = document.place(("known", "cameras", known.cameras.index(camera), "mount"))
    yield Finding(*where, "the rear camera sees neither the plugged connector nor the clip; turn or move it")


def _cable(document: Document, cell: CableCell) -> Iterator[Finding]:
    known, cable = cell.known, cell.hidden.cable
    plugged = known.cable.socket(PLUGGED_INTO)
    if plugged is known.cable.sockets[-1]:
        message = (
            f"{quoted(plugged.name)}, the last socket, holds the cable's other end; name another, or put it elsewhere"
        )
        yield Finding(*document.place(("known", "cable", "plugged_into")), message)
        return
    rear = [-0.5 * known.cable.connector.length, 0.0, 0.0]
    ends = {
        f"socket {plugged.name}": plugged.world_from_plug(known.cable.connector.length),
        "the clip": known.cable.clip.world_from_seat,
    }
    for name, pose in ends.items():
        way = float(np.linalg.norm(pose.apply(rear) - cable.anchor))
        if way >= cable.length:
            message = f"a cable {cable.length:g} m long does not reach a connector in {cut(name)}, {way:.3f} m away"
            place = document.place(("hidden", "cable", "length"))
            yield Finding(*place, f"{message}; make it longer, or move that nearer")


def _clip(document: Document, known: CableKnown) -> Iterator[Finding]:
    from regrasp.behaviors.cable.hand import HANDLING_ARM
    from regrasp.motion.robots.kinematics import ORIGINS, TOOL_OFFSET  # late: it brings the compiler

    shoulder = np.asarray(known.arm(HANDLING_ARM).base) + ORIGINS[0] + ORIGINS[1]
    reach = float(np.linalg.norm(ORIGINS[2:], axis=1).sum() + np.linalg.norm(TOOL_OFFSET))
    way = float(np.linalg.norm(np.asarray(known.cable.clip.seat) - shoulder))
    if way > reach:
        message = f"the clip is {way:.2f} m from the {HANDLING_ARM} arm's shoulder, which reaches {reach:.2f} m"
        yield Finding(*document.place(("known", "cable", "clip", "seat")), f"{message}; move it nearer")


def _plug(document: Document, known: CableKnown) -> Iterator[Finding]:
    from regrasp.motion.execution import JawParameters  # late: it brings the planner and the compiler

    jaw, thick = JawParameters(), 2 * known.cable.connector.radius
    if thick + 2 * jaw.slack > jaw.open_gap:
        message = (
            f"a connector {1e3 * thick:.0f} mm thick does not fit the jaw, which opens {1e3 * jaw.open_gap:.0f} mm"
        )
        right = f"write a radius up to {0.5 * jaw.open_gap - jaw.slack:.3f}"
        yield Finding(
            *document.place(("known", "cable", "connector", "radius")), f"{message} and needs some room; {right}"
        )
        return
    if trouble := _no_grasp(known):
        message = f"no way to take hold of a connector in socket {cut(known.cable.plugged_into)}: {trouble}"
        yield Finding(
            *document.place(("known", "cable", "plugged_into")), f"{message}; plug it in elsewhere, or make room"
        )


@lru_cache(maxsize=64)
def _no_grasp(known: CableKnown) -> str | None:
    """Why the hand cannot take hold of the plugged connector among the known boxes; None when it can."""
    from regrasp.behaviors.cable.hand import HANDLING_ARM  # late: the rest brings the planner and the compiler
    from regrasp.behaviors.cable.unplug import UnplugParameters
    from regrasp.motion.execution import JawParameters
    from regrasp.motion.failure import PlanningError
    from regrasp.motion.grasping.approach import pick_candidates
    from regrasp.motion.grasping.grasps import ApproachParameters, choose_grasp
    from regrasp.motion.robots.kinematics import ArmKinematics
    from regrasp.motion.scene.collision import ArmBody, Clearances, CollisionModel

    arms: dict[str, ArmKinematics] = {
        arm.name: ArmKinematics(RigidTransform.from_translation(arm.base)) for arm in known.arms
    }
    boxes, connector = known.solids(), known.cable.connector
    others = [
        CollisionModel(arms[a.name], boxes).spheres(np.array(a.sleep)) for a in known.arms if a.name != HANDLING_ARM
    ]
    body = ArmBody(opening=JawParameters().open_gap)
    model = CollisionModel(arms[HANDLING_ARM], boxes, body, other_arm=np.vstack(others))
    plug = known.cable.socket(PLUGGED_INTO).world_from_plug(connector.length)
    asleep_at = np.array(known.arm(HANDLING_ARM).sleep)
    clearances = Clearances()
    approach = ApproachParameters(margin=clearances.tight_margin, near_margin=clearances.near_margins[-1])
    try:
        candidates = pick_candidates(plug, connector, UnplugParameters().shallow)
        choose_grasp(arms[HANDLING_ARM], model, asleep_at, candidates, parameters=approach)
    except (PlanningError, ValueError) as error:
        return str(error)
    return None
