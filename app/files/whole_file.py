"""Writes files atomically."""

import errno
import os
from pathlib import Path

from regrasp.app.files.findings import Finding, Findings, real_path, shown


def write_named(path: Path, content: str | bytes) -> None:
    """`write_whole` of a file that a user named, with the folders on its way. Raises `Findings` if it cannot."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        write_whole(path, content)
    except OSError as error:
        raise Findings([Finding(shown(path), 0, f"cannot write it: {error.strerror}; name another file")]) from None


def write_whole(path: Path, content: str | bytes) -> None:
    """Write a file in one step: readers see the old content or the new one, never a part of it.

    A link is followed, not replaced. A pipe or a device is written to directly.

    Raises:
        OSError: the file cannot be written.
    """
    data = content.encode() if isinstance(content, str) else content
    if path.exists() and not path.is_file():
        path.write_bytes(data)
        return
    path = real_path(path)
    if path.is_symlink():  # it leads back to itself
        raise OSError(errno.ELOOP, os.strerror(errno.ELOOP), str(path))
    part = path.with_name(path.name + ".part")
    try:
        with part.open("wb") as file:
            if path.exists():
                os.fchmod(file.fileno(), path.stat().st_mode)
            file.write(data)
            file.flush()
            os.fsync(file.fileno())
        part.replace(path)
    except BaseException:
        part.unlink(missing_ok=True)
        raise
