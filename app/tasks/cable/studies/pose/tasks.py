"""Runs the scenes of a pose study, each in a process of its own, with a line on stderr when one is done."""

import sys
from collections.abc import Callable, Mapping, Sequence
from typing import TypeVar

from regrasp.app.run.processes import run_each

T = TypeVar("T")


def run_tasks(
    tasks: Mapping[str, Callable[[], Sequence[T]]], jobs: int, keep: Callable[[list[T]], None]
) -> tuple[list[T], int]:
    """Run tasks by their titles, `jobs` at a time: all their results in the tasks' order, and the exit code.

    `keep` is called after each task with the results so far. The code is 1 when a task raised an error or its process
    died, 130 after Ctrl-C, else 0.
    """
    titles, found, code = list(tasks), dict[int, Sequence[T]](), 0
    each = run_each(list(tasks.values()), jobs)

    def so_far() -> list[T]:
        return [part for number in sorted(found) for part in found[number]]

    try:
        for count, done in enumerate(each, 1):
            outcome = done.error
            if done.value is None:
                code = 1
            else:
                found[done.number] = done.value
                outcome = ", ".join(map(str, done.value))
                keep(so_far())
            print(f"[{count}/{len(tasks)}] {titles[done.number]}: {outcome}", file=sys.stderr, flush=True)
    except KeyboardInterrupt:
        print(f"interrupted; {len(found)} of {len(tasks)} scenes were done", file=sys.stderr)
        code = 130
    finally:
        each.close()
    return so_far(), code
