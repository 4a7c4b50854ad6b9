"""Trees made by hand, ticked by the real BehaviourTree; 1 s a tick, the first at 0 s."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import py_trees
from py_trees.behaviour import Behaviour
from py_trees.common import ParallelPolicy, Status
from py_trees.composites import Parallel, Selector, Sequence
from py_trees.decorators import FailureIsSuccess, Inverter, Retry
from scripted import F, R, S, Script

from regrasp.app.run.attempts import Attempts
from regrasp.interfaces.cable.cause import CableCause
from regrasp.interfaces.cause import Cause, CauseCode


@dataclass
class Bench:
    """A tree under watch and the list of its causes."""

    causes: list[Cause] = field(default_factory=list)
    now: float = -1.0

    def fails(self, name: str, *before: Status) -> Script:
        """A leaf that fails in the end, with a cause."""
        return Script(name, *before, F, causes=self.causes)

    def run(self, root: Behaviour, ticks: int = 50, types: Mapping[str, str] | None = None) -> Attempts:
        """Tick until the root ends, or so often, then stop what is left."""
        tree = py_trees.trees.BehaviourTree(root)
        attempts = Attempts(root, lambda: self.causes, lambda: self.now, types)
        tree.visitors.append(attempts)
        for _ in range(ticks):
            self.now += 1.0
            tree.tick()
            if root.status is not Status.RUNNING:
                break
        if root.status is Status.RUNNING:
            root.stop(Status.INVALID)
        attempts.finalise()
        return attempts


Line = tuple[str, float, float, str, str | None, int]


def told(attempts: Attempts) -> list[Line]:
    """Each attempt, with its own name for its path."""
    return [
        (a.path.rsplit("/", 1)[-1], a.started, a.ended, a.status, a.cause.message if a.cause else None, a.times)
        for a in attempts.made
    ]


def chain(attempts: Attempts) -> list[tuple[str, str, str]]:
    """Own name, type and reason of each link."""
    return [(link.path.rsplit("/", 1)[-1], link.type, link.why) for link in attempts.failed_chain() or ()]


def test_a_failure_that_a_fallback_caught_is_an_attempt_with_its_cause() -> None:
    bench = Bench()
    root = Selector("root", memory=True, children=[bench.fails("look", R, R), Script("search", R, S)])
    attempts = bench.run(root)
    assert told(attempts) == [
        ("look", 0.0, 2.0, "FAILURE", "look 0 mm", 1),
        ("search", 2.0, 3.0, "SUCCESS", None, 1),
    ]
    assert attempts.failed_chain() is None


def test_the_chain_goes_through_retry_and_sequence_to_the_last_try() -> None:
    # tick | grasp   | mission | stop
    # 0    | RUNNING | RUNNING |
    # 1    | FAILURE | RUNNING |         first try
    # 2    | FAILURE | FAILURE | RUNNING second try
    # 3    | INVALID | INVALID | FAILURE root FAILURE; the stop names no cause
    bench = Bench()
    body = Sequence("try", memory=True, children=[Script("held", S), bench.fails("grasp", R, F)])
    mission = Sequence("mission", memory=True, children=[Script("start", S), Retry("tries", body, 2)])
    attempts = bench.run(
        Selector("root", memory=True, children=[mission, Script("stop", R, F)]), types={"root": "Fallback"}
    )
    assert told(attempts) == [
        ("start", 0.0, 0.0, "SUCCESS", None, 1),
        ("held", 0.0, 0.0, "SUCCESS", None, 1),
        ("grasp", 0.0, 1.0, "FAILURE", "grasp 0 mm", 1),
        ("held", 2.0, 2.0, "SUCCESS", None, 1),
        ("grasp", 2.0, 2.0, "FAILURE", "grasp 1 mm", 1),
        ("stop", 2.0, 3.0, "FAILURE", None, 1),
    ]
    assert chain(attempts) == [
        ("root", "Fallback", "both children failed"),
        ("mission", "Sequence", "child tries failed (2 of 2)"),
        ("tries", "Retry", "2 of 2 tries failed"),
        ("try", "Sequence", "child grasp failed (2 of 2)"),
        ("grasp", "Script", "slipped: grasp 1 mm"),
    ]
    assert attempts.cause() == Cause(CableCause.SLIPPED, "grasp 1 mm", "grasp")
    assert [link.at for link in attempts.failed_chain() or ()] == [3.0, 2.0, 2.0, 2.0, 2.0]


def test_a_parallels_stopped_child_is_told_as_stopped() -> None:
    bench = Bench()
    watch = Sequence("watch", memory=False, children=[Script("look", S), bench.fails("slip", R, R)])
    attempts = bench.run(Parallel("root", ParallelPolicy.SuccessOnOne(), [watch, Script("carry", R)]))
    assert told(attempts) == [
        ("look", 0.0, 2.0, "SUCCESS", None, 3),  # at every tick: told once
        ("slip", 0.0, 2.0, "FAILURE", "slip 0 mm", 1),
        ("carry", 0.0, 2.0, "INVALID", None, 1),
    ]
    assert [name for name, _, _ in chain(attempts)] == ["root", "watch", "slip"]


def test_a_preempted_leaf_is_stopped_in_the_tick_that_took_over() -> None:
    work = Sequence("work", memory=True, children=[Script("guard", S, R), Script("move", R)])
    attempts = Bench().run(Selector("root", memory=False, children=[Script("alarm", F, F, S), work]))
    assert told(attempts)[:3] == [
        ("alarm", 0.0, 1.0, "FAILURE", None, 2),
        ("guard", 0.0, 0.0, "SUCCESS", None, 1),
        ("move", 0.0, 2.0, "INVALID", None, 1),
    ]
    assert told(attempts)[3] == ("alarm", 2.0, 2.0, "SUCCESS", None, 1)


def test_decorators_say_what_they_make_of_their_child() -> None:
    bench = Bench()
    kept = FailureIsSuccess("kept", bench.fails("tool"))
    attempts = bench.run(Sequence("root", memory=True, children=[kept, Inverter("not", Script("clear", S))]))
    assert chain(attempts) == [
        ("root", "Sequence", "child not failed (2 of 2)"),
        ("not", "Inverter", "its child ended SUCCESS, which it makes a failure"),
    ]
    assert attempts.cause() is None
    assert told(attempts)[0] == ("tool", 0.0, 0.0, "FAILURE", "tool 0 mm", 1)


def test_the_chain_skips_a_stop_that_passes_on_the_cause_of_what_failed_before() -> None:
    class Stop(Script):
        def update(self) -> Status:
            bench.causes.append(bench.causes[-1])
            return Status.FAILURE

    bench = Bench()
    attempts = bench.run(Selector("root", memory=True, children=[bench.fails("carry"), Stop("stop", F)]))
    assert told(attempts)[1] == ("stop", 0.0, 0.0, "FAILURE", "carry 0 mm", 1)
    assert chain(attempts)[1:] == [("carry", "Script", "slipped: carry 0 mm")]
    assert attempts.cause() == Cause(CableCause.SLIPPED, "carry 0 mm", "carry")


def test_a_fallbacks_chain_skips_what_names_no_cause() -> None:
    bench = Bench()
    either = Selector("either", memory=True, children=[bench.fails("recover", R), Script("held", F)])
    assert chain(bench.run(either))[1:] == [("recover", "Script", "slipped: recover 0 mm")]


def test_a_failure_that_was_overcome_does_not_decide_later() -> None:
    bench = Bench()
    either = Selector("either", memory=True, children=[bench.fails("look"), Script("search", S)])
    attempts = bench.run(Sequence("root", memory=True, children=[either, Inverter("not", Script("clear", S))]))
    assert [name for name, _, _ in chain(attempts)] == ["root", "not"]


def test_repeats_with_other_causes_are_not_folded() -> None:
    bench = Bench()
    attempts = bench.run(Retry("root", bench.fails("ask"), 3))
    assert [line[4] for line in told(attempts)] == ["ask 0 mm", "ask 1 mm", "ask 2 mm"]
    assert chain(attempts)[0] == ("root", "Retry", "3 of 3 tries failed")


def test_a_run_cut_short_has_a_chain_to_the_leaf_that_ran() -> None:
    leaf = Script("move", R)
    root = Sequence("root", memory=True, children=[leaf])
    bench = Bench()
    attempts = bench.run(root, ticks=2)
    assert told(attempts) == [("move", 0.0, 1.0, "INVALID", None, 1)]
    links = attempts.chain_to(leaf, "was running", "was still running") or ()
    assert [(link.path, link.why) for link in links] == [
        ("root", "child move was running"),
        ("root/move", "was still running"),
    ]
    assert attempts.chain_to(None, "raised", "raised") is None


def test_a_leaf_that_raised_before_its_visit_has_an_attempt_with_the_cause() -> None:
    class Broken(Script):
        def update(self) -> Status:
            raise RuntimeError("broken")

    broken = Broken("broken", R)
    bench = Bench()
    cause = Cause(CauseCode.INTERNAL_ERROR, "RuntimeError: broken", "root/broken")
    root = Sequence("root", memory=True, children=[Script("first", S), broken])
    attempts = Attempts(root, lambda: bench.causes, lambda: 4.0)
    tree = py_trees.trees.BehaviourTree(root)
    tree.visitors.append(attempts)
    try:
        tree.tick()
    except RuntimeError:
        attempts.raised(broken, cause)
    attempts.finalise()
    assert told(attempts) == [
        ("first", 4.0, 4.0, "SUCCESS", None, 1),
        ("broken", 4.0, 4.0, "INVALID", "RuntimeError: broken", 1),
    ]
