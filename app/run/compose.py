"""Puts a run together: the world of a scenario and seed, the robot's services, the tree, and the judge."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import py_trees

from regrasp.app.run.attempts import Attempts
from regrasp.app.run.fault_injection import break_services
from regrasp.app.scenario.load import Scenario
from regrasp.app.scenario.sampling import draw_faults, draw_obstacles
from regrasp.app.task.judge import Judge
from regrasp.app.task.task import Task
from regrasp.behaviors import registry
from regrasp.behaviors.keys import causes
from regrasp.behaviors.services import Services
from regrasp.interfaces.cell import Cell
from regrasp.interfaces.scene import SceneSetup
from regrasp.motion.service import Motion
from regrasp.perception.service import Perception
from regrasp.sim.render.renderer import RendererName
from regrasp.sim.world import World
from regrasp.trees import load_tree, read_graph


@dataclass
class Episode:
    """All that one run is made of."""

    task: Task
    world: World[Any]
    services: Services
    tree: py_trees.trees.BehaviourTree
    judge: Judge[Any]
    attempts: Attempts


def build_world(scenario: Scenario, seed: int, renderer: RendererName = "software", gui: bool = False) -> World[Any]:
    """The scenario's world for this seed. The caller closes it."""
    rng = np.random.default_rng([seed, 0])
    obstacles = draw_obstacles(scenario.file, rng)
    faults = draw_faults(scenario.file, rng)
    cell = scenario.lit_cell
    objects = scenario.task.objects()(cell)
    return World(cell, scenario.file.gravity, seed, objects, SceneSetup(obstacles, faults), renderer, gui)


def build_services(world: World[Any], seed: int, log: Any) -> Services:
    """Motion and perception on the world's devices, as every task has them. `log` is a structlog logger.

    They get the known part of the cell only, and no ground truth.
    """
    cell: Cell = world.cell
    grippers = {name: arm.gripper for name, arm in world.arms.items()}
    motion = Motion(cell.known, world.arms, grippers, world, planner_seed(seed), on_anomaly=anomaly_log(log))
    motion.warm_up()
    perception = Perception(cell.known, world.cameras, world, motion.camera_pose, motion.spheres)
    return Services(cell.known, world, motion, perception, log)


def planner_seed(seed: int) -> int:
    """Where the planner's seeds begin in the run with this seed; each plan takes the next one."""
    return seed * 1000


def anomaly_log(log: Any) -> Callable[[str], None]:
    """Writes a warning into the log when an arm does not follow; see `Execution`."""
    return lambda sentence: log.warning("does not follow", why=sentence)


def assemble(scenario: Scenario, world: World[Any], seed: int, log: Any) -> Episode:
    """Services with the scenario's software faults, the tree on an empty blackboard, its attempts and the judge."""
    task = scenario.task
    py_trees.blackboard.Blackboard.clear()
    services = task.services()(world, seed, log)
    break_services(services, world.faults, world.now)
    leaves = registry.leaves_of(task.name)
    tree = py_trees.trees.BehaviourTree(load_tree(scenario.tree, leaves, scenario.inputs))
    graph = read_graph(scenario.tree, leaves, scenario.inputs)
    types = {node.path: node.type for node in graph.walk() if node.kind != "subtree"}
    attempts = Attempts(tree.root, causes, world.now, types)
    judge = task.judge()(world, services, scenario.file.expect)
    return Episode(task, world, services, tree, judge, attempts)
