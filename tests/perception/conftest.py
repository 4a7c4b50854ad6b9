import pytest
from scipy.spatial.transform import RigidTransform

from interfaces.cell import Connector, FixedMount
from interfaces.frame import Intrinsics


@pytest.fixture
def connector() -> Connector:
    return Connector(length=0.09, radius=0.010, color=(0.75, 0.05, 0.06))


@pytest.fixture
def rear() -> RigidTransform:
    return FixedMount(position=(-0.3556, 0.0, 0.4064), pitch_down_deg=14.0).world_from_camera


@pytest.fixture
def camera() -> Intrinsics:
    """The rear camera's middle third: as sharp, faster to render."""
    return Intrinsics(280, 240, 665.6, 665.6, 139.5, 119.5)
