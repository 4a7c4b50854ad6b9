"""The key frames and the film of a run, as data that a page holds, within its limit of bytes."""

import base64
import json
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from markupsafe import Markup

from regrasp.app.records.folders import OUTLINES, PICTURES
from regrasp.app.records.reader import RunRecord
from regrasp.app.report.sightings import Sighting, Sightings

FILM = "video.mp4"
MOST_CORNERS = 100  # of an outline that is drawn; choice
_NAME = re.compile(r"(\d+\.\d+)-(.+)-([^-]*)\.jpg")


@dataclass(frozen=True)
class PictureLimits:
    """How much of its pictures a page takes, in bytes before they are written as text, which takes a third more."""

    pictures: int = 2_800_000
    film: int = 5_000_000
    count: int = 300
    width: int = 640  # px of a picture that has to become smaller
    quality: int = 70  # of its JPEG


@dataclass(frozen=True)
class Found:
    """What perception found in a picture: its name, and the corners of its outline as fractions of the picture."""

    name: str
    corners: tuple[tuple[float, float], ...]

    def points(self, width: int, height: int) -> str:
        """The corners for SVG, in a picture of this size in px."""
        return " ".join(f"{x * width:.1f},{y * height:.1f}" for x, y in self.corners)


@dataclass(frozen=True)
class KeyFrame:
    """A camera's picture at a moment: its size in px, its data, what the robot knew of things in it then, and found."""

    t: float
    camera: str
    event: str
    width: int
    height: int
    data: Markup  # base64
    sightings: tuple[Sighting, ...] = ()
    found: tuple[Found, ...] = ()


@dataclass(frozen=True)
class Pictures:
    """Key frames in the order of time, the film's data ('' for none), and remarks on what is left out."""

    frames: tuple[KeyFrame, ...]
    film: Markup
    remarks: tuple[str, ...]


def pictures(record: RunRecord, sightings: Sightings, limits: PictureLimits = PictureLimits()) -> Pictures:
    """The pictures of a record."""
    remarks: list[str] = []
    files = [*_files(record.folder / PICTURES)]
    if not files:
        remarks.append("the run kept no pictures; regrasp run --pictures keeps some")
    elif len(files) > limits.count:
        remarks.append(f"of {len(files)} pictures {limits.count}, evenly chosen, are shown")
        files = [files[number * len(files) // limits.count] for number in range(limits.count)]
    small = sum(path.stat().st_size for _, _, _, path in files) > limits.pictures
    outlines = _outlines(record.folder / PICTURES / OUTLINES, remarks) if files else {}
    frames, left = [], limits.pictures
    for t, camera, event, path in files:
        frame = _key_frame(t, camera, event, path, limits if small else None, outlines.get(path.name, ()))
        if frame is None:
            remarks.append(f"{PICTURES}/{path.name} is no picture that can be read")
            continue
        left -= len(frame.data) * 3 // 4
        if left < 0:
            remarks.append("later pictures are left out, for the page would be too large")
            break
        frames.append(replace(frame, sightings=tuple(sightings.at(frame.t, frame.camera))))
    film, told = _film(record.folder / FILM, limits.film)
    return Pictures(tuple(frames), film, (*remarks, *told))


def _files(folder: Path) -> Iterator[tuple[float, str, str, Path]]:
    """Second, camera and event of each picture, by its name."""
    if folder.is_dir():
        for path in sorted(folder.iterdir()):
            if (parts := _NAME.fullmatch(path.name)) and path.is_file():
                yield float(parts[1]), parts[2], parts[3].replace("_", " "), path


def _outlines(file: Path, remarks: list[str]) -> dict[str, list[tuple[str, list[list[float]]]]]:
    """By a picture's name, the name and the outline (n, 2) px of each thing that was found in it."""
    found: dict[str, list[tuple[str, list[list[float]]]]] = {}
    try:
        lines = file.read_text(encoding="utf-8").splitlines() if file.is_file() else []
    except (OSError, UnicodeDecodeError):
        lines = [""]
    unread = 0
    for line in lines:
        try:
            row = json.loads(line)
            corners = [[float(u), float(v)] for u, v in row["outline"][:MOST_CORNERS]]
            found.setdefault(str(row["picture"]), []).append((str(row["found"]), corners))
        except (ValueError, TypeError, KeyError, RecursionError):
            unread += 1
    if unread:
        remarks.append(f"{PICTURES}/{OUTLINES}: {unread} lines cannot be read, so some outlines are not drawn")
    return found


def _key_frame(
    t: float,
    camera: str,
    event: str,
    path: Path,
    limits: PictureLimits | None,
    outlines: Sequence[tuple[str, list[list[float]]]],
) -> KeyFrame | None:
    """The picture, made smaller if there are limits; None if it cannot be read."""
    import cv2  # late: it takes a moment
    import numpy as np

    try:
        data = path.read_bytes()
        image = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR) if data else None
    except (OSError, cv2.error):
        return None
    if image is None:
        return None
    height, width = image.shape[:2]
    found = tuple(Found(name, tuple((u / width, v / height) for u, v in corners)) for name, corners in outlines)
    if limits is not None:
        scale = min(1.0, limits.width / width)
        small = cv2.resize(
            image, (max(1, int(width * scale)), max(1, int(height * scale))), interpolation=cv2.INTER_AREA
        )
        data = cv2.imencode(".jpg", small, [cv2.IMWRITE_JPEG_QUALITY, limits.quality])[1].tobytes()
        height, width = small.shape[:2]
    return KeyFrame(t, camera, event, width, height, Markup(base64.b64encode(data).decode()), found=found)


def _film(path: Path, most: int) -> tuple[Markup, tuple[str, ...]]:
    """The film's data, and a remark if it is too large or cannot be read."""
    if not path.is_file():
        return Markup(), ()
    size = path.stat().st_size
    if size > most:
        return Markup(), (f"the film, {path.name} in the record, has {size / 1e6:.1f} MB and is not in this page",)
    try:
        return Markup(base64.b64encode(path.read_bytes()).decode()), ()
    except OSError as error:
        return Markup(), (f"{path.name} cannot be read: {error.strerror}",)
