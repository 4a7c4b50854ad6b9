import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from regrasp.interfaces.cable.cell import CableKnown
from regrasp.interfaces.cell import pose_along
from regrasp.motion.cable.cable_shape import cable_course


def test_the_plugged_cable_is_about_as_long_as_it_is(known: CableKnown) -> None:
    plug = known.cable.socket(known.cable.plugged_into).world_from_plug(known.cable.connector.length)
    course = cable_course(known, plug)
    outside = 0.553 - 0.040  # m: the cell's cable without what its socket hides
    assert np.linalg.norm(np.diff(course, axis=0), axis=1).sum() == pytest.approx(outside, rel=0.03)


@given(
    x=st.floats(0.2, 0.45),
    y=st.floats(-0.1, 0.3),
    z=st.floats(0.1, 0.5),
    axis=st.tuples(st.floats(-0.6, 0.6), st.floats(0.3, 1.0), st.floats(-0.6, 0.6)),
)
def test_it_joins_the_two_ends_in_their_directions(
    known: CableKnown, x: float, y: float, z: float, axis: tuple[float, float, float]
) -> None:
    connector = pose_along((x, y, z), axis)
    course = cable_course(known, connector, spacing=0.001)
    socket = known.cable.sockets[-1]
    assert course[0] == pytest.approx([socket.center[0], -0.417, socket.center[2]])  # the middle of the socket's face
    assert course[-1] == pytest.approx(connector.apply([-0.045, 0.0, 0.0]))
    steps = np.diff(course, axis=0)
    leaves, arrives = steps[0] / np.linalg.norm(steps[0]), steps[-1] / np.linalg.norm(steps[-1])
    assert leaves @ -np.array(socket.axis) > 0.99
    assert arrives @ connector.rotation.apply([1.0, 0.0, 0.0]) > 0.99


def test_points_lie_about_the_spacing_apart(known: CableKnown) -> None:
    course = cable_course(known, pose_along((0.3, 0.05, 0.3), (0.0, 1.0, 0.0)), spacing=0.01)
    steps = np.linalg.norm(np.diff(course, axis=0), axis=1)
    assert steps.min() > 0.005
    assert steps.max() < 0.02
