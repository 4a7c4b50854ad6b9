"""A cell of no task: the thesis's boxes and hidden world with one arm and two cameras, all by other names."""

from regrasp.interfaces.cell import ArmSpec, Cell, FixedMount, KnownCell, WristMount

ARM, ABOVE, ON_ARM = "solo", "above", "on_arm"


def one_arm_cell(cell: Cell) -> Cell:
    """Made from `cell`, whose first fixed camera and first camera on a wrist it takes."""
    known = cell.known
    fixed = next(c for c in known.cameras if isinstance(c.mount, FixedMount))
    carried = next(c for c in known.cameras if isinstance(c.mount, WristMount))
    assert isinstance(carried.mount, WristMount)
    cameras = (
        fixed.model_copy(update={"name": ABOVE}),
        carried.model_copy(update={"name": ON_ARM, "mount": WristMount(arm=ARM, offset=carried.mount.offset)}),
    )
    arm = ArmSpec(name=ARM, robot=known.arms[0].robot, base=(0.0, 0.0, 0.0), sleep=known.arms[0].sleep)
    return Cell(
        known=KnownCell(boxes=known.boxes, arms=(arm,), cameras=cameras, latencies=known.latencies), hidden=cell.hidden
    )
