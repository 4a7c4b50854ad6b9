"""Masses, centres of mass and inertia tensors of a robot's links, from its URDF."""

import xml.etree.ElementTree as ET
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.robot.urdf import pose_of


@dataclass(frozen=True, eq=False)
class LinkInertias:
    """What the links of a `Chain` weigh; the base, link 0, comes first.

    `masses` (n + 1,) kg, `centers` (n + 1, 3) m in the links' frames, `tensors` (n + 1, 3, 3) kg m2 about the centres,
    by the same axes.
    """

    masses: FloatArray
    centers: FloatArray
    tensors: FloatArray


def link_inertias(root: ET.Element, count: int, place: Callable[[str], tuple[int, FloatArray]]) -> LinkInertias:
    """Lump the links of a URDF together by the `count` links of a chain.

    `place` tells, for a URDF's link, the number of the chain's link that moves it and chain_link_from_link (4, 4).
    """
    masses, moments, about_origin = np.zeros(count), np.zeros((count, 3)), np.zeros((count, 3, 3))
    for link in root.findall("link"):
        inertial = link.find("inertial")
        if inertial is None:
            continue
        mass, center, tensor = _read(inertial)
        index, pose = place(str(link.get("name")))
        turn, at = pose[:3, :3], pose[:3, :3] @ center + pose[:3, 3]
        masses[index] += mass
        moments[index] += mass * at
        about_origin[index] += turn @ tensor @ turn.T + _of_point(mass, at)
    centers = moments / np.maximum(masses, 1e-12)[:, None]
    shifts = np.array([_of_point(mass, center) for mass, center in zip(masses, centers, strict=True)])
    return LinkInertias(masses, centers, about_origin - shifts)


def _read(inertial: ET.Element) -> tuple[float, FloatArray, FloatArray]:
    """Mass, centre (3,) and tensor (3, 3) about it, by the axes of the link."""
    origin, mass, inertia = inertial.find("origin"), inertial.find("mass"), inertial.find("inertia")
    xyz, rpy = (
        tuple(map(float, ("0 0 0" if origin is None else origin.get(key, "0 0 0")).split())) for key in ("xyz", "rpy")
    )
    entries = {} if inertia is None else {key: float(value) for key, value in inertia.attrib.items()}
    xx, xy, xz, yy, yz, zz = (entries.get(key, 0.0) for key in ("ixx", "ixy", "ixz", "iyy", "iyz", "izz"))
    pose = pose_of(xyz, rpy)
    turn = pose[:3, :3]
    tensor = turn @ np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]) @ turn.T
    return 0.0 if mass is None else float(mass.get("value", "0")), pose[:3, 3], tensor


def _of_point(mass: float, place: FloatArray) -> FloatArray:
    """Inertia tensor (3, 3) of a point mass about the origin (parallel axis theorem)."""
    return np.asarray(mass * (place @ place * np.eye(3) - np.outer(place, place)))
