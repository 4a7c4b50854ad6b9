"""What the commands that train a detector have in common: what must be there before, and progress."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING

from regrasp.app.files.findings import Finding, Findings, shown
from regrasp.app.records import folders

if TYPE_CHECKING:
    from regrasp.app.studies.detector.network import NetworkParameters

TRAINING_SEED, HELD_OUT_SEED = 0, 1_000_000  # choice: far apart, so that nobody trains on held-out pictures


def training_findings(command: str, out: Path, file: str, start: Path | None) -> list[Finding]:
    """Why `command` cannot train a network to be `file` in the folder `out`, from the network `start` on."""
    wrong = folders.folder_findings(out)
    if (out / file).exists():
        wrong.append(Finding(shown(out), 0, f"already holds {file}; name another folder"))
    missing = [name for name in ("onnx", "torch") if find_spec(name) is None]
    if missing:
        message = f"{missing[0]} is not installed; pip install -e '.[train]' in the project's folder"
        wrong.append(Finding(command, 0, message))
    if start is not None and not start.is_file():
        wrong.append(Finding(shown(start), 0, f"is no file; name an ONNX file that `regrasp {command}` made"))
    return wrong


def checked_start(command: str, start: Path | None, network: "NetworkParameters") -> bytes | None:
    """The file of the network `start`. Raises `Findings` if it is none that `command` made."""
    from regrasp.app.studies.detector.network import read_weights

    if start is None:
        return None
    model = start.read_bytes()
    try:
        read_weights(model, network)
    except ValueError as error:
        raise Findings([Finding(shown(start), 0, f"{error}; name one that `{command}` made")]) from None
    return model


def evaluation_findings(command: str, model: Path | None, out: Path | None) -> list[Finding]:
    """Why a network, an ONNX file that the command `command` made, cannot be evaluated, with figures to `out`."""
    wrong = folders.file_findings(out, new=True) if out else []
    if out is not None and out.suffix.lower() == ".onnx":
        wrong.append(Finding(shown(out), 0, "is a network's name, and the figures are JSON; end it in .json"))
    if model is not None and not model.is_file():
        wrong.append(Finding(shown(model), 0, f"is no file; name an ONNX file that `regrasp {command}` made"))
    return wrong


@contextmanager
def counted(what: str, total: int) -> Iterator[Callable[..., None]]:
    """A callback (done, words) that shows progress on stderr: a bar on a terminal, else a line for every tenth."""
    from rich.console import Console
    from rich.progress import Progress

    console = Console(stderr=True, highlight=False, markup=False, soft_wrap=True)
    if console.is_terminal:
        with Progress(console=console, transient=True) as progress:
            task = progress.add_task(what, total=total)
            yield lambda done, words="": progress.update(task, completed=done, description=f"{what} {words}")
        return

    def line(done: int, words: str = "") -> None:
        if done * 10 // total > (done - 1) * 10 // total:
            console.print(f"{what}: {done} of {total} {words}".rstrip())

    yield line
