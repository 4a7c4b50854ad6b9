from collections.abc import Callable, Iterator

import numpy as np
import pytest
from arm_surface import surface
from fake_devices import TICK, Clock, FakeArm, FakeGripper, Rig
from numpy.typing import NDArray
from scipy.spatial.transform import RigidTransform

from regrasp.interfaces.cable.cell import CableKnown
from regrasp.interfaces.cause import CauseCode
from regrasp.interfaces.cell import KnownCell, pose_along
from regrasp.interfaces.frame import Intrinsics, RgbdFrame
from regrasp.motion.execution import ExecutionParameters, JawParameters
from regrasp.motion.failure import PlanningError, TouchError
from regrasp.motion.request import MotionRequest
from regrasp.motion.robots.contact_guard import ContactLimits, Touch
from regrasp.motion.service import Motion, MotionParameters

Points = NDArray[np.float64]
PARAMETERS = MotionParameters()
OPEN_GAP = PARAMETERS.execution.jaw.open_gap
TIGHT_MARGIN = PARAMETERS.clearances.tight_margin
READY = np.array([0.4, -0.6, 0.6, 0.0, 0.3, 0.0])
ASIDE = np.array([-0.5, -0.6, 0.6, 0.0, 0.3, 0.0])


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


def test_a_plan_costs_its_latency_and_ends_where_planned(rig: Rig) -> None:
    task = rig.motion.move("right", READY[None])
    assert not task.poll()
    assert not rig.arms["right"].followed  # planned, not yet begun
    rig.clock.t = rig.known.latencies.plan
    assert not task.poll()
    [(begun, trajectory)] = rig.arms["right"].followed
    assert begun == pytest.approx(rig.known.latencies.plan)
    rig.run(task)
    assert rig.motion.joints("right") == pytest.approx(READY)
    assert rig.clock.t >= begun + trajectory.duration
    assert task.poll()  # done stays done
    assert not rig.arms["left"].followed


def test_the_nearest_to_hand_of_several_goals_is_reached(rig: Rig) -> None:
    rig.run(rig.motion.move("left", np.stack([ASIDE, READY])))
    assert min(np.abs(rig.motion.joints("left") - goal).max() for goal in (ASIDE, READY)) < 1e-6


@pytest.mark.parametrize("work", [lambda m: m.move("right", READY[None]), lambda m: m.shift("right", [0.0, 0.0, 0.05])])
def test_an_arm_that_does_not_follow_is_led_on_slower_and_then_given_up(
    rig: Rig, work: Callable[[Motion], MotionRequest]
) -> None:
    rig.arms["right"].at = ASIDE
    rig.arms["right"].stuck = 0.0
    with pytest.raises(PlanningError, match=r"off its trajectory \(at most 0.080\), 3 times") as error:
        rig.run(work(rig.motion))
    assert error.value.code is CauseCode.ARM_FAILED
    assert rig.arms["right"].stops == 3
    assert len(rig.remarks) == 4
    assert "out of order" in rig.remarks[-1]
    lengths = [trajectory.duration for _, trajectory in rig.arms["right"].followed]
    assert lengths[1] == pytest.approx(2 * lengths[0], rel=0.1)
    with pytest.raises(PlanningError) as again:
        rig.motion.move("right", READY[None]).poll()
    assert again.value is error.value
    rig.run(rig.motion.move("left", READY[None]))  # the other arm is sound


def test_an_arm_that_pulls_something_elastic_and_falls_behind_is_blocked_but_in_order(rig: Rig) -> None:
    rig.arms["right"].at = READY
    rig.arms["right"].stuck = 0.0
    with pytest.raises(PlanningError, match=r"off its trajectory \(at most 0.080\), 3 times") as error:
        rig.run(rig.motion.sleep("right", pulling=True))
    assert error.value.code is CauseCode.MOTION_BLOCKED
    assert rig.motion.execution.held_back("right")
    rig.arms["right"].stuck = 1.0
    rig.run(rig.motion.move("right", ASIDE[None]))
    assert rig.motion.joints("right") == pytest.approx(ASIDE)
    assert not rig.motion.execution.held_back("right")


