"""Whether there is room on the desk for what the hand holds."""

import math
from collections.abc import Generator
from typing import TYPE_CHECKING, Any, ClassVar

from regrasp.behaviors.leaf import LeafFailed, LeafPort, LeafSteps
from regrasp.behaviors.printer.leaf import PrinterLeaf
from regrasp.interfaces.cause import CauseCode
from regrasp.interfaces.printer.actions import PlaceView, RailGoal
from regrasp.interfaces.printer.cause import PrinterCause

if TYPE_CHECKING:
    from regrasp.interfaces.cell import Box


class LookAtPlace(PrinterLeaf):
    """Looks down at the clamp or the tray, past what the hand holds; fails if something stands there.

    The camera looks from `distance` m before the place, `pitch_deg` downwards or, where the hand has no room there,
    about so much, with the arm's base `beside` it. Things lower than 15 mm are not noticed.
    """

    least_points = 300  # that must show the place; choice: a free one has 1000
    least_above = 20  # of them that make a thing; choice: a cube of 3 cm has 150
    rim = 0.02  # m of the tray's edges that do not count: its walls, 1 cm thick, by camera and arm 5 mm off; choice

    INPUT_PORTS: ClassVar[dict[str, Any]] = {
        "place": LeafPort(data_type=str, names="place", description="clamp or tray"),
        "distance": LeafPort(data_type=float, above=0.0, description="m from the camera to the place"),
        "pitch_deg": LeafPort(data_type=float, above=0.0, description="degrees that the hand points downwards"),
        "beside": LeafPort(data_type=float, description="m along y from the place to the arm's base"),
        "seconds": LeafPort(
            data_type=float, required=False, default_value=1.0, above=0.0, description="simulated seconds of looking"
        ),
    }

    def steps(self) -> LeafSteps:
        """See the class."""
        name, motion = self.get_input("place"), self.services.motion
        place, base = self._place(name), self.services.known.arm(self.hand).base
        floor = (*place.center[:2], place.center[2] - 0.5 * place.size[2])
        yield self.services.rail.send(RailGoal(floor[1] + self.get_input("beside") - base[1]))
        pitch = math.radians(self.get_input("pitch_deg"))
        yield self.with_arm(motion.look_at(self.hand, floor, self.get_input("distance"), pitch))
        seen = yield from self._look(place, name)
        self.say("saw the place", place=name, points=seen.points, above=seen.above, height=round(seen.height, 4))
        if seen.above >= self.least_above:
            why = f"something stands {1e3 * seen.height:.0f} mm high on the {name}"
            raise LeafFailed(PrinterCause.PLACE_OCCUPIED, why)

    def _look(self, place: "Box", name: str) -> Generator[None, None, PlaceView]:
        """Wait for a frame that shows the place."""
        camera, perception = self.services.known.printer.camera, self.services.perception
        begin = self.services.clock.now()
        while (seen := perception.see_place(camera, begin, place)) is None or seen.points < self.least_points:
            if self.services.clock.now() > begin + self.get_input("seconds"):
                why = f"the {camera} camera did not show the {name} in {self.get_input('seconds'):g} s"
                if (trouble := perception.trouble(camera)) is not None:
                    raise LeafFailed(CauseCode.CAMERA_FAILED, f"{why}: {trouble}")
                raise LeafFailed(PrinterCause.TARGET_NOT_SEEN, why)
            yield None
        return seen

    def _place(self, name: str) -> "Box":
        """The room on the clamp or in the tray that the part shall take up, in the clamp with its plate."""
        from regrasp.interfaces.cell import Box  # late: a tree's check needs no scipy

        printer = self.services.known.printer
        tall = printer.part.size[2] + printer.plate.size[2]
        if name == "clamp":
            x, y, z = printer.clamp.center
            return Box(
                name=name,
                center=(x, y, z + 0.5 * (tall - printer.plate.size[2])),
                size=(*printer.plate.size[:2], tall),
            )
        tray = next(box for box in self.services.known.boxes if box.name == "tray")
        (x, y, z), (length, width, thickness) = tray.center, tray.size
        size = (length - 2.0 * self.rim, width - 2.0 * self.rim, tall)
        return Box(name=name, center=(x, y, z + 0.5 * (thickness + tall)), size=size)
