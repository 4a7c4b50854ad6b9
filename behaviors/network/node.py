"""The node of a tree that plans a task in a network, and does the plan."""

from collections.abc import Iterator
from typing import Any, ClassVar

from py_trees.behaviour import Behaviour
from py_trees.common import Status
from py_trees.composites import Composite
from py_trees.ports import PortsMixin

from regrasp.behaviors.keys import CAUSES
from regrasp.behaviors.leaf import LeafPort, WithServices
from regrasp.behaviors.network.planner import plan
from regrasp.interfaces.cause import Cause, CauseCode


class DoTask(WithServices, PortsMixin, Composite):
    """Plans a task in a network, and ticks the child that bears the name of each action, in the plan's order.

    It keeps a state: what each action gives, corrected by what the robot sees. When an action fails, or the state
    contradicts what the next one needs, it plans again from that state, at most `replans` times. It succeeds when
    nothing is left to do. It fails when there is no plan, or no new one, or when an action has failed for one cause as
    often as its `tries` allow, without a success in between; with the cause of the action that failed.
    """

    INPUT_PORTS: ClassVar[dict[str, Any]] = {
        "network": LeafPort(data_type=str, description="the network: a shipped one's name, or a path to a .yaml file"),
        "task": LeafPort(data_type=str, required=False, default_value="", description="the task, by default the goal"),
        "replans": LeafPort(data_type=int, required=False, default_value=8, least=0, description="new plans at most"),
    }
    OUTPUT_PORTS: ClassVar[dict[str, Any]] = {}

    status: Status
    children: list[Behaviour]
    current_child: Behaviour | None

    def tick(self) -> Iterator[Behaviour]:
        """Tick the child of the action that is under way; see the class."""
        if self.status != Status.RUNNING:
            for child in self.children:
                if child.status is not Status.INVALID:
                    child.stop(Status.INVALID)
            self._begin()
        self.status, child = self.update(), self.current_child
        if self.status != Status.RUNNING:
            self.stop(self.status)
        elif child is not None:
            yield from child.tick()
            if child.status != Status.RUNNING:
                self._ended(child.status)
        yield self

    def _begin(self) -> None:
        self.network = self.services.networks[self.get_input("network")]
        self.state = self.network.start()
        self._children = {self._action_of(child): child for child in self.children}
        self._todo: list[str] = []
        self._why, self._plans = "the task begins", 0
        self._failed: Cause | None = None  # of the action that failed last
        self._failures: list[tuple[str, str]] = []  # actions since their last success, each with its cause's code
        self.current_child = None

    def _action_of(self, child: Behaviour) -> str:
        """A child's own name, which is that of its action. Names are paths from the root on, joined by dots."""
        return str(child.name[len(self.name) + 1 :].partition(".")[0])

    def work(self) -> Status:
        """Choose the child to tick; see `WithServices`."""
        if self.current_child is not None:
            return Status.RUNNING
        self.state |= self._seen()
        if not self._why and self._todo:
            action = self._todo[0]
            if (variable := self.network.unmet(action, self.state)) is not None:
                self._why = f"{variable} is {self.state[variable]}, and {action} needs another"
        if self._why and (status := self._plan()) is not None:
            return status
        if not self._todo:
            return Status.SUCCESS
        self.current_child = self._children[self._todo[0]]
        self.feedback_message = ", ".join(self._todo)
        return Status.RUNNING

    def _plan(self) -> Status | None:
        """Make a new plan; a status if there is none, or the last action has failed too often."""
        if self._failures:
            last, tries = self._failures[-1], self.network.actions[self._failures[-1][0]].tries
            if tries is not None and self._failures.count(last) >= tries:
                return self._give_up(CauseCode.TOO_MANY_TRIES, f"tried {tries} times; {self._why}")
        if self._plans > self.get_input("replans"):
            return self._give_up(CauseCode.TOO_MANY_TRIES, f"planned {self._plans} times; {self._why}")
        try:
            made = plan(self.network, self.state, self.get_input("task") or None)
        except ValueError as error:  # no plan, or the robot sees what cannot be
            return self._give_up(CauseCode.NO_PLAN, str(error))
        self._plans += 1
        self._todo = [*made.actions]
        actions = " ".join(self._todo) or "none"
        self.say("planned", because=self._why, actions=actions, state=dict(self.state), network=[*made.root.lines()])
        self._why = ""
        return None

    def _give_up(self, code: str, message: str) -> Status:
        """Fail: with the cause of the action that failed, if one did."""
        if self._failed is None:
            return self.fail(code, message)
        self.say("no plan", why=message)
        return self.fail_with(self._failed)

    def _ended(self, status: Status) -> None:
        """Note what is the case after an action."""
        action = self.network.actions[name := self._todo[0]]
        self.current_child = None
        if status is Status.SUCCESS:
            self.state |= action.gives
            self._todo.pop(0)
            self._failed = None
            self._failures = [failure for failure in self._failures if failure[0] != name]
            return
        causes: tuple[Cause, ...] = self.read(CAUSES)
        self._failed = causes[-1] if causes else None
        code = "" if self._failed is None else str(self._failed.code)
        self._failures.append((name, code))
        self.state |= action.failed.get(code, {})
        self._why = f"{name} failed with {code}" if code else f"{name} failed"

    def _seen(self) -> dict[str, str]:
        """What the robot sees now of the state, as far as the network asks for it."""
        known = self.network.state
        return {k: v for k, v in self.services.seen(self.state).items() if k in known and v in known[k].values}
