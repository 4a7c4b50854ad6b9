"""Digests of all that decides how a run comes out: the scenario, and the program that runs it."""

import hashlib
import json
import os
from collections.abc import Iterable, Iterator
from functools import cache
from importlib.metadata import distributions
from importlib.util import find_spec
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as ET

from regrasp.app.records.result import versions
from regrasp.app.scenario.copies import copies
from regrasp.app.scenario.load import Scenario
from regrasp.interfaces.robot.robot import Robot
from regrasp.interfaces.robot.urdf import RobotError

_LEFT_OUT = {"__pycache__", ".git", "runs", "results"}  # folders that hold no sources
_MADE = (".pyc", ".nbi", ".nbc")  # files that Python and numba make


def program() -> dict[str, str]:
    """What runs a scenario here: versions of packages, and digests of Regrasp and of the packages that put parts in."""
    return {**versions(), **{f"{name} sources": digest for name, digest in sorted(_sources().items())}}


def digest_of(*parts: Any) -> str:
    """A digest of plain values, 32 hexadecimal digits."""
    return hashlib.sha256(json.dumps(parts, sort_keys=True).encode()).hexdigest()[:32]


def scenario_digest(scenario: Scenario) -> str:
    """A digest of a case: its values, its cell with the robots, their URDFs and meshes, and its tree. Not of a seed."""
    robots = [_robot_digest(robot) for robot in _robots(scenario)]
    return digest_of(scenario.name, scenario.case, copies(scenario, 0), robots)


def _robots(scenario: Scenario) -> Iterator[Robot]:
    return (arm.robot for arm in scenario.cell.known.arms)


def _robot_digest(robot: Robot) -> str:
    try:
        root = robot.element()
    except RobotError as error:  # the run will say so
        return str(error)
    for element in root.iter("mesh"):
        if path := element.get("filename"):
            element.set("filename", _file_digest(Path(path)))
    return digest_of(ET.tostring(root, encoding="unicode"))


@cache
def _file_digest(path: Path) -> str:
    try:
        return hashlib.sha256(path.read_bytes()).hexdigest()
    except OSError as error:
        return str(error.strerror)


@cache
def _sources() -> dict[str, str]:
    """The digest of each package whose code a run may execute, by the package's name."""
    points = (point for package in distributions() for point in package.entry_points)
    names = {point.module.partition(".")[0] for point in points if point.group.startswith("regrasp.")}
    return {name: _folders_digest(_places(name)) for name in {"regrasp", *names}}


def _places(package: str) -> list[Path]:
    spec = find_spec(package)
    if spec is None:
        return []
    if spec.submodule_search_locations is not None:
        return [Path(place) for place in spec.submodule_search_locations]
    return [Path(spec.origin)] if spec.origin else []


def _folders_digest(places: Iterable[Path]) -> str:
    digest = hashlib.sha256()
    for place in places:
        for path in _files(place):
            digest.update(json.dumps([str(path.relative_to(place)), _file_digest(path)]).encode())
    return digest.hexdigest()[:32]


def _files(place: Path) -> Iterator[Path]:
    """The files of a package in the order of their names; links to folders are followed, as `regrasp` has them."""
    if place.is_file():
        yield place
    for folder, folders, names in os.walk(place, followlinks=True):
        folders[:] = sorted(name for name in folders if name not in _LEFT_OUT)
        yield from (Path(folder, name) for name in sorted(names) if not name.endswith(_MADE))
