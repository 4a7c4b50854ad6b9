import os
import signal
import subprocess
import sys
import textwrap
from pathlib import Path

import cv2
import numpy as np
import pytest

from regrasp.app.run.video import OVERVIEW_SIZE, SIZE, RgbImage, VideoWriter, _drop_cut_box, compose


def image(width: int, height: int, color: tuple[int, int, int]) -> RgbImage:
    return np.full((height, width, 3), color, np.uint8)


def colors(path: Path) -> list[tuple[int, int, int]]:
    """Mean RGB of each frame."""
    video = cv2.VideoCapture(str(path))
    found = []
    while (read := video.read())[0]:
        b, g, r = read[1].reshape(-1, 3).mean(axis=0).round().astype(int).tolist()
        found.append((r, g, b))
    return found


def test_each_picture_has_its_place() -> None:
    frame = compose(
        image(*OVERVIEW_SIZE, (200, 0, 0)),
        [("rear", image(848, 480, (0, 200, 0))), ("wrist", image(848, 480, (0, 0, 200)))],
        ["look"],
    )
    assert frame.shape == (SIZE[1], SIZE[0], 3)
    assert tuple(frame[240, 400]) == (200, 0, 0)
    assert tuple(frame[120, 1100]) == (0, 200, 0)
    assert tuple(frame[360, 1100]) == (0, 0, 200)


def test_text_has_contrast_in_the_band_and_on_the_pictures() -> None:
    white = image(848, 480, (255, 255, 255))
    frame = compose(white, [("rear", white), ("wrist", None)], ["look  12.3 s", "phase", "tall_obstacle", "seed 3"])
    for part in (frame[480:, :600], frame[480:, 640:], frame[4:24, 860:980]):
        assert int(part.max()) - int(part.min()) > 150
    bare = compose(white, [("rear", white), ("wrist", None)], [])
    assert not np.array_equal(frame, bare)


def test_other_shapes_are_fitted_and_missing_pictures_left_dark() -> None:
    frame = compose(image(100, 400, (200, 0, 0)), [("rear", None), ("wrist", image(64, 48, (0, 0, 200)))], ["ü" * 300])
    assert tuple(frame[240, OVERVIEW_SIZE[0] // 2]) == (200, 0, 0)
    assert tuple(frame[240, 100]) == tuple(frame[120, 1100]) == (24, 24, 24)


def test_the_film_plays_back(tmp_path: Path) -> None:
    shown = [(200, 30, 30), (30, 200, 30), (30, 30, 200)]
    with VideoWriter(tmp_path / "v.mp4", 20, (64, 48)) as video:
        for color in shown:
            video.write(image(64, 48, color))
    assert np.allclose(colors(tmp_path / "v.mp4"), shown, atol=12)


def test_a_frame_of_another_shape_is_refused(tmp_path: Path) -> None:
    with VideoWriter(tmp_path / "v.mp4", 20, (64, 48)) as video:
        with pytest.raises(ValueError, match=r"\(48, 64, 3\)"):
            video.write(image(48, 64, (0, 0, 0)))
        video.write(image(64, 48, (0, 0, 0)))


def test_a_folder_that_is_missing_is_an_error(tmp_path: Path) -> None:
    video = VideoWriter(tmp_path / "none" / "v.mp4", 20, (64, 48))
    with pytest.raises(OSError, match="ffmpeg"):
        video.close()


def test_after_ctrl_c_the_film_plays(tmp_path: Path) -> None:
    program = textwrap.dedent("""
        import sys
        import numpy as np
        from regrasp.app.run.video import VideoWriter
        with VideoWriter(sys.argv[1], 20, (64, 48)) as video:
            for i in range(10**9):
                video.write(np.full((48, 64, 3), 99, np.uint8))
                if i == 50:
                    print("now", flush=True)
    """)
    arguments = [sys.executable, "-c", program, str(tmp_path / "v.mp4")]
    with subprocess.Popen(
        arguments, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, start_new_session=True
    ) as process:
        assert process.stdout is not None
        process.stdout.readline()
        os.killpg(process.pid, signal.SIGINT)  # as a terminal does: to the whole group
        assert process.wait() == -signal.SIGINT  # the interrupt, and no error of ffmpeg's on top
    assert len(colors(tmp_path / "v.mp4")) > 20


def killed(film: Path) -> None:
    """A film of some seconds whose ffmpeg is killed, as by a container that is stopped."""
    video = VideoWriter(film, 20, (64, 48))
    for i in range(10_000):
        video.write(image(64, 48, (i % 200, 99, 99)))
        if film.exists() and film.read_bytes().count(b"moof") > 2:
            break
    os.kill(video._ffmpeg.pid, signal.SIGKILL)
    with pytest.raises(OSError, match="ffmpeg could not write"):
        video.close()


def test_after_a_kill_what_was_filmed_plays(tmp_path: Path) -> None:
    killed(tmp_path / "v.mp4")
    assert len(colors(tmp_path / "v.mp4")) >= 20  # a second


def test_a_film_that_is_cut_anywhere_plays_up_to_there(tmp_path: Path) -> None:
    film, cut = tmp_path / "v.mp4", tmp_path / "cut.mp4"
    killed(film)
    content = film.read_bytes()
    second = content.index(b"moof", content.index(b"moof") + 4)
    for end in range(second, len(content), (len(content) - second) // 12):
        cut.write_bytes(content[:end])
        _drop_cut_box(cut)
        assert len(colors(cut)) >= 20