def test_an_arm_that_touches_each_time_it_goes_to_sleep_pulls_harder(rig: Rig) -> None:
    arm = rig.arms["right"]
    arm.at = READY

    before = [0.0]  # how far (rad) it was from where it began at the last reading

    def held(q: Points) -> bool:
        """Whether it goes further away from where it began, and pulls no harder yet."""
        last, before[0] = before[0], float(np.abs(q - READY).max())
        return before[0] > max(last, 0.05) and not any("pulls harder" in remark for remark in rig.remarks)

    arm.bumps += [held] * 100
    rig.run(rig.motion.sleep("right", pulling=True))
    assert any("pulls harder" in remark for remark in rig.remarks)
    assert rig.motion.joints("right") == pytest.approx(rig.known.arm("right").sleep)


def test_an_arm_that_fell_behind_once_is_slower_later_unless_it_pulled_something_elastic(known: CableKnown) -> None:
    later = {}
    for pulling in (True, False):
        rig = Rig(known)
        arm = rig.arms["right"]
        arm.at, arm.stuck = READY, 0.0
        task = rig.motion.sleep("right", pulling=pulling)
        while not arm.stops:
            task.poll()
            rig.clock.t += 0.05
        arm.stuck = 1.0
        rig.run(task)
        rig.run(rig.motion.move("right", READY[None]))
        later[pulling] = arm.followed[-1][1].duration
    assert later[False] == pytest.approx(2.0 * later[True], rel=0.1)


def test_an_arm_goes_slowly_beside_what_was_seen_and_fast_elsewhere(rig: Rig) -> None:
    model = rig.motion.model("right", others=False)
    hand = model.spheres(READY)[-1, :3]
    path, separation = np.vstack([ASIDE, READY]), rig.motion.parameters.separation

    def fastest(points: Points) -> tuple[float, float]:
        """The fastest that a sphere is (m/s) whose clearance allows no more than `slow`, and any at all."""
        rig.motion.set_obstacles(points, 0.01)
        rig.motion.stop()
        rig.arms["right"].at = ASIDE
        rig.run(rig.motion.execution.request("right", rig.motion._follow("right", path, 1.0, model)))
        trajectory, near, anywhere = rig.arms["right"].followed[-1][1], 0.0, 0.0
        for t in np.arange(0.0, trajectory.duration - 0.01, 0.01):
            before, after = (model.spheres(trajectory.sample(t + dt)[0]) for dt in (0.0, 0.001))
            speeds = np.linalg.norm(after[:, :3] - before[:, :3], axis=1) / 0.001
            gaps = np.linalg.norm(before[:, None, :3] - points, axis=2).min(axis=1) - before[:, 3]
            near = max(near, *speeds[gaps < separation.touching], 0.0)
            anywhere = max(anywhere, *speeds)
        return near, anywhere

    wall = cube(np.add(hand, [0.0, 0.06, 0.0]))  # beside the goal; the hand comes on from the other side
    near, anywhere = fastest(wall)
    assert 0.5 * separation.slow < near <= 1.05 * separation.slow
    assert anywhere > 2 * separation.slow
    far = fastest(np.add(wall, [0.0, 0.0, 1.0]))[1]
    assert far == pytest.approx(anywhere, rel=0.2)


def test_an_arm_that_pulls_something_elastic_takes_its_time(rig: Rig) -> None:
    goals = np.array([rig.motion.known.arm("right").sleep])
    guard, durations = rig.motion.parameters.execution.guard, []
    for limits in (guard.free, guard.pulling):
        rig.motion.stop()
        rig.arms["right"].at = READY
        rig.run(rig.motion.execution.request("right", rig.motion._move_steps("right", goals, contact=limits)))
        durations.append(rig.arms["right"].followed[-1][1].duration)
    assert durations[1] == pytest.approx(durations[0] / rig.motion.parameters.pulling_speed, rel=0.05)


def test_an_arm_that_comes_free_ends_where_planned(rig: Rig) -> None:
    rig.arms["right"].stuck = 0.3
    task = rig.motion.move("right", READY[None])
    while not rig.arms["right"].stops:
        assert not task.poll()
        rig.clock.t += TICK
    rig.arms["right"].at = rig.motion.joints("right")
    rig.arms["right"].stuck = 1.0
    rig.run(task)
    assert rig.motion.joints("right") == pytest.approx(READY)


