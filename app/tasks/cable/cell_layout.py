"""Checks of a cell for the cable task: its names, and how sockets, clip, cable and hand lie to one another."""

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy.spatial.transform import RigidTransform

from regrasp.app.files.findings import Finding
from regrasp.app.files.yaml_lines import Document, Path
from regrasp.app.scenario.cell_layout import (
    CellLayoutParameters,
    Part,
    arm_bases,
    box_parts,
    out_of_reach,
    overlap_findings,
    reaches,
)
from regrasp.app.scenario.shapes import half_edges, line_depth, penetration_depth
from regrasp.app.tasks.cable.placement import cable_at_start, cable_error, socket_block
from regrasp.interfaces.cable.cell import PLUGGED_INTO, CableCell, CableKnown
from regrasp.interfaces.cell import FixedMount, WristMount
from regrasp.interfaces.quote import cut, nearest, quoted
from regrasp.interfaces.scene import GRAVITIES


@dataclass(frozen=True)
class CableLayoutParameters(CellLayoutParameters):
    """How deep the parts of a cell may reach into one another, metres."""

    cable_ends: float = 0.05  # of the cable at both ends: they lie in their sockets


def cell_findings(document: Document, cell: CableCell, laid_out: bool) -> list[Finding]:
    """Names that are taken twice or refer to nothing; only if `laid_out`, how the parts lie to one another."""
    return _layout(document, cell) if laid_out else [*_misnamed(document, cell.known)]


def _misnamed(document: Document, known: CableKnown) -> Iterator[Finding]:
    cable, here = known.cable, ("known", "cable")
    sockets = [s.name for s in cable.sockets]
    for name, count in Counter(sockets).items():
        if count > 1:
            message = f"{count} sockets are named {quoted(name)}; rename them"
            yield Finding(*document.place((*here, "sockets")), message)
    if cable.plugged_into not in sockets:
        message = f"no socket {quoted(cable.plugged_into)}; {nearest(cable.plugged_into, sockets)}"
        yield Finding(*document.place((*here, "plugged_into")), message)
    mounts = {camera.name: camera.mount for camera in known.cameras}
    fixed = [name for name, mount in mounts.items() if isinstance(mount, FixedMount)]
    carried = [name for name, mount in mounts.items() if isinstance(mount, WristMount) and mount.arm != cable.hand]
    roles = {
        "hand": ("arm", [arm.name for arm in known.arms]),
        "overview": ("fixed camera", fixed),
        "search": ("camera on the wrist of an arm other than the hand", carried),
    }
    for role, (kind, names) in roles.items():
        name = getattr(cable, role)
        if name not in names:
            right = nearest(name, names) if names else "add one"
            yield Finding(*document.place((*here, role)), f"{role}: no {kind} {quoted(name)}; {right}")


def _layout(
    document: Document, cell: CableCell, parameters: CableLayoutParameters = CableLayoutParameters()
) -> list[Finding]:
    known = cell.known
    found = [
        *overlap_findings(document, known, _own_parts(known), parameters),
        *_in_connectors(document, known, parameters.overlap),
        *_cable(document, cell),
        *_clip(document, known),
        *_sight(document, known),
    ]
    return found or [*_in_the_way(document, cell, parameters), *_plug(document, known)]  # these take a moment


def _own_parts(known: CableKnown) -> list[Part]:
    """The clip's bracket and the sockets."""
    cable = known.cable
    sockets = [Part(("known", "cable", "sockets", i), *socket_block(s)) for i, s in enumerate(cable.sockets)]
    return [*box_parts(("known", "cable", "clip", "bracket"), cable.clip.bracket), *sockets]


def _parts(known: CableKnown) -> list[Part]:
    """Boxes, the clip's bracket and sockets."""
    return [*box_parts(("known", "boxes"), known.boxes), *_own_parts(known)]


def _in_connectors(document: Document, known: CableKnown, most: float) -> Iterator[Finding]:
    """Parts of the cell in the plugged or the stowed connector."""
    cable = known.cable
    length, radius = cable.connector.length, cable.connector.radius
    size = (length, radius * np.sqrt(2), radius * np.sqrt(2))  # the box inside the cylinder
    plugged = cable.socket(PLUGGED_INTO)
    own: dict[str, tuple[RigidTransform, Path]] = {  # where it is, and in which part of the file that is
        "the plugged connector": (
            plugged.world_from_plug(length),
            ("known", "cable", "sockets", cable.sockets.index(plugged)),
        ),
        "the stowed connector": (cable.clip.world_from_seat, ("known", "cable", "clip")),
    }
    for part in [*_parts(known), *arm_bases(known)]:
        for name, (pose, path) in own.items():
            if part.path[: len(path)] != path:
                halves = half_edges(pose.rotation.as_matrix(), size)
                depth = penetration_depth(np.vstack([part.halves, halves]), part.center - pose.translation)
                if depth > most:
                    yield reaches(document, part, depth, name)


def _in_the_way(document: Document, cell: CableCell, parameters: CableLayoutParameters) -> Iterator[Finding]:
    """Boxes through which the cable hangs at the start, in either gravity; its ends are left out."""
    ends = parameters.cable_ends
    for part in _parts(cell.known):
        if "sockets" in part.path:
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
    """The overview camera watches the carrying: it must see where this begins or where it ends."""
    camera = known.camera(known.cable.overview)
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
    yield Finding(*where, f"the {camera.name} camera sees neither the plugged connector nor the clip; turn or move it")


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
    trouble = out_of_reach(known.arm(known.cable.hand), np.asarray(known.cable.clip.seat))
    if trouble is not None:
        message = f"the clip is {trouble}; move it nearer"
        yield Finding(*document.place(("known", "cable", "clip", "seat")), message)


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
    # late: they bring the planner and the compiler
    from regrasp.motion.cable.taking import UnplugParameters
    from regrasp.motion.execution import JawParameters
    from regrasp.motion.failure import PlanningError
    from regrasp.motion.grasping.approach import pick_candidates
    from regrasp.motion.grasping.grasps import ApproachParameters, choose_grasp
    from regrasp.motion.robots.kinematics import ArmKinematics
    from regrasp.motion.scene.collision import ArmBody, Clearances, CollisionModel

    arms: dict[str, ArmKinematics] = {arm.name: ArmKinematics(arm.robot, arm.world_from_base) for arm in known.arms}
    boxes, connector = known.solids(), known.cable.connector
    others = [
        CollisionModel(arms[a.name], boxes).spheres(np.array(a.sleep)) for a in known.arms if a.name != known.cable.hand
    ]
    body = ArmBody(opening=JawParameters().open_gap)
    model = CollisionModel(arms[known.cable.hand], boxes, body, other_arm=np.vstack(others))
    plug = known.cable.socket(PLUGGED_INTO).world_from_plug(connector.length)
    asleep_at = np.array(known.arm(known.cable.hand).sleep)
    clearances = Clearances()
    approach = ApproachParameters(margin=clearances.tight_margin, near_margin=clearances.near_margins[-1])
    try:
        widest = known.arm(known.cable.hand).robot.gripper.opening
        candidates = pick_candidates(plug, connector, UnplugParameters().shallow, widest)
        choose_grasp(arms[known.cable.hand], model, asleep_at, candidates, parameters=approach)
    except (PlanningError, ValueError) as error:
        return str(error)
    return None
