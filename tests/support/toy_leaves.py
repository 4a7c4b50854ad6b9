"""Leaves for tree files in tests."""

from typing import Any, ClassVar

import py_trees
from py_trees.common import Status
from py_trees.ports import BehaviourWithPorts, PortInformation

from regrasp.behaviors.keys import Key, WithKeys

Ports = dict[str, PortInformation]


class _Leaf(BehaviourWithPorts):  # type: ignore[misc]
    """py_trees is untyped to mypy here; said once."""


class ToyWait(_Leaf):
    """Succeeds at its nth tick."""

    INPUT_PORTS: ClassVar[Ports] = {"ticks": PortInformation(data_type=int)}
    OUTPUT_PORTS: ClassVar[Ports] = {}

    def setup(self, **kwargs: Any) -> None:
        self.services = kwargs

    def initialise(self) -> None:
        self.count = 0

    def update(self) -> Status:
        self.count += 1
        return Status.SUCCESS if self.count >= self.get_input("ticks") else Status.RUNNING


class ToyFail(_Leaf):
    INPUT_PORTS: ClassVar[Ports] = {}
    OUTPUT_PORTS: ClassVar[Ports] = {}

    def update(self) -> Status:
        return Status.FAILURE


class ToyLook(_Leaf):
    INPUT_PORTS: ClassVar[Ports] = {
        "angle": PortInformation(data_type=float, default_value=0.5),
        "camera": PortInformation(data_type=str),
    }
    OUTPUT_PORTS: ClassVar[Ports] = {"place": PortInformation(data_type=float, required=False)}

    def update(self) -> Status:
        self._set_output("place", 2 * self.get_input("angle"))
        return Status.SUCCESS


class ToyGo(_Leaf):
    INPUT_PORTS: ClassVar[Ports] = {"place": PortInformation(data_type=float)}
    OUTPUT_PORTS: ClassVar[Ports] = {}

    def update(self) -> Status:
        self.went_to = self.get_input("place")
        return Status.SUCCESS


class ToySay(_Leaf):
    INPUT_PORTS: ClassVar[Ports] = {}
    OUTPUT_PORTS: ClassVar[Ports] = {"word": PortInformation(data_type=str, default_value="yes")}

    def update(self) -> Status:
        return Status.SUCCESS


class ToyHear(_Leaf):
    INPUT_PORTS: ClassVar[Ports] = {"word": PortInformation(data_type=str)}
    OUTPUT_PORTS: ClassVar[Ports] = {}

    def update(self) -> Status:
        self.heard = self.get_input("word")
        return Status.SUCCESS


class ToyTell(_Leaf):
    INPUT_PORTS: ClassVar[Ports] = {"words": PortInformation(data_type=str)}
    OUTPUT_PORTS: ClassVar[Ports] = {}

    def update(self) -> Status:
        return Status.SUCCESS


class ToySeen(_Leaf):
    """A condition: it answers at once."""

    INPUT_PORTS: ClassVar[Ports] = {}
    OUTPUT_PORTS: ClassVar[Ports] = {}
    RETURNS = frozenset({Status.SUCCESS, Status.FAILURE})

    def update(self) -> Status:
        return Status.SUCCESS


WIDTH: Key[float] = Key("toy/width", "width of what the hand holds, m")
GRASPS: Key[int] = Key("toy/grasps", "grasps so far", default=0)


class ToyGrip(WithKeys, _Leaf):
    """Takes hold of something."""

    INPUT_PORTS: ClassVar[Ports] = {}
    OUTPUT_PORTS: ClassVar[Ports] = {}
    READS = (GRASPS,)
    WRITES = (WIDTH, GRASPS)

    def update(self) -> Status:
        self.write(WIDTH, 0.04)
        self.write(GRASPS, self.read(GRASPS) + 1)
        return Status.SUCCESS


class ToyPull(WithKeys, _Leaf):
    INPUT_PORTS: ClassVar[Ports] = {}
    OUTPUT_PORTS: ClassVar[Ports] = {}
    NEEDS = (WIDTH,)

    def update(self) -> Status:
        self.read(WIDTH)
        return Status.SUCCESS


class ToyRegrip(ToyPull):
    """Needs what it writes."""

    WRITES = (WIDTH,)
    RETURNS = frozenset({Status.SUCCESS})


class ToyDrop(WithKeys, _Leaf):
    INPUT_PORTS: ClassVar[Ports] = {}
    OUTPUT_PORTS: ClassVar[Ports] = {}
    WRITES = (WIDTH,)

    def update(self) -> Status:
        self.clear(WIDTH)
        return Status.SUCCESS


KEY_LEAVES: dict[str, type[py_trees.behaviour.Behaviour]] = {
    "Grip": ToyGrip,
    "Pull": ToyPull,
    "Regrip": ToyRegrip,
    "Drop": ToyDrop,
}

LEAVES: dict[str, type[py_trees.behaviour.Behaviour]] = {
    "Wait": ToyWait,
    "Fail": ToyFail,
    "Look": ToyLook,
    "Go": ToyGo,
    "Say": ToySay,
    "Hear": ToyHear,
    "Tell": ToyTell,
    "Seen": ToySeen,
}

GOOD = """\
<root main_tree_to_execute="Main">
  <BehaviorTree ID="Main">
    <Sequence name="root" memory="true">
      <SubTree ID="Search" name="search" place="{place}" tries="2"/>
      <Parallel name="carry" policy="success_on_one">
        <Wait name="watch" ticks="99"/>
        <Wait name="move" ticks="2"/>
      </Parallel>
      <Go name="go" place="{place}"/>
    </Sequence>
  </BehaviorTree>
  <BehaviorTree ID="Search" camera="rear" tries="9">
    <Retry name="again" num_failures="{tries}">
      <Fallback name="either" memory="false">
        <Inverter name="not_yet"><Wait name="blink" ticks="1"/></Inverter>
        <Look name="look" angle="0.25" camera="{camera}" place="{place}"/>
      </Fallback>
    </Retry>
  </BehaviorTree>
</root>
"""
