"""Fixtures of all tests: the thesis's cell, arms, bare PyBullet clients. One file: mypy takes two for one module."""

import signal
import sys
from collections.abc import Iterator

import pybullet as p
import pytest
from hypothesis import settings
from robots import thesis

from regrasp.interfaces.cable.cell import CableCell, CableKnown
from regrasp.interfaces.cell import Box
from regrasp.motion.robots.kinematics import ArmKinematics
from regrasp.motion.scene.collision import CollisionModel

pytest_plugins = ["pytester", "regrasp.app.pytest_plugin"]

LONG = ("tests/scenarios", "tests/outside")
PACKAGES = {"app", "behaviors", "interfaces", "motion", "perception", "scenarios", "sim", "trees"}


class _NoBareImport:
    """Refuses `import sim`: the checkout's root lies on the path here, and a module would exist twice."""

    def find_spec(self, name: str, path: object = None, target: object = None) -> None:
        """As `importlib.abc.MetaPathFinder`."""
        if name.partition(".")[0] in PACKAGES:
            raise ModuleNotFoundError(f"no module {name}: import regrasp.{name}", name=name)


sys.meta_path.insert(0, _NoBareImport())


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Whole runs first: what is long must not begin last, when the other workers have nothing left to take over."""
    items.sort(key=lambda item: not item.nodeid.startswith(LONG))


# A shell starts background jobs with Ctrl-C ignored, and nohup with SIGHUP; what tests start would inherit that.
signal.signal(signal.SIGINT, signal.default_int_handler)
signal.signal(signal.SIGHUP, signal.SIG_DFL)
settings.register_profile("without deadline", deadline=None)  # compilation and other workers take their time
settings.load_profile("without deadline")


@pytest.fixture(scope="session")
def known() -> CableKnown:
    """The cell as its robot knows it."""
    return CableCell.model_validate(thesis()).known


@pytest.fixture(scope="session")
def cell() -> CableCell:
    """The thesis's cell with small pictures and arms without joint offsets."""
    data = thesis()
    data["hidden"]["errors"]["arm_tool"] = 0.0
    for camera in data["known"]["cameras"]:
        camera |= {"width": 212, "height": 120}
    return CableCell.model_validate(data)


@pytest.fixture
def client(cell: CableCell) -> Iterator[int]:
    """An empty world without gravity at the cell's step."""
    client = p.connect(p.DIRECT)
    p.setTimeStep(1.0 / cell.hidden.step_rate, physicsClientId=client)
    p.setPhysicsEngineParameter(numSolverIterations=cell.hidden.solver_iterations, physicsClientId=client)
    yield client
    p.disconnect(client)


@pytest.fixture(scope="session")
def boxes(known: CableKnown) -> list[Box]:
    """Floor, panels, sockets and clip."""
    sockets = [Box(name=s.name, center=s.center, size=s.size) for s in known.cable.sockets]
    return [*known.boxes, *sockets, *known.cable.clip.bracket]


@pytest.fixture(scope="session")
def left_arm(known: CableKnown) -> ArmKinematics:
    """The left arm where it stands."""
    return _kinematics(known, "left")


@pytest.fixture(scope="session")
def right_arm(known: CableKnown) -> ArmKinematics:
    """The right arm where it stands."""
    return _kinematics(known, "right")


@pytest.fixture(scope="session")
def right_model(right_arm: ArmKinematics, boxes: list[Box]) -> CollisionModel:
    """The right arm among the boxes."""
    return CollisionModel(right_arm, boxes)


def _kinematics(known: CableKnown, arm: str) -> ArmKinematics:
    spec = known.arm(arm)
    return ArmKinematics(spec.robot, spec.world_from_base)
