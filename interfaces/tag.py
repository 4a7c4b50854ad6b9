"""Printed tags that cameras read, on any body."""

from typing import Annotated

from pydantic import Field
from scipy.spatial.transform import RigidTransform, Rotation

from regrasp.interfaces.fields import Length, Model, Vector

TAG_DICTIONARY = "DICT_4X4_50"  # of cv2.aruco. Choice: the fewest cells, so they are the largest on a small plate


class Tag(Model):
    """An ArUco tag of `TAG_DICTIONARY` in the middle of a square white plate, fixed on a body.

    In the body's frame it faces +y, and its own x axis points along x. It stands for a printed film of a fraction of a
    gram that gives way to a hand: it is visible, and has neither mass nor a collision shape.
    """

    number: Annotated[int, Field(ge=0, le=49)]
    size: Length  # edge of the black square
    plate: Length  # edge of the plate, with the white border that the tag needs
    center: Vector  # of its face, in the body's frame

    @property
    def body_from_tag(self) -> RigidTransform:
        """Pose of the tag in the body's frame: x to its right, y to its top, z out of its face towards the viewer."""
        return RigidTransform.from_components(self.center, Rotation.from_matrix([[1, 0, 0], [0, 0, 1], [0, -1, 0]]))
