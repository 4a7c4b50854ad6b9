"""The hand that takes the printed part, in the habitat's world."""

from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import RigidTransform, Rotation

from regrasp.app.files.resources import shipped
from regrasp.app.scenario.cell_file import load_cell
from regrasp.app.tasks.printer.studies.hand_placed import HandPlaced
from regrasp.interfaces.printer.cell import PrinterCell


@pytest.mark.parametrize("askew", [-0.01, 0.01])  # rad
def test_a_hand_that_is_askew_turns_until_it_does_not_twist_the_part(askew: float) -> None:
    cell = load_cell(shipped("cell")["habitat_open"])
    assert isinstance(cell, PrinterCell)
    with HandPlaced(cell, 2) as hand:
        hand.place(hand.goal * RigidTransform.from_rotation(Rotation.from_rotvec([0.0, 0.0, askew])))
        hand.world.advance(0.5)
        motion: Any = hand.services.motion
        turned = motion.tool(hand.name).rotation
        taking, end = motion.take_part(hand.name, 0.0275), hand.world.now() + 30.0
        while not taking.poll():
            assert hand.world.now() < end
            hand.world.advance(0.05)
        moment = motion._moment_about(hand.name, motion.tool(hand.name).translation)
        assert abs(moment) < 2 * motion.parameters.relieved_moment
        back = (turned.inv() * motion.tool(hand.name).rotation).as_rotvec()[2]
        assert np.sign(back) == -np.sign(askew)
        assert hand.world.objects.part.bond.holds
