"""Tasks in processes of their own, and Ctrl-C."""

import os
import signal

import pytest

from regrasp.app.interrupts import late_imports
from regrasp.app.run.processes import run_each


def blocked() -> bool:
    return signal.SIGINT in signal.pthread_sigmask(signal.SIG_BLOCK, [])


WHILE_IMPORTED = blocked()


def from_the_start() -> bool:
    return WHILE_IMPORTED


def test_a_child_never_hears_ctrl_c_and_the_parent_does() -> None:
    assert [done.value for done in run_each([from_the_start] * 2, 1)] == [True, True]
    assert not blocked()


def test_ctrl_c_waits_for_an_import() -> None:
    imported = []

    def command() -> None:
        with late_imports():
            os.kill(os.getpid(), signal.SIGINT)
            imported.append("all")

    with pytest.raises(KeyboardInterrupt):
        command()
    assert imported == ["all"]
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
