"""`regrasp doctor`: checks that this machine has what a run needs."""

import os
import platform
import sys
from collections.abc import Callable, Iterator
from ctypes.util import find_library
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Literal

from regrasp.app.files.resources import shipped
from regrasp.app.records import folders

PACKAGES = ("regrasp", "numpy", "scipy", "pybullet", "py_trees", "ompl", "eaik", "toppra", "numba", "moderngl")
EGL = {
    "EGL": "libegl1",
    "EGL_mesa": "libegl-mesa0",
}  # Debian package by library; other vendors' drivers do without Mesa
INSTALL = "on Debian: apt-get install libegl1 libegl-mesa0 libgl1-mesa-dri"
Status = Literal["ok", "slow", "wrong"]  # "slow": a run works, but renders slowly


@dataclass(frozen=True)
class Check:
    """One line of the report: what was checked, its status, and what was found."""

    name: str
    status: Status
    seen: str


def checks(out: Path = Path("runs")) -> Iterator[Check]:
    """All checks, each yielded as soon as it is done; the last one builds a world and takes seconds."""
    yield python(sys.version_info[:3])
    yield Check("platform", "ok", platform.platform())
    yield from (package(name) for name in (*PACKAGES, "opencv-python-headless"))
    yield Check("processors", "ok", str(os.cpu_count()))
    yield output_folder(out)
    yield egl(find_library)
    yield renderer()


def python(found: tuple[int, int, int]) -> Check:
    """Whether this Python is new enough."""
    text = ".".join(map(str, found))
    return (
        Check("python", "ok", text) if found >= (3, 11, 0) else Check("python", "wrong", f"{text}; take 3.11 or newer")
    )


def package(name: str) -> Check:
    """Whether the package is installed."""
    try:
        return Check(name, "ok", version(name))
    except ImportError:  # PackageNotFoundError is one
        return Check(name, "wrong", "not installed; run make setup")


def output_folder(out: Path) -> Check:
    """Whether runs can be written below `out`."""
    wrong = folders.run_folder_findings(out / "doctor")
    return Check("output", "wrong", wrong[0].message) if wrong else Check("output", "ok", f"can write in {out}")


def egl(find: Callable[[str], str | None]) -> Check:
    """Whether `find` finds the libraries for an OpenGL context without a window."""
    seen = ", ".join(f"{name} {'found' if find(name) else f'not found ({package})'}" for name, package in EGL.items())
    return Check("EGL libraries", "ok" if find("EGL") else "slow", seen)


def renderer() -> Check:
    """Build the shipped cell's world, which needs all of the above; says which renderer it got, and why."""
    from regrasp.app.scenario.cell_file import load_cell

    try:
        from regrasp.sim.world import World

        world = World(load_cell(shipped("cell")["thesis"]), "zero", seed=0)
        seen = world.renderer
        world.close()
    except Exception as error:  # any error is what the user must read
        return Check("renderer", "wrong", f"no world can be built: {type(error).__name__}: {error}")
    if seen.name == "moderngl":
        return Check("renderer", "ok", f"moderngl, {seen.reason}")
    return Check("renderer", "slow", f"{seen.name}, {seen.reason}; {INSTALL}")
