"""What every tree must stand whatever its leaves do: it ends, and a stop at any tick leaves nothing at work.

The leaves are scripted. In one trial all succeed at once that can, in one all fail, and in the others each draws from a
seed how long it runs and how it ends, of the ways that the real leaf has; after a few times it succeeds at once, as a
guard must that is asked at every tick.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from random import Random

import py_trees
from py_trees.common import Status

from regrasp.trees.scripted import MOST_TICKS, ScriptedTree

SEEDS = 10
DRAWN = 6  # acts of a leaf
LENGTHS = (1, 2, 3, 8)  # ticks of an act
FAILING = 0.25  # share of the acts: with more, most trials would end where the tree begins
MOST_STOPS = 100  # of one trial: each runs the tree anew


@dataclass(frozen=True)
class Trial:
    """A tree file and its leaves' scripts by path, to be run as often as need be."""

    name: str
    path: Path
    script: Mapping[str, str]
    leaves: Mapping[str, type] | None

    def tree(self) -> ScriptedTree:
        """The tree before its first tick. The blackboard is cleared for it."""
        py_trees.blackboard.Blackboard.clear()
        return ScriptedTree(self.path, self.script, leaves=self.leaves)


def trials(path: Path, leaves: Mapping[str, type] | None = None) -> Iterator[Trial]:
    """The trials of a tree file; `leaves` and errors as for `ScriptedTree`."""
    returns = {at: leaf.RETURNS for at, leaf in Trial("", path, {}, leaves).tree().leaves.items()}
    yield Trial("what can succeed does", path, {at: _ends(can)[-1] for at, can in returns.items()}, leaves)
    yield Trial("what can fail does", path, {at: _ends(can)[0] for at, can in returns.items()}, leaves)
    for seed in range(SEEDS):
        random = Random(seed)
        yield Trial(f"drawn from seed {seed}", path, {at: _drawn(random, can) for at, can in returns.items()}, leaves)


def _ends(returns: frozenset[Status]) -> list[str]:
    """How a leaf of these statuses may end, failure first; one that never ends runs."""
    return sorted(status.value.lower() for status in returns - {Status.RUNNING}) or ["running"]


def _drawn(random: Random, returns: frozenset[Status]) -> str:
    fails, succeeds = _ends(returns)[0], _ends(returns)[-1]
    lengths = LENGTHS if Status.RUNNING in returns else (1,)
    acts = [(random.choice(lengths), fails if random.random() < FAILING else succeeds) for _ in range(DRAWN)]
    return ", ".join([*(f"{ticks} {end}" for ticks, end in acts), succeeds])


def never_ends(path: Path, leaves: Mapping[str, type] | None = None) -> Iterator[str]:
    """A paragraph for each trial in which the tree does not end, or leaves a leaf at work when it does."""
    for trial in trials(path, leaves):
        tree = trial.tree()
        if tree.run(MOST_TICKS) is Status.RUNNING:
            yield f"{trial.name}: the tree still runs after {MOST_TICKS} ticks, in {tree.unfinished}"
        elif tree.running:
            yield f"{trial.name}: the tree ended, but {', '.join(tree.running)} still runs\n{tree.table()}"


def left_by_a_stop(path: Path, leaves: Mapping[str, type] | None = None) -> Iterator[str]:
    """A paragraph for each trial and tick after which a stop of the tree leaves a leaf at work or stops it wrongly."""
    for trial in trials(path, leaves):
        tick = 0
        while (tree := trial.tree()).run(until=(tick := tick + 1)) is Status.RUNNING and tick <= MOST_STOPS:
            due = {leaf: node.stopped + (leaf in tree.running) for leaf, node in tree.leaves.items()}
            tree.cancel_at(tick)
            wrong = {leaf for leaf, node in tree.leaves.items() if node.stopped != due[leaf]}.union(tree.running)
            if wrong:
                yield f"{trial.name}: stopped after tick {tick}, {', '.join(sorted(wrong))} was not\n{tree.table()}"
