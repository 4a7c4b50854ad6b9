"""Contacts of the arms with what they must not touch."""

from collections.abc import Iterator, Mapping

import pybullet as p

from regrasp.sim.robot.arm import SimArm
from regrasp.sim.robot.model import pad_links

Link = tuple[int, int]  # a body's id and a link's, -1: the base
BodyOrLink = int | Link


class ContactWatch:
    """Notes the largest normal force of each arm against each body that it must not touch.

    `forbidden` gives the names of those bodies and links by their ids; an arm must not touch another one either.
    `grips` are links that belong to what a hand takes hold of: each may be touched by the pads of an arm that both
    touch its other link.
    `peaks` holds the forces in N by "NAME arm - OTHER". `take_recent` tells the forces of late.
    """

    def __init__(
        self, client: int, arms: Mapping[str, SimArm], forbidden: Mapping[BodyOrLink, str], grips: Mapping[Link, Link]
    ) -> None:
        self._client, self._arms, self._grips = client, arms, grips
        self._pads = {name: {arm.links[pad] for pad in pad_links(arm.robot.gripper)} for name, arm in arms.items()}
        self._named: dict[BodyOrLink, str] = {**forbidden, **{arm.body: name for name, arm in arms.items()}}
        self.peaks: dict[str, float] = {}
        self._recent = dict.fromkeys(arms, (0.0, 0.0))

    def look(self) -> None:
        """Look at the contacts of the last step."""
        for name, arm in self._arms.items():
            sums: dict[str, float] = {}
            allowed = 0.0
            touches = [*self._touches(arm)]
            by_pads = {(own, thing) for own, thing, _ in touches if own in self._pads[name]}
            for own, thing, force in touches:
                other = self._named.get(thing[0]) or self._named.get(thing)
                held = own in self._pads[name] and all(
                    (pad, self._grips.get(thing)) in by_pads for pad in self._pads[name]
                )
                if other is None or other == name or held:
                    allowed += force
                else:
                    sums[other] = sums.get(other, 0.0) + force
            for other, force in sums.items():
                key = f"{name} arm - {other}"
                self.peaks[key] = max(self.peaks.get(key, 0.0), force)
            before = self._recent[name]
            self._recent[name] = max(before[0], *sums.values(), 0.0), max(before[1], allowed)

    def _touches(self, arm: SimArm) -> Iterator[tuple[int, Link, float]]:
        """Of each contact of an arm its link, the other body's, and the force (N)."""
        for contact in p.getContactPoints(arm.body, physicsClientId=self._client):
            first, second = (contact[1], contact[3]), (contact[2], contact[4])
            own, other = (first, second) if contact[1] == arm.body else (second, first)
            yield own[1], other, contact[9]

    def take_recent(self, arm: str) -> tuple[float, float]:
        """The largest normal forces of an arm since this was last asked.

        The first is against one of the bodies that it must not touch, the second the sum of its other contacts, N.
        """
        recent, self._recent[arm] = self._recent[arm], (0.0, 0.0)
        return recent
