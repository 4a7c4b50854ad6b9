"""The simulated world: engine, scene, arms, cameras and their noise, tasks' objects, faults, ground truth."""

import contextlib
import os


def _import_quietly() -> None:
    """Import PyBullet for the first time, without the line that its C code prints on standard error."""
    with contextlib.ExitStack() as stack:
        with contextlib.suppress(OSError):  # standard error may be closed
            kept, null = os.dup(2), os.open(os.devnull, os.O_WRONLY)
            stack.callback(os.close, kept)
            stack.callback(os.dup2, kept, 2)
            os.dup2(null, 2)
            os.close(null)
        import pybullet  # noqa: F401


_import_quietly()
