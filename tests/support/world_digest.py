"""Print what a seeded run of two seconds comes to; with an argument, a second reader looks at every picture besides."""

import hashlib
import sys

import numpy as np
from robots import thesis

from regrasp.interfaces.cable.cell import CableCell
from regrasp.interfaces.trajectory import Trajectory
from regrasp.sim.cable.objects import cable_world

LOOKS = range(4, 21, 4)  # tenths of a second at which the second reader looks


def small_cell() -> CableCell:
    data = thesis()
    for camera in data["known"]["cameras"]:
        camera |= {"width": 212, "height": 120}
    return CableCell.model_validate(data)


def main(second_reader: bool) -> None:
    world = cable_world(small_cell(), "earth", seed=11)
    for name, arm in world.arms.items():
        start = arm.reading().positions
        goal = start + np.array([0.3, 0.4, -0.3, 0.5, 0.2, 0.6])
        arm.follow(Trajectory(np.array([0.0, 1.5]), np.array([start, goal]), np.zeros((2, 6))))
        arm.gripper.open(0.05 if name == "left" else 0.03)
    digest = hashlib.sha256()
    for tenth in range(1, 21):
        world.advance(0.1)
        if tenth == 10:
            world.arms["right"].gripper.close(15.0)
        digest.update(world.objects.connector_pose().as_matrix().tobytes())
        for arm in world.arms.values():
            reading = arm.reading()
            digest.update(np.concatenate([reading.positions, reading.velocities, reading.efforts]).tobytes())
            digest.update(np.float64(arm.gripper.reading().gap).tobytes())
            if second_reader:
                arm.reading(), arm.gripper.reading()
        if second_reader and tenth in LOOKS:
            for camera in world.cameras.values():
                camera.latest(), camera.true_ids(), camera.latest()
    for camera in world.cameras.values():
        frame = camera.latest()
        assert frame is not None
        digest.update(frame.rgb.tobytes() + frame.depth.tobytes() + np.float64(frame.stamp).tobytes())
    print(digest.hexdigest())


if __name__ == "__main__":
    main(second_reader=len(sys.argv) > 1)
