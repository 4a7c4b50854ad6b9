"""The recovery tree with its real leaves on services that play along."""

import inspect
import threading
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import py_trees
import pytest
from fake_services import Clock, FakeGripper, FakeMotion, FakePerception, Stage, seen
from py_trees.blackboard import Blackboard
from py_trees.common import Status
from scipy.spatial.transform import RigidTransform

from regrasp.app.files.resources import shipped
from regrasp.app.run.attempts import Attempts
from regrasp.behaviors import LEAVES, Leaf
from regrasp.behaviors.keys import causes
from regrasp.interfaces.cable.cell import CableKnown
from regrasp.interfaces.cause import Cause, ServiceError
from regrasp.interfaces.frame import Intrinsics, RgbdFrame
from regrasp.interfaces.request import Request
from regrasp.trees import in_tree_order, load_tree

Make = Callable[..., "Play"]
TICK = 0.25  # s: more than a run's, for less to do
K = Intrinsics(64, 48, 50.0, 50.0, 31.5, 23.5)


class BusyMotion(FakeMotion):
    """Knows which motions began and neither ended nor were stopped."""

    def __init__(self, clock: Clock, known: CableKnown) -> None:
        super().__init__(clock, known)
        self.at_work: list[str] = []

    def work(self, arm: str) -> Request[None]:
        def steps() -> Iterator[None]:
            self.at_work.append(arm)
            yield from self._steps()
            self.at_work.remove(arm)

        return Request(steps(), lambda: self.at_work.remove(arm) if arm in self.at_work else None)

    def stop(self) -> None:
        super().stop()
        self.at_work.clear()


class Hand(FakeGripper):
    """Holds whatever it closes on."""

    def close(self, force: float) -> None:
        super().close(force)
        self.gap = 0.02


class Eyes(FakePerception):
    """See the connector at the clip; while it is `hidden` only the wrist does, and none where it is `gone` then."""

    def __init__(self, clock: Clock, known: CableKnown, gone: bool) -> None:
        super().__init__(clock, known)
        place = np.array(known.cable.clip.seat)
        self.hidden = False
        self.troubles["rear"] = "no picture yet"
        self.shows = lambda camera, t: None if self.hidden and (gone or camera == "rear") else seen(t, place, camera)
        still = np.full((48, 64, 3), 160, np.uint8)
        self.frames = lambda t: RgbdFrame("rear", 1, t, still, np.zeros((48, 64), np.float32), K)


class Play:
    """The recovery tree with its leaves; the end is lost, once, and hidden `slip` ticks after the carrying began.

    Where it is `gone` nobody finds it, and the second try ends in the safe stop.
    """

    def __init__(self, known: CableKnown, folder: Path, slip: int, gone: bool = False) -> None:
        Blackboard.clear()
        stage = Stage(known, folder)
        self.clock, self.slip = stage.clock, slip
        self.motion = BusyMotion(stage.clock, known)
        self.motion.tool_pose = RigidTransform.from_translation(known.cable.clip.seat)
        self.hand = self.motion.grippers["right"] = Hand(stage.clock)
        self.eyes = Eyes(stage.clock, known, gone)
        services = replace(stage.services, motion=self.motion, perception=self.eyes)
        self.root = load_tree(shipped("tree")["recovery"], LEAVES, {"tries": "2"})
        self.leaves = {n.name.rsplit(".", 1)[1]: n for n in in_tree_order(self.root) if isinstance(n, Leaf)}
        self.seen: set[str] = set()
        self.services = services
        self.tree = py_trees.trees.BehaviourTree(self.root)
        self.tree.setup(services=services)

    def run(self, ticks: int = 500) -> int:
        """Tick so often or until the tree ends; how often it was ticked."""
        for tick in range(1, ticks + 1):
            self.tree.tick()
            self.seen |= {name for name, leaf in self.leaves.items() if leaf.status is Status.RUNNING}
            if self.root.status is not Status.RUNNING:
                return tick
            self.clock.t += TICK
            self.eyes.troubles.clear()
            if "carry" in self.seen:
                self.slip -= 1
            if self.slip == -1:
                self.hand.gap, self.eyes.hidden = 0.0, True
            elif "regrasp" in self.seen:
                self.eyes.hidden = False
        return ticks


