"""Ask the rear camera for the connector before any search."""

from typing import Any, ClassVar

from regrasp.behaviors.leaf import LeafFailed, LeafPort, LeafSteps, StepsLeaf
from regrasp.interfaces.cable.cause import CableCause
from regrasp.perception.pose.estimate import Estimate
from regrasp.perception.pose.fusion import fuse


class CheckCameras(StepsLeaf):
    """Looks for `seconds` through the rear camera, then asks the track the thesis's three questions.

    SUCCESS when the connector's frame exists, is fresh and is live; its mean pose is then in the belief. Else FAILURE:
    the connector must be searched for.
    """

    INPUT_PORTS: ClassVar[dict[str, Any]] = {
        "seconds": LeafPort(data_type=float, required=False, default_value=1.5, above=0, description="s of looking")
    }

    def steps(self) -> LeafSteps:
        """See the class."""
        clock, perception = self.services.clock, self.services.perception
        begin = clock.now()
        seen: dict[float, Estimate] = {}
        while clock.now() < begin + self.get_input("seconds") - 1e-9:
            yield None
            result = perception.look("rear")
            if isinstance(result, Estimate) and result.stamp >= begin:
                seen[result.stamp] = result
        health = perception.track.check(clock.now())
        if not (health.ok and seen):
            raise LeafFailed(CableCause.CONNECTOR_NOT_FOUND, health.reason)
        found, belief = fuse(list(seen.values())), self.services.belief
        belief.connector, belief.sure = found.world_from_connector, found.whole
        belief.found_by, belief.vain_searches = "rear", 0
        self.say("found", camera="rear", position=found.position.round(4).tolist())
