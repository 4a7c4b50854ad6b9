"""The services, the devices and their stand-ins in tests against the protocols: they have the same members."""

import inspect
from dataclasses import fields, is_dataclass
from typing import TYPE_CHECKING, Any

import fake_devices
import fake_services
import pytest

from regrasp.interfaces.cable.services import CableMotionService, CablePerceptionService, GripService
from regrasp.interfaces.devices import Arm, Clock, Gripper
from regrasp.interfaces.services import MotionService, PerceptionService, StillnessService
from regrasp.motion.cable.socket_motion import SocketMotion
from regrasp.motion.grasping.gap_test import GripWatch
from regrasp.motion.service import Motion
from regrasp.perception.cable.service import CablePerception
from regrasp.perception.service import Perception, StillnessWatch

PAIRS: list[tuple[type[Any], type[Any]]] = [
    (MotionService, Motion),
    (CableMotionService, SocketMotion),
    (CableMotionService, fake_services.FakeMotion),
    (PerceptionService, Perception),
    (CablePerceptionService, CablePerception),
    (CablePerceptionService, fake_services.FakePerception),
    (GripService, GripWatch),
    (StillnessService, StillnessWatch),
    (StillnessService, fake_services.FakeStillness),
    (Clock, fake_services.Clock),
    (Clock, fake_devices.Clock),
    (Arm, fake_devices.FakeArm),
    (Gripper, fake_devices.FakeGripper),
    (Gripper, fake_services.FakeGripper),
]


def members(protocol: type[Any]) -> dict[str, Any]:
    """What a protocol asks for, by name: a function, a property, or None for an attribute."""
    found: dict[str, Any] = {}
    for base in protocol.__mro__:
        if getattr(base, "_is_protocol", False):
            found = dict.fromkeys(vars(base).get("__annotations__", {})) | found
            found |= {n: m for n, m in vars(base).items() if not n.startswith("_") and n not in found}
    return found


def shape(function: Any) -> list[tuple[str, Any, Any]]:
    """Names, kinds and defaults of a function's parameters."""
    return [(p.name, p.kind, p.default) for p in inspect.signature(function).parameters.values()]


@pytest.mark.parametrize(("protocol", "real"), PAIRS, ids=lambda part: part.__module__ + "." + part.__name__)
def test_a_class_has_what_its_protocol_asks_for(protocol: type[Any], real: type[Any]) -> None:
    asked = members(protocol)
    assert asked
    attributes = {f.name for f in fields(real)} if is_dataclass(real) else set()
    for name, member in asked.items():
        if inspect.isfunction(member):
            own = inspect.getattr_static(real, name)
            assert inspect.isfunction(own), name
            assert shape(own) == shape(member), name
        else:
            assert hasattr(real, name) or name in attributes, name


def test_a_signature_that_differs_is_noticed() -> None:
    class Drifted:
        def still(self, camera: str) -> bool | None:
            return None

    with pytest.raises(AssertionError, match="still"):
        test_a_class_has_what_its_protocol_asks_for(StillnessService, Drifted)


if TYPE_CHECKING:  # and mypy sees that the types agree, too

    def _motion(motion: Motion, cable: SocketMotion, fake: fake_services.FakeMotion) -> tuple[MotionService, ...]:
        both: tuple[CableMotionService, CableMotionService] = (cable, fake)
        return (motion, *both)

    def _perception(
        eyes: Perception, cable: CablePerception, fake: fake_services.FakePerception
    ) -> tuple[PerceptionService, ...]:
        both: tuple[CablePerceptionService, CablePerceptionService] = (cable, fake)
        return (eyes, *both)

    def _devices(
        clocks: tuple[fake_devices.Clock, fake_services.Clock],
        arm: fake_devices.FakeArm,
        grippers: tuple[fake_devices.FakeGripper, fake_services.FakeGripper],
    ) -> tuple[tuple[Clock, Clock], Arm, tuple[Gripper, Gripper]]:
        return clocks, arm, grippers