@pytest.fixture
def play(known: CableKnown, tmp_path: Path) -> Iterator[Make]:
    yield lambda slip, gone=False: Play(known, tmp_path, slip, gone)
    Blackboard.clear()


@pytest.mark.parametrize("gone", [False, True], ids=["found again", "not found"])
def test_stopped_after_any_tick_no_arm_moves_and_no_work_is_left(play: Make, gone: bool) -> None:
    whole = play(2, gone)
    last = whole.run()
    assert whole.root.status is (Status.FAILURE if gone else Status.SUCCESS)
    threads = threading.active_count()
    caught: set[str] = set()
    moving = 0
    for tick in [*range(1, min(last, 80)), *range(max(last - 4, 80), last)]:  # a long search goes on as it begins
        cut = play(2, gone)
        cut.run(tick)
        caught |= {name for name, leaf in cut.leaves.items() if leaf.status is Status.RUNNING}
        moving += bool(cut.motion.at_work)
        cut.root.stop(Status.INVALID)
        assert cut.motion.at_work == [], f"tick {tick}"
        assert [leaf.name for leaf in cut.leaves.values() if leaf.status is Status.RUNNING] == []
        works = [vars(leaf)["_work"] for leaf in cut.leaves.values() if "_work" in vars(leaf)]
        assert {inspect.getgeneratorstate(work) for work in works} == {inspect.GEN_CLOSED}
        assert cut.eyes.axis is None
    assert caught == whole.seen
    assert moving > 10
    assert threading.active_count() == threads
    Blackboard.clear()
    assert not Blackboard.keys()


def test_the_two_plays_catch_every_leaf_that_takes_time(play: Make) -> None:
    """Whoever adds a leaf to the tree must let it be stopped at work, too."""
    at_work: set[str] = set()
    for gone in (False, True):
        whole = play(2, gone)
        whole.run()
        at_work |= whole.seen
    assert at_work == {name for name, leaf in whole.leaves.items() if Status.RUNNING in leaf.RETURNS}


@pytest.mark.parametrize("slip", range(12))
def test_a_slip_at_any_tick_of_carrying_and_inserting_ends_stowed(play: Make, slip: int) -> None:
    whole = play(slip)
    whole.run()
    assert whole.root.status is Status.SUCCESS


@pytest.mark.parametrize(
    "trouble", ["slip", "not found", "no hand", "dark cameras", "camera breaks off", "jaw breaks off"]
)
def test_every_failed_leaf_names_a_cause(play: Make, monkeypatch: pytest.MonkeyPatch, trouble: str) -> None:
    def breaks(*_arguments: Any) -> None:
        raise ServiceError("broke off")

    whole = play(2, trouble == "not found")
    attempts = Attempts(whole.root, causes, whole.clock.now)
    if trouble == "no hand":
        monkeypatch.setattr(whole.motion, "pick_plug", lambda *_, **__: Request(iter([None])))
        monkeypatch.setattr(whole.hand, "close", lambda force: setattr(whole.hand, "gap", 0.0))
    elif trouble == "dark cameras":
        monkeypatch.setattr(whole.eyes, "trouble", lambda camera: f"the {camera} camera is dark")
    elif "breaks off" in trouble:
        broken, what = (whole.eyes, "look") if "camera" in trouble else (whole.hand, "reading")
        monkeypatch.setattr(broken, what, breaks)
    whole.tree.add_visitor(attempts)
    whole.run()
    failed = [attempt for attempt in attempts.made if attempt.status == "FAILURE"]
    assert {type(attempt.cause) for attempt in failed} == {Cause}
    ended = {attempt.path.rsplit("/", 1)[-1] for attempt in failed}
    assert ended >= ({"detect_slip", "holding"} if trouble == "slip" else {"safe_stop"})
    assert all(attempt.cause and attempt.cause.message for attempt in failed)
    if trouble != "slip":
        assert (cause := attempts.cause()) is not None
        assert not cause.node.endswith("safe_stop")
