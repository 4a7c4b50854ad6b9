"""Plans a task in a network (`regrasp.interfaces.task_network`) by GTPyhop.

Total-order forward decomposition: tasks are broken down in the order in which they will be done, so that the whole
state is known at each method's condition (Nau et al. 2021, "GTPyhop: A Hierarchical Goal+Task Planner").
"""

import contextlib
import io
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import cache
from typing import Any

from regrasp.interfaces.quote import nearest, quoted
from regrasp.interfaces.task_network import State, TaskNetwork, holds, unmet

MAX_DEPTH = 60  # tasks within tasks; choice: ours have 3


class NoPlanError(ValueError):
    """No method leads from the state to the end of the task."""


class EndlessError(NoPlanError):
    """A task is broken down into itself without an end."""


@dataclass
class Step:
    """A task with the method taken and what it was broken down into, or an action (`method` None)."""

    name: str
    method: str | None = None
    steps: list["Step"] = field(default_factory=list)

    def actions(self) -> Iterator[str]:
        """The actions in their order."""
        if self.method is None:
            yield self.name
        for step in self.steps:
            yield from step.actions()

    def lines(self, indent: int = 0) -> Iterator[str]:
        """The network as text, a line each, indented."""
        done = " (nothing to do)" if self.method is not None and not self.steps else ""
        yield f"{'  ' * indent}{self.name}{'' if self.method is None else f': {self.method}'}{done}"
        for step in self.steps:
            yield from step.lines(indent + 1)


@dataclass(frozen=True)
class Plan:
    """How a task is done from a state on: the network as it was broken down, and its actions."""

    root: Step

    @property
    def actions(self) -> tuple[str, ...]:
        """The actions in their order."""
        return tuple(self.root.actions())


def plan(network: TaskNetwork, state: State, task: str | None = None) -> Plan:
    """The plan of a task, by default the network's goal.

    Raises:
        ValueError: there is no such task, or the state contradicts itself.
        NoPlanError: no method leads there.
        EndlessError: the methods never end.
    """
    task = network.goal if task is None else task
    if task not in network.tasks:
        raise ValueError(f"no task {quoted(task)}; {nearest(task, network.tasks)}")
    if (why := network.contradiction(state)) is not None:
        raise ValueError(f"the state contradicts itself: {why}")
    return _Decomposition(network).plan(dict(state), task)


class _Decomposition:
    """One planning: each try of a method is a step, which knows the step that it is a part of."""

    def __init__(self, network: TaskNetwork) -> None:
        self._network = network
        self._steps: list[tuple[Step, int, int]] = []  # of each try of a method: its parent's number and its place
        self._endless = ""  # a task that lies too deep
        self._refused: dict[str, str] = {}  # why an action could not be done, by its name

    def plan(self, state: dict[str, str], task: str) -> Plan:
        """See `plan` of the module."""
        gtpyhop = _gtpyhop()
        with contextlib.redirect_stdout(io.StringIO()):
            domain = gtpyhop.Domain("network")
            gtpyhop.set_current_domain(domain)
            gtpyhop.declare_actions(*(self._named(name, self._action(name)) for name in self._network.actions))
            for name, methods in self._network.tasks.items():
                tries = [
                    self._named(f"{name}.{method.name}", self._method(name, i)) for i, method in enumerate(methods)
                ]
                gtpyhop.declare_task_methods(name, *tries)
            begin = gtpyhop.State("state")
            begin.values = state
            with gtpyhop.PlannerSession(domain=domain, strategy="recursive_dfs", structured_logging=False) as session:
                found = session.find_plan(begin, [(task, -1, 0, 0)])
        if self._endless:
            raise EndlessError(f"the methods of {quoted(self._endless)} never end: it is broken down into itself")
        if not found.success:
            raise NoPlanError(self._why(task, state))
        return Plan(self._network_of(found.plan))

    def _named(self, name: str, function: Callable[..., Any]) -> Callable[..., Any]:
        function.__name__ = name  # by which GTPyhop knows it
        return function

    def _action(self, name: str) -> Callable[..., Any]:
        action = self._network.actions[name]

        def apply(state: Any, *_: int) -> Any:
            if (variable := unmet(action.needs, state.values)) is not None:
                self._refused.setdefault(name, f"{variable} is {state.values[variable]}")
                return False
            state.values = {**state.values, **action.gives}
            return state

        return apply

    def _method(self, task: str, index: int) -> Callable[..., Any]:
        method = self._network.tasks[task][index]

        def decompose(state: Any, parent: int, place: int, depth: int) -> Any:
            if self._endless or depth > MAX_DEPTH:
                self._endless = self._endless or task
                return False
            if not holds(method.when, state.values):
                return False
            number = len(self._steps)
            self._steps.append((Step(task, method.name), parent, place))
            return [(name, number, i, depth + 1) for i, name in enumerate(method.do)]

        return decompose

    def _network_of(self, actions: list[tuple[Any, ...]]) -> Step:
        """The steps that led to the plan's actions. Of several tries at one place the last one was taken."""
        tries = {(parent, place): number for number, (_, parent, place) in enumerate(self._steps)}
        return self._filled(tries[-1, 0], tries)

    def _filled(self, number: int, tries: Mapping[tuple[int, int], int]) -> Step:
        step, _, _ = self._steps[number]
        method = next(m for m in self._network.tasks[step.name] if m.name == step.method)
        for place, name in enumerate(method.do):
            if name in self._network.actions:
                step.steps.append(Step(name))
            else:
                step.steps.append(self._filled(tries[number, place], tries))
        return step

    def _why(self, task: str, state: State) -> str:
        known = ", ".join(f"{name} is {value}" for name, value in state.items())
        refused = "; ".join(f"{name} cannot be done where {why}" for name, why in self._refused.items())
        return f"no method leads to the end of {task} where {known}" + (f": {refused}" if refused else "")


@cache
def _gtpyhop() -> Any:
    """The library, which greets on stdout when it is imported."""
    with contextlib.redirect_stdout(io.StringIO()):
        import gtpyhop
    return gtpyhop
