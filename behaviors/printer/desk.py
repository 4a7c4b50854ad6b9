"""What the hand's camera sees on the desk: room for what the hand holds, and the part that it let go."""

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
    from regrasp.interfaces.printer.cell import PrinterKnown


class LookAtPlace(PrinterLeaf):
    """Looks down at the clamp or the tray, past what the hand holds; fails if something stands there.

    The camera looks from `distance` m before the place, `pitch_deg` downwards or, where the hand has no room there,
    about so much, with the arm's base `beside` it. Things lower than 15 mm are not noticed.
    """

    least_points = 300  # that must show the place; choice: a free one has 1000
    least_above = 20  # of them that make a thing; choice: a cube of 3 cm has 150

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
        if name == "tray":
            return tray_room(self.services.known)
        tall = printer.part.size[2] + printer.plate.size[2]
        x, y, z = printer.clamp.center
        return Box(
            name=name, center=(x, y, z + 0.5 * (tall - printer.plate.size[2])), size=(*printer.plate.size[:2], tall)
        )


def tray_room(known: "PrinterKnown", rim: float = 0.02) -> "Box":
    """The room in the tray that the part shall take up.

    `rim` m of the tray's edges do not count: its walls, 1 cm thick, by a camera and an arm that are 5 mm off.
    """
    from regrasp.interfaces.cell import Box  # late: a tree's check needs no scipy

    tray = next(box for box in known.boxes if box.name == "tray")
    (x, y, z), (length, width, thickness) = tray.center, tray.size
    tall = known.printer.part.size[2] + known.printer.plate.size[2]
    size = (length - 2.0 * rim, width - 2.0 * rim, tall)
    return Box(name="tray", center=(x, y, z + 0.5 * (thickness + tall)), size=size)


class WatchPart(PrinterLeaf):
    """Watches the part that the hand has let go over the tray; fails if it floats away, or is not there.

    Where there is gravity a part that lies in the tray stays there. One that has fallen over may hide its section; then
    something must rise from the tray's floor.
    """

    settle = 1.0  # s that the camera's place on the hand takes to be measured; choice: then a part at rest seems to
    # move with 0.02 mm/s, before with 0.4
    most_drift = 0.0005  # m/s; choice: closing the door takes 30 s, in which a faster one leaves the tray
    slack = 0.02  # m that a section may seem higher or lower: camera and arm are up to 8 mm off, and it may be tilted
    least_estimates = 5  # of its place; choice
    least_above = 60  # points of a part that has fallen over; choice

    INPUT_PORTS: ClassVar[dict[str, Any]] = {
        "seconds": LeafPort(
            data_type=float, required=False, default_value=2.5, above=1.5, description="simulated seconds of looking"
        )
    }

    def steps(self) -> LeafSteps:
        """See the class."""
        from regrasp.perception.printer.part_track import line_through  # late: a tree's check needs no numpy

        services, begin, seen = self.services, self.services.clock.now(), {}
        tracker = services.perception.part_tracker(
            services.motion.tool_at, lambda: services.gripper.state().gap, begin, self.say
        )
        while services.clock.now() < begin + self.get_input("seconds"):
            estimate = tracker.update()
            if estimate is not None and estimate.stamp > begin + self.settle:
                seen[estimate.stamp] = estimate
            yield None
        if tracker.trouble is not None:
            raise LeafFailed(CauseCode.CAMERA_FAILED, f"the part in the tray was not seen: {tracker.trouble}")
        if len(seen) < self.least_estimates:
            self._something_there(begin, tracker.why)
            return
        place, velocity = line_through([*seen.values()])
        speed = sum(v * v for v in velocity) ** 0.5
        self.say("watched the part", place=[round(x, 4) for x in place], speed=round(speed, 5))
        room = tray_room(services.known, rim=0.0)
        sizes = *room.size[:2], room.size[2] + 2.0 * self.slack
        if any(abs(x - c) > 0.5 * size for x, c, size in zip(place, room.center, sizes, strict=True)):
            at = ", ".join(f"{x:.3f}" for x in place)
            raise LeafFailed(PrinterCause.PART_ADRIFT, f"the part's section is at ({at}) m, which is not in the tray")
        if speed > self.most_drift and services.motion.floats(self.hand):
            raise LeafFailed(PrinterCause.PART_ADRIFT, f"the part drifts in the tray with {1e3 * speed:.1f} mm/s")

    def _something_there(self, since: float, why: str) -> None:
        """Raise LeafFailed if nothing rises from the tray's floor."""
        view = self.services.perception.see_place(
            self.services.known.printer.camera, since, tray_room(self.services.known)
        )
        self.say("watched the tray", points=view and view.points, above=view and view.above)
        if view is None or view.above < self.least_above:
            raise LeafFailed(PrinterCause.TARGET_NOT_SEEN, f"the part in the tray was not seen: {why}")
