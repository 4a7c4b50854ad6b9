"""Leaves of the behaviour trees (py_trees), and our own decorators. A tree file may name the `LEAVES`."""

from regrasp.behaviors.cable.carry import Carry, Insert
from regrasp.behaviors.cable.detect_slip import DetectSlip
from regrasp.behaviors.cable.look_closer import LookCloser
from regrasp.behaviors.cable.monitor import Monitor
from regrasp.behaviors.cable.recover import MakeRoom, WaitUntilStill
from regrasp.behaviors.cable.regrasp import Regrasp
from regrasp.behaviors.cable.spiral_search import SpiralSearch
from regrasp.behaviors.cable.stow import LetGo, LookAtStow
from regrasp.behaviors.cable.unplug import Unplug
from regrasp.behaviors.common.check_cameras import CheckCameras
from regrasp.behaviors.common.holding import Holding
from regrasp.behaviors.common.keys import CheckKey, SetKey
from regrasp.behaviors.common.log import Log
from regrasp.behaviors.common.safe_stop import SafeStop
from regrasp.behaviors.common.start_up import StartUp
from regrasp.behaviors.common.time import TimeLimit, Wait
from regrasp.behaviors.common.use_technique import UseTechnique
from regrasp.behaviors.leaf import Leaf, WithServices

LEAVES: dict[str, type[WithServices]] = {
    leaf.__name__: leaf
    for leaf in (
        Carry,
        CheckCameras,
        CheckKey,
        DetectSlip,
        Holding,
        Insert,
        LetGo,
        Log,
        LookAtStow,
        LookCloser,
        MakeRoom,
        Monitor,
        Regrasp,
        SafeStop,
        SetKey,
        SpiralSearch,
        StartUp,
        TimeLimit,
        Unplug,
        UseTechnique,
        Wait,
        WaitUntilStill,
    )
}

__all__ = ["LEAVES", "Leaf"]
