from dataclasses import replace

import numpy as np
import pytest
from fake_devices import Rig
from natural import natural_pose
from numpy.typing import NDArray
from scipy.spatial.transform import RigidTransform, Rotation

from regrasp.interfaces.cable.cell import CableKnown
from regrasp.interfaces.cause import CauseCode
from regrasp.motion.cable.carry_paths import CarryPathParameters
from regrasp.motion.failure import GraspEmptyError, JawBlockedError, PlanningError
from regrasp.motion.planning.straight import straight_line
from regrasp.motion.robots.spheres import sphere_distances
from regrasp.motion.service import MotionParameters

Points = NDArray[np.float64]
TIGHT_MARGIN = MotionParameters().clearances.tight_margin
READY = np.array([0.4, -0.6, 0.6, 0.0, 0.3, 0.0])
ASIDE = np.array([-0.5, -0.6, 0.6, 0.0, 0.3, 0.0])
HELD = RigidTransform.from_components([0.0, 0.0, 0.0], Rotation.from_euler("y", -90, degrees=True))


@pytest.fixture
def rig(known: CableKnown) -> Rig:
    return Rig(known)


def cube(center: Points, edge: float = 0.06, h: float = 0.01) -> Points:
    steps = np.arange(-edge / 2, edge / 2 + 1e-9, h)
    return np.asarray(center + np.stack(np.meshgrid(steps, steps, steps), -1).reshape(-1, 3))


def flown(rig: Rig, arm: str) -> list[Points]:
    """Where the arm was along its last trajectory, joints (6,)."""
    trajectory = rig.arms[arm].followed[-1][1]
    return [trajectory.sample(t)[0] for t in np.linspace(0.0, trajectory.duration, 60)]


def moved(rig: Rig, *way: float) -> RigidTransform:
    """The right tool's pose, shifted by `way` m in the world."""
    return RigidTransform.from_translation(way) * rig.motion.tool("right")


def in_hand(rig: Rig, off: list[float]) -> RigidTransform:
    """The right hand takes a connector where its cable, bent `off` m, holds it: tool_from_connector."""
    connector = natural_pose(rig.known, np.array(off))
    rig.run(rig.motion.pick("right", connector, rig.known.cable.connector))
    return rig.motion.tool("right").inv() * connector


def test_a_carry_takes_the_way_that_the_cable_goes_to_the_first_goal(rig: Rig) -> None:
    held = in_hand(rig, [0.02, 0.0, 0.10])
    start = rig.motion.tool("right")
    goals = [natural_pose(rig.known, np.array([x, 0.0, 0.17])) * held.inv() for x in (-0.04, 0.0)]
    rig.run(rig.motion.carry("right", goals, held, speed=0.5))
    end = rig.motion.tool("right")
    assert end.translation == pytest.approx(goals[0].translation, abs=1e-3)
    assert (end.rotation.inv() * goals[0].rotation).magnitude() < 0.01
    carried = [rig.motion.kinematics["right"].tool(q) * held for q in flown(rig, "right")]
    anchor, course = rig.known.cable.anchor
    for pose in carried:
        place = pose.apply([-0.5 * rig.known.cable.connector.length, 0.0, 0.0]) - anchor
        natural = natural_pose(rig.known, place - (place @ course) * course)
        assert np.linalg.norm(pose.translation - natural.translation) < 0.005
    length = np.linalg.norm(np.diff([pose.translation for pose in carried], axis=0), axis=1).sum()
    assert length < 1.2 * np.linalg.norm((goals[0] * held).translation - (start * held).translation)


