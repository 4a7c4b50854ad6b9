"""A right scenario file beside a tree of one toy leaf."""

from pathlib import Path
from typing import ClassVar

import own_leaves
import pytest
from py_trees.common import Status
from py_trees.ports import BehaviourWithPorts, PortInformation

SCENARIO = """\
description: a foam block hides the end of the cable
cell: thesis
tree: tree.xml
gravity: zero
inputs: {tries: 4}
obstacles:
  - name: short
    size: [0.08, 0.12, 0.18]
    color: [0.5, 0.2, 0.6]
    position: {zero: [0.30, 0.14, 0.16], earth: [0.30, 0.12, 0.0]}
    yaw_deg: 0
    jitter: [0.01, 0.01, 0.0]
faults:
  - {type: jaw_opens, when: {carried: [0.3, 0.8]}, seconds: 1.0}
limits: {sim_seconds: 600}
expect:
  outcome: success
  slips: 1
  hidden: true
  unintended_force: 5.0
"""
TREE = """\
<root main_tree_to_execute="Main"><BehaviorTree ID="Main" tries="2">
<Retry name="again" num_failures="{tries}"><Wait name="settle" seconds="0.1"/></Retry>
</BehaviorTree></root>
"""


class Wait(BehaviourWithPorts, register=False):  # type: ignore[misc, call-arg]  # py_trees is untyped to mypy here
    INPUT_PORTS: ClassVar[dict[str, PortInformation]] = {"seconds": PortInformation(data_type=float)}
    OUTPUT_PORTS: ClassVar[dict[str, PortInformation]] = {}

    def update(self) -> Status:
        return Status.SUCCESS


def write_scenario(folder: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Write mine.yaml and tree.xml into `folder` and make it the current one."""
    own_leaves.put_in({"Wait": Wait}, monkeypatch.setattr)
    monkeypatch.chdir(folder)
    (folder / "tree.xml").write_text(TREE)
    (folder / "mine.yaml").write_text(SCENARIO)
    return folder / "mine.yaml"
