"""`regrasp doctor`: checks that this machine has what a run needs."""

import os
import platform
import sys
import time
from collections.abc import Callable, Iterator
from ctypes.util import find_library
from dataclasses import dataclass, fields, replace
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from regrasp.app.files.findings import Findings
from regrasp.app.files.resources import shipped
from regrasp.app.records import folders
from regrasp.app.task import find
from regrasp.app.task.part import Part
from regrasp.behaviors.registry import leaf_set
from regrasp.interfaces.plugins import PluginError

if TYPE_CHECKING:
    from regrasp.sim.world import World

PACKAGES = ("regrasp", "numpy", "scipy", "pybullet", "py_trees", "ompl", "eaik", "toppra", "numba", "moderngl")
EGL = {
    "EGL": "libegl1",
    "EGL_mesa": "libegl-mesa0",
}  # Debian package by library; other vendors' drivers do without Mesa
INSTALL = "on Debian: apt-get install libegl1 libegl-mesa0 libgl1-mesa-dri"
SLOW_PICTURE = 0.05  # s; the cameras take 30 pictures a simulated second
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
    yield from (task(name) for name in find.names())
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


def task(name: str) -> Check:
    """Whether the task can be loaded, with its leaves and all its parts."""
    try:
        task = find.task_named(name)
        for field in fields(task):
            if isinstance(part := getattr(task, field.name), Part):
                part()
        leaf_set(name)
    except Findings as error:
        return Check(f"task {name}", "wrong", str(error.items[0]))
    except (PluginError, TypeError, ValueError) as error:
        return Check(f"task {name}", "wrong", f"its leaves cannot be loaded: {error}")
    return Check(f"task {name}", "ok", task.about)


def output_folder(out: Path) -> Check:
    """Whether runs can be written below `out`."""
    wrong = folders.run_folder_findings(out / "doctor")
    return Check("output", "wrong", wrong[0].message) if wrong else Check("output", "ok", f"can write in {out}")


def egl(find: Callable[[str], str | None]) -> Check:
    """Whether `find` finds the libraries that `--renderer moderngl` needs, for a graphics card; a run does without."""
    seen = ", ".join(f"{name} {'found' if find(name) else f'not found ({package})'}" for name, package in EGL.items())
    return Check("EGL libraries", "ok", f"for --renderer moderngl: {seen if find('EGL') else f'{seen}; {INSTALL}'}")


def renderer() -> Check:
    """Build the shipped cell's world, which needs all of the above.

    Says how long a camera's picture takes.
    """
    from regrasp.app.scenario.cell_file import load_cell, tasks_of

    try:
        from regrasp.sim.world import World

        path = next(iter(shipped("cell").values()))
        task = find.task_named(tasks_of(path)[0])
        cell = load_cell(path, task=task)
        world = World(cell, "zero", 0, task.objects()(cell))
        seen, seconds = world.renderer, _picture_seconds(world)
        world.close()
    except Exception as error:  # any error is what the user must read
        return Check("renderer", "wrong", f"no world can be built: {type(error).__name__}: {error}")
    text = f"{seen.name}, {1e3 * seconds:.0f} ms for a picture of a camera; {seen.device}"
    return Check("renderer", "ok" if seconds < SLOW_PICTURE else "slow", text)


def _picture_seconds(world: "World[Any]") -> float:
    """The least wall-clock time of ten pictures of the first camera, each with its shadows drawn anew."""
    camera = next(iter(world.cameras.values()))
    pose, intrinsics, light = camera.true_pose(), camera.spec.intrinsics, world.light
    took = []
    for _ in range(11):  # the first one may be compiled
        start = time.perf_counter()
        world.renderer.render(world.visuals.snapshot(), pose, intrinsics, replace(light))
        took.append(time.perf_counter() - start)
    return min(took[1:])
