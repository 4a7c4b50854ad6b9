"""Injects faults into the robot's services, and reports entered nodes to the world, whose faults they may trigger."""

from collections.abc import Callable, Iterable
from typing import Any

import py_trees

from regrasp.behaviors.services import Services
from regrasp.interfaces.cause import CauseCode, ServiceError
from regrasp.interfaces.fault import PlanningFindsNothing, ServiceFault, ServiceRaises
from regrasp.motion.failure import PlanningError
from regrasp.sim.faults.faults import ScheduledFault
from regrasp.trees import node_paths


class EnteredNodes(py_trees.visitors.VisitorBase):
    """A visitor of the tree that calls `notice` with the path of each node when it is first entered."""

    def __init__(self, root: py_trees.behaviour.Behaviour, notice: Callable[[str], None]) -> None:
        super().__init__(full=False)
        self._paths, self._notice = node_paths(root), notice

    def run(self, behaviour: py_trees.behaviour.Behaviour) -> None:
        """At a node's visit."""
        path = self._paths.pop(behaviour.id, None)
        if path is not None:
            self._notice(path)


_WHAT = ("arm", "joint", "camera", "obstacle", "service")  # fields that name what a fault concerns


class FaultLog(py_trees.visitors.VisitorBase):
    """A visitor of the tree that logs when each fault begins and ends."""

    def __init__(self, faults: Iterable[ScheduledFault], log: Any) -> None:
        super().__init__(full=False)
        self._faults, self._log = list(faults), log
        self._told: set[tuple[int, str]] = set()

    def finalise(self) -> None:
        """After a tick."""
        for i, fault in enumerate(self._faults):
            for event, at in (("began", fault.began_at), ("ended", fault.ended_at)):
                if at is not None and (i, event) not in self._told:
                    self._told.add((i, event))
                    what = {name: getattr(fault.spec, name) for name in _WHAT if hasattr(fault.spec, name)}
                    self._log.info(f"fault {event}", fault=fault.spec.type, **what, at=round(at, 4))


def break_services(services: Services, faults: Iterable[ScheduledFault], now: Callable[[], float]) -> None:
    """Wrap the calls that the software faults concern: while a fault is active, its call raises."""
    for fault in faults:
        spec = fault.spec
        if isinstance(spec, ServiceRaises):
            part, name = spec.service.split(".")
            owner = getattr(services, part)
            error: Exception = ServiceError(f"{spec.service} broke off")
        elif isinstance(spec, PlanningFindsNothing):
            owner, name = services.motion, "planner"
            error = PlanningError(CauseCode.PLANNING_FAILED, "the planner found no way")
        else:
            continue
        setattr(owner, name, _breaking(getattr(owner, name), fault, spec, error, now))


def _breaking(
    call: Callable[..., Any], fault: ScheduledFault, spec: ServiceFault, error: Exception, now: Callable[[], float]
) -> Callable[..., Any]:
    broken = 0

    def answer(*args: Any, **kwargs: Any) -> Any:
        nonlocal broken
        if not fault.active:
            return call(*args, **kwargs)
        broken += 1
        if broken == spec.calls:
            fault.end(now())
        raise error

    return answer
