"""Spheres, cover and pairs for a robot file, worked out from its meshes."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase

import numpy as np

from regrasp.app.robots.cover import LinkMeasure, group_spheres, measure_cover, own_spheres, rigid_groups
from regrasp.app.robots.meshes import surfaces
from regrasp.app.robots.self_collision import Pair, meeting_pairs, with_spheres
from regrasp.app.robots.spheres import FitParameters, fit_spheres
from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.robot.robot import Robot

_A_LINE = 3  # spheres, so that a line of the file has less than 120 characters


@dataclass(frozen=True)
class Margins:
    """How far spheres may stand out, m: `general`, and of links by patterns such as `gripper_*`, the last that fits."""

    general: float = 0.02
    of_links: tuple[tuple[str, float], ...] = ()

    def of(self, link: str) -> float:
        """The margin of a link."""
        return next((m for pattern, m in reversed(self.of_links) if fnmatchcase(link, pattern)), self.general)


@dataclass(frozen=True, eq=False)
class Proposal:
    """Spheres (n, 4) m of the fitted links, the pairs of all links that can meet, and the measured cover."""

    spheres: dict[str, FloatArray]
    margins: Margins
    pairs: list[Pair]
    measures: list[LinkMeasure]


def propose(
    robot: Robot, margins: Margins, patterns: Sequence[str] = (), tell: Callable[[str], None] = lambda _: None
) -> Proposal:
    """Fit spheres to the links that a pattern names (without patterns: to all); other links keep theirs.

    Raises RobotError: the file of a mesh is missing.
    """
    geometry = surfaces(robot.element())
    wanted = [link for link in geometry if not patterns or any(fnmatchcase(link, p) for p in patterns)]
    done = {link: rows for link, rows in own_spheres(robot).items() if link not in wanted}
    for group in rigid_groups(robot):
        for link in (link for link in group if link in wanted):
            there = group_spheres(robot, link, group, done)
            fitted = fit_spheres(geometry[link], FitParameters(margin=margins.of(link)), there)
            tell(f"{link}: {len(fitted)} spheres")
            done |= {link: fitted} if len(fitted) else {}
    done = {link: done[link] for link in robot.tree.links if link in done}
    changed = with_spheres(robot, done)
    fitted_ones = {link: rows for link, rows in done.items() if link in wanted}
    return Proposal(fitted_ones, margins, meeting_pairs(changed), measure_cover(changed))


def as_yaml(proposal: Proposal) -> str:
    """The proposal as sections of a robot file."""
    lines = [*_cover_lines(proposal), "self_collision:", *(f"  - [{a}, {b}]" for a, b in proposal.pairs)]
    if not proposal.pairs:
        lines[-1] += " []"
    lines.append("spheres: # x, y, z, radius in m")
    for link, rows in proposal.spheres.items():
        lines += [f"  {link}: [", *_rows(rows), "  ]"]
    return "\n".join(lines) + "\n"


def table(measures: Sequence[LinkMeasure]) -> list[str]:
    """The measured cover of each link, a line each, and the sum of the spheres."""
    width = max((len(m.link) for m in measures), default=4)
    lines = [f"{'link':<{width}}  spheres  outside mm  excess mm"]
    for m in measures:
        lines.append(f"{m.link:<{width}}  {m.spheres:>7}  {_mm(m.outside):>10}  {_mm(m.excess):>9}")
    return [*lines, f"{'all':<{width}}  {sum(m.spheres for m in measures):>7}"]


def _mm(value: float | None) -> str:
    return "-" if value is None else f"{max(1000 * value, 0.0):.1f}"


def _cover_lines(proposal: Proposal) -> list[str]:
    """The promise that holds by how spheres are fitted."""
    general, links = proposal.margins.general, list(proposal.spheres)
    others: Mapping[str, float] = {link: proposal.margins.of(link) for link in links}
    lines = ["cover: # m", "  outside: 0.0", f"  excess: {general:g}"]
    differ = [f"    {link}: {{excess: {margin:g}}}" for link, margin in others.items() if margin != general]
    return [*lines, *(["  links:"] if differ else []), *differ]


def _rows(rows: FloatArray) -> list[str]:
    words = ["[" + ", ".join(f"{value:.4g}" for value in np.round(row, 4) + 0.0) + "]," for row in rows]
    return ["    " + " ".join(words[i : i + _A_LINE]) for i in range(0, len(words), _A_LINE)]
