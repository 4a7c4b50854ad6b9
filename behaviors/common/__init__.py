"""Leaves of every task."""

from regrasp.behaviors.common.keys import CheckKey, SetKey
from regrasp.behaviors.common.log import Log
from regrasp.behaviors.common.safe_stop import SafeStop
from regrasp.behaviors.common.start_up import StartUp
from regrasp.behaviors.common.time import TimeLimit, Wait
from regrasp.behaviors.leaf import WithServices
from regrasp.behaviors.network.node import DoTask

LEAVES: dict[str, type[WithServices]] = {
    leaf.__name__: leaf for leaf in (CheckKey, DoTask, Log, SafeStop, SetKey, StartUp, TimeLimit, Wait)
}
