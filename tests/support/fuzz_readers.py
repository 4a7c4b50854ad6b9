"""`make fuzz`: hostile scenarios, cells, trees and records, and symlink loops, against their readers.

A worker process reads one file after another; each reading must come to an end within `SECONDS` and `MEMORY`, in
success or with findings of a line each, and write nothing.
"""

import argparse
import os
import random
import re
import resource
import shutil
import signal
import sys
import tempfile
from collections import Counter
from collections.abc import Callable
from multiprocessing import get_context
from pathlib import Path
from typing import Any

from hostile_files import KINDS, RECORD, SHIPPED, Case, cases

from regrasp.app.files.findings import Findings
from regrasp.app.files.resources import shipped

RECORDED = KINDS[len(SHIPPED) :]
FORMATS = ("ascii", "dot", "groot", "json", "mermaid", "svg")
SECONDS = 5.0  # of computing: a busy machine makes no reader slow
PATIENCE = 60.0  # s: a reader that waits for something computes nothing
MEMORY = 2**30  # bytes more than the idle worker has
FINDING = re.compile(r"[^\n]+: [^\n]*; [^\n]+")


def read(case: Case, folder: Path) -> str:
    """How reading the case went: "clean", "findings", or what is wrong with the reader."""
    from regrasp.app.scenario.cell_file import load_cell  # late: in the worker
    from regrasp.app.scenario.load import load_scenario
    from regrasp.app.scenario.tree_file import check_tree_file

    if case.kind in RECORDED:
        run = folder / "run"
        shutil.rmtree(run, ignore_errors=True)
        shutil.copytree(RECORD, run)
        _put(run / case.kind, case)
        verdict = look(run, random.Random(case.made).choice(FORMATS))
        again = _verdict(lambda: load_scenario(str(run / "scenario.yaml")))
        return next((one for one in (verdict, again) if one not in ("clean", "findings")), min(verdict, again))
    path = folder / ("case.xml" if case.kind == "tree" else "case.yaml")
    _put(path, case)
    if case.kind == "scenario":
        return _verdict(lambda: load_scenario(str(path)))
    return _verdict(lambda: load_cell(path) if case.kind == "cell" else check_tree_file(path))


def _put(path: Path, case: Case) -> None:
    path.unlink(missing_ok=True)
    if case.is_loop:
        path.symlink_to(path.name)
    else:
        path.write_bytes(case.data)


def _verdict(reading: Callable[[], Any]) -> str:
    try:
        reading()
    except Findings as findings:
        odd = [str(f) for f in findings.items if not FINDING.fullmatch(str(f))]
        return f"finding without a remedy: {odd[0][:300]}" if odd else "findings"
    except MemoryError:
        return "more memory than allowed"
    except BaseException as error:
        return f"{type(error).__name__}: {error}"[:300]
    return "clean"


def look(run: Path, form: str) -> str:
    """How all the commands went that look at records: "clean", "findings", or what is wrong with the first of them."""
    from typer.testing import CliRunner

    from regrasp.app.cli.commands import app

    commands = (
        ["explain", str(run)],
        ["explain", str(run), "--json"],
        ["replay", str(run)],
        ["diff", str(run), str(RECORD)],
        ["diff", str(RECORD), str(run)],
        ["trees", "export", "--run", str(run), "--format", form],
        ["trees", "export", "recovery", "--run", str(run)],
    )
    codes = set()
    for command in commands:
        ran = CliRunner().invoke(app, command)
        codes.add(ran.exit_code)
        if wrong := _wrong(ran.exit_code, ran.exception, ran.stdout, ran.stderr):
            return f"{' '.join(command)}: {wrong}"[:500]
    return "findings" if 2 in codes else "clean"


def _wrong(code: int, error: BaseException | None, out: str, told: str) -> str | None:
    """What is wrong with the end of a command: its exit code, what it raised, printed, and told; None for nothing."""
    if error is not None and not isinstance(error, SystemExit):
        return f"{type(error).__name__}: {error}"
    if code not in (0, 1, 2):
        return f"exit code {code}"
    if odd := next((line for line in out.split("\n") if not line.isprintable()), None):
        return f"it prints {odd!r}"
    if code == 2 and (odd := next((line for line in told.splitlines() if not FINDING.fullmatch(line)), None)):
        return f"finding without a remedy: {odd}"
    return None


