"""Take the found connector again."""

from behaviors.hand import HAND, HandLeaf
from behaviors.leaf import Failed, Steps
from motion.failure import PlanningError

LIFT = 0.05  # m straight up from where it lay


class Regrasp(HandLeaf):
    """Brings the hand to where the connector was found, closes, feels, lifts.

    A hand that closes on nothing opens and goes back to sleep, and the leaf fails.
    """

    def steps(self) -> Steps:
        """See the class."""
        motion, connector = self.services.motion, self.services.belief.connector
        assert connector is not None
        yield motion.pick(HAND, connector)
        try:
            yield from self.grip(connector)
        except Failed:
            motion.grippers[HAND].open(0.06)
            yield from self.wait(0.6)
            yield from self.back_off()
            raise
        task = motion.shift(HAND, [0.0, 0.0, LIFT])
        try:
            while not task.poll():
                yield None
        except PlanningError as error:
            self.say("not lifted", why=str(error))
