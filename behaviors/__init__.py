"""py_trees leaves, one module per state of the task. `LEAVES` is what a tree file may name."""

from regrasp.behaviors.carry import Carry, Insert
from regrasp.behaviors.check_cameras import CheckCameras
from regrasp.behaviors.detect_slip import DetectSlip
from regrasp.behaviors.holding import Holding
from regrasp.behaviors.leaf import Leaf
from regrasp.behaviors.look_closer import LookCloser
from regrasp.behaviors.monitor import Monitor
from regrasp.behaviors.recover import MakeRoom, WaitUntilStill
from regrasp.behaviors.regrasp import Regrasp
from regrasp.behaviors.safe_stop import SafeStop
from regrasp.behaviors.spiral_search import SpiralSearch
from regrasp.behaviors.start_up import StartUp
from regrasp.behaviors.stow import LetGo, LookAtStow
from regrasp.behaviors.unplug import Unplug
from regrasp.behaviors.use_technique import UseTechnique

LEAVES: dict[str, type[Leaf]] = {
    leaf.__name__: leaf
    for leaf in (
        Carry,
        CheckCameras,
        DetectSlip,
        Holding,
        Insert,
        LetGo,
        LookAtStow,
        LookCloser,
        MakeRoom,
        Monitor,
        Regrasp,
        SafeStop,
        SpiralSearch,
        StartUp,
        Unplug,
        UseTechnique,
        WaitUntilStill,
    )
}

__all__ = ["LEAVES", "Leaf"]