def test_a_carry_does_not_take_the_cable_again_to_where_it_was_caught(
    rig: Rig, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(rig.motion, "feel", lambda arm, touch: touch.joints[:3])  # nothing is mapped
    held = in_hand(rig, [0.02, 0.0, 0.10])
    goal = natural_pose(rig.known, np.array([-0.04, 0.0, 0.17])) * held.inv()
    end_in_tool = held.apply([-0.5 * rig.known.cable.connector.length, 0.0, 0.0])

    def cable_end(q: Points) -> Points:
        return rig.motion.kinematics["right"].tool(q).apply(end_in_tool)

    halfway = 0.5 * (cable_end(rig.motion.joints("right")) + goal.apply(end_in_tool))
    caught: list[Points] = []

    def touches(q: Points) -> bool:
        if np.linalg.norm(cable_end(q) - halfway) < 0.02:
            caught.append(cable_end(q))
        return bool(caught)

    rig.arms["right"].bumps.append(touches)
    rig.run(rig.motion.carry("right", [goal], held, speed=0.5))
    assert rig.motion.tool("right").translation == pytest.approx(goal.translation, abs=1e-3)
    kept = min(np.linalg.norm(cable_end(q) - caught[0]) for q in flown(rig, "right"))
    assert kept > 0.02
    assert rig.motion.forget_felt()
    assert not rig.motion.forget_felt()


def test_a_goal_from_which_the_tool_cannot_go_on_is_no_goal(rig: Rig) -> None:
    held = in_hand(rig, [0.02, 0.0, 0.10])
    goals = [natural_pose(rig.known, np.array([-0.04, 0.0, 0.17])) * held.inv()]
    near, far = (RigidTransform.from_translation([-x, 0.0, 0.0]) for x in (0.03, 2.0))
    with pytest.raises(PlanningError) as error:
        rig.run(rig.motion.carry("right", goals, held, onward=[near, far], speed=0.5))
    assert error.value.code is CauseCode.OUT_OF_REACH
    rig.run(rig.motion.carry("right", goals, held, onward=[near], speed=0.5))
    assert rig.motion.tool("right").translation == pytest.approx(goals[0].translation, abs=1e-3)


def test_a_carry_leaves_room_for_a_jaw_that_opens(rig: Rig) -> None:
    upright = ASIDE + np.array([0.0, 0.0, 0.0, 0.0, 0.0, np.pi / 2])  # one finger above the other
    rig.arms["right"].at = upright
    goal = moved(rig, 0.0, 0.18, 0.0)
    bar = [moved(rig, 0.0, y, -0.077).apply([0.02, 0.0, 0.0]) for y in np.linspace(0.03, 0.15, 7)]
    rig.motion.set_obstacles(np.vstack([cube(place, 0.04) for place in bar]), 0.01)
    rig.run(rig.motion.carry("right", [goal], HELD, speed=0.5))
    open_jaw = rig.motion.model("right", held=rig.motion.held_spheres(HELD), opening=0.075)
    assert all(open_jaw.free(q, 0.0) for q in flown(rig, "right"))
    assert rig.motion.tool("right").translation == pytest.approx(goal.translation, abs=1e-3)


def test_a_carry_leaves_out_a_goal_in_the_panel(rig: Rig) -> None:
    rig.arms["right"].at = ASIDE
    tool = rig.motion.tool("right")
    blocked = RigidTransform.from_components([0.505, -0.15, 0.3], tool.rotation)
    free = moved(rig, 0.0, 0.10, 0.0)
    rig.run(rig.motion.carry("right", [blocked, free], HELD, speed=0.5))
    assert rig.motion.tool("right").translation == pytest.approx(free.translation, abs=1e-3)


def test_where_no_direct_way_is_free_a_carry_takes_the_shortest_of_the_searched_ones(
    rig: Rig, monkeypatch: pytest.MonkeyPatch
) -> None:
    carry = CarryPathParameters(lifts=(), lifted=())  # no path but the searched ones
    rig.motion.parameters = replace(rig.motion.parameters, carry=carry)
    rig.arms["right"].at = ASIDE
    goal = moved(rig, 0.0, 0.10, 0.0)
    bends = iter([0.8, 0.5, 0.2, 0.6])

    def search(_model: object, start: Points, goals: Points, *_: object) -> Points:
        bend = next(bends, None)
        if bend is None:
            raise PlanningError(CauseCode.PLANNING_FAILED, "no path")
        return np.array([start, start + bend, goals[0]])

    monkeypatch.setattr(rig.motion, "planner", search)
    rig.run(rig.motion.carry("right", [goal], HELD, speed=0.5))
    missed = [min(float(np.abs(q - ASIDE - bend).max()) for q in flown(rig, "right")) for bend in (0.2, 0.5)]
    assert missed[0] < 0.05 < missed[1]
    assert rig.motion.tool("right").translation == pytest.approx(goal.translation, abs=1e-3)


def test_the_carried_connector_counts_as_body(rig: Rig) -> None:
    q = READY
    tip = (rig.motion.kinematics["right"].tool(q) * HELD).apply([0.035, 0.0, 0.0])
    rig.motion.set_obstacles(tip[None], 0.01)
    assert (
        rig.motion.model("right", held=rig.motion.held_spheres(HELD)).nearest(q)[0]
        < rig.motion.model("right").nearest(q)[0]
    )
    assert not rig.motion.model("right", held=rig.motion.held_spheres(HELD)).free(q, TIGHT_MARGIN)


def test_a_grip_says_how_the_connector_lies_in_the_hand(rig: Rig) -> None:
    rig.arms["right"].at = READY
    rig.grippers["right"].gap, rig.grippers["right"].inside = 0.05, 0.0201
    connector = moved(rig, 0.0, 0.0, 0.01)
    task = rig.motion.grip(connector)
    rig.run(task)
    assert task.answer.gap == 0.0201
    assert (rig.motion.tool("right") * task.answer.pose).translation == pytest.approx(connector.translation)
    assert not rig.motion.watch_grip().evidence().detected


def test_a_jaw_that_closes_on_nothing_says_so(rig: Rig) -> None:
    rig.grippers["right"].gap = 0.05
    with pytest.raises(GraspEmptyError, match=r"closed on nothing: pads 0.0 mm apart") as error:
        rig.run(rig.motion.grip(rig.motion.tool("right")))
    assert error.value.code is CauseCode.GRASP_EMPTY


def test_a_jaw_that_closes_on_something_else_too_does_not_hold_the_connector(rig: Rig) -> None:
    """At the clip a jaw closes firmly at once; here it has taken hold of the clip's rod besides."""
    rig.arms["right"].at = READY
    rig.grippers["right"].gap, rig.grippers["right"].inside = 0.05, 0.0349
    clip = rig.known.cable.clip.world_from_seat
    with pytest.raises(JawBlockedError, match=r"holds something else, too: it stands 34\.9 mm open"):
        rig.run(rig.motion.grip(clip))


@pytest.mark.parametrize(("off", "gently"), [(0.0, False), (0.02, False), (0.05, True)])
def test_what_lies_beside_the_clip_is_gripped_gently_at_first(rig: Rig, off: float, gently: bool) -> None:
    rig.arms["right"].at = READY
    jaw = rig.grippers["right"]
    jaw.gap, jaw.inside = 0.05, 0.0201
    seat = rig.known.cable.clip.world_from_seat
    rig.run(rig.motion.grip(RigidTransform.from_components(seat.translation - [0.0, 0.0, off], seat.rotation)))
    forces = [force for _, _, force in jaw.told]
    assert (forces[0] < 10.0) is gently
    assert forces[-1] > 10.0


def test_a_jaw_that_meets_something_beside_the_connector_does_not_squeeze_it_at_first(rig: Rig) -> None:
    rig.arms["right"].at = READY
    jaw = rig.grippers["right"]
    jaw.gap, jaw.inside, jaw.soft, jaw.yields = 0.05, 0.0201, 0.031, 20.0
    connector = rig.motion.tool("right")
    pad = connector.apply([0.0, 0.0145, 0.0])
    before = rig.motion.model("right").clearance(ASIDE)
    with pytest.raises(JawBlockedError, match=r"met something beside: it stands 31\.0 mm open"):
        rig.run(rig.motion.grip(connector))
    assert max(force for _, _, force in jaw.told) < 10.0
    mapped = rig.motion.all_mapped()
    assert mapped is not None
    assert mapped.at(pad[None])[0] < 0.01
    assert rig.motion.model("right").clearance(ASIDE) == pytest.approx(before)
    jaw.gap = 0.05
    task = rig.motion.grip(connector)  # the same grasp once more, since no other was taken
    rig.run(task)
    assert task.answer.gap == 0.0201


def test_a_grasp_whose_way_in_touched_something_is_tried_after_the_others(
    rig: Rig, monkeypatch: pytest.MonkeyPatch
) -> None:
    motion, connector = rig.motion, natural_pose(rig.known, np.array([0.02, 0.0, 0.10]))
    monkeypatch.setattr(motion, "feel", lambda arm, touch: touch.joints[:3])  # nothing is mapped
    bumped = []

    def on_its_way_in(q: Points) -> bool:
        tool = motion.kinematics["right"].tool(q)
        if np.linalg.norm(tool.translation - connector.translation) < 0.06:
            bumped.append(tool)
        return bool(bumped)

    rig.arms["right"].bumps.append(on_its_way_in)
    rig.run(motion.pick_loose(connector))
    taken = motion.tool("right")
    assert not rig.arms["right"].bumps
    apart = np.linalg.norm(taken.translation - connector.translation)
    assert apart < 0.03
    assert (taken.rotation.inv() * bumped[0].rotation).magnitude() > 0.2


def test_what_lies_before_something_is_taken_nearer_to_the_finger_tips(rig: Rig) -> None:
    """One direction of grasp is left, and behind the connector stands a wall."""
    one_way = replace(rig.motion.parameters.pick.grasp, rolls=(0.0,), yaws=(np.deg2rad(15.0),))
    rig.motion.parameters = replace(
        rig.motion.parameters, pick=replace(rig.motion.parameters.pick, grasp=one_way, grip_offsets=(-0.02,))
    )
    connector = natural_pose(rig.known, np.array([0.02, 0.0, 0.10]))
    forward = min(rig.motion._candidates("right", connector), key=lambda grasp: grasp.cost).pose[:3, 0]
    depths = []
    for behind in (0.03, 0.018):
        rig.motion.set_obstacles(cube(connector.translation + (behind + 0.03) * forward, 0.06, 0.005), 0.005)
        rig.run(rig.motion.pick_loose(connector))
        taken = rig.motion.tool("right")
        depths.append(float(taken.inv().apply(connector.translation)[0]))
        rig.run(rig.motion.draw_back())
        rig.arms["right"].at = np.array(rig.known.arm("right").sleep)
    assert depths[1] - depths[0] == pytest.approx(rig.motion.parameters.shallow, abs=1e-4)


def drawn_out(rig: Rig, plug: RigidTransform) -> tuple[float, float, Points]:
    """How far (m) the right hand draws a plug out along its axis, then itself back, and its displacement (3,) m."""
    start = rig.motion.tool("right")
    rig.run(rig.motion.pull_out(plug))
    axis, back = plug.rotation.apply([1.0, 0.0, 0.0]), -start.rotation.apply([1.0, 0.0, 0.0])
    way = rig.motion.tool("right").translation - start.translation
    (out, retreat), *_ = np.linalg.lstsq(np.stack([-axis, back], axis=1), way)
    return float(out), float(retreat), np.asarray(way - back * retreat + axis * out)


def test_a_plug_is_not_drawn_out_into_foam_that_another_grasp_avoids(rig: Rig) -> None:
    plug = rig.known.cable.socket("back_1").world_from_plug(rig.known.cable.connector.length)
    rig.run(rig.motion.pick_plug(plug))
    usual, q = rig.motion.tool("right"), rig.motion.joints("right")
    out = -plug.rotation.apply([1.0, 0.0, 0.0])
    spheres = rig.motion.model("right").spheres(q)
    spheres = spheres[np.linalg.norm(spheres[:, :3] - usual.translation, axis=1) < 0.12]
    first = spheres[np.argmax(spheres[:, :3] @ out + spheres[:, 3])]  # to meet what lies in the way
    foam = cube(first[:3] + (first[3] + 0.045) * out, 0.02, 0.005)
    rig.arms["right"].at = np.array(rig.known.arm("right").sleep)
    drawn_out = RigidTransform.from_translation(0.05 * out)
    rig.motion.set_obstacles(foam, 0.005)
    rig.run(rig.motion.pick_plug(plug))
    chosen = rig.motion.tool("right")
    assert (chosen.rotation.inv() * usual.rotation).magnitude() > 0.05
    ends = rig.motion.kinematics["right"].ik(drawn_out * chosen)
    without = rig.known.solids()
    model = rig.motion.model("right", without=without, opening=0.02, optimistic=True)
    assert any(model.free(end, 0.0) for end in ends)


@pytest.mark.parametrize(("socket", "out"), [("back_1", 0.05), ("back_4", 0.02)])
def test_a_plug_is_drawn_out_as_far_as_is_free_and_the_hand_goes_back_as_it_came(
    rig: Rig, socket: str, out: float
) -> None:
    """Behind the hand at back_4 another socket's block stands."""
    plug = rig.known.cable.socket(socket).world_from_plug(rig.known.cable.connector.length)
    rig.run(rig.motion.pick_plug(plug))
    drawn, retreat, rest = drawn_out(rig, plug)
    assert drawn == pytest.approx(out, abs=1e-3)
    assert retreat == pytest.approx(0.06, abs=1e-3)
    assert rest == pytest.approx(np.zeros(3), abs=1e-3)


def test_the_hand_draws_back_as_far_as_is_free(rig: Rig) -> None:
    rig.arms["right"].at = READY
    start = rig.motion.tool("right")
    task = rig.motion.draw_back()
    rig.run(task)
    assert task.answer == ""
    back = start.inv().apply(rig.motion.tool("right").translation)
    assert back == pytest.approx([-0.10, 0.0, 0.0], abs=1e-3)


def test_a_hand_that_touches_something_as_it_draws_back_leaves_it_at_that(rig: Rig) -> None:
    rig.arms["right"].at = READY
    start = rig.motion.tool("right")
    rig.arms["right"].bumps.append(lambda q: bool(np.abs(q - READY).max() > 0.02))
    task = rig.motion.draw_back()
    rig.run(task)
    assert "touched something" in task.answer
    assert len(rig.arms["right"].followed) == 2  # and back again
    assert rig.motion.tool("right").translation == pytest.approx(start.translation, abs=2e-3)
    assert rig.motion.all_mapped() is not None


def test_a_hand_that_came_in_where_the_map_now_shows_something_goes_back_as_it_came(rig: Rig) -> None:
    plug = rig.known.cable.socket("back_1").world_from_plug(rig.known.cable.connector.length)
    rig.run(rig.motion.pick_plug(plug))
    grasp, hand = rig.motion.tool("right"), rig.arms["right"]
    before = rig.motion.kinematics["right"].tool(hand.followed[-1][1].sample(0.0)[0])
    rig.motion.parameters = replace(rig.motion.parameters, retreats=(0.10,))
    behind = RigidTransform.from_components(grasp.apply([-0.06, 0.0, 0.0]), grasp.rotation)
    back = straight_line(rig.motion.kinematics["right"], hand.at, behind)[-1]
    rig.motion.set_obstacles(rig.motion.model("right", others=False).spheres(back)[:, :3], 0.01)
    task = rig.motion.draw_back()
    rig.run(task)
    assert task.answer == ""
    assert rig.motion.tool("right").translation == pytest.approx(before.translation, abs=2e-3)


def test_where_no_way_back_is_free_the_answer_says_why(rig: Rig) -> None:
    task = rig.motion.draw_back()  # asleep, folded over its own base
    rig.run(task)
    assert "m" in task.answer
    assert not rig.arms["right"].followed


def test_a_search_begins_where_the_end_was_seen_or_at_the_panel(rig: Rig) -> None:
    seen = np.array([0.4, 0.1, 0.25])
    start, viewpoints = rig.motion.search_views(seen)
    assert start == pytest.approx(seen)
    first = next(viewpoints)
    assert rig.motion.view(first.world_from_camera).joints.shape[1] == 6
    start, _ = rig.motion.search_views(None)
    assert start == pytest.approx(next(box.center for box in rig.known.boxes if box.name == "back_panel"))


def test_the_clip_may_be_touched_by_a_straight_way_and_not_by_a_plan(rig: Rig) -> None:
    bracket = rig.known.cable.clip.bracket
    kin = rig.motion.kinematics["right"]
    inside = kin.ik(RigidTransform.from_translation(bracket[0].center))
    near = rig.motion.model("right", without=bracket)
    assert any(near.clearance(q) > rig.motion.model("right").clearance(q) for q in inside)


def test_a_look_at_what_a_hand_holds_passes_the_hand(rig: Rig) -> None:
    held = in_hand(rig, [0.02, 0.0, 0.10])
    rig.run(rig.motion.carry_to_clip(held))
    connector, hand = rig.motion.tool("right") * held, rig.motion.model("right", others=False)
    view = rig.motion.best_view(connector, past="right")
    half, eye = 0.5 * rig.known.cable.connector.length, view.world_from_camera.translation
    ends = connector.apply([[-half, 0.0, 0.0], [half, 0.0, 0.0]])
    rays = np.vstack([np.linspace(eye, eye + 0.85 * (end - eye), 50) for end in ends])
    assert sphere_distances(rays, hand.spheres(rig.motion.joints("right")))[0].min() > 0.0
    between = RigidTransform.from_translation(rig.motion.tool("right").apply([-0.3, 0.0, 0.0]))
    assert not rig.motion.sees(between, ends, past="right")
    assert rig.motion.sees(between, ends)


def test_unless_forced_a_carry_does_not_bend_the_cable(rig: Rig) -> None:
    held = in_hand(rig, [0.02, 0.0, 0.10])
    across = Rotation.from_euler("z", 70, degrees=True)
    connector = natural_pose(rig.known, np.array([-0.04, 0.0, 0.17]))
    goal = RigidTransform.from_components(connector.translation, across * connector.rotation) * held.inv()
    start = rig.motion.joints("right")
    with pytest.raises(PlanningError, match="without bending its cable by force") as failure:
        rig.run(rig.motion.carry("right", [goal], held, speed=0.5, forced=False))
    assert failure.value.code is CauseCode.OUT_OF_REACH
    assert rig.motion.joints("right") == pytest.approx(start)
    rig.run(rig.motion.carry("right", [goal], held, speed=0.5))
    assert rig.motion.tool("right").translation == pytest.approx(goal.translation, abs=1e-3)


def test_a_connector_that_could_not_be_carried_is_taken_otherwise(rig: Rig) -> None:
    motion, connector = rig.motion, natural_pose(rig.known, np.array([0.02, 0.0, 0.10]))
    rig.run(motion.pick_loose(connector))
    first = motion.tool("right").inv() * connector
    motion.set_obstacles(cube(np.array(rig.known.cable.clip.seat), 0.2), 0.01)
    with pytest.raises(PlanningError):
        rig.run(motion.carry_to_clip(first))
    motion.set_obstacles(np.empty((0, 3)), 0.01)
    rig.run(motion.sleep("right"))
    rig.run(motion.pick_loose(connector))
    second = motion.tool("right").inv() * connector
    apart = np.linalg.norm(first.inv().translation - second.inv().translation)
    assert apart > 0.03 or (first.rotation.inv() * second.rotation).magnitude() > 0.7
