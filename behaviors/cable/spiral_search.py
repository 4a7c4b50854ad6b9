"""Search for the connector with the wrist camera: the thesis's spiral (Hwang 2024, section 3.4.3)."""

from collections.abc import Generator, Iterator
from dataclasses import dataclass
from itertools import chain
from typing import TYPE_CHECKING, Any, ClassVar

from regrasp.behaviors.cable.keys import FOUND, VAIN_SEARCHES, Found
from regrasp.behaviors.cable.look import LookLeaf
from regrasp.behaviors.keys import Keys
from regrasp.behaviors.leaf import LeafFailed, LeafPort, LeafSteps
from regrasp.interfaces.arrays import FloatArray
from regrasp.interfaces.cable.cause import CableCause
from regrasp.interfaces.cable.motion import Viewpoint
from regrasp.interfaces.cable.sight import Estimate
from regrasp.interfaces.cause import CauseCode
from regrasp.interfaces.request import Request
from regrasp.motion.failure import PlanningError

if TYPE_CHECKING:
    from scipy.spatial.transform import RigidTransform


@dataclass(frozen=True)
class SpiralSearchParameters:
    """When the connector counts as found."""

    min_estimates: int = 3  # estimates from one viewpoint that make a find; choice


class SpiralSearch(LookLeaf):
    """Moves the wrist camera from viewpoint to viewpoint until it sees the connector, at most `time_limit` seconds.

    It looks first where the cable hangs by itself. Then the spiral starts where the connector was last seen. When that
    is not known, or a search from there has failed, it starts at the back panel's middle. A viewpoint that cannot be
    reached, not even a little nearer or further, is skipped and logged. After a weak detection, too little to tell
    whether it is the connector, the camera looks there next. When the search fails the arm goes back to sleep.
    """

    READS: ClassVar[Keys] = (VAIN_SEARCHES,)
    WRITES: ClassVar[Keys] = (
        FOUND,
        VAIN_SEARCHES,
    )
    parameters: ClassVar[SpiralSearchParameters] = SpiralSearchParameters()

    INPUT_PORTS: ClassVar[dict[str, Any]] = {
        "time_limit": LeafPort(
            data_type=float, required=False, default_value=300.0, above=0, description="s of searching"
        ),
        "look_seconds": LeafPort(
            data_type=float, required=False, default_value=1.0, above=0, description="s of looking from a viewpoint"
        ),
    }

    def steps(self) -> LeafSteps:
        """See the class."""
        clock, begin = self.services.clock, self.services.clock.now()
        skipped: list[int] = []
        looked = 0
        for viewpoint in self._viewpoints():
            yield from self._check_camera()
            if clock.now() > begin + self.get_input("time_limit"):
                break
            try:
                seen = yield from self._look_from(viewpoint.world_from_camera)
            except PlanningError:
                skipped.append(viewpoint.index)
                continue
            looked += 1
            if len(seen) >= self.parameters.min_estimates:
                position, stop = self._believe(self.services.perception.fuse(seen)), viewpoint.index
                self.say("found", camera=self.search, stop=stop, looked=looked, skipped=skipped, position=position)
                return
        self.write(VAIN_SEARCHES, self.read(VAIN_SEARCHES) + 1)
        yield from self.go_to_sleep(self.search_arm)
        seconds = clock.now() - begin
        self.say("not found", looked=looked, skipped=skipped)
        raise LeafFailed(
            CableCause.SEARCH_EXHAUSTED,
            f"not seen from {looked} stops in {seconds:.0f} s; {len(skipped)} stops were out of reach or not free",
        )

    def _check_camera(self) -> LeafSteps:
        """Steps that bring the arm to sleep and fail when the camera is not to be trusted."""
        trouble = self.services.perception.trouble(self.search)
        if trouble is not None:
            yield from self.go_to_sleep(self.search_arm)
            raise LeafFailed(CauseCode.CAMERA_FAILED, f"{trouble}; the {self.overview} camera shows no connector")

    def _look_from(self, world_from_camera: "RigidTransform") -> Generator[Request[None] | None, None, list[Estimate]]:
        """Estimates from a viewpoint, and from nearer after a weak detection. Raises PlanningError out of reach."""
        view = self.services.motion.view(world_from_camera)
        looked = yield from self.go_and_look(view, self.get_input("look_seconds"))
        seen = looked.estimates
        if len(seen) < self.parameters.min_estimates <= len(looked.weak_detections):
            seen = seen + (yield from self._look_there(world_from_camera, looked.glimpse))
        return seen

    def _look_there(
        self, world_from_camera: "RigidTransform", place: FloatArray
    ) -> Generator[Request[None] | None, None, list[Estimate]]:
        """Estimates from where a weak detection at `place` (3,) m shows better; none where nothing can look at it."""
        self.say("glimpsed", position=place.round(3).tolist())
        try:
            view = self.services.motion.view_of(place, world_from_camera)
            looked = yield from self.go_and_look(view, self.get_input("look_seconds"))
        except PlanningError as error:
            self.say("no closer look", why=str(error))
            return []
        return looked.estimates

    def _believe(self, found: Estimate) -> list[float]:
        """Hand on where the connector was found; its position (m in the world) for the log."""
        self.write(FOUND, Found(found.world_from_connector, found.whole, self.search))
        self.write(VAIN_SEARCHES, 0)
        position: list[float] = found.position.round(4).tolist()
        return position

    def _viewpoints(self) -> Iterator[Viewpoint]:
        last = self.services.perception.last
        from_last = last is not None and self.read(VAIN_SEARCHES) % 2 == 0
        position = last.position if last is not None and from_last else None
        start, viewpoints = self.services.motion.search_views(position)
        rest = self.services.motion.rest_views()
        self.say("search", start=start.round(3).tolist(), last_seen=from_last, rest_views=len(rest))
        # They count down from -1: the spiral's numbers are the thesis's.
        return chain((Viewpoint(-1 - n, -1, n, pose) for n, pose in enumerate(rest)), viewpoints)
