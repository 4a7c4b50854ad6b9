"""py_trees leaves, one module per state of the task. `LEAVES` is what a tree file may name."""

from behaviors.carry import Carry, Insert
from behaviors.check_cameras import CheckCameras
from behaviors.detect_slip import DetectSlip
from behaviors.holding import Holding
from behaviors.leaf import Leaf
from behaviors.look_closer import LookCloser
from behaviors.monitor import Monitor
from behaviors.recover import MakeRoom, WaitUntilStill
from behaviors.regrasp import Regrasp
from behaviors.safe_stop import SafeStop
from behaviors.spiral_search import SpiralSearch
from behaviors.start_up import StartUp
from behaviors.stow import LetGo, LookAtStow
from behaviors.unplug import Unplug
from behaviors.use_technique import UseTechnique

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
