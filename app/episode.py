"""One run: the world, the services, the tree, and the loop that ticks it."""

import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import py_trees
from py_trees.common import Status

from app.draw import draw_faults, draw_obstacles
from app.film import Film
from app.judge import Judge
from app.record import Outcome, Record, Result
from app.scenario_file import Scenario
from app.tick_log import TickLog, active_leaf, running_leaf
from behaviors import LEAVES
from behaviors.services import Services
from interfaces.cause import Cause, CauseCode
from motion.service import Motion
from perception.service import Perception
from sim.ground_truth import GroundTruth
from sim.renderer import RendererName
from sim.world import World
from trees import load_tree, node_paths

TICK = 0.05  # simulated seconds
Progress = Callable[[float, str], None]


@dataclass
class Episode:
    """All that one run is made of."""

    world: World
    services: Services
    tree: py_trees.trees.BehaviourTree
    judge: Judge


def run_episode(
    scenario: Scenario,
    out: Path | None,
    *,
    seed: int,
    video: bool = False,
    gui: bool = False,
    renderer: RendererName = "auto",
    progress: Progress | None = None,
) -> Result:
    """Run a scenario to its end and leave its record in the folder `out` (None: nowhere).

    `progress` is called at every tick with the simulated second and the active leaf; a KeyboardInterrupt from it ends
    the run cleanly. An exception inside a leaf ends it with the cause `internal_error` and its traceback in
    events.jsonl.
    """
    began = time.perf_counter()
    with Record(out, scenario.name, seed, scenario.case) as record:
        world = _world(scenario, seed, renderer, gui)
        try:
            log = record.logger(world.now)
            log.info(
                "begin",
                scenario=scenario.name,
                case=scenario.case,
                seed=seed,
                gravity=scenario.file.gravity,
                cell=scenario.file.cell,
                tree=scenario.file.tree,
                inputs=scenario.file.inputs,
                limits=scenario.file.limits.model_dump(),
                overrides=list(scenario.overrides),
                renderer=world.renderer.name,
                renderer_reason=world.renderer.reason,
            )
            episode = _assemble(scenario, world, seed, log)
            ticks = TickLog(episode.tree.root, record.ticks, world.now)
            episode.tree.visitors.append(ticks)
            with Film(out / "video.mp4" if video and out else None, world) as film:
                outcome, cause = _loop(episode, scenario, film, progress, log)
            ticks.finalise()
            result = _result(episode, scenario, seed, outcome, cause, time.perf_counter() - began)
            log.info("end", outcome=outcome, succeeded=result.succeeded, contact_peaks=world.contact_peaks)
            record.finish(result)
        finally:
            world.close()
    return result


def _world(scenario: Scenario, seed: int, renderer: RendererName, gui: bool) -> World:
    rng = np.random.default_rng([seed, 0])
    obstacles = draw_obstacles(scenario.file, rng)
    faults = draw_faults(scenario.file, rng)
    return World(scenario.lit_cell, scenario.file.gravity, seed, obstacles, faults, renderer, gui)


def _assemble(scenario: Scenario, world: World, seed: int, log: Any) -> Episode:
    known = scenario.cell.known
    grippers = {name: arm.gripper for name, arm in world.arms.items()}
    motion = Motion(known, world.arms, grippers, world, seed * 1000)
    perception = Perception(known, world.cameras, world, motion.camera_pose, motion.spheres)
    services = Services(known, world, motion, perception, log)
    py_trees.blackboard.Blackboard.clear()
    tree = py_trees.trees.BehaviourTree(load_tree(scenario.tree, LEAVES, scenario.inputs))
    tree.setup(services=services)
    return Episode(world, services, tree, Judge(GroundTruth(world), scenario.file.expect))


def _loop(
    episode: Episode, scenario: Scenario, film: Film, progress: Progress | None, log: Any
) -> tuple[Outcome, Cause | None]:
    """Tick until the tree ends, the time is over or somebody interrupts; the arms are stopped in the end."""
    world, root = episode.world, episode.tree.root
    belief = episode.services.belief
    try:
        while world.now() < scenario.file.limits.sim_seconds:
            episode.tree.tick()
            episode.judge.observe(world.now(), belief)
            leaf = active_leaf(root)
            film.show(leaf)
            if progress:
                progress(world.now(), leaf)
            if root.status is Status.SUCCESS:
                return "stowed", None
            if root.status is Status.FAILURE:
                return "safe_stop", belief.causes[-1] if belief.causes else None
            world.advance(TICK)
        limit = scenario.file.limits.sim_seconds
        return "time_limit", Cause(CauseCode.TIME_LIMIT, f"not done after {limit:g} simulated seconds", _running(root))
    except KeyboardInterrupt:
        return "interrupted", Cause(CauseCode.INTERRUPTED, "stopped from outside", _running(root))
    except Exception as error:
        node = _raising(error, root)
        log.exception("exception in a leaf", node=node)
        return "internal_error", Cause(CauseCode.INTERNAL_ERROR, f"{type(error).__name__}: {error}", node)
    finally:
        if root.status is Status.RUNNING:
            root.stop(Status.INVALID)
        episode.services.motion.stop()
        world.advance(0.3)


def _running(root: py_trees.behaviour.Behaviour) -> str:
    """Tree path of the active leaf, '' when none is."""
    leaf = running_leaf(root)
    return "" if leaf is None else node_paths(root)[leaf.id]


def _raising(error: BaseException, root: py_trees.behaviour.Behaviour) -> str:
    """Tree path of the innermost node that an exception came through."""
    path, trace = "", error.__traceback__
    while trace is not None:
        node = trace.tb_frame.f_locals.get("self")
        if isinstance(node, py_trees.behaviour.Behaviour):
            path = node_paths(root).get(node.id, path)
        trace = trace.tb_next
    return path


def _result(
    episode: Episode, scenario: Scenario, seed: int, outcome: Outcome, cause: Cause | None, wall: float
) -> Result:
    judge, belief = episode.judge, episode.services.belief
    expectations = judge.expectations(outcome, cause.code if cause else None, belief)
    return Result(
        scenario.name,
        seed,
        outcome,
        succeeded=all(e.met for e in expectations),
        case=scenario.case,
        cause=cause,
        expectations=expectations,
        slips=judge.slips(belief),
        sim_seconds=episode.world.now(),
        wall_seconds=wall,
        real_time_factor=episode.world.now() / wall,
        renderer=episode.world.renderer.name,
    )
