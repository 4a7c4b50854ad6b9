"""The thesis's cell and bare PyBullet clients for the tests of this room."""

from collections.abc import Iterator
from importlib.resources import files

import pybullet as p
import pytest
import yaml

from interfaces.cell import Cell


@pytest.fixture(scope="session")
def cell() -> Cell:
    """The thesis's cell with small pictures and arms without joint offsets."""
    text = (files("scenarios") / "cells/thesis.yaml").read_text(encoding="utf-8")
    data = yaml.safe_load(text)
    data["hidden"]["errors"]["arm_tool"] = 0.0
    for camera in data["known"]["cameras"]:
        camera |= {"width": 212, "height": 120}
    return Cell.model_validate(data)


@pytest.fixture
def client(cell: Cell) -> Iterator[int]:
    """An empty world without gravity at the cell's step."""
    client = p.connect(p.DIRECT)
    p.setTimeStep(1.0 / cell.hidden.step_rate, physicsClientId=client)
    p.setPhysicsEngineParameter(numSolverIterations=cell.hidden.solver_iterations, physicsClientId=client)
    yield client
    p.disconnect(client)
