import sys
import threading
from functools import partial
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import cv2
import numpy as np
import pytest

from regrasp.app.run import film as film_module
from regrasp.app.run.film import Film, FilmParameters
from regrasp.app.run.video import OVERVIEW_SIZE, SIZE
from regrasp.interfaces.cell import FixedMount
from regrasp.sim.world import World

TICK = 0.05


def a_world() -> Any:
    """As much of a world as a film looks at: it turns from black to green over two seconds."""
    world = SimpleNamespace(t=0.0, gravity="zero", light=None)
    world.now = lambda: world.t
    world.visuals = SimpleNamespace(deferred_snapshot=lambda: partial(float, world.t))
    world.cameras = {name: SimpleNamespace(deferred_preview=lambda shrink: None) for name in ("rear", "wrist")}
    world.renderer = SimpleNamespace(name="toy")
    world.cell = SimpleNamespace(viewpoint=FixedMount(position=(0.0, 0.0, 0.0), pitch_down_deg=0.0))
    return world


class ToyRenderer:
    """Poses are a second here."""

    def __init__(self, *_: Any) -> None:
        self.thread = threading.get_ident()

    def render_color(self, second: Any, _pose: Any, intrinsics: Any, _light: Any) -> Any:
        if second > 100:
            raise ZeroDivisionError
        rgb = np.zeros((intrinsics.height, intrinsics.width, 3), np.uint8)
        rgb[..., 1] = min(255, int(100 * second))
        return rgb

    def close(self) -> None:
        assert threading.get_ident() == self.thread


@pytest.fixture(autouse=True)
def _toy_renderer(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(film_module, "make_renderer", ToyRenderer)


def green(path: Path) -> list[float]:
    """Mean green of the overview in each frame."""
    video, found = cv2.VideoCapture(str(path)), []
    while (read := video.read())[0]:
        assert read[1].shape == (SIZE[1], SIZE[0], 3)
        found.append(float(read[1][: OVERVIEW_SIZE[1], : OVERVIEW_SIZE[0], 1].mean()))
    return found


def test_two_seconds_give_frames_at_the_films_rate_in_their_order(tmp_path: Path) -> None:
    world = a_world()
    with Film(tmp_path / "video.mp4", cast(World[Any], world)) as film:
        for i in range(round(2.0 / TICK)):
            world.t = i * TICK
            film.show("carry")
            film.show("carry")  # the same instant once more
    shades = green(tmp_path / "video.mp4")
    assert len(shades) == 2 * FilmParameters().rate
    assert shades == sorted(shades)
    assert shades[-1] == pytest.approx(190, abs=8)


def test_a_film_cut_short_by_an_error_can_be_seen(tmp_path: Path) -> None:
    world = a_world()
    film = Film(tmp_path / "video.mp4", cast(World[Any], world)).__enter__()
    film.show("carry")
    film.__exit__(ZeroDivisionError, ZeroDivisionError(), None)
    assert len(green(tmp_path / "video.mp4")) == 1


def test_without_a_path_nothing_is_drawn(tmp_path: Path) -> None:
    world = a_world()
    del world.renderer
    threads = threading.active_count()
    with Film(None, cast(World[Any], world)) as film:
        film.show("carry")
        assert threading.active_count() == threads
    assert list(tmp_path.iterdir()) == []


def test_an_error_while_drawing_is_raised_once_and_leaves_nothing_behind(tmp_path: Path) -> None:
    world, threads, interval = a_world(), threading.active_count(), sys.getswitchinterval()
    film = Film(tmp_path / "video.mp4", cast(World[Any], world)).__enter__()
    film.show("carry")
    world.t = 101.0
    film.show("carry")
    film.show("carry")
    with pytest.raises(ZeroDivisionError):
        film.finish()
    film.__exit__(None, None, None)
    assert threading.active_count() == threads
    assert sys.getswitchinterval() == interval
    assert len(green(tmp_path / "video.mp4")) == 1