def test_an_arm_that_stays_a_little_short_was_blocked(rig: Rig) -> None:
    rig.arms["right"].at = ASIDE
    goal = ASIDE + 0.07 * np.eye(6)[0]
    rig.arms["right"].stuck = 0.0
    with pytest.raises(PlanningError, match=r"right arm stopped 0.07 rad short") as error:
        rig.run(rig.motion.move("right", goal[None]))
    assert error.value.code is CauseCode.MOTION_BLOCKED


def test_an_encoder_that_jumps_while_the_arm_rests_is_noticed_before_it_moves(rig: Rig) -> None:
    rig.run(rig.motion.move("right", ASIDE[None]))
    rig.arms["right"].at = ASIDE + 0.3 * np.eye(6)[0]
    rig.arms["right"]._begun = None
    with pytest.raises(PlanningError, match=r"waist reads 0.300 rad from where it was left") as error:
        rig.run(rig.motion.move("right", READY[None]))
    assert error.value.code is CauseCode.ARM_FAILED
    assert len(rig.arms["right"].followed) == 1


class Deaf(FakeGripper):
    """Stands at its gap whatever it is told."""

    def open(self, gap: float) -> None:
        self.told.append((self.clock.t, "open", gap))


def test_a_jaw_that_does_not_open_is_told_three_times_and_then_given_up(rig: Rig) -> None:
    rig.grippers["right"] = rig.motion.grippers["right"] = Deaf(rig.clock, gap=0.02)  # type: ignore[index]
    with pytest.raises(PlanningError, match=r"right jaw stands 20.0 mm open, told 3 times to open to 50 mm") as error:
        rig.run(rig.motion.release("right", 0.025))
    assert error.value.code is CauseCode.GRIPPER_FAILED
    assert len(rig.grippers["right"].told) == 3


def test_parameters_of_every_part_come_through_the_service(rig: Rig) -> None:
    jaw = JawParameters(attempts=2, open_gap=0.06)
    parameters = MotionParameters(execution=ExecutionParameters(jaw=jaw))
    deaf = {"left": rig.grippers["left"], "right": Deaf(rig.clock, gap=0.02)}
    motion = Motion(rig.known, rig.arms, deaf, rig.clock, 0, parameters)
    with pytest.raises(PlanningError, match="told 2 times to open to 60 mm"):
        rig.run(motion.release("right", 0.025))


def test_cancel_stops_the_arm_where_it_is(rig: Rig) -> None:
    task = rig.motion.move("right", READY[None])
    while rig.clock.t < 0.5:
        task.poll()
        rig.clock.t += TICK
    there = rig.motion.joints("right")
    task.cancel()
    rig.clock.t += 5.0
    assert rig.arms["right"].stops == 1
    assert task.poll()
    assert rig.motion.joints("right") == pytest.approx(there)
    assert np.abs(there - READY).max() > 0.1
    assert np.abs(there - rig.known.arm("right").sleep).max() > 0.1


def test_stop_stops_both_arms(rig: Rig) -> None:
    rig.motion.stop()
    assert [arm.stops for arm in rig.arms.values()] == [1, 1]


def test_a_goal_in_the_panel_is_no_goal(rig: Rig) -> None:
    kin = rig.motion.kinematics["right"]
    inside = RigidTransform.from_translation([0.50, -0.1, 0.3])
    goals = kin.ik(inside)
    assert len(goals)
    with pytest.raises(PlanningError) as error:
        rig.motion.move("right", goals).poll()
    assert error.value.code is CauseCode.NO_COLLISION_FREE_GOAL


def test_a_straight_way_is_straight_and_does_not_turn(rig: Rig) -> None:
    rig.arms["right"].at = READY
    start, way = rig.motion.tool("right"), np.array([-0.05, 0.03, 0.04])
    rig.run(rig.motion.shift("right", way))
    end = rig.motion.tool("right")
    assert end.translation == pytest.approx(start.translation + way, abs=1e-4)
    assert (start.rotation.inv() * end.rotation).magnitude() < 1e-3
    tools = np.array([rig.motion.kinematics["right"].tool(q).translation for q in flown(rig, "right")])
    off = np.linalg.norm(np.cross(tools - start.translation, way), axis=1) / np.linalg.norm(way)
    assert off.max() < 0.004


