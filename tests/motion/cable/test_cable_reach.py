import pytest

from regrasp.interfaces.cable.cause import CableCause
from regrasp.interfaces.cable.cell import CableKnown
from regrasp.motion.cable.cable_reach import check_cable_reaches
from regrasp.motion.failure import PlanningError


def test_the_cable_reaches_the_socket_that_held_it_at_first(known: CableKnown) -> None:
    check_cable_reaches(known, known.cable.socket("plugged_into"))


@pytest.mark.parametrize(
    ("name", "code", "told"),
    [
        (
            "back_3",
            CableCause.CABLE_TOO_SHORT,
            "a plug in back_3 ends 0.547 m from the cable's fixed end",
        ),
        ("back_1", CableCause.CABLE_TOO_LONG, "pressed together by 0.19. m it would turn the plug in the hand"),
        ("back_2", CableCause.CABLE_TOO_LONG, "pressed together by 0.12. m"),
    ],
)
def test_what_the_cable_does_not_let_its_end_reach_has_a_cause(
    known: CableKnown, name: str, code: CableCause, told: str
) -> None:
    with pytest.raises(PlanningError, match=told) as error:
        check_cable_reaches(known, known.cable.socket(name))
    assert error.value.code is code
