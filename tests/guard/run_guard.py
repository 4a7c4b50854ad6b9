"""`make guard`: whether twelve demonstration runs are still the same to the last bit; for changes that only move code.

    python tests/guard/run_guard.py record       # write what the runs come to into tests/guard/runs.json
    python tests/guard/run_guard.py check        # run them again and say where the first one parts; exit code 1
    python tests/guard/run_guard.py check --only "no_obstacle zero seed 0"

A run comes to the digests of its ticks.jsonl, of its events.jsonl, of its result.json without wall times and versions,
and of its state at every tick, unrounded: joints and fingers as read, the connector's true pose and velocities, the
track and the belief. The same holds on the same kind of machine with the same renderer and packages only: record
before the change, on the machine that checks after it.
"""

import argparse
import hashlib
import json
import sys
import tempfile
from collections.abc import Iterator
from functools import partial
from itertools import product
from pathlib import Path
from typing import Any, cast

import numpy as np

from regrasp.app.run.compose import Episode
from regrasp.app.run.episode import run_episode
from regrasp.app.run.observers import Observers
from regrasp.app.run.processes import run_each
from regrasp.app.scenario.load import load_scenario
from regrasp.behaviors.cable.keys import FOUND, HELD
from regrasp.behaviors.cable.services import CableServices
from regrasp.behaviors.keys import value_of

KEPT = Path(__file__).with_name("runs.json")
SCENARIOS = ("no_obstacle", "short_obstacle", "tall_obstacle")
SEEDS = (0, 1)
OF_THE_CLOCK = ("wall_seconds", "real_time_factor", "wall_by_part", "longest_tick", "versions")
TICKS = 20  # between two digests that are kept: a second, to tell where runs part


class StateTrace:
    """The digest of all states so far, kept every so many ticks."""

    def __init__(self, made: Episode) -> None:
        self._made, self._digest = made, hashlib.sha256()
        self._ticks = 0
        self.kept: list[str] = []

    def note(self) -> None:
        """After a tick."""
        for part in self._state():
            self._digest.update(np.ascontiguousarray(part, dtype=np.float64).tobytes())
        self._ticks += 1
        if self._ticks % TICKS == 0:
            self.kept.append(self._digest.hexdigest()[:16])

    def finish(self) -> list[str]:
        """What is kept, the last state's digest last."""
        return [*self.kept, self._digest.hexdigest()]

    def _state(self) -> Iterator[Any]:
        world, services = self._made.world, self._made.services
        for arm in world.arms.values():
            reading = arm.reading()
            yield from (reading.positions, reading.velocities, reading.efforts, [arm.gripper.reading().gap])
        yield from world.objects.cable.connector_state()[2:]
        yield world.objects.connector_pose().as_matrix()
        if (last := cast(CableServices, services).perception.last) is not None:
            yield from (last.position, [last.stamp])
        held, found = value_of(HELD, None), value_of(FOUND, None)
        for pose in (held, None if found is None else found.world_from_connector):
            if pose is not None:
                yield pose.as_matrix()


def digests(scenario: str, gravity: str, seed: int) -> dict[str, Any]:
    """What the run comes to."""
    traces: list[StateTrace] = []

    def watch(made: Episode) -> None:
        traces.append(StateTrace(made))
        made.tree.add_post_tick_handler(lambda _tree: traces[0].note())

    loaded = load_scenario(scenario, [f"vary.gravity=[{gravity}]", f"seed={seed}"])
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "run"
        run_episode(loaded, out, seed=seed, observers=Observers(assembled=watch))
        result = json.loads((out / "result.json").read_text(encoding="utf-8"))
        texts = {name: (out / name).read_bytes() for name in ("ticks.jsonl", "events.jsonl")}
    texts["result.json"] = json.dumps({k: v for k, v in result.items() if k not in OF_THE_CLOCK}).encode()
    found: dict[str, Any] = {name: hashlib.sha256(text).hexdigest() for name, text in texts.items()}
    return found | {"outcome": result["outcome"], "renderer": result["renderer"], "states": traces[0].finish()}


def runs(jobs: int, only: str) -> dict[str, dict[str, Any]]:
    """What each run comes to, by its name; of the runs whose names hold `only`."""
    cases = [case for case in product(SCENARIOS, ("zero", "earth"), SEEDS) if only in "{} {} seed {}".format(*case)]
    found: dict[str, dict[str, Any]] = {}
    for done in run_each([partial(digests, *case) for case in cases], jobs):
        name = "{} {} seed {}".format(*cases[done.number])
        if done.value is None:
            sys.exit(f"{name}: {done.error}")
        print(f"[{len(found) + 1}/{len(cases)}] {name}: {done.value['outcome']}", file=sys.stderr, flush=True)
        found[name] = done.value
    return dict(sorted(found.items()))


def differences(kept: dict[str, Any], found: dict[str, Any]) -> Iterator[str]:
    """A line for each run that is not as it was."""
    for name, now in found.items():
        before = kept[name]
        parts = [key for key in before if key != "states" and before[key] != now[key]]
        if before["states"] != now["states"]:
            pairs = zip(before["states"], now["states"], strict=False)
            second = next((i for i, (a, b) in enumerate(pairs) if a != b), len(now["states"]))
            parts.append(f"states from second {second} on")
        if parts:
            yield f"{name}: {', '.join(parts)}"


def main() -> int:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=("record", "check"))
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--only", default="", metavar="WORDS", help="check: those runs whose names hold these words")
    options = parser.parse_args()
    if options.what == "record" and options.only:
        parser.error("--only is for check: a record holds every run")
    found = runs(options.jobs, options.only)
    if options.what == "record":
        KEPT.write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")
        return 0
    wrong = list(differences(json.loads(KEPT.read_text(encoding="utf-8")), found))
    print("\n".join(wrong) or f"all {len(found)} runs are the same")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