def test_seen_obstacles_are_kept_clear_of(rig: Rig) -> None:
    rig.arms["right"].at = ASIDE
    kin = rig.motion.kinematics["right"]
    middle = kin.tool(0.5 * (ASIDE + READY)).translation
    rig.run(rig.motion.move("right", READY[None]))
    clearance = [np.linalg.norm(kin.tool(q).translation - middle) for q in flown(rig, "right")]
    assert min(clearance) < 0.03  # without an obstacle the hand goes through there
    rig.run(rig.motion.move("right", ASIDE[None]))

    points = cube(middle)
    rig.motion.set_obstacles(points, 0.01)
    rig.run(rig.motion.move("right", READY[None]))
    body = rig.motion.model("right", others=False)
    for q in flown(rig, "right"):
        spheres = body.spheres(q)
        gaps = np.linalg.norm(points[:, None] - spheres[None, :, :3], axis=2) - spheres[:, 3]
        assert gaps.min() > TIGHT_MARGIN - 0.01  # the grid's voxels are a centimetre


def test_points_where_an_arm_is_or_sleeps_are_no_obstacles(rig: Rig) -> None:
    rig.arms["left"].at = READY
    on_left = rig.motion.tool("left").translation
    asleep = rig.motion.kinematics["left"].tool(np.array(rig.known.arm("left").sleep)).translation
    far = np.array([0.3, 0.25, 0.15])
    rig.motion.set_obstacles(np.vstack([cube(on_left, 0.04), cube(asleep, 0.04), cube(far, 0.04)]), 0.01)
    assert rig.motion.model("left").free(READY, TIGHT_MARGIN)
    assert rig.motion.model("left").free(np.array(rig.known.arm("left").sleep), 0.0)
    eye = RigidTransform.from_translation([-0.3, 0.0, 0.4])
    assert not rig.motion.sees(eye, 2 * far[None] - eye.translation)  # the other points still count
    rig.motion.set_obstacles(np.empty((0, 3)), 0.01)
    assert rig.motion.sees(eye, far[None])


def test_what_was_seen_before_an_arm_came_stays_an_obstacle_beside_it(rig: Rig) -> None:
    *hand, radius = rig.motion.model("right").spheres(READY)[-1]
    beside = cube(np.add(hand, [0.0, 0.0, radius + 0.02]), 0.02)
    rig.arms["right"].at = READY
    rig.motion.set_obstacles(beside, 0.01)
    alone = rig.motion.model("right", others=False).clearance(READY)
    assert rig.motion.model("right").clearance(READY) == pytest.approx(alone)  # what is seen there is the hand
    rig.arms["right"].at = ASIDE
    rig.motion.set_obstacles(beside, 0.01)
    rig.arms["right"].at = READY
    rig.motion.set_obstacles(beside, 0.01)
    assert rig.motion.model("right").clearance(READY) < min(alone, 0.01)
    rig.motion.set_obstacles(np.empty((0, 3)), 0.01)  # it has moved away
    rig.motion.set_obstacles(beside, 0.01)
    assert rig.motion.model("right").clearance(READY) == pytest.approx(alone)


def test_space_that_no_camera_saw_is_entered_slowly_and_only_where_there_is_no_other_way(rig: Rig) -> None:
    rig.arms["right"].at = ASIDE
    rig.run(rig.motion.move("right", READY[None]))
    quick = rig.arms["right"].followed[-1][1].duration
    rig.run(rig.motion.move("right", ASIDE[None]))
    place = rig.motion.kinematics["right"].tool(READY).translation
    rig.motion.set_obstacles(np.empty((0, 3)), 0.01, unseen=cube(place))
    rig.run(rig.motion.move("right", READY[None]))
    assert rig.motion.joints("right") == pytest.approx(READY)
    assert rig.arms["right"].followed[-1][1].duration > 2 * quick
    rig.run(rig.motion.move("right", ASIDE[None]))

    rig.motion.set_obstacles(cube(place), 0.01)
    with pytest.raises(PlanningError) as caught:
        rig.run(rig.motion.move("right", READY[None]))
    assert caught.value.code is CauseCode.NO_COLLISION_FREE_GOAL


