"""The kinematic chain of a robot."""

from dataclasses import dataclass, fields, replace

from regrasp.interfaces.arrays import FloatArray, Mask


@dataclass(frozen=True, eq=False)
class Chain:
    """The joints from the base to the tool, by axes and offsets at zero (product of exponentials).

    Link 0 is the base, link i + 1 moves with joint i. At zero all link frames are parallel to the base's; each has
    its origin on its joint's axis. `origins` (n, 3) m are those of the joints in the link before, `axes` (n, 3) unit
    vectors, `slides` (n,) says which joints are prismatic. Limits are (n,), rad or m and their derivatives; `torques`
    are N m or N, `levers` m that the far end moves by a rad, about.
    """

    names: tuple[str, ...]
    origins: FloatArray
    axes: FloatArray
    slides: Mask
    lower: FloatArray
    upper: FloatArray
    speeds: FloatArray
    accelerations: FloatArray
    torques: FloatArray
    levers: FloatArray
    last_from_tool: FloatArray

    def __len__(self) -> int:
        return len(self.names)

    def without(self, first: int) -> "Chain":
        """The chain from joint number `first` on; its base is the link before that joint."""
        rows = {f.name: getattr(self, f.name)[first:] for f in fields(self) if f.name != "last_from_tool"}
        return replace(self, **rows)
