"""`regrasp doctor`: what a run needs from this machine, and whether it is there."""

import os
import platform
import sys
from collections.abc import Callable, Iterator
from ctypes.util import find_library
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Literal

from app import output
from app.resources import shipped
from app.scenario_file import load_cell

PACKAGES = ("regrasp", "numpy", "scipy", "pybullet", "py_trees", "ompl", "eaik", "toppra", "numba", "moderngl")
# The libraries that moderngl's EGL context opens, and the Debian package of each.
EGL = {"EGL": "libegl1", "EGL_mesa": "libegl-mesa0", "GL": "libgl1"}
Status = Literal["ok", "slow", "wrong"]  # "slow": a run works, at a price


@dataclass(frozen=True)
class Check:
    """One line of the report: what was looked at, how it stands, and what was seen."""

    name: str
    status: Status
    seen: str


def checks(out: Path = Path("runs")) -> Iterator[Check]:
    """All checks, each as soon as it is done; the last builds a world and takes seconds."""
    yield _python(sys.version_info[:3])
    yield Check("platform", "ok", platform.platform())
    yield from (_package(name) for name in (*PACKAGES, "opencv-python-headless"))
    yield Check("processors", "ok", str(os.cpu_count()))
    yield _output(out)
    yield _egl(find_library)
    yield _world()


def _python(found: tuple[int, int, int]) -> Check:
    text = ".".join(map(str, found))
    return (
        Check("python", "ok", text) if found >= (3, 11, 0) else Check("python", "wrong", f"{text}; take 3.11 or newer")
    )


def _package(name: str) -> Check:
    try:
        return Check(name, "ok", version(name))
    except ImportError:  # PackageNotFoundError is one
        return Check(name, "wrong", "not installed; run make setup")


def _output(out: Path) -> Check:
    wrong = output.findings(out / "doctor")
    return Check("output", "wrong", wrong[0].message) if wrong else Check("output", "ok", f"can write in {out}")


def _egl(find: Callable[[str], str | None]) -> Check:
    missing = [package for library, package in EGL.items() if not find(library)]
    if sys.platform != "linux" or not missing:
        return Check("EGL", "ok", "found")
    wanted = " ".join([*missing, "libgl1-mesa-dri"])
    return Check("EGL", "slow", f"missing, so the slow renderer draws; on Debian: apt-get install {wanted}")


def _world() -> Check:
    """Build the shipped cell's world, which takes all of the above, and say which renderer it got and why."""
    try:
        from sim.world import World

        world = World(load_cell(shipped("cell")["thesis"]), "zero", seed=0)
        seen = world.renderer
        world.close()
    except Exception as error:  # whatever it is, it is what the user must read
        return Check("renderer", "wrong", f"no world can be built: {type(error).__name__}: {error}")
    return Check("renderer", "ok" if seen.name == "moderngl" else "slow", f"{seen.name}, {seen.reason}")
