from types import SimpleNamespace
from typing import Any, cast

import py_trees
import pytest
from py_trees.common import Status

from regrasp.app.run.fault_injection import EnteredNodes, FaultLog, break_services
from regrasp.interfaces.cause import CauseCode, ServiceError
from regrasp.interfaces.fault import PlanningFindsNothing, ServiceRaises, When
from regrasp.motion.failure import PlanningError
from regrasp.sim.faults.effects import Effect
from regrasp.sim.faults.faults import ScheduledFault, TriggerState

AT_ONE = When(at=(1.0, 1.0))


def services() -> Any:
    """Services whose look and planner answer 42."""
    return SimpleNamespace(
        perception=SimpleNamespace(look=lambda camera: 42), motion=SimpleNamespace(planner=lambda: 42)
    )


def test_a_service_raises_for_so_many_calls_from_its_moment_on() -> None:
    fault = ScheduledFault(
        ServiceRaises(type="service_raises", when=AT_ONE, service="perception.look", calls=2), Effect()
    )
    made = services()
    break_services(made, [fault], lambda: 1.5)
    assert made.perception.look("rear") == 42
    fault.watch(TriggerState(1.0))
    for _ in range(2):
        with pytest.raises(ServiceError, match=r"perception.look broke off"):
            made.perception.look("rear")
    assert made.perception.look("rear") == 42
    assert (fault.began_at, fault.ended_at) == (1.0, 1.5)


def test_a_planner_finds_nothing_for_so_long() -> None:
    fault = ScheduledFault(PlanningFindsNothing(type="planning_finds_nothing", when=AT_ONE, seconds=2.0), Effect())
    made = services()
    break_services(made, [fault], lambda: 0.0)
    fault.watch(TriggerState(1.0))
    with pytest.raises(PlanningError) as error:
        made.motion.planner()
    assert error.value.code is CauseCode.PLANNING_FAILED
    fault.watch(TriggerState(3.0))
    assert made.motion.planner() == 42


def test_the_world_is_told_of_each_node_once_when_it_is_first_entered() -> None:
    told: list[str] = []
    first = py_trees.behaviours.StatusQueue("first", [Status.RUNNING, Status.SUCCESS], Status.SUCCESS)
    root = py_trees.composites.Sequence("root", memory=True, children=[first, py_trees.behaviours.Running("second")])
    tree = py_trees.trees.BehaviourTree(root)
    tree.visitors.append(EnteredNodes(root, told.append))
    counts = []
    for _ in range(3):
        tree.tick()
        counts.append(len(told))
    assert sorted(told) == ["root", "root/first", "root/second"]
    assert counts == [2, 3, 3]


def test_the_log_has_each_beginning_and_end_once() -> None:
    lines: list[tuple[str, dict[str, object]]] = []
    log = SimpleNamespace(info=lambda event, **values: lines.append((event, values)))
    fault = ScheduledFault(PlanningFindsNothing(type="planning_finds_nothing", when=AT_ONE, seconds=2.0), Effect())
    watch = FaultLog([fault], cast(Any, log))
    for now in (0.0, 1.0, 2.0, 3.0, 4.0):
        fault.watch(TriggerState(now))
        watch.finalise()
    assert lines == [
        ("fault began", {"fault": "planning_finds_nothing", "at": 1.0}),
        ("fault ended", {"fault": "planning_finds_nothing", "at": 3.0}),
    ]