def test_a_motion_can_begin_with_a_hand_beside_a_seen_surface(rig: Rig) -> None:
    rig.motion.set_obstacles(cube(rig.motion.kinematics["right"].tool(READY).translation, 0.04), 0.01)
    rig.arms["right"].at = READY  # it came in by feel, the margin to the voxels is gone
    assert not rig.motion.model("right").free(READY, TIGHT_MARGIN)
    rig.run(rig.motion.move("right", ASIDE[None]))
    assert rig.motion.joints("right") == pytest.approx(ASIDE)


def test_of_a_surface_that_the_hand_touches_only_what_it_overlaps_is_forgotten(rig: Rig) -> None:
    *hand, radius = rig.motion.model("right").spheres(READY)[-1]
    rig.arms["right"].at = ASIDE
    rig.motion.set_obstacles(cube(np.add(hand, [0.0, 0.0, 0.09]), 0.20), 0.01)
    count = len(rig.motion._points)
    rig.arms["right"].at = READY
    rig.motion.start_model("right")
    left = np.linalg.norm(rig.motion._points - hand, axis=1)
    assert 0 < len(left) < count
    assert radius < left.min() < radius + 0.02


def test_nothing_is_seen_through_a_panel(rig: Rig) -> None:
    eye = RigidTransform.from_translation([0.0, 0.0, 0.3])
    assert rig.motion.sees(eye, np.array([[0.45, 0.3, 0.3]]))
    assert not rig.motion.sees(eye, np.array([[0.9, 0.3, 0.3]]))


@pytest.mark.parametrize("shallow", [0.0, 0.008])
def test_a_pick_brings_the_open_jaw_round_the_connector(rig: Rig, shallow: float) -> None:
    plug = rig.known.cable.socket("back_4").world_from_plug(rig.known.cable.connector.length)
    rig.run(rig.motion.pick("right", plug, rig.known.cable.connector, shallow=shallow))
    assert rig.grippers["right"].gap == OPEN_GAP
    opened_at = rig.grippers["right"].told[0][0]
    assert opened_at <= rig.arms["right"].followed[0][0]
    tool, axis = rig.motion.tool("right"), plug.rotation.apply([1.0, 0.0, 0.0])
    pads_middle = tool.translation + tool.rotation.apply([shallow, 0.0, 0.0])
    offset = pads_middle - plug.translation
    assert min(abs(offset @ axis - known) for known in PARAMETERS.pick.grip_offsets) < 1e-3
    assert np.linalg.norm(offset - (offset @ axis) * axis) < 1e-3
    assert abs(tool.rotation.apply([0.0, 1.0, 0.0]) @ axis) < 1e-3  # the fingers close across it


def test_an_arm_seen_to_be_off_takes_hold_where_the_connector_is(rig: Rig) -> None:
    plug = rig.known.cable.socket("back_1").world_from_plug(rig.known.cable.connector.length)
    off = np.array([0.01, 0.02, -0.02, 0.04, 0.02, 0.03])
    kin = rig.motion.kinematics["right"]
    asked: list[float] = []

    def seen(since: float) -> Points | None:
        asked.append(since)
        return surface(kin, rig.motion.joints("right") + off, OPEN_GAP) if rig.clock.t > since + 0.2 else None

    rig.run(rig.motion.pick("right", plug, rig.known.cable.connector, shallow=0.008, point_cloud=seen))
    assert min(asked) == max(asked) > rig.arms["right"].followed[0][0]
    blind = Rig(rig.known)
    blind.run(blind.motion.pick("right", plug, rig.known.cable.connector, shallow=0.008))
    there, wanted = kin.tool(rig.motion.joints("right") + off), kin.tool(blind.motion.joints("right"))
    missed = kin.tool(blind.motion.joints("right") + off)
    assert np.linalg.norm(missed.translation - wanted.translation) > 0.007
    assert np.linalg.norm(there.translation - wanted.translation) < 0.004


