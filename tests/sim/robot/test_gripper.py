"""The jaw of an arm alone in an empty world: motion, force, and what its encoder says."""

import numpy as np
import pybullet as p
import pytest

from regrasp.interfaces.cable.cell import CableCell
from regrasp.interfaces.devices import Gripper
from regrasp.sim.robot.arm import SimArm

GAP = 0.0005  # m
CLOSED = 0.003  # m
COUPLING = 0.0005  # m between the fingers' ways


def make(cell: CableCell, client: int) -> SimArm:
    without_camera = cell.known.model_copy(update={"cameras": ()})
    return SimArm(client, cell.model_copy(update={"known": without_camera}), "right", np.random.default_rng(5))


@pytest.fixture
def arm(cell: CableCell, client: int) -> SimArm:
    return make(cell, client)


def run(arm: SimArm, seconds: float) -> list[tuple[float, float]]:
    """Reading's stamp and gap after every step."""
    readings = []
    for _ in range(round(seconds * 480)):
        arm.step()
        p.stepSimulation(physicsClientId=arm.client)
        reading = arm.gripper.reading()
        readings.append((reading.stamp, reading.gap))
    return readings


def fingers(arm: SimArm) -> tuple[int, int]:
    """PyBullet's numbers of the left and the right finger's joint."""
    numbers = range(p.getNumJoints(arm.body, physicsClientId=arm.client))
    names = [p.getJointInfo(arm.body, j, physicsClientId=arm.client)[1].decode() for j in numbers]
    return names.index("left_finger"), names.index("right_finger")


def finger_ways(arm: SimArm) -> tuple[float, float]:
    states = p.getJointStates(arm.body, fingers(arm), physicsClientId=arm.client)
    return states[0][0], -states[1][0]


def test_it_is_a_gripper(arm: SimArm) -> None:
    device: Gripper = arm.gripper
    assert device.reading().stamp == 0.0


@pytest.mark.parametrize("gap", [0.01, 0.04, 0.07])
def test_it_opens_to_a_gap_and_both_fingers_move_alike(arm: SimArm, gap: float) -> None:
    arm.gripper.open(gap)
    run(arm, 1.5)
    assert arm.gripper.true_gap() == pytest.approx(gap, abs=GAP)
    left, right = finger_ways(arm)
    assert left == pytest.approx(right, abs=COUPLING)


def test_an_empty_jaw_closes_to_its_stop(arm: SimArm) -> None:
    assert arm.gripper.true_gap() == pytest.approx(CLOSED, abs=GAP)
    arm.gripper.open(0.05)
    run(arm, 1.0)
    arm.gripper.close(20.0)
    run(arm, 1.0)
    assert arm.gripper.true_gap() == pytest.approx(CLOSED, abs=GAP)


def test_it_moves_at_its_stated_speed(arm: SimArm) -> None:
    arm.gripper.open(0.06)
    run(arm, 1.5)
    before = arm.gripper.true_gap()
    arm.gripper.close(20.0)
    run(arm, 0.1)
    speed = (before - arm.gripper.true_gap()) / 0.1
    assert speed == pytest.approx(2 * 0.10, rel=0.1)


@pytest.mark.parametrize(("asked", "pressed"), [(10.0, 10.0), (30.0, 30.0), (500.0, 40.0)])
def test_it_presses_with_the_force_told_and_no_more_than_its_own(arm: SimArm, asked: float, pressed: float) -> None:
    arm.gripper.open(0.03)
    run(arm, 1.0)
    half = [0.01, 0.01, 0.01]
    shape = p.createCollisionShape(p.GEOM_BOX, halfExtents=half, physicsClientId=arm.client)
    tool = arm.tool_pose()
    block = p.createMultiBody(
        0.02, shape, -1, tool.translation.tolist(), tool.rotation.as_quat().tolist(), physicsClientId=arm.client
    )
    arm.gripper.close(asked)
    run(arm, 1.0)
    forces = []
    for _ in range(50):
        run(arm, 1 / 480)
        forces.append(
            [
                sum(c[9] for c in p.getContactPoints(arm.body, block, pad, physicsClientId=arm.client))
                for pad in arm.gripper.pads
            ]
        )
    np.testing.assert_allclose(np.mean(forces, axis=0), pressed, rtol=0.15)


def test_samples_fall_at_the_stated_rate_and_stay_between(arm: SimArm) -> None:
    readings = run(arm, 1.0)
    stamps = [stamp for stamp, _ in readings]
    assert len(set(stamps)) == 100
    assert len(set(readings)) == 100
    # Samples fall on the physics step at or after their time.
    np.testing.assert_allclose(sorted(set(stamps)), np.arange(100) / 100, atol=1 / 480 + 1e-9)


@pytest.mark.parametrize("asked_at_every_step", [False, True])
def test_who_asks_changes_nothing(cell: CableCell, client: int, arm: SimArm, asked_at_every_step: bool) -> None:
    twin_client = p.connect(p.DIRECT)
    p.setTimeStep(1 / cell.hidden.step_rate, physicsClientId=twin_client)
    p.setPhysicsEngineParameter(numSolverIterations=cell.hidden.solver_iterations, physicsClientId=twin_client)
    twin = make(cell, twin_client)
    for one in (arm, twin):
        one.gripper.open(0.05)
    run(arm, 0.5)
    for _ in range(240):
        twin.step()
        p.stepSimulation(physicsClientId=twin_client)
        if asked_at_every_step:
            assert twin.gripper.reading() == twin.gripper.reading()
    assert twin.gripper.reading() == arm.gripper.reading()
    p.disconnect(twin_client)


def test_readings_are_noisy_and_quantised(cell: CableCell, arm: SimArm) -> None:
    arm.gripper.open(0.03)
    run(arm, 1.0)
    gaps = np.array(sorted(dict(run(arm, 4.0)).items()))[:, 1]
    errors = cell.hidden.errors
    assert len(gaps) >= 399
    assert float(np.std(gaps)) == pytest.approx(errors.finger_noise, rel=0.2)
    counts = gaps / errors.finger_resolution
    np.testing.assert_allclose(counts, np.round(counts), atol=1e-6)


def test_backlash_lags_behind_the_direction(cell: CableCell, arm: SimArm) -> None:
    means = []
    for start in (0.01, 0.05):
        arm.gripper.open(start)
        run(arm, 1.0)
        arm.gripper.open(0.03)
        run(arm, 1.0)
        lag = [gap - arm.gripper.true_gap() for _, gap in run(arm, 4.0)]
        means.append(float(np.mean(lag)))
    half = cell.hidden.errors.finger_backlash / 2
    assert means == pytest.approx([-half, half], abs=1e-4)


def test_forced_open_it_opens_whatever_it_is_told(arm: SimArm) -> None:
    arm.gripper.close(20.0)
    run(arm, 0.2)
    arm.gripper.set_fault(forced_open=True)
    run(arm, 0.3)
    arm.gripper.close(20.0)
    run(arm, 0.19)
    assert arm.gripper.true_gap() > 0.06
    arm.gripper.set_fault(forced_open=False)
    run(arm, 0.7)
    assert arm.gripper.true_gap() == pytest.approx(CLOSED, abs=GAP)


def test_the_fingers_are_joined_to_each_other_and_to_nothing_else(arm: SimArm) -> None:
    ids = [p.getConstraintUniqueId(i, arm.client) for i in range(p.getNumConstraints(arm.client))]
    joined = [p.getConstraintInfo(c, arm.client)[:5] for c in ids]
    left, right = fingers(arm)
    assert joined == [(arm.body, left, arm.body, right, p.JOINT_GEAR)]
