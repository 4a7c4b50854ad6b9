"""Where a hand ends that brings the connector into its seat."""

import numpy as np
import pytest
from scipy.spatial.transform import RigidTransform, Rotation

from regrasp.interfaces.cable.cell import CableKnown
from regrasp.motion.cable.seating import SeatingParameters, lying_otherwise, seated_pose

VALUES = SeatingParameters()
HELD = RigidTransform.from_components([0.005, 0.0, 0.01], Rotation.from_euler("y", -90, degrees=True))
TOOL = RigidTransform.from_translation([0.2, 0.0, 0.4])


def test_the_first_try_trusts_the_belief() -> None:
    first = lying_otherwise(HELD, *VALUES.tries[0])
    assert first.as_matrix() == pytest.approx(HELD.as_matrix())


@pytest.mark.parametrize("lies", VALUES.tries)
def test_a_connector_that_lies_as_a_try_takes_it_to_ends_in_the_seat(
    known: CableKnown, lies: tuple[float, float]
) -> None:
    seat, really = known.cable.clip.world_from_seat, lying_otherwise(HELD, *lies)
    end = seated_pose(TOOL, seat, really, VALUES.fine_rolls) * really
    assert end.translation == pytest.approx(seat.translation, abs=1e-9)
    assert end.rotation.apply([1.0, 0.0, 0.0]) == pytest.approx(seat.rotation.apply([1.0, 0.0, 0.0]), abs=1e-9)
    shift, turn = np.abs(lies)
    assert np.linalg.norm(really.translation - HELD.translation) == pytest.approx(shift)
    assert np.rad2deg((really.rotation * HELD.rotation.inv()).magnitude()) == pytest.approx(turn)


def test_a_connector_nearer_to_the_palm_is_brought_in_deeper(known: CableKnown) -> None:
    seat = known.cable.clip.world_from_seat
    [deeper] = [lies for lies in VALUES.tries if lies[0] < 0.0]
    believed, other = (
        seated_pose(TOOL, seat, held, VALUES.fine_rolls) for held in (HELD, lying_otherwise(HELD, *deeper))
    )
    way = believed.inv().apply(other.translation)
    assert way == pytest.approx([-deeper[0], 0.0, 0.0], abs=1e-9)
