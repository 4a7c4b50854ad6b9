"""What the world asks of a task's objects, and when."""

from collections.abc import Mapping
from typing import Literal

import numpy as np
import pybullet as p
import pytest
from one_arm import ABOVE, ARM, ON_ARM, one_arm_cell
from scipy.spatial.transform import RigidTransform

from regrasp.interfaces.cell import Box, Cell
from regrasp.interfaces.fault import Fault, JawOpens, PlanningFindsNothing, When
from regrasp.interfaces.scene import Obstacle, Prop, SceneSetup
from regrasp.interfaces.trajectory import Trajectory
from regrasp.sim.bodies import build_box
from regrasp.sim.engine import Engine
from regrasp.sim.faults.effects import Effect, FaultTarget, TaskEffects
from regrasp.sim.faults.faults import TriggerState
from regrasp.sim.ground_truth import GroundTruth
from regrasp.sim.objects import NoObjects, TaskObjects
from regrasp.sim.robot.arm import SimArm
from regrasp.sim.world import World

NEVER = PlanningFindsNothing(type="planning_finds_nothing", when=When(at=(1000.0, 1000.0)))
OBSTACLE = Obstacle(Box(name="block", center=(0.2, 0.6, 0.1), size=(0.1, 0.1, 0.2)), 0.0, None)
RADIUS, MASS = 0.03, 0.1  # m, kg


@pytest.fixture(scope="module")
def solo(cell: Cell) -> Cell:
    return one_arm_cell(cell)


class Diary(TaskObjects):
    """Notes what is called, and how many bodies there are at that time."""

    def __init__(self) -> None:
        self.called: list[str] = []
        self.bodies: dict[str, int] = {}

    def _note(self, hook: str) -> None:
        self.called.append(hook)
        self.bodies.setdefault(hook, p.getNumBodies(physicsClientId=self._client))

    def build_fixed(self, engine: Engine) -> Mapping[str, int]:
        self._client = engine.client
        self._note("build_fixed")
        return {"shelf": build_box(engine.client, Box(name="shelf", center=(0.0, 1.0, 0.5), size=(0.1, 0.1, 0.1)))}

    def build_moving(self, engine: Engine, arms: Mapping[str, SimArm]) -> None:
        self._note("build_moving")
        self.arms = list(arms)

    def lay_out(self, engine: Engine, fixed: Mapping[str, int]) -> None:
        self._note("lay_out")
        self.fixed = dict(fixed)
        engine.step()  # on the way to the beginning

    def forbidden(self) -> Mapping[int, str]:
        self._note("forbidden")
        return {}

    def effects(self) -> TaskEffects:
        self._note("effects")
        return {}

    def before_step(self) -> None:
        self._note("before_step")

    def after_step(self) -> None:
        self._note("after_step")

    def update_triggers(self, now: float, triggers: TriggerState) -> None:
        assert now == triggers.now
        self._note("update_triggers")


def test_hooks_are_called_in_their_order(solo: Cell) -> None:
    diary = Diary()
    setup = SceneSetup((OBSTACLE,), (NEVER,), (Prop("ball", (0.03,), (0.0, 1.0, 0.0)),))
    world = World(solo, "zero", 1, diary, setup)
    assert diary.called == ["build_fixed", "build_moving", "lay_out", "forbidden", "effects", "update_triggers"]
    assert world.now() == 0.0
    boxes = len(solo.known.boxes)
    # after the shelf come an obstacle, a prop and the arm
    assert (diary.bodies["build_fixed"], diary.bodies["build_moving"]) == (boxes, boxes + 4)
    assert list(diary.fixed) == [*(box.name for box in solo.known.boxes), "shelf", "obstacle block"]
    assert diary.fixed == world.fixed_bodies
    assert diary.arms == [ARM]
    diary.called.clear()
    world.advance(5 * world.step_seconds)
    assert diary.called == ["before_step", "after_step"] * 4 + ["update_triggers", "before_step", "after_step"]
    world.close()


def test_without_a_waiting_fault_no_triggers_are_worked_out(solo: Cell) -> None:
    diary = Diary()
    world = World(solo, "zero", 1, diary)
    world.advance(0.1)
    assert "update_triggers" not in diary.called
    world.close()


class BallWhen(When):
    """A ball's fault may wait until it has landed."""

    phase: Literal["landed"] | None = None


class BallPushed(Fault):
    """A push on the ball, upwards: a constant force for 50 ms."""

    type: Literal["ball_pushed"] = "ball_pushed"
    impulse: float  # N s


class Ball(TaskObjects):
    """A ball that falls to the floor; the phase "landed" begins when it is there."""

    def __init__(self) -> None:
        self.began: dict[str, float] = {}

    def build_moving(self, engine: Engine, arms: Mapping[str, SimArm]) -> None:
        self._client = engine.client
        shape = p.createCollisionShape(p.GEOM_SPHERE, radius=RADIUS, physicsClientId=engine.client)
        self.body = p.createMultiBody(MASS, shape, -1, [0.3, 0.3, 0.2], physicsClientId=engine.client)

    def lay_out(self, engine: Engine, fixed: Mapping[str, int]) -> None:
        self._floor = fixed["floor"]

    def effects(self) -> TaskEffects:
        def pushed(fault: BallPushed, world: FaultTarget, _: np.random.Generator) -> Effect:
            def push(_: float) -> None:
                force = [0.0, 0.0, fault.impulse / 0.05]
                p.applyExternalForce(self.body, -1, force, self.place(), p.WORLD_FRAME, physicsClientId=world.client)

            return Effect(step=push, seconds=0.05)

        return {BallPushed: pushed}

    def update_triggers(self, now: float, triggers: TriggerState) -> None:
        if p.getContactPoints(self.body, self._floor, physicsClientId=self._client):
            self.began.setdefault("landed", now)
        triggers.phases = self.began

    def place(self) -> tuple[float, float, float]:
        place: tuple[float, float, float] = p.getBasePositionAndOrientation(self.body, physicsClientId=self._client)[0]
        return place


