"""Key frames of a run: what the cameras saw at its events, as JPEG files in the record, and what was found in them."""

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2

from regrasp.app.records.folders import OUTLINES, PICTURES
from regrasp.interfaces.outline import Outline
from regrasp.interfaces.wall_time import counts_as
from regrasp.sim.world import World


@dataclass(frozen=True)
class PictureParameters:
    """How many pictures are kept."""

    quality: int = 80  # of JPEG, 0 to 100
    every: float = 0.5  # simulated s between two pictures of a camera at events, at least
    longest_gap: float = 2.0  # s without an event after which a picture is kept all the same
    newest: float = 0.1  # s: what was found in a frame so long before still lies about there; choice
    max_bytes: int = 3_000_000  # of all pictures of a run; later ones are left out


class Pictures:
    """Keeps the newest frame of each camera when an event has come, or none for long. Without a folder it does nothing.

    A frame is drawn the same whoever reads it, so no log changes.
    """

    def __init__(
        self, folder: Path | None, world: World[Any], parameters: PictureParameters = PictureParameters()
    ) -> None:
        self._folder, self._world, self._parameters = folder and folder / PICTURES, world, parameters
        self._event, self._urgent = "", False  # urgent: a failure or a warning, of which a picture is always kept
        # Of a camera: its last picture's frame number and second, and the second of its last at an event
        self._taken: dict[str, tuple[int, float, float]] = {}
        self._bytes = 0

    def note(self, values: Mapping[str, Any]) -> None:
        """An event has come."""
        if self._folder is not None and values["level"] != "debug":
            self._event = self._event or str(values["event"])
            self._urgent = self._urgent or values["event"] == "failed" or values["level"] != "info"

    @counts_as("record")
    def take(self, outlines: Callable[[str], Sequence[Outline]] = lambda camera: ()) -> None:
        """After a tick: keep the frames if an event has come in it, or none for long.

        `outlines` tells what was found in a camera's frames.
        """
        now = self._world.now()
        quiet = now - max((at for _, at, _ in self._taken.values()), default=0.0) >= self._parameters.longest_gap
        of_event, event, self._event = bool(self._event), self._event or ("no event" if quiet else ""), ""
        urgent, self._urgent = self._urgent, False
        if not event or self._folder is None:
            return
        for name, camera in self._world.cameras.items():
            number, _, last = self._taken.get(name, (-1, 0.0, float("-inf")))
            frame = camera.latest() if urgent or now - last >= self._parameters.every else None
            if frame is None or frame.number == number:
                continue
            settings = [cv2.IMWRITE_JPEG_QUALITY, self._parameters.quality]
            data = cv2.imencode(".jpg", cv2.cvtColor(frame.rgb, cv2.COLOR_RGB2BGR), settings)[1].tobytes()
            self._taken[name] = frame.number, now, now if of_event else last
            self._bytes += len(data)
            if self._bytes > self._parameters.max_bytes:
                return
            self._folder.mkdir(exist_ok=True)
            words = "".join(letter if letter.isalnum() else "_" for letter in event)[:40]
            file = self._folder / f"{now:07.2f}-{name}-{words}.jpg"
            file.write_bytes(data)
            self._note(
                file.name, [one for one in outlines(name) if abs(frame.stamp - one.stamp) < self._parameters.newest]
            )

    def _note(self, picture: str, found: Sequence[Outline]) -> None:
        """Write down what was found in a picture."""
        assert self._folder is not None
        with (self._folder / OUTLINES).open("a", encoding="utf-8") as file:
            for one in found:
                row = {"picture": picture, "found": one.label, "outline": one.polygon.round(1).tolist()}
                file.write(json.dumps(row) + "\n")
