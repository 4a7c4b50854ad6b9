"""The scenes of a pose study, each in a process of its own, with a line on stderr when it is done."""

import sys
from collections.abc import Callable, Mapping, Sequence
from typing import TypeVar

from regrasp.app.run.processes import run_each

T = TypeVar("T")


def run_tasks(
    tasks: Mapping[str, Callable[[], Sequence[T]]], jobs: int, keep: Callable[[list[T]], None]
) -> tuple[list[T], int]:
    """Do the tasks of these titles, `jobs` at a time: all that they gave, in their order, and the exit code.

    `keep` gets what there is after each. The code is 1 when a task broke off, 130 after Ctrl-C, else 0.
    """
    titles, found, code = list(tasks), dict[int, Sequence[T]](), 0
    each = run_each(list(tasks.values()), jobs)

    def so_far() -> list[T]:
        return [part for number in sorted(found) for part in found[number]]

    try:
        for count, done in enumerate(each, 1):
            told = done.error
            if done.value is None:
                code = 1
            else:
                found[done.number] = done.value
                told = ", ".join(map(str, done.value))
                keep(so_far())
            print(f"[{count}/{len(tasks)}] {titles[done.number]}: {told}", file=sys.stderr, flush=True)
    except KeyboardInterrupt:
        print(f"interrupted; {len(found)} of {len(tasks)} scenes were done", file=sys.stderr)
        code = 130
    finally:
        each.close()
    return so_far(), code