def test_a_task_s_fault_waits_for_its_phase_and_acts_on_its_objects(solo: Cell) -> None:
    push = BallPushed(when=BallWhen(phase="landed"), impulse=0.3)
    world = World(solo, "earth", 1, Ball(), SceneSetup(faults=(push,)))
    highest, [fault] = 0.0, world.faults
    for _ in range(40):
        world.advance(0.025)
        if fault.began_at is not None:
            highest = max(highest, world.objects.place()[2])
    assert fault.began_at is not None
    assert fault.ended_at == pytest.approx(fault.began_at + 0.05, abs=0.01)
    floor = next(box for box in solo.known.boxes if box.name == "floor")
    fall = 0.2 - RADIUS - floor.center[2] - floor.size[2] / 2
    assert fault.began_at == pytest.approx(np.sqrt(2 * fall / 9.81), abs=0.05)
    assert 0.2 < highest < 0.5  # 3 N s/kg against gravity for 0.05 s: 2.5 m/s, 0.3 m high
    world.close()


def test_a_fault_that_no_task_explains_changes_nothing(solo: Cell) -> None:
    push = BallPushed(when=When(at=(0.0, 0.0)), impulse=0.3)
    world = World(solo, "zero", 1, NoObjects(), SceneSetup(faults=(push,)))
    plain = World(solo, "zero", 1, NoObjects())
    for one in (world, plain):
        one.advance(0.2)
    assert world.faults[0].began_at == 0.0
    assert np.array_equal(world.arms[ARM].tool_pose().as_matrix(), plain.arms[ARM].tool_pose().as_matrix())
    world.close()
    plain.close()


class Vice(TaskObjects):
    """A block between an arm's fingers."""

    def __init__(self, untouchable: bool) -> None:
        self._untouchable = untouchable

    def build_moving(self, engine: Engine, arms: Mapping[str, SimArm]) -> None:
        x, y, z = arms[ARM].tool_pose().translation.tolist()
        self.body = build_box(engine.client, Box(name="vice", center=(x, y, z), size=(0.02, 0.02, 0.02)))

    def forbidden(self) -> Mapping[int, str]:
        return {self.body: "vice"} if self._untouchable else {}


@pytest.mark.parametrize("untouchable", [True, False])
def test_an_arm_on_what_the_task_forbids_is_counted(solo: Cell, untouchable: bool) -> None:
    world = World(solo, "zero", 1, Vice(untouchable))
    world.advance(0.1)
    assert ("solo arm - vice" in world.contact_peaks) == untouchable
    world.close()


def test_without_objects_and_with_one_arm_of_another_name_all_else_works(solo: Cell) -> None:
    opens = JawOpens(type="jaw_opens", when=When(at=(0.2, 0.2)), arm=ARM, seconds=None)
    setup = SceneSetup((OBSTACLE,), (opens,), (Prop("box", (0.05, 0.05, 0.05), (0.0, 1.0, 0.0)),))
    world = World(solo, "earth", 7, NoObjects(solo), setup)
    arm = world.arms[ARM]
    start = arm.reading().positions
    goal = start + np.array([0.4, 0.3, -0.3, 0.0, 0.2, 0.0])
    arm.follow(Trajectory(np.array([0.0, 1.0]), np.array([start, goal]), np.zeros((2, 6))))
    before = world.cameras[ON_ARM].true_pose()
    world.place_obstacle("block", np.array([0.3, 0.0, 0.1]))
    world.place_prop(0, RigidTransform.from_translation([0.4, 0.1, 0.3]))
    world.advance(1.5)
    np.testing.assert_allclose(arm.reading().positions, goal, atol=0.01)
    assert arm.gripper.true_gap() > 0.03
    assert float(np.linalg.norm((before.inv() * world.cameras[ON_ARM].true_pose()).translation)) > 0.05
    for camera in (ABOVE, ON_ARM):
        frame = world.cameras[camera].latest()
        assert frame is not None
        assert frame.depth.any()
    assert GroundTruth(world).pixels(ABOVE, world.fixed_bodies["obstacle block"]) > 20
    world.close()


def test_a_cell_without_arms_and_cameras_is_a_world(solo: Cell) -> None:
    nothing = solo.known.model_copy(update={"arms": (), "cameras": ()})
    world = World(solo.model_copy(update={"known": nothing}), "earth", 1, Ball())
    world.advance(0.1)
    assert not world.arms
    assert not world.cameras
    assert not world.contact_peaks
    assert world.objects.place()[2] == pytest.approx(0.2 - 9.81 * 0.1**2 / 2, abs=5e-3)
    world.close()
