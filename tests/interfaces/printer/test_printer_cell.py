import pytest
from pydantic import ValidationError

from regrasp.interfaces.printer.cell import Door

DOOR = {"center": (-0.35, 2.549, 1.57), "size": (0.02, 0.44, 0.38), "travel": 0.43}
HANDLE = {"center": (-0.30, 2.37, 1.57), "size": (0.02, 0.02, 0.12)}


def test_a_door_moves_with_its_handle_along_y() -> None:
    door = Door.model_validate({**DOOR, "handle": HANDLE})
    panel, handle = door.parts(0.43)
    assert panel.center == pytest.approx((-0.35, 2.979, 1.57))
    assert handle.center == pytest.approx((-0.30, 2.80, 1.57))  # as the source's table has it


@pytest.mark.parametrize(
    ("center", "why"),
    [
        ((-0.345, 2.37, 1.57), "lies in the door"),
        ((-0.30, 2.32, 1.57), "stands out of the door along y"),
        ((-0.30, 2.37, 1.72), "stands out of the door along z"),
    ],
)
def test_a_handle_that_cannot_be_is_refused(center: tuple[float, float, float], why: str) -> None:
    with pytest.raises(ValidationError, match=why):
        Door.model_validate({**DOOR, "handle": {**HANDLE, "center": center}})
