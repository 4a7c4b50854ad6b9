"""Bad input at the motion service's door: a ValueError at once, or a PlanningError with a named cause."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from fake_devices import Rig
from robots import VX300S
from scipy.spatial.transform import RigidTransform

from regrasp.interfaces.cable.cell import CableKnown
from regrasp.interfaces.cause import CauseCode
from regrasp.motion.cable.service import CableMotion
from regrasp.motion.failure import PlanningError
from regrasp.motion.robots.kinematics import ArmKinematics

READY = np.array([0.4, -0.6, 0.6, 0.0, 0.3, 0.0])
NAN_POSE = RigidTransform.from_translation([np.nan, 0.0, 0.3])
HERE = RigidTransform.from_translation([0.3, 0.0, 0.3])
HOLD = RigidTransform.identity()


def changed(joint: int, value: float) -> np.ndarray:
    q = READY.copy()
    q[joint] = value
    return q


@pytest.fixture
def rig(known: CableKnown) -> Rig:
    return Rig(known)


BAD: dict[str, tuple[Callable[[CableMotion], object], str]] = {
    "NaN joints": (lambda m: m.move("right", changed(1, np.nan)[None]), "1 of 6 numbers are not finite"),
    "endless joints": (lambda m: m.move("right", changed(1, np.inf)[None]), "1 of 6 numbers are not finite"),
    "too few joints": (lambda m: m.move("right", READY[None, :5]), r"shape \(1, 5\); give \(k, 6\)"),
    "NaN margin": (lambda m: m.move("right", READY[None], margin=np.nan), "the margin is nan"),
    "margin below 0": (lambda m: m.move("right", READY[None], margin=-0.01), r"the margin is -0\.01"),
    "NaN pose": (lambda m: m.move_tool("right", NAN_POSE), "the tool's pose: 1 of 16 numbers"),
    "NaN pose onward": (lambda m: m.move_tool("right", HERE, onward=[NAN_POSE]), "the tool's pose: 1 of 16"),
    "NaN line": (lambda m: m.straight("right", NAN_POSE), "the tool's pose"),
    "no speed": (lambda m: m.straight("right", HERE, speed=0.0), "the speed is 0; give a number above 0 and at most 1"),
    "too fast": (lambda m: m.straight("right", HERE, speed=2.0), "the speed is 2"),
    "NaN shift": (lambda m: m.shift("right", [np.nan, 0.0, 0.0]), "the displacement: 1 of 3 numbers"),
    "flat shift": (lambda m: m.shift("right", [0.1, 0.0]), r"the displacement has the shape \(2,\)"),
    "NaN pick": (lambda m: m.pick_loose(NAN_POSE), "the connector's pose"),
    "NaN cable": (
        lambda m: m.pick("right", HERE, m.known.cable.connector, clear_of=np.full((2, 3), np.nan)),
        "the points to keep clear of: 6 of 6 numbers",
    ),
    "NaN hold": (lambda m: m.carry_to_clip(NAN_POSE), "the held connector's pose"),
    "NaN carry": (lambda m: m.carry("right", [NAN_POSE], HOLD, speed=0.5), "a pose of the tool or the connector"),
    "NaN plug": (lambda m: m.pull_out(NAN_POSE), "the plug's pose"),
    "NaN view": (lambda m: m.view(NAN_POSE), "the camera's pose"),
    "NaN place": (lambda m: m.view_of(np.full(3, np.nan), HERE), "the place"),
    "NaN connector": (lambda m: m.best_view(NAN_POSE), "the connector's pose"),
    "NaN jaw": (lambda m: m.release("right", np.nan), "the gap is nan"),
    "nothing to close on": (lambda m: m.close("right", 0.0), "the thickness is 0"),
    "NaN points": (lambda m: m.set_obstacles(np.array([[0.3, 0.0, np.nan]]), 0.01), "the points: 1 of 3 numbers"),
    "flat points": (lambda m: m.set_obstacles(np.zeros((4, 2)), 0.01), r"the points have the shape \(4, 2\)"),
    "no spacing": (lambda m: m.set_obstacles(np.zeros((4, 3)), 0.0), "the spacing is 0; give a number above 0"),
    "NaN cloud": (lambda m: m.keep_clear(np.array([[np.inf, 0.0, 0.0]])), "the points: 1 of 3 numbers"),
}


@pytest.mark.parametrize("name", BAD)
def test_what_is_no_number_or_has_another_shape_is_refused_at_once(rig: Rig, name: str) -> None:
    ask, sentence = BAD[name]
    with pytest.raises(ValueError, match=sentence):
        ask(rig.motion)
    assert not rig.arms["right"].followed


def refused(rig: Rig, ask: Callable[[CableMotion], object]) -> PlanningError:
    with pytest.raises(PlanningError) as error:
        ask(rig.motion).poll()  # type: ignore[attr-defined]
    return error.value


def test_goals_past_the_limits_are_out_of_reach_and_the_sentence_names_the_joint(rig: Rig) -> None:
    error = refused(rig, lambda m: m.move("right", changed(1, 2.0)[None]))
    assert error.code is CauseCode.OUT_OF_REACH
    assert str(error) == "none of 1 goals lies within the joints' limits: shoulder 2, limits -1.85 to 1.257"


def test_an_arm_that_touches_something_says_what_and_how_deep(rig: Rig) -> None:
    rig.arms["right"].at = np.array([0.0, 0.9, -0.9, 0.0, 0.0, 0.0])
    error = refused(rig, lambda m: m.move("right", READY[None]))
    assert (error.code, str(error)) == (CauseCode.MOTION_BLOCKED, "the arm touches back_panel, 21 mm deep")


def test_an_encoder_without_a_number_is_the_arms_failure(rig: Rig) -> None:
    rig.arms["right"].at = changed(2, np.nan)
    error = refused(rig, lambda m: m.move("right", READY[None]))
    assert (error.code, str(error)) == (CauseCode.ARM_FAILED, "the encoders of the right arm give no number for elbow")


def test_a_tool_out_of_reach_says_how_far(rig: Rig) -> None:
    far = RigidTransform.from_translation([3.0, -0.1778, 0.0])
    error = refused(rig, lambda m: m.move_tool("right", far))
    assert error.code is CauseCode.OUT_OF_REACH
    assert "the tool of the right arm there: 3.00 m from its base, and its links measure 0.93 m" in str(error)
    error = refused(rig, lambda m: m.pick_loose(far))
    assert error.code is CauseCode.OUT_OF_REACH
    assert "1152 out of reach of the right arm: 3.00 m from its base" in str(error)


def test_a_tool_that_cannot_go_on_says_so(rig: Rig) -> None:
    tool = rig.motion.kinematics["right"].tool(READY)
    onward = [RigidTransform.from_translation([2.0, 0.0, 0.0])]
    error = refused(rig, lambda m: m.move_tool("right", tool, onward=onward))
    assert error.code is CauseCode.OUT_OF_REACH
    assert "joint angles bring the tool of the right arm there, but from none it can go straight on" in str(error)


def test_an_endless_line_is_out_of_reach(rig: Rig) -> None:
    error = refused(rig, lambda m: m.straight("right", RigidTransform.from_translation([1e9, 0.0, 0.0])))
    assert (error.code, str(error)) == (
        CauseCode.OUT_OF_REACH,
        "a straight line of 1e+09 m is out of any arm's reach",
    )


@pytest.mark.parametrize("cloud", [np.empty((0, 3)), np.empty(0)])
def test_an_empty_cloud_clears_the_map(rig: Rig, cloud: np.ndarray) -> None:
    eye, seen = RigidTransform.from_translation([-0.3, 0.0, 0.4]), np.array([[0.3, 0.1, 0.3]])
    rig.motion.set_obstacles(np.linspace(eye.translation, seen[0], 100)[60:80], 0.01)
    assert not rig.motion.sees(eye, seen)
    rig.motion.set_obstacles(cloud, 0.01)
    rig.motion.keep_clear(cloud)
    assert rig.motion.sees(eye, seen)


def test_a_million_points_are_mapped(rig: Rig) -> None:
    wall = np.random.default_rng(0).uniform([0.28, -0.45, 0.0], [0.30, 0.05, 0.6], (1_000_000, 3))
    rig.motion.set_obstacles(wall, 0.01)
    assert not rig.motion.sees(RigidTransform.from_translation([-0.3, -0.2, 0.3]), np.array([[0.45, -0.2, 0.3]]))
    error = refused(rig, lambda m: m.move("right", m.kinematics["right"].ik(HERE)))
    assert (error.code, "seen surface" in str(error)) == (CauseCode.NO_COLLISION_FREE_GOAL, True)


def test_points_that_no_arm_reaches_cost_nothing_and_hide_nothing(rig: Rig) -> None:
    seen, far = np.array([[0.3, 0.25, 0.15]]), np.array([[1e6, -1e6, 1e6], [0.0, 0.0, 40.0]])
    rig.motion.set_obstacles(np.vstack([far, seen]), 0.01)
    rig.motion.keep_clear(far)
    model = rig.motion.model("left")
    alone = Rig(rig.known)
    alone.motion.set_obstacles(seen, 0.01)
    assert model.nearest(READY) == alone.motion.model("left").nearest(READY)


def test_limits_that_contradict_are_refused_by_name() -> None:
    robot = VX300S.model_copy()
    lower = VX300S.chain.lower.copy()
    for value in (2.0, np.nan):
        lower[2] = value
        robot.__dict__["chain"] = replace(VX300S.chain, lower=lower)
        with pytest.raises(ValueError, match=f"limits of elbow contradict: lower {value:g} is not below upper"):
            ArmKinematics(robot, RigidTransform.identity())
