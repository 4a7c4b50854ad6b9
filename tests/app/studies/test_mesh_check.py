import numpy as np
import pytest
from robots import VX300S
from scipy.spatial.transform import RigidTransform, Rotation

from regrasp.app.studies.mesh_check import Carried, MeshCheck, Standing, Surroundings
from regrasp.interfaces.cell import Box
from regrasp.motion.robots.kinematics import ArmKinematics

pytest.importorskip("coal")

KIN = ArmKinematics(VX300S, RigidTransform.identity())
LEFT, RIGHT = np.array([[0.7, 0.0, 0.0, 0.0, 0.3, 0.0], [-0.7, 0.0, 0.0, 0.0, 0.3, 0.0]])
POST = Box(name="post", center=(0.5, 0.0, 0.25), size=(0.06, 0.06, 0.5))
PATH = np.array([LEFT, RIGHT])


def test_a_path_through_a_post_touches_it_and_one_over_it_does_not() -> None:
    check = MeshCheck(KIN, Surroundings([POST]))
    assert check.first_touch(PATH) == "post"
    assert check.touches(PATH)
    assert check.first_touch(np.array([LEFT, LEFT + 0.1])) is None
    assert not MeshCheck(KIN, Surroundings()).touches(PATH)


def test_a_turned_box_is_where_it_is_turned_to() -> None:
    tool = KIN.tool(LEFT).translation
    beam = Box(name="beam", center=(0.0, 0.0, 0.0), size=(0.02, 1.0, 0.5))
    along = Rotation.from_euler("z", LEFT[0] - np.pi / 2)
    beside = RigidTransform.from_components(tool + along.apply([0.25, 0.0, 0.0]), along)
    at_rest = np.array([LEFT, LEFT])
    assert not MeshCheck(KIN, Surroundings(turned=[(beam, beside)])).touches(at_rest)
    across = RigidTransform.from_components(beside.translation, along * Rotation.from_euler("z", np.pi / 2))
    assert MeshCheck(KIN, Surroundings(turned=[(beam, across)])).first_touch(at_rest) == "beam"


def test_another_arm_is_in_the_way() -> None:
    other = ArmKinematics(VX300S, RigidTransform.from_translation([1.0, 0.0, 0.0]))
    facing = Standing(other, np.array([np.pi, 0.0, 0.0, 0.0, 0.3, 0.0]))
    asleep = Standing(other, np.array([0.0, -1.8, 1.55, 0.0, 0.8, 0.0]))
    assert MeshCheck(KIN, Surroundings(arms=[facing])).first_touch(PATH) == "other arm"
    assert MeshCheck(KIN, Surroundings(arms=[asleep])).first_touch(PATH) is None


def test_what_the_hand_holds_and_how_far_its_jaw_stands_open_count() -> None:
    tool = KIN.tool(LEFT)
    at_rest = np.array([LEFT, LEFT])

    def beside(x: float, y: float) -> Surroundings:
        place = RigidTransform.from_components(tool.apply([x, y, 0.0]), tool.rotation)
        return Surroundings(turned=[(Box(name="bead", center=(0.0, 0.0, 0.0), size=(0.004, 0.004, 0.004)), place)])

    def touches(around: Surroundings, opening: float, *carried: Carried) -> bool:
        return MeshCheck(KIN, around, opening=opening, carried=carried).touches(at_rest)

    along_y = RigidTransform.from_rotation(Rotation.from_euler("z", 90, degrees=True))
    rod = Carried(len(KIN), KIN.last_from_tool @ along_y.as_matrix(), (0.2, 0.01))
    block = Carried(len(KIN), KIN.last_from_tool, (0.01, 0.2, 0.01))
    for thing in (rod, block):
        assert touches(beside(0.0, 0.095), 0.05, thing)
        assert not touches(beside(0.0, 0.11), 0.05, thing)
        assert not touches(beside(0.02, 0.095), 0.05, thing)
    assert not touches(beside(0.0, 0.095), 0.05)
    assert touches(beside(0.0, 0.046), 0.075)
    assert not touches(beside(0.0, 0.046), 0.01)
