from pathlib import Path

import numpy as np
import pytest
from toy_robot import ROBOT, URDF, write_robot

from regrasp.app.files.resources import shipped
from regrasp.app.robots.reach import link_poses, random_positions, reach_of
from regrasp.app.robots.robot_file import load_robot
from regrasp.app.robots.self_collision import meeting_pairs


@pytest.mark.parametrize("name", list(shipped("robot")))
def test_the_tool_is_where_the_urdf_puts_it(name: str) -> None:
    robot = load_robot(shipped("robot")[name])
    chain = robot.chain
    for row in random_positions(chain, 5, seed=1):
        rotations, places = link_poses(chain, row[None])
        tool = places[0, -1] + rotations[0, -1] @ chain.last_from_tool[:3, 3]
        in_urdf = dict(zip(robot.urdf_joints, row * robot.signs, strict=True))
        zero = robot.tree.frame(robot.base_link)
        expected = np.linalg.inv(zero) @ robot.tree.frame(robot.tool.link, in_urdf) @ [*robot.tool.xyz, 1.0]
        assert tool == pytest.approx(expected[:3], abs=1e-9)


def test_the_reach_of_two_joints_is_known(tmp_path: Path) -> None:
    reach = reach_of(load_robot(write_robot(tmp_path)).chain)
    assert reach.nearest == pytest.approx(0.24)
    assert reach.farthest == pytest.approx(0.24)
    assert reach.highest == pytest.approx(0.36 + 0.24, abs=1e-4)
    assert reach.lowest == pytest.approx(0.36 + 0.24 * np.cos(2.0), abs=1e-4)


def test_links_that_can_meet_are_no_neighbours(tmp_path: Path) -> None:
    path = write_robot(tmp_path, ROBOT.replace("spheres:\n", "spheres:\n  base: [[0, 0, 0, 0.15]]\n"))
    (tmp_path / "toy.urdf").write_text(URDF.replace('lower="-2" upper="2"', 'lower="-3.1" upper="3.1"'))
    assert meeting_pairs(load_robot(path)) == [("base", "lower"), ("base", "left"), ("base", "right")]


def test_links_that_the_limits_keep_apart_are_no_pair(tmp_path: Path) -> None:
    text = ROBOT.replace("spheres:\n", "spheres:\n  base: [[0, 0, 0, 0.15]]\n")
    assert meeting_pairs(load_robot(write_robot(tmp_path, text))) == []  # the fingers stay 0.26 m above the base


def test_the_pairs_by_hand_of_the_viperx_are_found() -> None:
    robot = load_robot(shipped("robot")["vx300s"])
    found = {frozenset(pair) for pair in meeting_pairs(robot)}
    assert {frozenset(pair) for pair in robot.self_collision} <= found
