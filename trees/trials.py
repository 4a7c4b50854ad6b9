"""Tests that every tree must pass whatever its leaves do: it ends, and a stop at any tick leaves no leaf running.

The leaves are scripted. In one trial all leaves succeed that can, in one all fail, and in the others a seed draws how
long each runs and how it ends, among the statuses of the real leaf. After a few executions a leaf succeeds at once, as
a guard must that is ticked at every tick.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from random import Random

import py_trees
from py_trees.common import Status

from regrasp.trees.scripted import MAX_TICKS, ScriptedTree


@dataclass(frozen=True)
class ScriptedTrialParameters:
    """How many trials there are, and how the scripts are drawn."""

    seeds: int = 10  # trials with drawn scripts; choice
    acts: int = 6  # of a leaf, before it succeeds at once; choice
    ticks: tuple[int, ...] = (1, 2, 3, 8)  # that an act may take; choice
    failing_share: float = 0.25  # of the acts; choice: with more, most trials would end where the tree begins
    max_stops: int = 8  # per trial; choice: each runs the tree anew


_DEFAULTS = ScriptedTrialParameters()


@dataclass(frozen=True)
class ScriptedTrial:
    """A tree file and its leaves' scripts by path; it can be run many times."""

    name: str
    path: Path
    script: Mapping[str, str]
    leaves: Mapping[str, type] | None

    def tree(self) -> ScriptedTree:
        """The tree before its first tick. The blackboard is cleared for it."""
        py_trees.blackboard.Blackboard.clear()
        return ScriptedTree(self.path, self.script, leaves=self.leaves)


def trials(
    path: Path, leaves: Mapping[str, type] | None = None, parameters: ScriptedTrialParameters = _DEFAULTS
) -> Iterator[ScriptedTrial]:
    """The trials of a tree file; `leaves` and errors as for `ScriptedTree`."""
    returns = {at: leaf.RETURNS for at, leaf in ScriptedTrial("", path, {}, leaves).tree().leaves.items()}
    yield ScriptedTrial("what can succeed does", path, {at: _ends(can)[-1] for at, can in returns.items()}, leaves)
    yield ScriptedTrial("what can fail does", path, {at: _ends(can)[0] for at, can in returns.items()}, leaves)
    for seed in range(parameters.seeds):
        random = Random(seed)
        script = {at: _drawn(random, can, parameters) for at, can in returns.items()}
        yield ScriptedTrial(f"drawn from seed {seed}", path, script, leaves)


def _ends(returns: frozenset[Status]) -> list[str]:
    """How a leaf that returns these statuses may end, failure first; one that never ends is running."""
    return sorted(status.value.lower() for status in returns - {Status.RUNNING}) or ["running"]


def _drawn(random: Random, returns: frozenset[Status], parameters: ScriptedTrialParameters) -> str:
    fails, succeeds = _ends(returns)[0], _ends(returns)[-1]
    lengths = parameters.ticks if Status.RUNNING in returns else (1,)
    acts = [
        (random.choice(lengths), fails if random.random() < parameters.failing_share else succeeds)
        for _ in range(parameters.acts)
    ]
    return ", ".join([*(f"{ticks} {end}" for ticks, end in acts), succeeds])


def never_ends(path: Path, leaves: Mapping[str, type] | None = None) -> Iterator[str]:
    """A paragraph for each trial in which the tree does not end, or ends while a leaf is running."""
    for trial in trials(path, leaves):
        tree = trial.tree()
        if tree.run(MAX_TICKS) is Status.RUNNING:
            yield f"{trial.name}: the tree still runs after {MAX_TICKS} ticks, in {tree.unfinished}"
        elif tree.running:
            yield f"{trial.name}: the tree ended, but {', '.join(tree.running)} still runs\n{tree.table()}"


def left_by_a_stop(
    path: Path, leaves: Mapping[str, type] | None = None, max_stops: int = ScriptedTrialParameters.max_stops
) -> Iterator[str]:
    """A paragraph for each trial and tick after which a stop of the tree leaves a leaf running or stops it wrongly.

    The tree is stopped after each tick that entered a leaf or left one: in between a stop meets the same leaves.
    """
    for trial in trials(path, leaves):
        for tick in [*islice(_changes(trial.tree()), max_stops)]:  # all before another tree has the blackboard
            (tree := trial.tree()).run(until=tick)
            due = {leaf: node.stopped + (leaf in tree.running) for leaf, node in tree.leaves.items()}
            tree.cancel_at(tick)
            wrong = {leaf for leaf, node in tree.leaves.items() if node.stopped != due[leaf]}.union(tree.running)
            if wrong:
                yield f"{trial.name}: stopped after tick {tick}, {', '.join(sorted(wrong))} was not\n{tree.table()}"


def _changes(tree: ScriptedTree) -> Iterator[int]:
    """The ticks of a run to the tree's end after which other leaves run, or a leaf anew; not the last tick."""
    tick, before = 0, None
    while tree.run(until=(tick := tick + 1)) is Status.RUNNING and tick < MAX_TICKS:
        now = [(leaf, tree.leaves[leaf].entered) for leaf in tree.running]
        if now != before:
            yield tick
        before = now
