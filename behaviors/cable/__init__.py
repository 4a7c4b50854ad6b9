"""Leaves of the cable task."""

from regrasp.behaviors.cable.carry import Carry, Insert
from regrasp.behaviors.cable.check_cameras import CheckCameras
from regrasp.behaviors.cable.detect_slip import DetectSlip
from regrasp.behaviors.cable.holding import Holding
from regrasp.behaviors.cable.look_closer import LookCloser
from regrasp.behaviors.cable.monitor import Monitor
from regrasp.behaviors.cable.recover import MakeRoom, WaitUntilStill
from regrasp.behaviors.cable.regrasp import Regrasp
from regrasp.behaviors.cable.replug import CarryToSocket, CheckSocket, LetGoOfPlug, LookAtPlug, Replug
from regrasp.behaviors.cable.spiral_search import SpiralSearch
from regrasp.behaviors.cable.stow import LetGo, LookAtStow
from regrasp.behaviors.cable.unplug import Unplug
from regrasp.behaviors.cable.use_technique import UseTechnique
from regrasp.behaviors.leaf import WithServices

LEAVES: dict[str, type[WithServices]] = {
    leaf.__name__: leaf
    for leaf in (
        Carry,
        CarryToSocket,
        CheckCameras,
        CheckSocket,
        DetectSlip,
        Holding,
        Insert,
        LetGo,
        LetGoOfPlug,
        LookAtPlug,
        LookAtStow,
        LookCloser,
        MakeRoom,
        Monitor,
        Regrasp,
        Replug,
        SpiralSearch,
        Unplug,
        UseTechnique,
        WaitUntilStill,
    )
}