@pytest.mark.parametrize("points", [None, np.empty((0, 3))])
def test_a_camera_that_shows_no_arm_changes_nothing(rig: Rig, points: Points | None) -> None:
    plug = rig.known.cable.socket("back_4").world_from_plug(rig.known.cable.connector.length)
    rig.run(rig.motion.pick("right", plug, rig.known.cable.connector, point_cloud=lambda _since: points))
    blind = Rig(rig.known)
    blind.run(blind.motion.pick("right", plug, rig.known.cable.connector))
    assert rig.motion.joints("right") == pytest.approx(blind.motion.joints("right"))


def test_the_way_to_a_pick_keeps_off_the_cable_and_the_cable_is_forgotten(rig: Rig) -> None:
    connector = pose_along((0.30, 0.02, 0.25), (0.0, 1.0, 0.0))
    cable = connector.translation + np.linspace(0.045, 0.40, 40)[:, None] * np.array([0.0, -1.0, 0.0])
    rig.run(rig.motion.pick("right", connector, rig.known.cable.connector, clear_of=cable))
    body = rig.motion.model("right", others=False)
    counted = cable[np.linalg.norm(cable - connector.translation, axis=1) > 0.13]
    for q in flown(rig, "right"):
        spheres = body.spheres(q)
        gaps = np.linalg.norm(counted[:, None] - spheres[None, :, :3], axis=2) - spheres[:, 3]
        assert gaps.min() > -0.01
    assert rig.motion.sees(RigidTransform.from_translation([-0.3, 0.0, 0.4]), counted)


def test_a_connector_out_of_reach_cannot_be_picked(rig: Rig) -> None:
    with pytest.raises(PlanningError, match="grasp candidates") as error:
        rig.motion.pick("right", pose_along((0.2, 1.2, 0.3), (0.0, 1.0, 0.0)), rig.known.cable.connector).poll()
    assert error.value.code is CauseCode.OUT_OF_REACH
    assert not rig.grippers["right"].told


def test_a_wrist_frame_is_placed_by_the_joints_at_its_exposure(rig: Rig) -> None:
    k = Intrinsics(4, 4, 4.0, 4.0, 1.5, 1.5)
    rgb, depth = np.zeros((4, 4, 3), np.uint8), np.zeros((4, 4), np.float32)
    then = rig.motion.camera_pose(RgbdFrame("wrist", 1, 0.0, rgb, depth, k, READY))
    rig.arms["left"].at = ASIDE
    again = rig.motion.camera_pose(RgbdFrame("wrist", 1, 0.0, rgb, depth, k, READY))
    assert np.array_equal(then.as_matrix(), again.as_matrix())
    now = rig.motion.camera_pose(RgbdFrame("wrist", 2, 0.0, rgb, depth, k, ASIDE))
    assert np.linalg.norm(now.translation - then.translation) > 0.1
    rear = rig.motion.camera_pose(RgbdFrame("rear", 1, 0.0, rgb, depth, k))
    assert rear.translation == pytest.approx([-0.3556, 0.0, 0.4064])


@pytest.mark.parametrize("names", [["only"], ["one", "two", "three"]])
def test_there_may_be_one_arm_or_three(known: CableKnown, names: list[str]) -> None:
    specs = tuple(
        known.arms[0].model_copy(update={"name": n, "base": (0.0, 0.5 * i, 0.0)}) for i, n in enumerate(names)
    )
    cell = KnownCell(boxes=known.boxes, arms=specs, cameras=known.cameras[:1], latencies=known.latencies)
    clock, remarks = Clock(), list[str]()
    arms = {name: FakeArm(name, clock, np.array(specs[0].sleep)) for name in names}
    motion = Motion(cell, arms, {name: FakeGripper(clock) for name in names}, clock, 0, on_anomaly=remarks.append)
    task = motion.move(names[0], ASIDE[None])
    while not task.poll():
        clock.t += TICK
    assert motion.joints(names[0]) == pytest.approx(ASIDE)
    motion.set_obstacles(cube(np.array([0.3, 0.0, 0.6])), 0.01)
    assert len(motion.spheres()) == len(names)
    motion.stop()
    assert [arm.stops for arm in arms.values()] == [1] * len(names)
    assert not remarks


