"""The thesis's cell for the tests of this room."""

from importlib.resources import files

import pytest
import yaml
from scipy.spatial.transform import RigidTransform

from interfaces.cell import Box, Cell, KnownCell
from motion.collision import CollisionModel
from motion.kinematics import ArmKinematics


@pytest.fixture(scope="session")
def known() -> KnownCell:
    text = (files("scenarios") / "cells/thesis.yaml").read_text(encoding="utf-8")
    return Cell.model_validate(yaml.safe_load(text)).known


@pytest.fixture(scope="session")
def boxes(known: KnownCell) -> list[Box]:
    sockets = [Box(name=s.name, center=s.center, size=s.size) for s in known.sockets]
    return [*known.boxes, *sockets, *known.clip.bracket]


@pytest.fixture(scope="session")
def left_arm(known: KnownCell) -> ArmKinematics:
    return ArmKinematics(RigidTransform.from_translation(known.arm("left").base))


@pytest.fixture(scope="session")
def right_arm(known: KnownCell) -> ArmKinematics:
    return ArmKinematics(RigidTransform.from_translation(known.arm("right").base))


@pytest.fixture(scope="session")
def right_model(right_arm: ArmKinematics, boxes: list[Box]) -> CollisionModel:
    return CollisionModel(right_arm, boxes)
