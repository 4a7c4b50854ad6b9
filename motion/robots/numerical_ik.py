"""Inverse kinematics by iteration, for arms that no closed form solves."""

import numpy as np
from scipy.optimize import least_squares

from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.robot.chain import Chain
from regrasp.motion.robots.forward import joint_table, tool_frame, tool_jacobian
from regrasp.motion.robots.poses import rotation_vector


class NumericalSolver:
    r"""Joint positions at which the tool has a pose, each found from a different start.

    Minimises :math:`|p(q) - p^*|^2 + |\log(R(q)^T R^*)|^2` within the joints' limits by scipy's trust-region
    reflective method. The starts are the same for every pose: the middle of the limits, then random ones.
    """

    def __init__(self, chain: Chain, base: FloatArray, starts: int = 12, answers: int = 4, seed: int = 0) -> None:
        """The chain stands at `base` (4, 4). It gives up after so many `starts`, or when it has so many `answers`."""
        self._base, self._joints = np.ascontiguousarray(base), joint_table(chain)
        self._last_from_tool = np.ascontiguousarray(chain.last_from_tool)
        inside = 1e-9 * (chain.upper - chain.lower)
        self._lower, self._upper = chain.lower + inside, chain.upper - inside
        rng = np.random.default_rng(seed)
        self._starts = np.vstack(
            [0.5 * (chain.lower + chain.upper), rng.uniform(self._lower, self._upper, (starts - 1, len(chain)))]
        )
        self._answers = answers

    def solve(self, world_from_tool: FloatArray, near: FloatArray | None = None) -> FloatArray:
        """Positions (k, n) at which the tool has the pose (4, 4); the first is sought from the last n of `near`."""
        starts = self._starts if near is None else np.vstack([near[-self._starts.shape[1] :], self._starts])
        found: list[FloatArray] = []
        for start in np.clip(starts, self._lower, self._upper):
            answer = least_squares(
                self._error,
                start,
                self._jacobian,
                bounds=(self._lower, self._upper),
                args=(world_from_tool,),
                xtol=1e-12,
                ftol=1e-14,
                gtol=1e-12,
                max_nfev=60,
            )
            if answer.cost < 1e-14:
                found.append(answer.x)
            if len(found) == self._answers:
                break
        return np.array(found).reshape(-1, self._starts.shape[1])

    def _error(self, q: FloatArray, target: FloatArray) -> FloatArray:
        pose = tool_frame(self._base, self._joints, self._last_from_tool, q)
        turn = rotation_vector(pose[:3, :3] @ target[:3, :3].T)
        return np.concatenate([pose[:3, 3] - target[:3, 3], turn])

    def _jacobian(self, q: FloatArray, target: FloatArray) -> FloatArray:
        # The derivative of the rotation's logarithm is the identity where it vanishes; near enough to converge.
        return np.asarray(tool_jacobian(self._base, self._joints, self._last_from_tool, q))
