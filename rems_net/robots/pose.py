"""Pose: the fields of the state that are a mobile robot's pose."""

from rems_net.defdict import Field, angle, length


def pose(of: str) -> dict[str, Field]:
    """Return the fields x and y, m, `of` a point of the robot, and its heading, rad."""
    return {
        "x": length(doc=f"of {of}"),
        "y": length(doc=f"of {of}"),
        "heading": angle(doc="counter-clockwise from +x, not wrapped"),
    }
