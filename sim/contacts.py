"""Contacts of the arms with what they must not touch."""

from collections.abc import Mapping

import pybullet as p

from regrasp.sim.robot.arm import SimArm

BodyOrLink = int | tuple[int, int]  # a body's id, or that and a link (-1: the base)


class ContactWatch:
    """Notes the largest normal force of each arm against each body that it must not touch.

    `forbidden` gives the names of those bodies and links by their ids; an arm must not touch another one either.
    `peaks` holds the forces in N by "NAME arm - OTHER". `take_recent` tells the forces of late.
    """

    def __init__(self, client: int, arms: Mapping[str, SimArm], forbidden: Mapping[BodyOrLink, str]) -> None:
        self._client, self._arms = client, arms
        self._named: dict[BodyOrLink, str] = {**forbidden, **{arm.body: name for name, arm in arms.items()}}
        self.peaks: dict[str, float] = {}
        self._recent = dict.fromkeys(arms, (0.0, 0.0))

    def look(self) -> None:
        """Look at the contacts of the last step."""
        for name, arm in self._arms.items():
            sums: dict[str, float] = {}
            allowed = 0.0
            for contact in p.getContactPoints(arm.body, physicsClientId=self._client):
                body, link = (contact[2], contact[4]) if contact[1] == arm.body else (contact[1], contact[3])
                other = self._named.get(body) or self._named.get((body, link))
                if other is not None and other != name:
                    sums[other] = sums.get(other, 0.0) + contact[9]
                else:
                    allowed += contact[9]
            for other, force in sums.items():
                key = f"{name} arm - {other}"
                self.peaks[key] = max(self.peaks.get(key, 0.0), force)
            before = self._recent[name]
            self._recent[name] = max(before[0], *sums.values(), 0.0), max(before[1], allowed)

    def take_recent(self, arm: str) -> tuple[float, float]:
        """The largest normal forces of an arm since this was last asked.

        The first is against one of the bodies that it must not touch, the second the sum of its other contacts, N.
        """
        recent, self._recent[arm] = self._recent[arm], (0.0, 0.0)
        return recent