def _work(pipe: Any, folder: str) -> None:
    """Read what the pipe brings; tell how it went and what files were opened for writing meanwhile."""
    os.chdir(folder)
    # all imports first, and all functions that are compiled on their first call
    whole = [(kind, path) for kind in SHIPPED for path in shipped(kind).values()]
    for kind, path in [*whole, *((name, RECORD / name) for name in RECORDED)]:
        read(Case(kind, path.read_bytes(), ""), Path(folder))
    written: list[str] = []

    def audit(event: str, args: tuple[Any, ...]) -> None:
        if event == "open" and isinstance(args[1], str) and set(args[1]) & set("wax+"):
            written.append(str(args[0]))

    sys.addaudithook(audit)
    with open("/proc/self/statm", encoding="ascii") as statm:
        used = int(statm.read().split()[0]) * resource.getpagesize()
    resource.setrlimit(resource.RLIMIT_AS, (used + MEMORY, used + MEMORY))
    pipe.send("ready")
    while True:
        case = pipe.recv()
        written.clear()
        signal.setitimer(signal.ITIMER_PROF, SECONDS)  # its signal ends the process
        verdict = read(case, Path(folder))
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        outside = [name for name in written if not name.startswith(folder)]
        pipe.send(f"wrote {outside[0]}" if outside else verdict)


def fuzz(count: int, seed: int, progress: Callable[[int], None] = lambda _done: None) -> tuple[Counter[str], list[str]]:
    """Read `count` cases. How many went how, and a line for each that a reader did not stand."""
    context = get_context("spawn")
    tally: Counter[str] = Counter()
    failures = []
    worker: tuple[Any, Any] | None = None
    with tempfile.TemporaryDirectory() as folder:
        for number, case in enumerate(cases(count, seed)):
            if worker is None:
                ours, theirs = context.Pipe()
                process = context.Process(target=_work, args=(theirs, folder), daemon=True)
                process.start()
                theirs.close()
                worker = process, ours
                assert ours.recv() == "ready"
            process, ours = worker
            ours.send(case)
            try:
                verdict = ours.recv() if ours.poll(PATIENCE) else f"no end after {PATIENCE:g} s of waiting"
            except EOFError:
                process.join()
                verdict = f"the reader's process died with exit code {process.exitcode}"
                if process.exitcode == -signal.SIGPROF:
                    verdict = f"no end after {SECONDS:g} s of computing"
            if verdict.startswith(("no end", "the reader's")):
                process.kill()
                worker = None
            tally[verdict if verdict in ("clean", "findings") else "failed"] += 1
            if verdict not in ("clean", "findings"):
                failures.append(f"{case.kind}, {case.made}: {verdict}")
            progress(number + 1)
        if worker is not None:
            worker[0].kill()
            worker[0].join()
    return tally, failures


def main() -> int:
    """Command line; 0 when every reader stood every case."""
    parser = argparse.ArgumentParser(description="Hostile scenarios, cells, trees and records against their readers.")
    parser.add_argument("--cases", type=int, default=2000)
    parser.add_argument(
        "--seed", type=int, default=random.SystemRandom().randrange(10**6), help="default: another each time"
    )
    parser.add_argument("--keep", type=int, metavar="N", help="write case N's bytes to standard output and stop")
    options = parser.parse_args()
    if options.keep is not None:
        sys.stdout.buffer.write(list(cases(options.keep + 1, options.seed))[options.keep].data)
        return 0

    def progress(done: int) -> None:
        if done % 100 == 0:
            print(f"{done} of {options.cases}", file=sys.stderr)

    tally, failures = fuzz(options.cases, options.seed, progress)
    for failure in failures:
        print(failure)
    print(f"seed {options.seed}: " + ", ".join(f"{count} {name}" for name, count in sorted(tally.items())))
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