def test_a_jaw_closes_on_a_thing_and_says_how_wide_it_holds(rig: Rig) -> None:
    rig.grippers["left"].gap, rig.grippers["left"].inside = 0.05, 0.031
    task = rig.motion.close("left", 0.03)
    rig.run(task)
    assert task.answer == 0.031
    assert rig.clock.t == pytest.approx(1.0, abs=TICK)
    assert rig.grippers["left"].told == [(0.0, "close", 40.0)]


@pytest.mark.parametrize("speed", [0.05, 1.0])
def test_after_a_touch_an_arm_goes_back_as_far_as_it_may_have_pressed_before_that_was_felt(
    rig: Rig, speed: float
) -> None:
    arm, motion, values = rig.arms["right"], rig.motion, rig.motion.parameters.execution.back_off
    start, goal = np.array([0.4, -0.6, 0.6, 0.0, 0.3, 0.0]), np.array([-0.5, -0.6, 0.6, 0.0, 0.3, 0.0])
    arm.at = start
    arm.bumps.append(lambda q: bool(q[0] < -0.3))
    steps = motion.execution.follow("right", np.array([start, goal]), speed)
    with pytest.raises(TouchError) as error:
        rig.run(motion.execution.request("right", steps))
    begun, trajectory = arm.followed[0]
    felt = error.value.touch.stamp - begun
    ways = motion.kinematics["right"].chain.levers * (motion.joints("right") - error.value.touch.joints)
    assert np.linalg.norm(ways) >= values.distance - 1e-6
    earlier = trajectory.sample(felt - values.seconds)[0]
    assert motion.joints("right")[0] >= earlier[0] - 1e-3


def test_an_arm_is_slow_in_the_shadow_of_a_thing(rig: Rig) -> None:
    rig.arms["right"].at = ASIDE
    rig.run(rig.motion.move("right", READY[None]))
    quick = rig.arms["right"].followed[-1][1]
    rig.run(rig.motion.move("right", ASIDE[None]))
    place = rig.motion.kinematics["right"].tool(READY).translation
    rig.motion.set_obstacles(np.empty((0, 3)), 0.01, shadow=cube(place))
    rig.run(rig.motion.move("right", READY[None]))
    slow = rig.arms["right"].followed[-1][1]
    assert slow.duration > 1.2 * quick.duration


def test_an_arm_does_not_go_again_where_it_met_once_more_what_was_felt_and_forgotten(rig: Rig) -> None:
    motion, went = rig.motion, []
    q = np.array([0.4, -0.6, 0.6, 0.0, 0.3, 0.0])

    def steps(optimistic: bool) -> Iterator[None]:
        """The only way there is, which the touch blocks as long as it is on the map."""
        if motion.all_mapped() is not None:
            raise PlanningError(CauseCode.PLANNING_FAILED, "no path")
        went.append(optimistic)
        yield
        raise TouchError("touched", Touch(rig.clock.t, q + 0.01 * len(went), np.full(6, 0.5), np.full(6, -2.0)))

    with pytest.raises(TouchError):
        rig.run(MotionRequest(motion._tries("right", steps), lambda: None))
    assert went == [False, False]  # once more after it was forgotten


@pytest.mark.parametrize("elastic", [True, False])
def test_an_arm_that_is_held_as_it_goes_back_after_a_touch_is_not_broken(rig: Rig, elastic: bool) -> None:
    arm, motion = rig.arms["right"], rig.motion
    arm.at = np.array([0.4, -0.6, 0.6, 0.0, 0.3, 0.0])
    goal = np.array([-0.5, -0.6, 0.6, 0.0, 0.3, 0.0])

    def caught(q: NDArray[np.float64]) -> bool:
        if q[0] < -0.2:
            arm.stuck = 0.0
        return bool(q[0] < -0.2)

    arm.bumps.append(caught)
    steps = motion.execution.follow("right", np.array([arm.at, goal]), 1.0, ContactLimits(0.1, elastic=elastic))
    with pytest.raises(TouchError):
        rig.run(motion.execution.request("right", steps))
    arm.stuck = 1.0
    rig.run(motion.move("right", goal[None]))
    assert motion.joints("right") == pytest.approx(goal, abs=1e-3)
