"""Which pictures a run keeps."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np

from regrasp.app.run.pictures import Pictures


class Watched:
    """A world with one camera, whose clock is set."""

    seconds = 0.0

    def __init__(self) -> None:
        self.cameras = {"hand": self}

    def now(self) -> float:
        return self.seconds

    def latest(self) -> Any:
        return SimpleNamespace(number=round(30 * self.seconds), stamp=self.seconds, rgb=np.zeros((4, 4, 3), np.uint8))


def test_a_picture_without_an_event_does_not_keep_out_that_of_an_event_soon_after(tmp_path: Path) -> None:
    world: Any = Watched()
    pictures = Pictures(tmp_path, world)
    for tick in range(90):
        world.seconds = 0.05 * tick
        if tick in (45, 50, 60):  # 2.25, 2.50 and 3 s
            pictures.note({"event": f"saw {tick}", "level": "info"})
        pictures.take()
    names = sorted(file.name for file in (tmp_path / "pictures").glob("*.jpg"))
    assert names == ["0002.00-hand-no_event.jpg", "0002.25-hand-saw_45.jpg", "0003.00-hand-saw_60.jpg"]
