"""Video frames (overview, up to two cameras, a few lines of text), and their encoding as a film."""

import contextlib
import subprocess
from collections.abc import Sequence
from pathlib import Path
from types import TracebackType
from typing import Self

import cv2
import numpy as np
from imageio_ffmpeg import get_ffmpeg_exe
from numpy.typing import NDArray

RgbImage = NDArray[np.uint8]
# One file, in fragments of 1 s: if ffmpeg is killed, those that are written can still be played.
_KEPT = ["-movflags", "+hybrid_fragmented", "-frag_duration", "1000000"]

# Width and height are multiples of 16, as h264 has it. The cameras' 848x480 halved give the right column.
SIZE = (1280, 544)
OVERVIEW_SIZE = (856, 480)  # what an overview camera should render, to be shown without scaling
_CAMERA_SIZE = (424, 240)
_INK, PAPER = (235, 235, 235), 24  # of 255: light letters on a dark ground


def compose(
    overview: RgbImage | None, cameras: Sequence[tuple[str, RgbImage | None]], lines: Sequence[str]
) -> RgbImage:
    """One video frame (544, 1280, 3) uint8 RGB: overview on the left, up to two cameras on the right, text below.

    Images are (H, W, 3) uint8 RGB of any size and are scaled to fit; None leaves the place dark. Up to four lines are
    shown, in two columns.
    """
    frame: RgbImage = np.full((SIZE[1], SIZE[0], 3), PAPER, np.uint8)
    _place(frame, overview, (0, 0), OVERVIEW_SIZE)
    for row, (name, image) in enumerate(cameras[:2]):
        left, top = OVERVIEW_SIZE[0], row * _CAMERA_SIZE[1]
        _place(frame, image, (left, top), _CAMERA_SIZE)
        write_text(frame, f"{name} camera", (left + 8, top + 20), 0.5)
    for i, line in enumerate(lines[:4]):
        column, row = divmod(i, 2)
        write_text(frame, line, (16 + column * SIZE[0] // 2, OVERVIEW_SIZE[1] + 25 + 27 * row), 0.6)
    return frame


def _place(frame: RgbImage, image: RgbImage | None, corner: tuple[int, int], size: tuple[int, int]) -> None:
    """Copy the image, scaled to fit and centred, into the box at `corner` (left, top) of `size` (width, height)."""
    if image is None:
        return
    scale = min(size[0] / image.shape[1], size[1] / image.shape[0])
    width, height = (max(1, round(image.shape[1] * scale)), max(1, round(image.shape[0] * scale)))
    if (height, width) != image.shape[:2]:
        image = cv2.resize(image, (width, height), interpolation=cv2.INTER_AREA if scale < 1 else cv2.INTER_LINEAR)
    left, top = corner[0] + (size[0] - width) // 2, corner[1] + (size[1] - height) // 2
    frame[top : top + height, left : left + width] = image


def write_text(frame: RgbImage, text: str, origin: tuple[int, int], scale: float) -> None:
    """Write light letters on a dark rectangle; `origin` (x, y) px is the left end of the base line. ASCII only."""
    text = text.encode("ascii", "replace").decode()
    (width, height), below = cv2.getTextSize(text, cv2.FONT_HERSHEY_SIMPLEX, scale, 1)
    left, base = origin
    cv2.rectangle(frame, (left - 4, base - height - 2), (left + width + 4, base + below), (PAPER,) * 3, cv2.FILLED)
    cv2.putText(frame, text, origin, cv2.FONT_HERSHEY_SIMPLEX, scale, _INK, 1, cv2.LINE_AA)


def _drop_cut_box(path: Path) -> None:
    """Cut off a fragmented film's last box where it is not whole: with half a header no player opens it.

    A box is 4 bytes of its size, big-endian, 4 of its type, then its content (ISO/IEC 14496-12, section 4.2).
    """
    with contextlib.suppress(OSError), path.open("r+b") as film:
        length, whole = path.stat().st_size, 0
        while whole + 8 <= length:
            film.seek(whole)
            size = int.from_bytes(film.read(4), "big")
            if size < 8 or whole + size > length:
                break
            whole += size
        film.truncate(whole)


class VideoWriter:
    """An H.264 film, encoded by imageio_ffmpeg's own ffmpeg; a context manager.

    ffmpeg runs in a session of its own: Ctrl-C does not reach it, and the film can still be closed properly.
    """

    def __init__(self, path: Path, fps: float, size: tuple[int, int] = SIZE) -> None:
        """`size` is (width, height) in pixels, both even.

        Raises:
            OSError: ffmpeg cannot be started.
        """
        self._path, self._shape = path, (size[1], size[0], 3)
        self._broken = False
        source = ["-f", "rawvideo", "-pix_fmt", "rgb24", "-s", f"{size[0]}x{size[1]}", "-r", str(fps), "-i", "-"]
        target = ["-an", "-c:v", "libx264", "-preset", "veryfast", "-crf", "23", "-pix_fmt", "yuv420p"]
        self._ffmpeg = subprocess.Popen(
            [get_ffmpeg_exe(), "-y", "-v", "error", *source, *target, *_KEPT, str(path)],
            stdin=subprocess.PIPE,
            stdout=subprocess.DEVNULL,
            start_new_session=True,
        )

    def write(self, frame: RgbImage) -> None:
        """Append a frame, (height, width, 3) uint8 RGB.

        Raises:
            ValueError: another shape or type.
            OSError: ffmpeg has died (a full disk, say).
        """
        if frame.shape != self._shape or frame.dtype != np.uint8:
            raise ValueError(f"a frame must be {self._shape} uint8, not {frame.shape} {frame.dtype}")
        assert self._ffmpeg.stdin is not None
        if self._broken:
            return
        try:
            self._ffmpeg.stdin.write(np.ascontiguousarray(frame).data)
        except BaseException:  # half a frame may be written: the next one would be shifted
            self._broken = True
            raise

    def close(self) -> None:
        """End the film and wait until it is written; a second call does nothing.

        Raises:
            OSError: ffmpeg could not write it.
        """
        stdin = self._ffmpeg.stdin
        assert stdin is not None
        if stdin.closed:
            return
        with contextlib.suppress(BrokenPipeError):  # its exit status says why
            stdin.close()
        if code := self._ffmpeg.wait():
            _drop_cut_box(self._path)
            raise OSError(f"ffmpeg could not write the video (exit status {code})")

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()
