"""What a task bundles, and where its parts are.

A task is a job that the engine does not know, such as pressing a button. It names its parts as
"module:attribute", and each is imported when it is asked for: checking a scenario brings the models, and a run the
simulation. Its leaves are a set of the group `regrasp.leaves` with the task's name (`regrasp.behaviors.registry`).
"""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from regrasp.app.task.part import Part
from regrasp.app.task.technique import Technique

if TYPE_CHECKING:
    from enum import StrEnum

    from regrasp.app.files.findings import Finding
    from regrasp.app.files.yaml_lines import Document
    from regrasp.app.task.draw import Draw
    from regrasp.app.task.expect import Expect
    from regrasp.app.task.judge import Judge
    from regrasp.app.task.signals import SignalGroup
    from regrasp.app.task.words import Words
    from regrasp.behaviors.services import Services
    from regrasp.interfaces.cell import Cell
    from regrasp.interfaces.fault import Fault, When
    from regrasp.interfaces.scene import Gravity, SceneSetup
    from regrasp.sim.objects import TaskObjects
    from regrasp.sim.world import World


@dataclass(frozen=True, eq=False)
class Task:
    """A task. What is left out is what every task has."""

    name: str  # also that of its sections in a cell file, known.NAME and hidden.NAME
    about: str  # a sentence for lists
    # What it builds in the world of a cell.
    objects: Part["Callable[[Any], TaskObjects]"] = Part("regrasp.sim.objects:NoObjects")
    # The model of a cell file with the task's sections.
    cell: Part["type[Cell]"] = Part("regrasp.interfaces.cell:Cell")
    # Findings in a cell each of whose values is right; only if the flag is set, how its parts lie to one another.
    cell_findings: Part["Callable[[Document, Any, bool], Iterable[Finding]]"] | None = None
    # Names in a cell (None: any) that a tree's ports may hold, by kind, each with why it cannot be used there, or "".
    cell_names: Part["Callable[[Any | None], dict[str, dict[str, str]]]"] | None = None
    # What an obstacle, a `JitteredBox` in a cell and a gravity (None: unknown), overlaps: a name and a depth in m.
    obstacle_overlaps: Part["Callable[..., Iterable[tuple[str, float]]]"] | None = None
    # The model of what a scenario's seed may draw.
    draw: Part["type[Draw]"] = Part("regrasp.app.task.draw:Draw")
    # Why a drawn scene, a cell with a gravity and a `SceneSetup`, cannot be solved, in a few words; "" if it can.
    unsolvable: Part["Callable[[Any, Gravity, SceneSetup], str]"] | None = None
    expect: Part["type[Expect]"] = Part("regrasp.app.task.expect:Expect")
    causes: Part["Iterable[StrEnum]"] = Part("regrasp.app.task.part:NOTHING")  # of its leaves' failures
    when: Part["type[When]"] = Part("regrasp.interfaces.fault:When")
    faults: Part["tuple[type[Fault], ...]"] = Part("regrasp.app.task.part:NOTHING")
    service_calls: tuple[str, ...] = ()  # that the fault service_raises may break, besides those of every task
    services: Part["Callable[[World[Any], int, Any], Services]"] = Part("regrasp.app.run.compose:build_services")
    judge: Part["type[Judge[Any]]"] = Part("regrasp.app.task.judge:Judge")
    belief: Part["Callable[[Any], dict[str, Any]]"] = Part("regrasp.app.task.belief:belief")  # for the record
    # Its signals in the record, besides the arms'.
    signals: Part["Callable[[World[Any], Any], Iterable[SignalGroup]]"] = Part("regrasp.app.task.signals:no_signals")
    words: Part["Words"] = Part("regrasp.app.task.words:PLAIN")
    old_outcomes: Mapping[str, str] = field(default_factory=dict)  # of schema 1, and what is written today
    old_cell_keys: Mapping[str, str] = field(default_factory=dict)  # of cell files from before there were sections
    techniques: Mapping[str, Technique] = field(default_factory=dict)  # of `regrasp perceive`, by name
    # Adds commands to the command line, and to `regrasp study`, both of them Typer's.
    commands: Part["Callable[[Any, Any], None]"] | None = None
