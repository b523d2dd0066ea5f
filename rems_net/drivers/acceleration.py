"""Acceleration: the specific force that accelerometers measure, in every simulation."""

from collections.abc import Sequence
from typing import Any

from rems_net.bodies.body import GRAVITY

Three = Sequence[Any]


def felt(before: Three, now: Three, spin: Three, up: Three, dt: float) -> Three:
    """Return the specific force along x, y and z of a robot, m/s2; 9.81 up at rest.

    before, now: velocity of the robot's origin at the start and the end of a tick, m/s
    spin: its angular velocity, rad/s      up: the unit vector up
    dt: length of the tick, s; 0 if there is no tick before
    All in the robot's own frame, which turns; numbers, or arrays of them for a swarm.
    """
    (a, b, c), (x, y, z), (p, q, r) = before, now, spin
    turning = q * z - r * y, r * x - p * z, p * y - q * x
    change = ((x - a) / dt, (y - b) / dt, (z - c) / dt) if dt else (0.0, 0.0, 0.0)
    return [
        gained + turned - GRAVITY * share
        for gained, turned, share in zip(change, turning, up, strict=True)
    ]


def component(axis: Three, force: Three) -> Any:
    """Return the component of a force along an axis."""
    return axis[0] * force[0] + axis[1] * force[1] + axis[2] * force[2]
