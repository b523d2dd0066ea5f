"""Pose: how the state of a robot that drives says where it is."""

from rems_net.defdict import Field, angle, length


def pose(of: str) -> dict[str, Field]:
    """Return the fields x and y, m, `of` a point of the robot, and its heading, rad."""
    return {
        "x": length(doc=f"of {of}"),
        "y": length(doc=f"of {of}"),
        "heading": angle(doc="counter-clockwise from +x, not wrapped"),
    }
