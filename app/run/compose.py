"""Puts a run together: the world of a scenario and seed, the robot's services, the tree, and the judge."""

from dataclasses import dataclass
from typing import Any

import numpy as np
import py_trees

from regrasp.app.run.attempts import Attempts
from regrasp.app.run.fault_injection import break_services
from regrasp.app.scenario.load import Scenario
from regrasp.app.scenario.sampling import draw_faults, draw_obstacles
from regrasp.app.tasks.cable.judge import Judge
from regrasp.behaviors import LEAVES
from regrasp.behaviors.services import Services
from regrasp.interfaces.scene import SceneSetup
from regrasp.motion.service import Motion
from regrasp.perception.service import Perception
from regrasp.sim.ground_truth import GroundTruth
from regrasp.sim.render.renderer import RendererName
from regrasp.sim.world import World
from regrasp.trees import load_tree, read_graph


@dataclass
class Episode:
    """All that one run is made of."""

    world: World
    services: Services
    tree: py_trees.trees.BehaviourTree
    judge: Judge
    attempts: Attempts


def build_world(scenario: Scenario, seed: int, renderer: RendererName = "software", gui: bool = False) -> World:
    """The scenario's world for this seed. The caller closes it."""
    rng = np.random.default_rng([seed, 0])
    obstacles = draw_obstacles(scenario.file, rng)
    faults = draw_faults(scenario.file, rng)
    setup = SceneSetup(obstacles, faults)
    return World(scenario.lit_cell, scenario.file.gravity, seed, setup, renderer, gui)


def build_services(world: World, seed: int, log: Any) -> Services:
    """Motion and perception on the world's devices, with an empty belief. `log` is a structlog logger.

    They get the known part of the cell only, and no ground truth.
    """
    known = world.cell.known
    grippers = {name: arm.gripper for name, arm in world.arms.items()}
    motion = Motion(
        known,
        world.arms,
        grippers,
        world,
        seed * 1000,
        on_anomaly=lambda sentence: log.warning("does not follow", why=sentence),
    )
    perception = Perception(known, world.cameras, world, motion.camera_pose, motion.spheres)
    return Services(known, world, motion, perception, log)


def assemble(scenario: Scenario, world: World, seed: int, log: Any) -> Episode:
    """Services with the scenario's software faults, the tree on an empty blackboard, its attempts and the judge."""
    services = build_services(world, seed, log)
    services.motion.warm_up()
    break_services(services, world.faults, world.now)
    py_trees.blackboard.Blackboard.clear()
    tree = py_trees.trees.BehaviourTree(load_tree(scenario.tree, LEAVES, scenario.inputs))
    graph = read_graph(scenario.tree, LEAVES, scenario.inputs)
    types = {node.path: node.type for node in graph.walk() if node.kind != "subtree"}
    attempts = Attempts(tree.root, services.belief.causes, world.now, types)
    return Episode(world, services, tree, Judge(GroundTruth(world), scenario.file.expect), attempts)
