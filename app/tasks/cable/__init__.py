"""The cable task: two arms unplug a cable, lose its end, and get it back with cameras alone."""

from typing import Any

from regrasp.app.task.part import Part
from regrasp.app.task.task import Task
from regrasp.app.task.technique import Technique

_HERE = "regrasp.app.tasks.cable"
_PERCEIVE: Part[Any] = Part(f"{_HERE}.perceive:perceive_connector")

TASK = Task(
    name="cable",
    about="Unplug a cable's end and stow it in a clip; get it back whenever it is lost.",
    objects=Part("regrasp.sim.cable.objects:CableObjects"),
    cell=Part("regrasp.interfaces.cable.cell:CableCell"),
    cell_findings=Part(f"{_HERE}.cell_layout:cell_findings"),
    cell_names=Part(f"{_HERE}.cell_names:cell_names"),
    obstacle_overlaps=Part(f"{_HERE}.placement:obstacle_overlaps"),
    draw=Part(f"{_HERE}.scene_draw:CableDraw"),
    unsolvable=Part(f"{_HERE}.solvable:unsolvable"),
    expect=Part(f"{_HERE}.expectations:Expect"),
    causes=Part("regrasp.interfaces.cable.cause:CableCause"),
    when=Part("regrasp.interfaces.cable.fault:CableWhen"),
    faults=Part("regrasp.interfaces.cable.fault:FAULTS"),
    service_calls=("perception.look", "motion.carry", "motion.pick"),
    services=Part(f"{_HERE}.services:cable_services"),
    judge=Part(f"{_HERE}.judge:CableJudge"),
    belief=Part(f"{_HERE}.belief:belief"),
    signals=Part(f"{_HERE}.signals:cable_signals"),
    words=Part(f"{_HERE}.words:WORDS"),
    old_outcomes={"stowed": "success", "safe_stop": "failure"},
    old_cell_keys={
        **{f"known.{key}": f"known.cable.{key}" for key in ("sockets", "plugged_into", "clip", "connector")},
        "known.cable_length": "known.cable.length",
        "hidden.connector_mass": "hidden.cable.connector_mass",
        "hidden.connector_friction": "hidden.cable.connector_friction",
    },
    techniques={
        "fused": Technique("the connector's pose, by its shape, colour and depth together", _PERCEIVE),
        "rgbd": Technique("the connector's pose, by its colour and depth", _PERCEIVE),
        "detector": Technique("the connector's pose, by a network and depth", _PERCEIVE),
        "fiducial": Technique("the connector's pose, by its tag; needs no depth", _PERCEIVE),
    },
    commands=Part(f"{_HERE}.cli:add_to"),
)
